"""Rods that rotate, that carry a current, that are bent between forks, and a frame: closed forms and shooting."""

from math import cos, pi, sin, sqrt
from typing import Any

import numpy as np
import pytest
import ufl
from classics import BEAM, ON_AXIS, circle, column

import rodfem
from rodfem import Attachment, Discretization, End, Ordinate, Plan, at, clamped, everywhere, free, pinned, sliding
from rodfem.forms import loads
from rodfem.forms.energy import bending_and_twist

FIRST = Plan(depth=0)


@pytest.mark.long
def test_rotating_cantilever() -> None:
    """About e1 at the rate 12: across its plane Wright, Smith, Thresher & Wang (1982) have 13.1702 and 37.6031.

    The tension is ``12^2 (1 - s^2)/2``; in the plane of rotation ``omega^2`` is less by 12^2.
    """
    expected = [173.45286386315985, 645.4793724390186, 1413.994056978653, 6338.465185147834]  # by Galerkin's method
    assert np.sqrt(expected)[[0, 2]] == pytest.approx([13.1702, 37.6031], abs=1e-4)
    rod = column(
        "blade", (clamped(), free()), (0.0, 144.0), inertia=BEAM, constants={"B1": 50.0, "B2": 1.0, "C": 50.0},
        potential=lambda x, c: -c.P / 2 * (x.r[1] ** 2 + x.r[2] ** 2),
    )  # fmt: skip
    solver = rodfem.Solver(rod)
    verdict = solver.assess(solver.equilibrium(144.0), number=4)
    assert (verdict.negative, verdict.zero) == (0, 0)
    assert verdict.values[:4] == pytest.approx(expected, rel=1e-8)


@pytest.mark.long
def test_current_along_a_magnetic_field() -> None:
    """A wire with a current along a field: ``y'''' = i p y'`` for ``y = r1 + i r2`` (Wolfe, Trans. AMS 278, 1983).

    Its force ``p e3 x r'`` has the potential of a pressure, in space as in a plane.
    """
    wire = column(
        "wire", (clamped(), sliding(ON_AXIS)), (300.0, 450.0), constants={"P": 300.0, "B2": 1.0},
        potential=lambda x, c: loads.pressure(x.r, x.dr, c.P, (0.0, 0.0, 1.0)),
    )  # fmt: skip
    (found,) = rodfem.trace(wire, plan=FIRST).special()
    assert (found.negative_before, found.negative_after, found.multiplicity) == (0, 2, 2)
    assert abs(found.point.load - 394.17625416873756) < found.error_estimate < 1e-8


@pytest.mark.long
@pytest.mark.parametrize("side", [1, -1])
def test_arc_in_pure_bending(side: int) -> None:
    """A strip bent to an arc of angle a, its ends on forks: ``M = (B + C)/2 -+ sqrt((B - C)^2/4 + B C pi^2/a^2)``.

    Moments that close the arc, or open it, on a strip that does not bend in its plane (Timoshenko & Gere, chapter 7).
    They turn about e2, by the angle of d3 in the plane across it.
    """
    B, C, half = 1.0, 0.7, 0.6

    def turned(x: Any, s: float) -> Any:
        return ufl.asin(x.d3[0] * cos(s) - x.d3[2] * sin(s))

    def end(s: float, free_along: bool) -> End:
        z = None if free_along else sin(s)
        return End(position=lambda c: (1 - cos(s), 0.0, z), energy=lambda x, c: np.sign(-s) * c.P * turned(x, s))

    forks = tuple(at(s, lambda x, c, s=s: x.d2[0] * cos(s) - x.d2[2] * sin(s)) for s in (-half, half))
    arc = column(
        "arc", (end(-half, False), end(half, True)), (0.0, 4.0 * side), interval=(-half, half), start=circle,
        energy=lambda v, k, c: bending_and_twist((k[0], k[1] - 1.0, k[2]), (c.B1, c.B2, c.C)), constants={"C": C},
        constraints=(everywhere(lambda x, c: x.k[1] - 1.0, strain=True), *forks),
        ordinate=Ordinate("crown", s=0.0, of=lambda r, q: float(r[1])),
    )  # fmt: skip
    found = rodfem.trace(arc, plan=FIRST).special()[0]
    expected = (B + C) / 2 + side * sqrt((B - C) ** 2 / 4 + B * C * (pi / (2 * half)) ** 2)
    assert (found.negative_before, found.negative_after) == (0, 1)
    assert abs(found.point.load - expected) < found.error_estimate < 1e-9


@pytest.mark.long
def test_frame_of_lee() -> None:
    """Two legs of length one, pinned at their ends, and a load at a fifth of the second one: Lee, Manuel & Rossow 1968.

    The corner is a piece 0.02 long that is a thousand times as stiff.  A sharp one has its fold at 18.559 EI/L^2.
    """
    h, stiff = 0.01, 1001.0
    radius = 4 * h / pi

    corner: Any = lambda s: ufl.conditional(ufl.And(ufl.gt(s, 1 - h), ufl.lt(s, 1 + h)), 1.0, 0.0)  # noqa: E731
    foot: Any = lambda c: (radius + 1 - h, 0.0, radius + 1 - h)  # noqa: E731

    def start(s: np.ndarray) -> np.ndarray:
        quarter = pi / 4 * np.clip((s - 1 + h) / (2 * h), 0, 1)
        return np.stack([np.cos(quarter), 0 * s, np.sin(quarter), 0 * s], axis=1)

    def energy(v: Any, k: Any, c: Any) -> Any:
        EI = 1 + (stiff - 1) * corner(c.s)
        return bending_and_twist((k[0], k[1] - corner(c.s) / radius, k[2]), (EI, EI, EI))

    frame = column(
        "frame", (pinned(), pinned(foot)), (0.0, 20.0), interval=(0.0, 2.0), planar="e2", start=start, energy=energy,
        breaks=(1 - h, 1 + h), attachments=(Attachment(1.2, force=lambda c: (0.0, 0.0, -c.P)),),
        ordinate=Ordinate("sinks by", s=1.2, of=lambda r, q: 1.0 - float(r[2])),
    )  # fmt: skip
    (fold,) = rodfem.trace(frame, Discretization(elements=12, degree=6), FIRST).special("fold")
    assert (fold.negative_before, fold.negative_after) == (0, 1)
    assert abs(fold.point.load - 18.60846659573521) < 1e-8 and fold.error_estimate < 1e-8  # by shooting
