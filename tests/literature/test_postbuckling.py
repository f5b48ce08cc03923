"""Initial postbuckling (Koiter): coefficients in closed form, what turns back at once, and sides that differ."""

from dataclasses import replace
from math import pi, sqrt
from typing import Any

import classics
import numpy as np
import pytest
from classics import ON_AXIS, column, push

import rodfem
from rodfem import Diagram, Discretization, Ordinate, Plan, Ring, SpecialPoint, clamped, pinned, sliding
from rodfem.continuation.normal_form import NormalForm
from rodfem.forms.energy import bending_and_twist

ACROSS = Ordinate("middle", s=0.5, of=lambda r, q: float(r[0]))
PINNED = (pinned(), pinned(ON_AXIS, push))
ONCE = Plan(depth=1)
Energy = Any


def linear(v: Any, k: Any, c: Any) -> Any:
    return bending_and_twist(k, (9.0, 1.0, 1.0))


def traced(span: tuple[float, float], energy: Energy, constants: dict[str, float], **more: Any) -> Diagram:
    """A pinned column in the plane across e2, bent about d2 with the stiffness one; ``ends`` may be given."""
    ends, plan = more.pop("ends", PINNED), more.pop("plan", ONCE)
    given = {"planar": "e2", "ordinate": ACROSS, "energy": energy, "constants": constants} | more
    return rodfem.trace(column("postbuckling", ends, span, **given), plan=plan)


def check_law(special: SpecialPoint, kind: str, coefficient: float, most: float) -> NormalForm:
    """The law by which a branch leaves, of this ``kind`` and ``coefficient`` within less than ``most``."""
    law = special.law
    assert law is not None and law.kind == kind
    assert abs(law.coefficient - coefficient) <= law.uncertainty < most
    return law


def quartic(v: Any, k: Any, c: Any) -> Any:
    """Not linear: ``k^2/2 + beta k^4``."""
    return linear(v, k, c) + c.beta * k[1] ** 4


@pytest.mark.long
@pytest.mark.parametrize("beside", [0.9, 1.001])
def test_material_that_is_not_linear(beside: float) -> None:
    """For ``k^2/2 + beta k^4`` ``P = pi^2 + pi^4/8 (1 + 24 beta pi^2) x^2``: subcritical below -1/(24 pi^2)."""
    beta = -beside / (24 * pi**2)
    (found,) = traced((9.0, 10.5), quartic, {"beta": beta}).special("branch point", "straight")
    check_law(found, f"{'super' if beside < 1 else 'sub'}critical pitchfork", pi**4 / 8 * (1 - beside), 1e-5)


@pytest.mark.long
@pytest.mark.parametrize("excess", [0.3, pytest.param(1e-3, marks=pytest.mark.long), 1e-4])
def test_column_that_stretches(excess: float) -> None:
    """``P (1 - P/EA) = pi^2`` has two roots if EA exceeds 4 pi^2: it buckles, and is straight again when it is shorter.

    Near that the branches that leave the two points turn at once.  ``P (1 - P/EA) = pi^2 + 3 A^2 (P/24 - P^2/(6 EA))``
    for the slope ``A cos(pi s)``, and the middle moves by ``(1 - P/EA) A/pi``: subcritical for EA below 16 pi^2/3.
    """
    EA = 4 * pi**2 * (1 + excess)
    energy = lambda v, k, c: c.EA / 2 * (v[2] - 1) ** 2 + linear(v, k, c)  # noqa: E731
    loads = [EA / 2 * (1 + side * sqrt(1 - 4 * pi**2 / EA)) for side in (-1, 1)]
    margin = loads[1] - loads[0]
    diagram = traced((loads[0] - margin, loads[1] + margin), energy, {"EA": EA}, rod="unshearable")
    found = diagram.special("branch point", "straight")
    assert [(s.negative_before, s.negative_after) for s in found] == [(0, 1), (1, 0)]
    for special, P in zip(found, loads, strict=True):
        assert abs(special.point.load - P) <= special.error_estimate
        expected = 3 * pi**2 * (P / 24 - P * P / (6 * EA)) / ((1 - 2 * P / EA) * (1 - P / EA) ** 2)
        supercritical = expected > 0 and P < EA / 2
        check_law(special, f"{'super' if supercritical else 'sub'}critical pitchfork", expected, 1e-3 * abs(expected))


@pytest.mark.long
def test_buckling_in_tension() -> None:
    """Under a tension T a column that shears buckles supercritically: the law with ``T (T/GA - 1)``, ``T^2/(6 GA)``."""
    GA = 10.0
    T = (GA + sqrt(GA * GA + 4 * GA * pi**2)) / 2
    energy = lambda v, k, c: c.GA / 2 * (v[0] ** 2 + v[1] ** 2) + linear(v, k, c)  # noqa: E731
    diagram = traced((-15.0, -17.0), energy, {"GA": GA, "P": -15.0}, rod="inextensible")
    (found,) = diagram.special("branch point", diagram.branches[0].name)
    expected = -3 * pi**2 * (T * T / (6 * GA) - T / 24) / ((2 * T / GA - 1) * (T / GA - 1) ** 2)
    check_law(found, "supercritical pitchfork", expected, 1e-4)


@pytest.mark.long
@pytest.mark.parametrize("of", [lambda r, q: 0.0, lambda r, q: float(r[1]), lambda r, q: float(r[0]) ** 4])
def test_ordinate_that_does_not_change(of: Any) -> None:
    """``P = pi^2 + pi^2/4 a^2`` whatever the ordinate is: ``a^2`` is the integral of the square of the angle."""
    diagram = traced((9.0, 10.5), linear, {}, ordinate=Ordinate("nothing", s=0.5, of=of))
    (found,) = diagram.special("branch point", "straight")
    law = check_law(found, "supercritical pitchfork", pi**2 / 4, 1e-6)
    assert (law.power, law.of) == (2, "distance")
    assert "where it buckles supercritically;" in diagram.in_words()


@pytest.mark.long
def test_size_of_a_displacement_at_a_transcritical_point() -> None:
    """``8 beta/pi^3 |x|`` would have two signs: it is ``8 beta/pi^3 sqrt(2)/pi a`` with ``a^2`` of the angle alone.

    Where a potential depends on the position that is an unknown, too: ``a^2`` has the factor ``1 + 1/pi^2``.
    """
    size = Ordinate("size", s=0.5, of=lambda r, q: abs(float(r[0])))
    diagram = traced((9.5, 10.5), linear, {"k": 1.0}, ordinate=size, potential=lambda x, c: c.k * x.r[0] ** 3)
    (found,) = diagram.special("branch point", "straight")
    expected = 8 / pi**3 * sqrt(2) / pi / sqrt(1 + 1 / pi**2)
    assert check_law(found, "transcritical", expected, 1e-4).of == "distance"
    assert found.coefficient_derivative("k").value == pytest.approx(expected, abs=1e-9)


@pytest.mark.few(1)
@pytest.mark.parametrize("C", [1.3, 1.4])
def test_ring_of_intrinsic_twist(C: float) -> None:
    """Michell's ring buckles supercritically for C/B above 11/8 (Le Bret 1984): ``t = sqrt(3)/C + (C - 11/8)/C x``.

    ``x`` is the twist in turns that it loses.  The coefficient is that of the expansion about the circle.
    """
    twist = Ordinate("twist", s=None, of=lambda x, c: x.k[2] / (2 * pi))
    ring = replace(classics.ring().varying("k", (1.0, 1.6), C=C), ends=Ring(), ordinate=twist)
    plan = Plan(depth=1, most_branches=2, error_bars=False)
    found = rodfem.trace(ring, Discretization(elements=14, degree=6), plan).special("branch point", "ring")[0]
    assert abs(found.point.load - sqrt(3) / C) < 1e-9
    assert found.law is not None
    assert found.law.kind == f"{'super' if C > 11 / 8 else 'sub'}critical pitchfork"
    assert found.law.coefficient == pytest.approx((C - 11 / 8) / C, abs=1e-7)
    slope = found.coefficient_derivative("C")
    assert abs(slope.value - 11 / 8 / C**2) <= slope.error < 1e-5


@pytest.mark.few(1)
@pytest.mark.parametrize(
    ("beta", "folds"),
    [(1.0, 1), pytest.param(0.3, 1, marks=pytest.mark.long), pytest.param(0.01, 0, marks=pytest.mark.long), (1e-3, 0)],
)
def test_foundation_that_is_softer_on_one_side(beta: float, folds: int) -> None:
    """With ``beta x^3`` per length ``P = pi^2 + 8 beta/pi^3 x + pi^4/8 x^2 + ...``: two branches, a fold on one.

    The fold is ``(8 beta/pi^3)^2 / (pi^4/2)`` below the branch point, to first order in beta: by 1.4e-7 for 0.01.
    There the branch begins beyond it.
    """
    slope = 8 * beta / pi**3
    diagram = traced((9.5, 10.5), linear, {"k": beta}, potential=lambda x, c: c.k * x.r[0] ** 3)
    (point,) = diagram.special("branch point", "straight")
    check_law(point, "transcritical", slope, 1e-3 * slope)
    assert point.coefficient_derivative("k").value == pytest.approx(8 / pi**3, abs=1e-9)
    assert [b.name for b in diagram] == ["straight", "branch 1", "branch 2"]
    assert np.sign([b.points[-1].ordinate for b in diagram.branches[1:]]).tolist() == [1.0, -1.0]
    assert [b.points[-1].stable for b in diagram.branches[1:]] == [False, True]
    # turned about the line of its ends by phi the rod gains beta x^3 (cos^3 phi - 1) per length
    for branch, falls in zip(diagram.branches[1:], (1, 0), strict=True):
        assert {p.negative_in_space for p in branch.points[1:] if not p.negative} == {falls}
    assert len(diagram.special("fold")) == folds
    for fold in diagram.special("fold"):
        assert (fold.negative_before, fold.negative_after) == (1, 0)
        assert point.point.load - fold.point.load == pytest.approx(slope**2 / (pi**4 / 2), rel=2e-3)
        assert abs(fold.point.load - pi**2 + slope**2 / (pi**4 / 2)) <= max(fold.error_estimate, 2e-3 * slope**2)
    assert not any(branch.unexplained for branch in diagram) and not diagram.warnings


@pytest.mark.long
def test_sides_that_differ_across_the_plane() -> None:
    """``g x y^2`` does nothing in the plane across y: of the two sides of the pitchfork one is unstable in space."""
    ends = (clamped(), sliding(ON_AXIS, force=push))
    energy = lambda v, k, c: bending_and_twist(k, (1.05, 1.0, 1.0))  # noqa: E731
    diagram = traced((38.0, 44.0), energy, {"k": 200.0}, ends=ends, potential=lambda x, c: c.k * x.r[0] * x.r[1] ** 2)
    ends_at = {np.sign(b.points[-1].ordinate): b.points[-1] for b in diagram.branches[1:]}
    assert {side: (p.negative, p.negative_in_space) for side, p in ends_at.items()} == {1.0: (0, 0), -1.0: (0, 1)}
    assert ends_at[1.0].ordinate == pytest.approx(-ends_at[-1.0].ordinate, rel=1e-6)
