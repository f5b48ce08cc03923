"""What pictures draw between rows, against the elastica, whose load and displacement are elliptic integrals."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.special import ellipe, ellipk

from rodfem.output.plot_diagram import between, drawn


def elastica(k: np.ndarray) -> dict[str, Any]:
    """A clamped column, P = K(k)^2, whose tip moves by 2 k / K(k), with k for its arclength, as a branch of a file."""
    K = ellipk(k**2)
    derivative = np.divide(ellipe(k**2) / (1 - k**2) - K, k, out=np.zeros_like(k), where=k > 0)
    columns = {"arclength": k, "load": K**2, "slope": 2 * K * derivative, "ordinate": 2 * k / K}
    negative = {"negative": [0] * len(k)}
    return {"name": "b", "parent": ["straight", 0], "special": [], "columns": {**columns, **negative}}


def test_long_steps_are_no_chords() -> None:
    branch = elastica(np.array([0.0, 0.3, 0.45, 0.6, 0.7]))
    ((_, curve),) = drawn(branch)
    load, height = curve[:10].T
    exact = ellipk((height * np.sqrt(load) / 2) ** 2) ** 2
    chord = np.interp(height, branch["columns"]["ordinate"], branch["columns"]["load"])
    assert abs(load - exact).max() < 2e-3 < 6e-3 < abs(chord - exact).max()
    assert all(row in curve for row in np.column_stack([branch["columns"][x] for x in ("load", "ordinate")]))


def test_rows_close_to_each_other_and_corners_stay_as_they_are() -> None:
    assert not between(elastica(np.linspace(0.0, 0.7, 200)), "ordinate")
    assert between(elastica(np.linspace(0.0, 0.7, 5)), "ordinate")
    zigzag = abs(np.linspace(-0.2, 0.2, 9))
    corner = elastica(np.linspace(0.0, 0.7, 9))
    corner["columns"]["ordinate"] = zigzag
    values = np.concatenate([found[:, 1] for found in between(corner, "ordinate").values()])
    assert values.min() >= -1e-12 and values.max() <= 0.2 + 1e-12


def test_an_ordinate_has_no_kink_at_its_greatest_value() -> None:
    """A parabola of few rows, none at its top, is that parabola."""
    branch = elastica(np.linspace(0.0, 0.7, 7))
    s = branch["columns"]["arclength"]
    branch["columns"]["ordinate"] = s * (0.55 - s)
    found = between(branch, "ordinate")
    places = np.concatenate([s[row] + np.arange(1, 8) / 8 * (s[row + 1] - s[row]) for row in found])
    np.testing.assert_allclose(np.concatenate([x[:, 1] for x in found.values()]), places * (0.55 - places), atol=1e-12)
