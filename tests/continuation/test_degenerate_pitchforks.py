"""Pitchforks whose leading coefficient nearly vanishes: super- or subcritical by its sign, and the fold beside it.

The branch of the rod with ``V = -P f2/2 + eps f2^2/4 + f2^3/6``, where ``f2 = 2 - 2 cos f`` and f is the twist of its
end, is ``P = f/sin f - 1 + eps f2 + f2^2``: in f it begins with ``(eps + 1/6) f^2``.
"""

from collections.abc import Callable
from math import cos, sin
from typing import Any

import pytest
from classics import column, push
from hard.two_freedoms import scene
from scipy.optimize import minimize_scalar

from rodfem import Diagram, Discretization, End, Plan, Scene, elastic, free, pinned, trace
from rodfem.continuation.kinds import BRANCH_POINT, FOLD
from rodfem.forms import loads


def pitchfork(beside: float) -> Diagram:
    """Diagram with ``eps = -1/6 + beside``."""
    eps = -1 / 6 + beside
    model = scene(
        lambda u, f2, c: 0.5 * c.a * u * u - 0.5 * c.P * f2 + 0.25 * c.b * f2**2 + f2**3 / 6, (-0.3, 0.3), a=1.0, b=eps
    )
    return trace(model, Discretization("auto", 4, 3), Plan(depth=1))


def load(f: float, beside: float) -> float:
    f2 = 2 - 2 * cos(f)
    return float(f / sin(f) - 1 + (-1 / 6 + beside) * f2 + f2**2)


def on_one_rank(*given: Any) -> list[Any]:
    """Parameters of tests that two ranks do without."""
    return [pytest.param(*one if isinstance(one, tuple) else (one,), marks=pytest.mark.alone) for one in given]


@pytest.mark.ranks
@pytest.mark.few(4)
@pytest.mark.parametrize("beside", [-1e-3, *on_one_rank(-1e-2, -2e-4)])
def test_a_fold_beside_a_subcritical_pitchfork(beside: float) -> None:
    """Beyond the fold the branch is stable, and at loads above: there the pitchfork is none that is supercritical.

    The load is even in f: the other side is a mirror image.  At -5e-4 the fold is 6e-8 beside the branch point in load.
    """
    diagram = pitchfork(beside)
    assert [branch.name for branch in diagram] == ["straight", "branch 1"]
    assert all("the index is 0 or 1 (torsion" in said for said in diagram.warnings)  # right beside the fold
    (special,) = diagram.special(BRANCH_POINT)
    law = special.law
    assert (law.kind, law.side) == ("subcritical pitchfork", -1)
    assert law.coefficient == pytest.approx(3 * beside, rel=1e-5, abs=2 * law.uncertainty)
    fold = diagram.special(FOLD)[0]
    true = minimize_scalar(load, bounds=(1e-9, 3 * (-beside) ** 0.5), args=(beside,), method="bounded")
    assert abs(fold.point.load - true.fun) <= max(fold.error_estimate, 1e-13)
    assert (fold.negative_before, fold.negative_after) == (1, 0)
    rows = [p for p in diagram[1].points[1:] if p is not fold.point and not p.undecided]
    assert {(p.negative, p.slope < 0) for p in rows} == {(1, True), (0, False)} and len(rows) > 12


@pytest.mark.ranks
@pytest.mark.few(1)
@pytest.mark.parametrize(
    ("beside", "kind"), [(1e-2, "supercritical"), *on_one_rank((-1e-6, "subcritical"), (1e-6, "supercritical"))]
)
def test_the_sign_of_the_coefficient_names_the_pitchfork(beside: float, kind: str) -> None:
    """Also where the fold is as near to the branch point as the uncertainty of that, which a note says."""
    diagram = pitchfork(beside)
    (special,) = diagram.special(BRANCH_POINT)
    assert special.law.kind == f"{kind} pitchfork"
    assert ("turns back in a fold" in special.note) == (beside < 0)


def test_a_coefficient_that_is_not_told_from_zero() -> None:
    diagram = pitchfork(0.0)
    (special,) = diagram.special(BRANCH_POINT)
    assert (special.law.kind, special.law.side) == ("pitchfork", 0)
    assert abs(special.law.coefficient) <= special.law.uncertainty
    assert "undetermined form" in diagram.in_words()


WEAK = 1e-7
"""Stiffness of a spring; that of the rod in bending, and its length, are one."""


def loses_its_spring() -> Scene:
    """Hinged at its foot by a spring whose stiffness falls with P, and is none at P = 1."""
    foot = End(
        position=lambda c: (0.0, 0.0, 0.0), energy=lambda x, c: loads.rotational_spring(x.q, c.k * (1 - c.P))
    )  # fmt: skip
    return column("indifferent", (foot, free()), (0.0, 3.0), constants={"k": 0.3 * WEAK}, planar="e2")


def tip_spring() -> Scene:
    """The same with a spring across at its tip, in space: P = k L, in two planes at once."""
    ends = pinned(), elastic(lambda c: (c.k, c.k, 0.0), force=push)
    return column("tip", ends, (0.0, 3 * WEAK), constants={"k": WEAK})


CASES = [
    (loses_its_spring, 1.0, (0, 1)), (tip_spring, WEAK, (0, 2)),
]  # fmt: skip


@pytest.mark.parametrize(
    ("scene", "load", "change"), [pytest.param(*x, marks=pytest.mark.alone, id=x[0].__name__) for x in CASES]
)
def test_where_a_slow_eigenvalue_crosses_zero(scene: Callable[[], Scene], load: float, change: tuple[int, int]) -> None:
    """Closed forms of rigid links; bending lowers them by a part of k/3, which is less than the bars."""
    diagram = trace(scene(), Discretization("auto", 8, 6), Plan(depth=0))
    (special,) = diagram.special("branch point")
    assert (special.negative_before, special.negative_after) == change
    assert abs(special.point.load - load) <= special.error_estimate < 0.01 * load
    assert not diagram.warnings and not diagram.notes and not diagram[0].unexplained
    assert {p.negative + p.undecided for p in diagram[0].points} == set(change)
