"""What is no equilibrium is never a point of a branch: states that are spoilt after Newton's method has ended."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest
from classics import euler
from golden_cases import cases

from rodfem import Discretization, Plan, trace
from rodfem.continuation.branch_solver import BranchSolver, Step

SMALL = 1e-6
"""Size of the mutations, in the units of a rod of unit length and stiffness."""


def test_a_step_that_has_jumped_is_halved(monkeypatch: pytest.MonkeyPatch) -> None:
    """From the straight branch beyond the load 2 to the buckled one, with the tangent of the straight one."""
    scene, mesh, plan = cases()["demo hemitropic"](), Discretization("auto", 8, 6), Plan(depth=1, error_bars=False)
    straight, buckled = trace(scene, mesh, plan).branches[:2]
    step: Callable[..., Step] = BranchSolver.step
    jumped = list[float]()

    def jumping(self: BranchSolver, *given: Any) -> Step:
        made = step(self, *given)
        near = min(buckled.points[2:], key=lambda p: abs(p.load - made.load))
        if jumped or made.tangent is None or abs(near.load - made.load) > 0.1:
            return made
        jumped.append(near.load)
        return replace(made, x=near.x.copy(), load=near.load)

    monkeypatch.setattr(BranchSolver, "step", jumping)
    (found,) = trace(scene, mesh, replace(plan, depth=0))
    assert jumped and found.ended == straight.ended
    assert [s.point.load for s in found.special] == pytest.approx([s.point.load for s in straight.special], abs=1e-9)
    assert max(abs(p.ordinate) for p in found.points) == pytest.approx(max(abs(p.ordinate) for p in straight.points))


@pytest.mark.few(1)
def test_a_violation_ends_the_branch_with_a_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    step: Callable[..., Step] = BranchSolver.step
    where = 5.0

    def spoiling(self: BranchSolver, *given: Any) -> Step:
        made = step(self, *given)
        if made.load <= where:
            return made
        x, f = made.x.copy(), self.system.fields
        self.system.set_load(x, made.load + SMALL)
        begin = f.number[f.dofs["q"]].max() // 2
        x.setValue(int(begin), x.getValue(int(begin)) + SMALL)
        x.assemble()
        return replace(made, x=x)

    monkeypatch.setattr(BranchSolver, "step", spoiling)
    diagram = trace(euler("clamped-pinned"), Discretization("reduced", 4, 4), Plan(depth=0, error_bars=False))
    (branch,) = diagram
    assert branch.ended.startswith("no convergence: At P = ")
    assert max(p.load for p in branch.points) <= where
    assert any(branch.ended.endswith(sentence) for sentence in diagram.warnings)
