"""Eigenvalues that pass zero together, in the same direction or in opposite ones, alone and beside others."""

from __future__ import annotations

import pytest
from hard.bifurcations import opposite, opposite_other
from hard.planes import MESH, Draw, Plane, drawn

from rodfem import Plan, trace
from rodfem.continuation.kinds import BRANCH_POINT

pytestmark = pytest.mark.alone


def pair(first: Plane, second: Plane, grow: float = 0.0) -> Draw:
    return Draw((first, second), grow)


TOGETHER = {
    "between rows": pair(Plane((0.5532544,), (1.65,), 0.139), Plane((0.5532544,), (0.147,), -0.336), 1.0),
    "at a row": pair(Plane((1.1766,), (0.6,), 0.3), Plane((1.1766,), (0.4,), -0.1)),
    "three rows that lead to no zero": pair(
        Plane((1.1258044772763802,), (0.8015230860565039,), -0.31104558436229185),
        Plane(
            (1.1258044772763802, 1.1859791655482117), (0.14865154979544007, 0.15713402116987757), -0.3347341710682127
        ),
        1.0,
    ),
    "beside a third one, found in the next step": pair(
        Plane(
            (0.9587714508160521, 0.8551573462753422, 1.0030679581667403),
            (1.3117374737572292, 0.1037192627888499, 0.1121925474786899),
            -0.06084707354511355,
        ),
        Plane((0.9587714508160521,), (0.34869963697471124,), -0.2480026448071125),
        -2.0,
    ),
    "nearly, 7e-5 apart": pair(
        Plane((2.1335149277434473,), (0.5447525477934998,), 0.06958719077859915),
        Plane((2.1334486667406964,), (0.5755870839754178,), -0.061324083185334576),
        -2.0,
    ),
    "two at one load beside one in each of two steps": pair(
        Plane(
            (0.6926350287483546, 0.7797876173375289), (0.40079451767680613, 1.8759828104452128), -0.16706830915916765
        ),
        Plane(
            (0.6926350287483546, 0.6833693626493129, 1.0251674485027018),
            (0.16330374677523235, 0.22023860400231957, 0.15779269438343024),
            0.06911017183491122,
        ),
        -2.0,
    ),
}
"""Draws in which the first zero of either plane is one, or nearly so; the last one has others in steps nearby."""


HARDER = {
    "a zero of a function that is no line": (23, 6, 0.0),
    "a slow one and a fast one": (118, 5, 0.0),
    "a parabola that is two eigenvalues'": (119, 7, 1e-6),
    "two pairs in two steps": (57, 9, 1e-6),
    "four in two steps, two of them at one load": (67, 11, 1e-6),
    "a pair hidden by a crossing beside the next row": (53, 6, 0.0),
    "a pair hidden by one two steps later": (85, 7, 1e-6),
    "steps are shortened from a critical row": (56, 10, 1e-6),
    "a slow one within the band of a fast one's zero": (48, 13, 1e-6),
    "two at one load hide a pair": (101, 11, 1e-6),
    "four in the step of a fifth one, beside its end": (34, 5, 1e-6),
    "a pair where all stiffnesses grow": (131, 8, 1e-6),
    "two at one load in the last step": (162, 8, 1e-6),
}
"""Numbers and seeds of random draws of up to five zeros, and what is no shallower."""


@pytest.mark.few(1)
@pytest.mark.parametrize("name", TOGETHER)
def test_opposite_crossings_at_one_load(name: str) -> None:
    """A branch point at which two eigenvalues vanish and the index stays, located as others are."""
    found = TOGETHER[name].measured()
    assert found.right, f"{found.error:.3g} {found.wrong} {found.said}"


@pytest.mark.long
def test_both_modes_leave_a_branch_point_of_opposite_crossings() -> None:
    """The null vectors bend the rod in one plane each, and branches of both planes leave there."""
    draw = TOGETHER["between rows"]
    diagram = trace(draw.scene(), MESH, Plan(depth=1, error_bars=False))
    (special,) = [s for s in diagram[0].special if s.kind == BRANCH_POINT]
    assert special.multiplicity == 2 and special.negative_before == special.negative_after == 1
    assert special.point.load == pytest.approx(draw.planes[0].zeros[0], abs=1e-9)
    assert len([branch for branch in diagram if branch.parent]) == 2


@pytest.mark.long
@pytest.mark.parametrize("apart", [1e-12, 0.0])
def test_opposite_crossings_of_a_rod_that_stretches(apart: float) -> None:
    """``d - P`` and ``d + P``, whichever passes zero first."""
    assert opposite(apart).right and opposite_other(apart).right


@pytest.mark.few(1)
@pytest.mark.parametrize("name", HARDER)
def test_up_to_five_crossings(name: str) -> None:
    number, seed, shallow = HARDER[name]
    found = drawn(number, seed, 5, shallow).measured()
    assert found.right, f"{found.error:.3g} {found.wrong} {found.said}"
