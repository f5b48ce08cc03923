"""What is computed once, or by compiled code, at every row of three scenes: beside PETSc, dolfinx and new factors."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import small_states

from rodfem.continuation.branch import Point
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.diagram.diagram import Diagram, trace
from rodfem.diagram.plan import Plan
from rodfem.fem.fields import Discretization
from rodfem.fem.symmetries import phase_at
from rodfem.linalg.matrices import shared
from rodfem.stability.motion_names import DEPENDENT, MotionNames
from rodfem.stability.pencil import symmetry_modes

pytestmark = pytest.mark.alone
SCENES = ["hemitropic", "cord", "ruler"]
BOTH = [(name, formulation) for name in SCENES for formulation in ("reduced", "pointwise")]


def traced(name: str, formulation: str) -> Diagram:
    plan = Plan(depth=1, error_bars=False)
    return trace(small_states.scene(name), Discretization(formulation, 4, 4), plan)


@cache
def rows(name: str, formulation: str) -> tuple[BranchSolver, list[Point]]:
    """A solver and all rows of a scene."""
    found = traced(name, formulation)
    solver = found.solvers[0]
    points = [point for branch in found.branches for point in branch.points if point.mesh == 0]
    assert len(points) > 40
    return solver, points


@pytest.mark.few(3)
@pytest.mark.parametrize(("name", "formulation"), BOTH)
def test_second_variation_is_that_of_petsc(name: str, formulation: str) -> None:
    """To the last bit: the same kernels, and the same sums."""
    solver, points = rows(name, formulation)
    inertia, matrix = solver.inertia, shared(solver.inertia.matrix)
    assert inertia.compiled is not None
    assert matrix is not None
    for point in points:
        solver.system.set_phase(point.x)
        inertia.compiled.assemble(point.x)
        ours, border = matrix.values.copy(), inertia.compiled.border.copy()
        inertia._assemble_by_petsc(solver.system.at(point.x))
        np.testing.assert_array_equal(ours, matrix.values)
        np.testing.assert_array_equal(border, inertia.border.array_r)


@pytest.mark.parametrize("formulation", ["reduced", "pointwise"])
def test_conditions_of_a_state_met_again_are_its_own(formulation: str) -> None:
    """In whatever order rows are asked for, the phase conditions are those that are found anew."""
    solver, points = rows("hemitropic", formulation)
    system = solver.system
    some = points[::9]
    for point in [*some, *some[:3], some[1], some[0], *some[::-1]]:
        system.set_phase(point.x)
        anew = phase_at(system, point.x, set())
        assert list(system.phase.rows) == list(anew.rows)
        for i, row in anew.rows.items():
            np.testing.assert_array_equal(system.phase.rows[i], row)
        np.testing.assert_array_equal(system.phase.offsets, anew.offsets)
        assert system.phase.reference is not None
        assert system.phase.reference.equal(point.x)


@pytest.mark.parametrize(("name", "formulation"), BOTH)
def test_motions_are_those_of_the_elementary_generators(name: str, formulation: str) -> None:
    """One sparse matrix for all of them, projected together, beside one motion after the other by its own formula."""
    solver, points = rows(name, formulation)
    system, metric = solver.system, solver.inertia.metric
    names = MotionNames(system)
    for point in points[::11]:
        state = system.at(point.x)
        ours = list(names.generators(point.x, state).values())
        theirs = []
        for motion in names.motions.values():
            g = system.vector(motion.change(state), np.zeros(len(system.drifts)))
            before = g.dot(metric * g)
            for s in symmetry_modes(system, point.x).values():
                g.axpy(-s.dot(metric * g) / s.dot(metric * s), s)
            after = g.dot(metric * g)
            if after > DEPENDENT * max(before, DEPENDENT):
                theirs.append(g.array_r[: len(state.generators.T)] / np.sqrt(after))
        assert len(ours) == len(theirs)
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-8 * abs(np.array(theirs)).max())


def test_convexity_by_factors_is_that_by_eigenvalues() -> None:
    solver, points = rows("ruler", "reduced")
    assert solver.convexity is not None
    for point in points[::5]:
        assert solver.convexity.holds(point.x)
        assert solver.convexity.lowest(point.x) > 0
