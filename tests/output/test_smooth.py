"""What pictures draw between rows, against the elastica, whose load and displacement are elliptic integrals."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.special import ellipe, ellipk

from rodfem.output.smooth import between, drawn_pieces


def elastica(k: np.ndarray) -> dict[str, Any]:
    """A clamped column, P = K(k)^2, whose tip moves by 2 k / K(k), with k for its arclength, as a branch of a file."""
    K = ellipk(k**2)
    derivative = np.divide(ellipe(k**2) / (1 - k**2) - K, k, out=np.zeros_like(k), where=k > 0)
    columns = {"arclength": k, "load": K**2, "slope": 2 * K * derivative, "ordinate": 2 * k / K}
    negative = {"negative": [0] * len(k)}
    return {"name": "b", "parent": ["straight", 0], "special": [], "columns": {**columns, **negative}}


def test_long_steps_are_no_chords() -> None:
    branch = elastica(np.array([0.0, 0.3, 0.45, 0.6, 0.7]))
    (piece,) = drawn_pieces(branch, "black")
    load, height = piece.curve[:10].T
    exact = ellipk((height * np.sqrt(load) / 2) ** 2) ** 2
    chord = np.interp(height, branch["columns"]["ordinate"], branch["columns"]["load"])
    assert abs(load - exact).max() < 2e-3 < 6e-3 < abs(chord - exact).max()
    assert all(row in piece.curve for row in np.column_stack([branch["columns"][x] for x in ("load", "ordinate")]))


def test_rows_close_to_each_other_and_corners_stay_as_they_are() -> None:
    assert not between(elastica(np.linspace(0.0, 0.7, 200)), "ordinate")
    branch = elastica(np.linspace(0.0, 0.7, 5))
    older = {**branch, "columns": {name: x for name, x in branch["columns"].items() if name != "slope"}}
    assert between(branch, "ordinate") and not between(older, "ordinate")
    corner = {**branch, "columns": {**branch["columns"], "ordinate": np.array([0.2, 0.1, 0.0, 0.1, 0.2])}}
    values = np.concatenate([found[:, 1] for found in between(corner, "ordinate").values()])
    assert values.min() >= 0.0 and values.max() <= 0.2 + 1e-12
