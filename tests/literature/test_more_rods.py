"""More rods against closed forms and equations of their linearised states: rings, strips, torques, tension, signs."""

from dataclasses import replace
from math import hypot, pi, sqrt
from typing import Any

import numpy as np
import pytest
import ufl
from classics import BEAM, ON_AXIS, circle, column, push
from scipy.optimize import brentq
from scipy.special import ellipe, ellipj, ellipk

import rodfem
from rodfem import Discretization, Ordinate, Plan, Ring, Scene, Solver, clamped, everywhere, free, pinned, sliding
from rodfem.forms.energy import bending_and_twist
from rodfem.stability import METHODS

FIRST = Plan(depth=0)
B, C = 1.0, 0.7


def ring(turns: int, load: str, span: tuple[float, float], **more: Any) -> Scene:
    """A rod of natural curvature k0 closed to a circle of radius one that it covers several times."""
    given: dict[str, Any] = {
        "energy": lambda v, k, c: bending_and_twist((k[0], k[1] - c.k0, k[2]), (B, B, c.C)),
        "ordinate": Ordinate("width", s=pi, of=lambda r, q: hypot(*r)),
    }
    return column(
        "ring", more.pop("ends", Ring(odd=turns % 2 == 1)), span, interval=(0.0, 2 * pi * turns), load=load,
        constants={"k0": 1.0, "C": C} | {load: span[0]}, **{"start": circle} | given | more,
    )  # fmt: skip


@pytest.mark.long
def test_ring_covered_twice() -> None:
    """Out of its plane a mode of wave number p has the energy ``B (a p - b)^2 + C (a - b p)^2 - M (a^2 ...)``.

    With the moment ``M = B (1 - k0)`` it vanishes where ``M^2 - (B + C) M = B C (p^2 - 1)``.  Of p = 1/2, 1, 3/2, ...
    the first is unstable in a naturally straight rod, whatever C is (Manning & Hoffman, J. Elasticity 62, 2001).
    """
    expected = []
    for p in (0.5, 1.5):
        M = ((B + C) - np.array([1, -1]) * sqrt((B + C) ** 2 - 4 * B * C * (1 - p * p))) / 2
        expected += [1 - x / B for x in M if 0.05 < 1 - x / B < 1.6]
    found = rodfem.trace(ring(2, "k0", (0.05, 1.6)), Discretization(elements=14, degree=6), FIRST).special()
    assert [(s.negative_before, s.negative_after, s.multiplicity) for s in found] == [(2, 0, 2), (0, 2, 2)]
    for special, k0 in zip(found, sorted(expected), strict=True):
        assert abs(special.point.load - k0) < special.error_estimate < 1e-8


@pytest.mark.long
@pytest.mark.parametrize("method", [name for name in METHODS if name != "count"])
def test_vibrating_ring(method: str) -> None:
    """Love: ``n^2 (n^2 - 1)^2 / (n^2 + B/C)`` out of the plane, ``B2 n^2 (n^2 - 1)^2 / (n^2 + 1)`` in it.

    Rotations have no mass, so that factors of the pencil delay many pivots.
    """
    energy = lambda v, k, c: bending_and_twist((k[0], k[1] - 1.0, k[2]), (B, 2.0, c.C))  # noqa: E731
    solver = Solver(ring(1, "C", (C, 1.0), energy=energy, inertia=BEAM), Discretization(elements=8, degree=6))
    verdict = solver.assess(solver.equilibrium(C), method=method, number=8)
    size = {n: n * n * (n * n - 1) ** 2 for n in (2, 3)}
    expected = [x for n in (2, 3) for x in (size[n] / (n * n + B / C), 2 * size[n] / (n * n + 1))]
    assert (verdict.negative, verdict.zero, verdict.certified) == (0, 6, True)
    assert verdict.values == pytest.approx(np.repeat(expected, 2), rel=1e-6)


@pytest.mark.long
@pytest.mark.parametrize(
    ("above", "load"), [(0.0, 3.3571814732694114), (0.2, 2.33968005359683), (-0.2, 3.9129711807378964)]
)
def test_load_above_a_strip(above: float, load: float) -> None:
    """A strip that does not bend in its plane, loaded across at its tip, off its axis (Prandtl, Timoshenko & Gere 6.3).

    ``C phi'' + P^2 (1 - s)^2 / B phi = 0``, with ``C phi' = P a phi`` at the tip under a load at the height a.
    """
    strip = column(
        "strip", (clamped(), free(energy=lambda x, c: -c.P * (x.r[0] - c.k * x.d1[0]))), (0.0, 5.0),
        constants={"k": above, "B1": B, "C": C}, constraints=(everywhere(lambda x, c: x.k[1], strain=True),),
    )  # fmt: skip
    (found,) = rodfem.trace(strip, plan=FIRST).special()
    assert (found.negative_before, found.negative_after) == (0, 1)
    assert abs(found.point.load - load) < found.error_estimate < 1e-9


@pytest.mark.long
def test_torque_and_tension() -> None:
    """A round rod between clamps buckles by a torque M and a tension T where ``y'''' - i M y''' - T y'' = 0``."""
    turned: Any = lambda c: (ufl.cos(c.phi / 2), 0.0, 0.0, ufl.sin(c.phi / 2))  # noqa: E731
    rod = column(
        "cable", (clamped(), sliding(ON_AXIS, turned, force=lambda c: (0.0, 0.0, c.T))), (0.0, 6.0), load="phi",
        constants={"phi": 0.0, "T": 0.0, "B2": 1.0, "C": 2.0},
    )  # fmt: skip
    diagram = rodfem.trace(rod, plan=replace(FIRST, error_bars=False))
    locus = diagram.locus(diagram.special("branch point")[0], "T", (-30.0, 20.0), load=(0.0, 8.0))
    ends = sorted(locus.values[[0, locus.start, -1]].tolist())
    assert [T for _, T in ends] == [-30.0, 0.0, 20.0]
    torques = 3.800429623480081, 8.986818915818128, 11.800329535425245
    assert [2.0 * phi for phi, _ in ends] == pytest.approx(torques, rel=1e-8)


@pytest.mark.long
def test_buckling_in_tension() -> None:
    """Haringx: ``P (1 + P/GA) = n^2 pi^2 B``, the negative root; for n = 0, ``P = -GA``, all sections turn alike."""
    GA = 10.0
    expected = [-GA, *(-(GA + sqrt(GA * GA + 4 * GA * pi**2 * x)) / 2 for x in (1.0, 2.0))]
    rod = column(
        "tension", (pinned(), pinned(ON_AXIS, push)), (0.0, -22.0), rod="inextensible",
        energy=lambda v, k, c: GA / 2 * (v[0] ** 2 + v[1] ** 2) + bending_and_twist(k, (c.B1, c.B2, c.C)),
    )  # fmt: skip
    found = rodfem.trace(rod, plan=FIRST).special()
    assert [(s.negative_before, s.negative_after) for s in found] == [(0, 2), (2, 3), (3, 4)]
    for special, P in zip(found, expected, strict=True):
        assert abs(special.point.load - P) < special.error_estimate < 1e-9


@pytest.mark.few(1)
@pytest.mark.parametrize(
    ("start", "rotation"),
    [
        (lambda s: np.stack([-1 + 0 * s, 0 * s, 0 * s, 0 * s], axis=1), (1.0, 0.0, 0.0, 0.0)),
        (lambda s: np.stack([np.where(s < 0.33, -1.0, 1.0), 0 * s, 0 * s, 0 * s], axis=1), (1.0, 0.0, 0.0, 0.0)),
        (None, (-1.0, 0.0, 0.0, 0.0)),
    ],
)
def test_signs_of_quaternions(start: Any, rotation: tuple[float, float, float, float]) -> None:
    """A quaternion and its negative are one rotation: a column is Euler's, whichever of them a person gives."""
    rod = column("signs", (clamped(rotation=rotation), free(push)), (0.0, 4.0), start=start)
    (found,) = rodfem.trace(rod, plan=FIRST).special()
    assert abs(found.point.load - pi**2 / 4) < found.error_estimate < 1e-9


@pytest.mark.long
def test_figure_eight() -> None:
    """A closed elastica that crosses itself, ``2 E(m) = K(m)``: stable in space where C exceeds two.

    What leaves there ends as a circle of one excess turn, where that becomes unstable: at C = sqrt(3) (Michell).
    """
    m = brentq(lambda m: 2 * ellipe(m) - ellipk(m), 0.5, 0.99, xtol=1e-15)

    def start(s: np.ndarray) -> np.ndarray:
        half = np.arcsin(sqrt(m) * ellipj(2 * ellipk(m) / pi * s, m)[0])
        return np.stack([np.cos(half), 0 * s, np.sin(half), 0 * s], axis=1)

    twist = Ordinate("twist", s=None, of=lambda x, c: x.k[2] / (2 * pi))
    rod = ring(1, "C", (1.6, 2.2), ends=Ring(odd=False), start=start, ordinate=twist,
               energy=lambda v, k, c: bending_and_twist(k, (B, B, c.C)))  # fmt: skip
    diagram = rodfem.trace(rod, Discretization(elements=16, degree=6), Plan(depth=1))
    (found,), (last,) = (diagram.special("branch point", name) for name in ("ring", "branch 1"))
    assert (found.negative_before, found.negative_after, found.point.ordinate) == (1, 0, pytest.approx(0.0, abs=1e-10))
    assert abs(found.point.load - 2.0) < found.error_estimate + 1e-11 < 1e-9
    assert {p.negative for p in diagram["branch 1"].points} == {0}
    assert abs(last.point.load - sqrt(3)) < 1e-9 and abs(last.point.ordinate) == pytest.approx(1.0, abs=1e-6)


@pytest.mark.long
def test_moebius_band() -> None:
    """Ends that meet, one turned by pi: an oblong section fits its own back, and the band slides along itself.

    Where it does it can be at any place along the band: a family of states at that angle, at which the range ends.
    """
    turned: Any = lambda c: (-ufl.cos(c.phi / 2), 0.0, 0.0, -ufl.sin(c.phi / 2))  # noqa: E731
    band = ring(1, "phi", (0.0, 3.3), ends=(clamped(), clamped(rotation=turned)),
                energy=lambda v, k, c: bending_and_twist(k, (B, 1.5, c.C)))  # fmt: skip
    diagram = rodfem.trace(band, Discretization(elements=10, degree=6), Plan(depth=1))
    (found,) = diagram.special("branch point")
    assert (found.negative_before, found.negative_after) == (1, 0)
    assert max(abs(p.load - pi) for p in diagram["branch 1"].points) < 1e-8
    assert abs(found.point.load - pi) < found.error_estimate < 1e-9
    assert "meets a family of states at one and the same load" in diagram.in_words()
    warnings = " ".join(diagram.again(span=(0.0, pi), depth=0).warnings)
    assert "no state is found at 3.14159: let the range end elsewhere if that is a bifurcation" in warnings
