"""The end at which a rod is pressed to no length: its load in closed form, and each state that leads there once."""

from collections import Counter
from typing import Any

import pytest
import ufl
from classics import SUPPORTS, WIDE, column

from rodfem import Discretization, Plan, StepControl, elastic, pinned, trace
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.kinds import BRANCH_POINT
from rodfem.forms.energy import bending_and_twist


def stretched(v: Any, k: Any, c: Any) -> Any:
    """Linear; the compliance in stretch is ``(1 + a sin(3 s))/2``."""
    return (v[2] - 1) ** 2 / (1 + c.a * ufl.sin(3 * c.s)) + bending_and_twist(k, (9.0, 9.0, 9.0))


@pytest.mark.long
def test_no_state_is_computed_twice(monkeypatch: pytest.MonkeyPatch) -> None:
    """``v3 = 1 - P (1 + a sin(3 s))/2`` vanishes first at ``s = pi/6``, inside of an element, and ``P = 2/(1 + a)``."""
    asked: Counter[tuple[int, float]] = Counter()
    at_load = BranchSolver.at_load

    def counted(self: BranchSolver, guess: Any, load: float, reach: float = 1e3) -> Any:
        asked[self.system.fields.discretization.elements, load] += 1
        return at_load(self, guess, load, reach)

    monkeypatch.setattr(BranchSolver, "at_load", counted)
    more: dict[str, Any] = {"rod": "unshearable", "energy": stretched, "constants": {"a": 0.7}}
    rod = column("pressed", SUPPORTS["clamped-free"], (0.0, 3.0), **more)
    (branch,) = trace(rod, Discretization(elements=2, degree=3), Plan(depth=0, steps=WIDE)).branches
    assert branch.ended == "stretch reaches zero"
    end = branch.special[-1]
    assert abs(end.point.load - 2 / 1.7) <= end.error_estimate < 1e-2
    finer = [times for (elements, _), times in asked.items() if elements > 2]
    assert len(finer) > 4
    assert set(finer) == {1}


@pytest.mark.few(2)
@pytest.mark.parametrize(
    ("planar", "largest", "e"),
    [(None, 0.2, 4e3), (None, 0.2, 4e6), ("e1", 0.11, 4e3), ("e1", 0.2, 4e3), ("e1", 0.05, 4e3)],
)
def test_a_branch_point_in_the_last_step_before_the_end(planar: str | None, largest: float, e: float) -> None:
    """A pinned rod on a spring e turns as a rigid body where ``(e v - P) v < 0`` with the stretch ``v = 1 - P/40``.

    At the end, too, eigenvalues vanish: where it has no length.
    """
    rod = column(
        "rigid", (pinned(), elastic(lambda c: (e, e, 0.0), force=lambda c: (0.0, 0.0, -c.P))), (0.0, 60.0),
        rod="unshearable", planar=planar,
        energy=lambda v, k, c: 0.5 * (4 * k[0] ** 2 + 5 * k[1] ** 2 + 2 * k[2] ** 2) + 20 * (v[2] - 1) ** 2,
    )  # fmt: skip
    plan = Plan(depth=0, steps=StepControl(first=0.05, largest=largest), error_bars=False)
    (branch,) = trace(rod, Discretization("auto", 5, 6), plan)
    assert branch.ended == "stretch reaches zero"
    found = [(s.point.load, s.negative_before, s.negative_after) for s in branch.special if s.kind == BRANCH_POINT]
    assert found == [(pytest.approx(40 * e / (40 + e), abs=1e-8), 0, 1 if planar else 2)]
