"""One symmetric factorisation a point against two shifts, LU factors, and what the theory says."""

import demo_cases
import hemitropic_cases
import numpy as np
import pytest

from rodfem.continuation.branch import Branch
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.kinds import BRANCH_POINT, FOLD
from rodfem.fem.symmetries import phase_at

BENT = {"hemitropic": ("branch 1", 0.5), "cord": ("branch 2", 30.0), "ruler": ("branch 1", 8.0)}


def demo(name: str, formulation: str) -> tuple[BranchSolver, list[Branch]]:
    """Solver and branches of a demo."""
    if name == "hemitropic":
        return hemitropic_cases.follower(formulation, 8, 6), hemitropic_cases.explored(formulation, 8, 6)
    found = demo_cases.explored(name, formulation)
    return found.solvers[0], found.branches


@pytest.mark.ranks
@pytest.mark.few(3)
@pytest.mark.parametrize("formulation", ["reduced", pytest.param("pointwise", marks=pytest.mark.alone)])
@pytest.mark.parametrize("name", ["hemitropic", *(pytest.param(x, marks=pytest.mark.alone) for x in ("cord", "ruler"))])
def test_index_is_that_of_two_shifts_at_every_point(name: str, formulation: str) -> None:
    follower, branches = demo(name, formulation)
    for branch in branches:
        for point in branch.points:
            follower.system.set_phase(point.x)
            index = follower.inertia.at(point.x).count()
            if point is not branch.points[0] and not any(s.point is point for s in branch.special):
                assert (index.negative, index.zero) == (point.negative, point.zero), (branch.name, point.load)


@pytest.mark.parametrize("name", BENT)
def test_tangent_is_that_of_lu_factors(name: str) -> None:
    follower, branches = demo(name, "reduced")
    system, wanted = follower.system, BENT[name]
    branch = next(b for b in branches if b.name == wanted[0])
    point = min(branch.points[2:-2], key=lambda p: abs(p.load - wanted[1]))
    row = follower.row(point.tangent)
    tangent, regular = follower._tangent(row, point.x), follower.regular.at(point.x)
    assert regular is not None and system.norm(regular.unit_tangent(row) - tangent) < 1e-12
    image = system.at(point.x).jacobian(row) * tangent  # J t = (0, row . t)
    system.set_load(image, 0.0)
    assert image.norm() < 1e-9 * system.matrix.norm()


@pytest.mark.parametrize("name", ["hemitropic", "cord"])
def test_near_singular_states_are_left_to_others(name: str) -> None:
    follower, branches = demo(name, "reduced")
    special = [s for b in branches for s in b.special if s.kind in (FOLD, BRANCH_POINT)]
    assert len(special) > 2
    for s in special:
        follower.system.set_phase(s.point.x)
        assert follower.regular.at(s.point.x) is None
        found = follower.inertia.at(s.point.x)
        found.count()
        assert abs(found.nearest(1)[0][0]) < follower.inertia.regular


@pytest.mark.ranks
@pytest.mark.parametrize("formulation", ["reduced", "pointwise"])
def test_conditions_of_a_state_met_again_are_its_own(formulation: str) -> None:
    """In whatever order rows are asked for, the phase conditions are those that are found anew."""
    solver, branches = demo("hemitropic", formulation)
    system, points = solver.system, [point for branch in branches for point in branch.points]
    some = points[::9]
    for point in [*some, *some[:3], some[1], some[0], *some[::-1]]:
        system.set_phase(point.x)
        anew = phase_at(system, point.x)
        assert list(system.phase.rows) == list(anew.rows)
        for i, row in anew.rows.items():
            np.testing.assert_array_equal(system.phase.rows[i], row)
        np.testing.assert_array_equal(system.phase.offsets, anew.offsets)
        assert system.phase.reference is not None
        assert system.phase.reference.equal(point.x)
