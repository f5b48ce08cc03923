"""Every row of a diagram against counts at its own state, and the chain of indices along every branch."""

from collections.abc import Sequence

from rodfem.continuation.branch import Branch, Point
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.kinds import BRANCH_POINT, FOLD
from rodfem.stability.assessment import Assessor


def verify(follower: BranchSolver, branches: Sequence[Branch], explained: bool = True) -> None:
    """Assert that recorded indices and tangents are those of the rows' own states, and that all changes are explained.

    What the prediction's factors tell and what two shifts tell is independent: other matrices, other factors, other
    code.
    """
    for branch in branches:
        special = {id(s.point): s for s in branch.special if s.kind in (FOLD, BRANCH_POINT)}
        for row, point in enumerate(branch.points):
            if point.mesh != follower.mesh:
                continue
            verdict = Assessor(follower)(point.x, "count")
            recorded, counted = (point.negative, point.zero), (verdict.negative, verdict.zero)
            assert recorded == counted, f"{branch.name}, row {row}, load {point.load}: {recorded}, not {counted}"
            if point.tangent is not None and verdict.zero == follower.system.active_drifts(point.x):  # else singular
                row_of = follower.row(point.tangent)
                cosine = row_of.dot(follower.tangent(row_of, at=point.x))
                assert cosine > 1 - 1e-6, (
                    f"{branch.name}, row {row}, load {point.load}: tangent off, cosine {cosine:.3f}"
                )
            if id(point) in special:
                before, after = special[id(point)].negative_before, special[id(point)].negative_after
                assert point.negative <= min(before, after), f"{branch.name}, row {row}"
        assert not (explained and branch.unexplained), [str(u) for u in branch.unexplained]


def regular(branch: Branch) -> list[Point]:
    """Rows that a branch has been followed by: without its special points."""
    return [p for p in branch.points if not any(p is s.point for s in branch.special)]
