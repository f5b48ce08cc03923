"""Energies that are not smooth in the state within an element: no error bar, wherever one is given."""

from __future__ import annotations

from math import cos, isnan, sin, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import ufl
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from rodfem import Diagram, Discretization, Ordinate, Parameter, Plan, Scene, clamped, free, trace
from rodfem.codim2.locus import Locus

LOADS = (1.2, 1.5, 2.0, 3.0)


def bent(energy: Any, mesh: tuple[int, int], at: tuple[float, ...] = LOADS) -> Diagram:
    """A cantilever under a force across, of bending energy ``energy(k)`` about one axis."""
    rod = Scene(
        "bent", (0.0, 1.0), "unshearable and inextensible", lambda v, k, c: energy(k[0]) + 5 * k[1] ** 2 + k[2] ** 2,
        {"P": 0.0}, "P", (clamped(), free(lambda c: (0.0, -c.P, 0.0))), Ordinate("y", s=1.0, of=lambda r, q: r[1]),
        (0.0, 3.5),
    )  # fmt: skip
    return trace(rod, Discretization("auto", *mesh), Plan(depth=0, at=at))


def layer(width: float) -> Any:
    """``M = k`` below 1 and ``M = k + 4 (k - 1)`` beyond, smoothed over a ``width`` of the curvature."""

    def energy(k: Any) -> Any:
        ramp = (k - 1 + ufl.sqrt((k - 1) ** 2 + width**2)) / 2
        return 0.5 * k**2 + 2 * ramp**2

    return energy


def deflection(load: float, width: float) -> float:
    """Of the tip, by shooting from there."""

    def moment(k: float) -> tuple[float, float]:
        root = sqrt((k - 1) ** 2 + width**2)
        ramp, slope = (k - 1 + root) / 2, (1 + (k - 1) / root) / 2
        return k + 4 * ramp * slope, 1 + 4 * (slope**2 + ramp * width**2 / root**3 / 2)

    def clamp(angle: float) -> np.ndarray:
        at_tip = brentq(lambda k: moment(k)[0], -1.0, 1.0, xtol=1e-15)
        ode = lambda s, y: (-y[1], load * cos(y[0]) / moment(y[1])[1], -sin(y[0]))  # noqa: E731
        out = solve_ivp(ode, (0, 1), [angle, at_tip, 0.0], method="DOP853", rtol=1e-11, atol=1e-13, max_step=5e-3)
        return np.asarray(out.y[:, -1])

    angle = brentq(lambda t: clamp(t)[0], 0.05, 1.55, xtol=1e-13)
    return float(clamp(angle)[2])


def ordinates(found: Diagram) -> list[tuple[float, float, float]]:
    """Loads that were asked for, with ordinate and bar."""
    return [(s.point.load, s.point.ordinate, s.ordinate_error) for s in found[0].special if s.point.load in LOADS]


@pytest.mark.long
@pytest.mark.alone
def test_bars_hold_or_there_are_none() -> None:
    """Of 128 ordinates 25 were above their bars at the width 1e-4, up to 37 times, without a warning."""
    told = {width: {load: deflection(load, width) for load in LOADS} for width in (3e-3, 1e-1)}
    for width, mesh in ((3e-3, (7, 4)), (3e-3, (8, 6)), (1e-1, (7, 4)), (1e-1, (8, 6))):
        found = bent(layer(width), mesh)
        said = [x for x in found.warnings if "does not integrate the equations" in x]
        assert len(said) == (width < 1e-2), found.warnings
        for load, ordinate, bar in ordinates(found):
            assert isnan(bar) if width < 1e-2 else abs(ordinate - told[width][load]) <= bar < 1e-4


def lateral(threshold: float) -> Diagram:
    """A strip under a force across, which buckles sideways; softer in its plane beyond a curvature."""

    def soft(k: Any) -> Any:
        a = abs(k)
        return ufl.conditional(ufl.lt(a, threshold), 5 * k**2, 2 * k**2 + 6 * threshold * a - 3 * threshold**2)

    rod = Scene(
        "strip", (0.0, 1.0), "unshearable and inextensible",
        lambda v, k, c: soft(k[0]) + 0.5 * k[1] ** 2 + 0.5 * c.C * k[2] ** 2,
        {"P": 0.0, "C": Parameter(1.0)}, "P", (clamped(), free(lambda c: (0.0, -c.P, 0.0))),
        Ordinate("x", s=1.0, of=lambda r, q: r[0]), (0.0, 6.0),
    )  # fmt: skip
    return trace(rod, Discretization(elements=4, degree=4), Plan(depth=0))


@pytest.mark.long
@pytest.mark.alone
def test_loci_and_modes_have_no_bar_beyond_a_kink(tmp_path: Path) -> None:
    for threshold, kink in ((10.0, False), (0.2, True)):
        found = lateral(threshold)
        special = found.special("branch point")[0]
        locus = found.locus(special, "C", (0.9, 1.1))
        assert np.isfinite(locus.error).any() != kink
        assert ("does not integrate the equations" in locus.note) == kink
        assert (locus.note in locus.text()) and Locus.read(_saved(locus, tmp_path)).note == locus.note
        modes = found.modes(special)
        assert np.isfinite(modes.error).any() != kink
        assert ("does not integrate the equations" in modes.note) == kink


def _saved(locus: Locus, folder: Path) -> Path:
    path = folder / "locus.json"
    locus.save(path)
    return path
