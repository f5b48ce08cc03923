"""Index and eigenvalues from factorisations, against dense linear algebra on the same matrices and closed forms."""

from functools import cache

import closed_form_hemitropic
import numpy as np
import pytest
import scipy.linalg
import scipy.sparse as sp
from hemitropic_cases import DEFAULT, explored, follower, user_points
from petsc4py import PETSc
from work import compiled

from rodfem.continuation.branch import Point
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.stability.symmetric import SymmetricSolver

SMALL = (6, 3)
FORMULATIONS = pytest.mark.parametrize("formulation", ["reduced", "pointwise"])
STATES = pytest.mark.parametrize(("branch", "load"), [(0, 0.05), (0, 0.25), (0, 0.5), (1, 0.25), (1, 0.5), (2, 0.5)])


@cache
def state(formulation: str, branch: int, load: float) -> Point:
    """State on the straight rod (0), the first (1) or the second (2) branch, on the small discretisation."""
    branches = explored(formulation, *SMALL, span=(0.0, 0.55), at=(0.05, 0.25, 0.5))
    return user_points(branches[branch], load)[-1]


def dense(matrix: PETSc.Mat) -> np.ndarray:
    """All of a matrix on every rank."""
    rows = matrix.comm.tompi4py().allgather(matrix.getValuesCSR())
    blocks = [
        sp.csr_matrix((values, columns, starts), shape=(len(starts) - 1, matrix.size[1]))
        for starts, columns, values in rows
    ]
    return sp.vstack(blocks).toarray()


def unknowns(f: BranchSolver) -> tuple[np.ndarray, np.ndarray]:
    """Global numbers of the state's unknowns and of the constraints' multipliers."""
    fields = f.system.fields
    mine = [fields.number[fields.dofs[b.name]].ravel() for b in fields.blocks if b.multiplier]
    everywhere = f.system.comm.allgather(np.concatenate(mine))
    scalar = [fields.scalars[f"n{i + 1}"] for i in fields.forces]
    constraints = np.unique(np.concatenate([*everywhere, scalar]).astype(int))
    constraints = constraints[constraints >= 0]
    return np.setdiff1d(np.arange(fields.field_unknowns), constraints), constraints


def eigenvalues(S: np.ndarray, M: np.ndarray, f: BranchSolver) -> np.ndarray:
    """Finite eigenvalues of K relative to M on the kernel of C, where S = (K C; C^t 0), by dense linear algebra."""
    state, constraints = unknowns(f)
    Z = scipy.linalg.null_space(S[np.ix_(constraints, state)])
    K, M = Z.T @ S[np.ix_(state, state)] @ Z, Z.T @ M[np.ix_(state, state)] @ Z
    size, basis = np.linalg.eigh(M)
    massless = size < 1e-12 * size.max()
    a, b = basis[:, ~massless], basis[:, massless]  # strains, which have no mass, follow the motion
    assert np.all(np.linalg.eigvalsh(b.T @ K @ b) > 0)
    condensed = a.T @ K @ a - a.T @ K @ b @ np.linalg.solve(b.T @ K @ b, b.T @ K @ a)
    return scipy.linalg.eigh(condensed, np.diag(size[~massless]), eigvals_only=True)


@pytest.mark.ranks
@pytest.mark.few(1)
@pytest.mark.versions
@pytest.mark.short
@FORMULATIONS
@STATES
def test_index_is_that_of_dense_matrices(formulation: str, branch: int, load: float) -> None:
    f, p = follower(formulation, *SMALL), state(formulation, branch, load)
    f.system.set_phase(p.x)
    found = f.inertia.at(p.x).count()
    mu = eigenvalues(dense(f.inertia.at(p.x).matrix), dense(f.system.metric), f)
    assert found.negative == p.negative == (mu < -f.inertia.tolerance).sum()
    assert found.zero == p.zero == (abs(mu) < f.inertia.tolerance).sum() == (0 if branch == 0 else 1)
    others = mu[abs(mu) > f.inertia.tolerance]
    for sigma in (-3.0, -0.3, -0.03, 0.03, 0.3, 3.0):
        assert f.inertia.at(p.x).eigenvalue_count(sigma) == (others < sigma).sum()


@FORMULATIONS
@STATES
def test_eigenvalues_nearest_zero(formulation: str, branch: int, load: float) -> None:
    f, p = follower(formulation, *SMALL), state(formulation, branch, load)
    f.system.set_phase(p.x)
    factored = f.inertia.at(p.x)
    factored.count()
    values, vectors = factored.nearest(3, accuracy=1e-9)
    mu = eigenvalues(dense(f.inertia.at(p.x).matrix), dense(f.system.metric), f)
    mu = mu[abs(mu) > f.inertia.tolerance]
    expected = mu[np.argsort(abs(mu))[:3]]
    np.testing.assert_allclose(sorted(values), sorted(expected), rtol=1e-6)
    assert [f.system.norm(v) for v in vectors] == pytest.approx([1, 1, 1], abs=1e-10)


@pytest.mark.few(1)
def test_the_matrix_is_kept_for_the_state_that_it_holds() -> None:
    """Asked for the same state again it is not assembled or factored; it is after a shift, and for another state."""
    f, p, q = follower("reduced", *SMALL), state("reduced", 1, 0.25), state("reduced", 2, 0.5)
    anew = [dense(f.inertia.at(point.x).matrix) for point in (q, p)][-1]
    index = f.inertia.at(p.x).eigenvalue_count(0.0)
    before = compiled()
    assert f.inertia.at(p.x).eigenvalue_count(0.0) == index
    assert compiled() == before
    for disturb in (lambda: f.inertia.at(p.x).count(), lambda: f.inertia.at(q.x), f.inertia.forget_band):
        disturb()
        assert dense(f.inertia.at(p.x).matrix) == pytest.approx(anew, abs=1e-13 * abs(anew).max())
        assert f.inertia.at(p.x).eigenvalue_count(0.0) == index
    assert compiled()["factorisations"] == before["factorisations"] + 5


@pytest.mark.parametrize("load", [0.05, 0.25, 0.7])
def test_spectrum_of_the_straight_rod(load: float) -> None:
    f = follower("reduced", 12, 6)
    f.system.set_phase(None)
    x, outcome = f.at_load(f.start(load), load)
    assert outcome.converged
    modes = SymmetricSolver(f.inertia).at(x).leftmost(8)
    np.testing.assert_allclose(modes.values, closed_form_hemitropic.spectrum(load, *DEFAULT)[:8], rtol=1e-7, atol=1e-9)
    assert modes.errors.max() < 1e-8
