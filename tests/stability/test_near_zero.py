"""Eigenvalues nearest zero on a coarse mesh of linear elements, beside dense linear algebra of numpy and scipy."""

from __future__ import annotations

import classics
import numpy as np
import pytest
import scipy.linalg
from demo_cases import scene

from rodfem import Diagram, Discretization, Plan, trace
from rodfem.continuation.branch import Point
from rodfem.linalg.matrices import local_rows
from rodfem.stability.inertia import Inertia
from rodfem.stability.near_zero import near_zero

pytestmark = pytest.mark.alone


@pytest.fixture(scope="module")
def ruler() -> Diagram:
    return trace(scene("ruler"), Discretization("reduced", 40, 1), Plan(depth=1, error_bars=False))


def dense(inertia: Inertia, x: Point) -> np.ndarray:
    """All eigenvalues of K on the null space of the constraints, relative to the metric."""
    inertia.at(x.x)
    S, M = (local_rows(a).toarray() for a in (inertia.matrix, inertia.metric))
    weighted = np.flatnonzero(abs(M).sum(axis=1) > 0)
    others = np.setdiff1d(np.arange(len(S)), weighted)
    others = others[abs(S[np.ix_(others, weighted)]).sum(axis=1) > 0]  # multipliers; the load has a row of its own
    null = scipy.linalg.null_space(S[np.ix_(others, weighted)])
    K, M = (null.T @ a[np.ix_(weighted, weighted)] @ null for a in (S, M))
    return np.asarray(scipy.linalg.eigh(K, M, eigvals_only=True))


@pytest.mark.long
def test_values_and_what_they_cost(ruler: Diagram, monkeypatch: pytest.MonkeyPatch) -> None:
    """Three are asked for, whose neighbours lie dense: a soft one is sharp, the others tell their signs."""
    solver, solves = ruler.solvers[0], [0]
    solve_all = solver.inertia.factors.solve_all

    def counted(right: np.ndarray) -> np.ndarray:
        solves[0] += 1
        return solve_all(right)

    monkeypatch.setattr(solver.inertia.factors, "solve_all", counted)
    for point in ruler[1].points[1::8]:
        exact = dense(solver.inertia, point)
        exact = exact[np.argsort(abs(exact))][:3]
        solves[0] = 0
        found = near_zero(solver.inertia.at(point.x), least=3)
        assert solves[0] < 60
        np.testing.assert_allclose(found.values, np.sort(exact), rtol=1e-2)
        nearest = found.values[np.argmin(abs(found.values))]
        assert abs(nearest - exact[0]) < 1e-6 * abs(exact[0])
        assert found.firm + int((found.values < 0).sum()) == point.negative


@pytest.mark.long
@pytest.mark.parametrize("apart", [1e-6, 1e-7])
def test_signs_in_a_band_as_wide_as_the_lowest_eigenvalue(apart: float) -> None:
    """One element of 1e-6 makes the round-off of a count as large as bending: quotients tell all signs.

    The clamped column buckles at 4 pi^2; beside that load on either side no sign is undecided.
    """
    beside = {39.475: 0, 39.4784: 0, 39.482: 1}
    column = classics.column("graded", classics.SUPPORTS["clamped-clamped"], (39.0, 39.6))
    mesh = Discretization("pointwise", 5, 6, vertices=(0.0, 0.2, 0.4, 0.4 + apart, 0.7, 1.0))
    diagram = trace(column, mesh, Plan(depth=0, at=tuple(beside)))
    inertia = diagram.solvers[0].inertia
    assert inertia.resolution > 0.1 * inertia.scale
    for point in diagram[0].points:
        critical = 4 * np.pi**2
        assert (point.negative, point.undecided) == (int(point.load > critical), 0) or abs(point.load - critical) < 1e-5
    assert {p.load: p.negative for p in diagram[0].points if p.load in beside} == beside
    (branch,) = diagram.special("branch point")
    assert abs(branch.point.load - 4 * np.pi**2) < branch.error_estimate < 1e-5
