"""Rods of all kinds against closed forms, transcendental equations and exponentials of constant matrices."""

from collections.abc import Callable
from math import acos, hypot, pi, sqrt
from typing import Any

import numpy as np
import pytest
import ufl
from classics import BEAM, FORMULATIONS, ON_AXIS, ROUND, circle, column, explore, partly_following, push, sweep
from closed_forms import flutter
from scipy.special import fresnel

import rodfem
from rodfem import Discretization, Ordinate, Ring, Scene, at, clamped, free, hinged, pinned, sliding
from rodfem.forms import loads
from rodfem.forms.energy import bending_and_twist, logarithmic_stretch

AWAY = Ordinate("distance", s=1.0, of=lambda r, q: float(np.linalg.norm(r)))


# --- many eigenvalues nearer to zero than the one that crosses ------------------------------------------------------


@pytest.mark.long
@pytest.mark.parametrize("EI", [1e-3, 1e-6])
def test_whirling_string(EI: float) -> None:
    """Pulled by T, spinning at sqrt(P): ``P = EI (n pi)^4 + T (n pi)^2``, twice each; torsion is softer by far."""
    T, P = 100.0, lambda n: EI * (n * pi) ** 4 + 100.0 * (n * pi) ** 2
    string = column(
        "string", (pinned(), pinned(ON_AXIS, lambda c: (0.0, 0.0, T))), (0.0, 4200.0),
        energy=lambda v, k, c: bending_and_twist(k, (EI, EI, EI)),
        potential=lambda x, c: -c.P / 2 * (x.r[0] ** 2 + x.r[1] ** 2),
    )  # fmt: skip
    found = explore(string)
    assert found.loads() == pytest.approx([P(1), P(2)], rel=1e-10)
    assert [(s.negative_before, s.negative_after) for s in found.special()] == [(0, 2), (2, 4)]


# --- loads without a potential --------------------------------------------------------------------------------------


@pytest.mark.long
@pytest.mark.parametrize("span", [(20.0, 60.0), (60.0, 20.0)])
def test_divergence_and_flutter_in_one_step(span: tuple[float, float]) -> None:
    """Beck's column with a spring at its tip: ``w'''' + P w'' = mu w``, ``w'' = 0`` and ``w''' = k w`` there.

    In one step of the sweep the second eigenvalue becomes negative, too, and meets the first one: from then on they
    are complex, and neither is counted as negative.
    """
    k, forth = 60.0, 1 if span[0] < span[1] else -1
    spring: Any = lambda x, c: loads.spring(x.r, (0.0, c.k, 0.0))  # noqa: E731
    rod = column(
        "sprung", (clamped(), free(follower=push, energy=spring)), span, inertia=BEAM,
        constants={"P": span[0], "B2": 90.0, "k": k},
    )  # fmt: skip
    diagram = rodfem.trace(rod, Discretization(elements=4, degree=6))
    expected = [(24.1853149575083, (0, 1)), (46.65798714630075, (1, 2)), (46.7735657939325, (2, 2))]
    for s, (exact, change) in zip(diagram.special()[::forth], expected, strict=True):
        assert abs(s.point.load - exact) < s.error_estimate < 1e-6
        assert (s.negative_before, s.negative_after)[::forth] == change
    assert not diagram.warnings


@pytest.mark.long
@pytest.mark.parametrize("share", [0.356, 0.3546])
def test_divergence_beside_flutter(share: float) -> None:
    """Where 0.35431 of a thrust turns with the tip, two frequencies become zero at once (Kordas & Zyczkowski 1963).

    A little above that the rod, unstable from ``w^2`` on, ``cos w = -a/(1 - a)``, is stable from ``(2 pi - w)^2`` to a
    flutter load that is greater by 6e-5 or 2e-6 of it: the eigenvalue that vanishes is not smooth over more.
    """
    w = acos(-share / (1 - share))
    flutters, mu = flutter(17.0, 600 * (share - 0.35431), share=share)
    diagram = rodfem.trace(partly_following(share, (0.0, 20.0), 90.0), Discretization(elements=4, degree=6))
    expected = [(w**2, 0, 1), ((2 * pi - w) ** 2, 1, 0), (flutters, 0, 2)]
    assert 0 < flutters / expected[1][0] - 1 < 7e-5 and mu > 0
    for s, (load, *change) in zip(diagram.special(), expected, strict=True):
        assert [s.negative_before, s.negative_after] == change
        assert abs(s.point.load - load) < s.error_estimate < 1e-5
    assert not diagram.warnings


@pytest.mark.long
def test_hauger() -> None:
    """Tangential thrust ``P (1 - s)`` along a rod that bends alike in all planes, by Galerkin's method."""
    thrust: Any = lambda c: (0.0, 0.0, -c.P * (1 - c.s))  # noqa: E731
    rod = column("hauger", (clamped(), free()), (140.0, 160.0), follower=thrust, inertia=BEAM, constants={"B2": 1.0})
    assert sweep(rod, elements=8).loads("flutter") == pytest.approx([150.64159540451925], rel=1e-10)


# --- planar rods with more than dead forces at an end ---------------------------------------------------------------


@pytest.mark.long
@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_planar_rod_against_an_incline(formulation: str) -> None:
    """The tip slides on ``x + z = 1`` without friction: to first order it does not move, as on a pin."""
    rod = column(
        "incline", (clamped(), free(push)), (0.0, 25.0), planar="e2", constants={"B1": 3.0, "B2": 1.0},
        constraints=(at(1.0, lambda x, c: x.r[0] + x.r[2] - 1),),
    )  # fmt: skip
    assert explore(rod, formulation).loads() == pytest.approx([20.1907285564], rel=4e-9)


# --- coupled, curved and twisted rods -------------------------------------------------------------------------------


def coupled() -> Scene:
    """Shear and bending coupled by 3: shear and curvature follow from the force ``-P theta`` and the moment."""

    def energy(v: Any, k: Any, c: Any) -> Any:
        return 10.0 * (v[0] ** 2 + v[1] ** 2) + 3.0 * v[1] * k[0] + bending_and_twist(k, (1.0, 2.0, 1.0))

    return column("shear and bending", (clamped(), free(push)), (0.0, 6.0), rod="inextensible", energy=energy)


def softening() -> Scene:
    """With ``n3 = EA log v3`` a long rod buckles, and is straight again when short: ``P exp(-P/EA) = EI pi^2``."""
    return column(
        "log", (pinned(), pinned(ON_AXIS, push)), (0.0, 60.0), rod="unshearable", constants={"B2": 3.0},
        energy=lambda v, k, c: logarithmic_stretch(v, 30.0) + bending_and_twist(k, (c.B1, c.B2, c.C)),
    )  # fmt: skip


def strip() -> Scene:
    """A strip twisted by a whole turn in its natural state, compressed: no moment at the tip of the linearised rod."""
    energy = lambda v, k, c: bending_and_twist((k[0], k[1], k[2] - 2 * pi), (1.0, 5.0, 1.0))  # noqa: E731
    return column("strip", (clamped(), free(push)), (0.0, 30.0), energy=energy)


def hinges() -> Scene:
    """Hinges at 45 degrees to both principal axes: what is bent about one is held by the other."""
    axis = (1.0, 1.0, 0.0)
    return column("hinges", (hinged(axis), hinged(axis, ON_AXIS, force=push)), (0.0, 60.0))


def turned_end() -> Scene:
    """An end turned about e1 without force, past a turn and two: conjugate points of a spinning top."""
    turned = sliding(lambda c: (None, None, None), lambda c: (ufl.cos(c.P / 2), ufl.sin(c.P / 2), 0.0, 0.0))
    energy = lambda v, k, c: bending_and_twist(k, (1.0, 2.0, 0.7))  # noqa: E731
    return column("turned", (clamped(), turned), (0.0, 15.0), energy=energy, ordinate=AWAY)


LOADS = {
    coupled: [0.9929093588933972, 4.095958428247924],
    softening: [17.959077095197106, 46.49936935876047],
    strip: [3.6656607834424975, 4.580877463845253, 28.522018902064907],
    hinges: [14.338267185056209, 51.63802542164159, 53.9048627544157],
    turned_end: [4.985603157591361, 7.878916105055257, 11.08435351276115, 14.211394428345457],
}
"""Zeros of the determinant of the exponential of the matrix of Kirchhoff's linearised equations, which is constant."""


@pytest.mark.long
@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize("make", LOADS)
def test_critical_loads(make: Callable[[], Scene], formulation: str) -> None:
    assert explore(make(), formulation).loads() == pytest.approx(LOADS[make], rel=1e-8)


@pytest.mark.few(1)
@pytest.mark.parametrize("n", [2, 3])
def test_ring_with_too_much_curvature(n: int) -> None:
    """``m^2 - (B + C) m - B C (n^2 - 1) = 0`` for the moment ``m = 1 - k0`` of a ring that is curved by k0 when cut."""
    B, C = 1.0, 0.7
    k0 = 1 - ((B + C) - sqrt((B + C) ** 2 + 4 * B * C * (n * n - 1))) / 2
    ring = column(
        "overcurved", Ring(), (k0 - 0.4, k0 + 0.3), load="k", start=circle, **ROUND,
        energy=lambda v, k, c: bending_and_twist((k[0], k[1] - c.k, k[2]), (B, 1.0, C)),
    )  # fmt: skip
    assert explore(ring, elements=10).loads() == pytest.approx([k0], rel=1e-9)


@pytest.mark.long
@pytest.mark.parametrize("planar", [None, "e2"])
def test_clothoid(planar: str | None) -> None:
    """A rod whose natural curvature grows along it rolls up to Euler's spiral: Fresnel's integrals."""
    a = 30.0
    rod = column(
        "clothoid", (clamped(), free()), (0.0, a), planar=planar, ordinate=AWAY,
        energy=lambda v, k, c: bending_and_twist((k[0], k[1] - c.P * c.s, k[2]), (1.0, 1.0, 1.0)),
    )  # fmt: skip
    last = explore(rod).branches[0].points[-1]
    assert (last.load, last.negative) == (a, 0)
    assert last.ordinate == pytest.approx(hypot(*fresnel(sqrt(a / pi))) / sqrt(a / pi), rel=1e-8)
