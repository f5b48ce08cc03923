"""Eigenvalues that cross zero so slowly that a count has them as zero at every row: rigid rods on weak springs."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from classics import column, push

from rodfem import Discretization, End, Plan, Scene, elastic, free, pinned, trace
from rodfem.forms import loads

WEAK = 1e-7
"""Stiffness of a spring; that of the rod in bending, and its length, are one."""


def loses_its_spring() -> Scene:
    """Hinged at its foot by a spring whose stiffness falls with P, and is none at P = 1."""
    foot = End(
        position=lambda c: (0.0, 0.0, 0.0), energy=lambda x, c: loads.rotational_spring(x.q, c.k * (1 - c.P))
    )  # fmt: skip
    return column("indifferent", (foot, free()), (0.0, 3.0), constants={"k": 0.3 * WEAK}, planar="e2")


def foot_spring() -> Scene:
    """A rigid link on a hinge with a spring: P L = k."""
    foot = End(position=lambda c: (0.0, 0.0, 0.0), energy=lambda x, c: loads.rotational_spring(x.q, c.k))
    return column("foot", (foot, free(push)), (0.0, 3 * WEAK), constants={"k": WEAK}, planar="e2")


def tip_spring() -> Scene:
    """The same with a spring across at its tip, in space: P = k L, in two planes at once."""
    ends = pinned(), elastic(lambda c: (c.k, c.k, 0.0), force=push)
    return column("tip", ends, (0.0, 3 * WEAK), constants={"k": WEAK})


def downwards() -> Scene:
    """The same, unloaded."""
    ends = pinned(), elastic(lambda c: (c.k, c.k, 0.0), force=push)
    return column("tip", ends, (3 * WEAK, 0.0), constants={"k": WEAK}, planar="e2")


CASES = [
    (loses_its_spring, 1.0, (0, 1)), (foot_spring, WEAK, (0, 1)), (tip_spring, WEAK, (0, 2)), (downwards, WEAK, (1, 0)),
]  # fmt: skip
ON_RANKS = (downwards,)
"""What several ranks do, too."""


@pytest.mark.long
@pytest.mark.parametrize(
    ("scene", "load", "change"),
    [pytest.param(*x, marks=[pytest.mark.alone] * (x[0] not in ON_RANKS), id=x[0].__name__) for x in CASES],
)
def test_where_a_slow_eigenvalue_crosses_zero(scene: Callable[[], Scene], load: float, change: tuple[int, int]) -> None:
    """Closed forms of rigid links; bending lowers them by a part of k/3, which is less than the bars."""
    diagram = trace(scene(), Discretization("auto", 8, 6), Plan(depth=0))
    (special,) = diagram.special("branch point")
    assert (special.negative_before, special.negative_after) == change
    assert abs(special.point.load - load) <= special.error_estimate < 0.01 * load
    assert not diagram.warnings and not diagram.notes and not diagram[0].unexplained
    assert {p.negative + p.undecided for p in diagram[0].points} == set(change)
