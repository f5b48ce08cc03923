"""Potential energies and what loads do work on: closed forms, the work of the load from row to row, and folds."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from classics import bow, euler
from golden_cases import cases

from rodfem import Diagram, Discretization, Ordinate, Plan, Solver, trace
from rodfem.continuation.branch import Branch, Point
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.kinds import FOLD
from rodfem.continuation.work import EnergyBalance

alone = pytest.mark.alone
WITH_FOLDS = [
    *("demo hemitropic", "demo ring", "docs hinge"),
    *("classic foundation", "classic tip spring", "classic pressed arch"),
]
MESHES = [Discretization("auto", 8, 6), Discretization("auto", 24, 1)]


def rows(branch: Branch) -> list[Point]:
    """Rows that the branch has been followed by: without its special points, and the state that it leaves."""
    special = {id(s.point) for s in branch.special}
    return [p for p in branch.points if id(p) not in special][1 if branch.parent else 0 :]


def solver_of(diagram: Diagram) -> BranchSolver:
    return diagram.solvers[0]


@pytest.fixture(scope="module", params=MESHES, ids=["8 P6", "24 P1"])
def diagram(request: pytest.FixtureRequest) -> Diagram:
    """The hemitropic rod, straight and buckled."""
    return trace(cases()["demo hemitropic"](), request.param, Plan(depth=1, error_bars=False))


@pytest.mark.few(1)
@pytest.mark.parametrize("mesh", MESHES)
def test_conjugate_of_a_distance_is_the_thrust(mesh: Discretization) -> None:
    """Clamps that come nearer by ``d``: ``V = W``, and ``dV/dd`` is the thrust, Castigliano's theorem."""
    solver = Solver(bow(), mesh)
    point = solver.equilibrium(0.2)
    thrust = solver.equilibria.system.scalar(point.x, "g1")
    assert point.potential == pytest.approx(point.energy, rel=1e-12)
    assert abs(point.conjugate) == pytest.approx(abs(thrust), rel=1e-10)


@pytest.mark.few(1)
@alone
@pytest.mark.parametrize("mesh", MESHES)
def test_dead_load_does_work_on_its_point(mesh: Discretization) -> None:
    """A column pushed down its axis by ``P``: ``V = W + P r3`` and ``c = -r3`` at its tip."""
    height = Ordinate("height of the tip", s=1.0, of=lambda r, q: float(r[2]))
    scene = replace(euler("clamped-free"), ordinate=height, span=(0.0, 10.0))
    bent = rows(trace(scene, mesh, Plan(depth=1, error_bars=False)).branches[1])
    assert bent[-1].ordinate < 0.5
    for point in bent:
        assert point.conjugate == pytest.approx(-point.ordinate, abs=1e-12)
        assert point.potential == pytest.approx(point.energy + point.load * point.ordinate, abs=1e-11)


@pytest.mark.few(1)
@alone
@pytest.mark.parametrize("name", WITH_FOLDS)
def test_stability_is_exchanged_at_folds_as_their_side_says(name: str) -> None:
    """The eigenvalue that vanishes at a fold changes by ``lam'' c'`` (Maddocks 1987).

    ``L_xx x' + lam' L_xlam = 0`` at all states.  Its derivative where ``lam' = 0``, along the null vector ``x'``, is
    ``x'.L_xxx x' x' = -lam'' x'.L_xlam``: the change of the eigenvalue, with ``c' = -L_xlam.x'``.
    """
    scene, folds = cases()[name](), 0
    mesh = Discretization("auto", 8 if scene.start is None else 16, 6)
    for branch in trace(scene, mesh, Plan(depth=1, error_bars=False)).branches:
        own = rows(branch)
        for special in (s for s in branch.special if s.kind == FOLD):
            a = max((p for p in own if p.arclength < special.point.arclength), key=lambda p: p.arclength)
            b = min((p for p in own if p.arclength > special.point.arclength), key=lambda p: p.arclength)
            turns = np.sign(b.slope - a.slope) * np.sign(b.conjugate - a.conjugate)
            assert special.negative_after - special.negative_before == -turns, special
            folds += 1
    assert folds


@pytest.mark.few(1)
@alone
def test_every_step_is_balanced(diagram: Diagram) -> None:
    """On linear elements, too; and hardly any is divided for it."""
    balanced, solver = EnergyBalance(), solver_of(diagram)
    steps = [own[: i + 1] for own in map(rows, diagram.branches) for i in range(1, len(own))]
    assert len(steps) > 80
    assert all(balanced(solver, step) for step in steps)


@pytest.mark.long
@alone
def test_a_jump_is_not_balanced(diagram: Diagram) -> None:
    """States of another branch at nearly the same load, farther than two steps away, in place of the last row.

    Those within a load step of where two branches meet have the energy of either.
    """
    solver, own, told = solver_of(diagram), [rows(b) for b in diagram.branches], []
    for branch in own:
        for other in (b for b in own if b is not branch):
            for i in range(4, len(branch)):
                last, step = branch[i], branch[i].arclength - branch[i - 1].arclength
                near = min(other, key=lambda p: abs(p.load - last.load))
                if abs(near.load - last.load) < 0.5 * step and solver.system.distance(near.x, last.x) > 2 * step:
                    jump = replace(near, arclength=last.arclength)
                    told.append(not EnergyBalance()(solver, [*branch[:i], jump]))
    assert len(told) > 150
    assert sum(told) > 0.95 * len(told)


@alone
def test_energy_that_does_not_follow_the_load_ends_a_branch(monkeypatch: pytest.MonkeyPatch) -> None:
    """From the load 0.5 on all energies are those of another state, by a part in a million."""
    whole = BranchSolver.point

    def spoilt(self: BranchSolver, *arguments: Any, **more: Any) -> Point:
        point = whole(self, *arguments, **more)
        point.potential += 1e-6 * abs(point.potential) if point.load > 0.5 else 0.0
        return point

    monkeypatch.setattr(BranchSolver, "point", spoilt)
    first = trace(cases()["demo hemitropic"](), MESHES[0], Plan(depth=0, error_bars=False)).branches[0]
    assert "is not the work of the load" in first.ended
    assert 0.4 < first.points[-1].load < 0.5
