"""MUMPS's factors on one rank and on several, against dense linear algebra on the same matrices."""

import numpy as np
import pytest
import small_states
from mpi4py import MPI
from petsc4py import PETSc

from rodfem import Discretization, Solver
from rodfem.fem.system import System
from rodfem.linalg.chain import Chain
from rodfem.linalg.factorization import Mumps
from rodfem.linalg.matrices import gathered
from rodfem.stability.assessment import Assessor
from rodfem.stability.inertia import Inertia

pytestmark = pytest.mark.short

FORMULATIONS = pytest.mark.parametrize("formulation", ["reduced", "pointwise"])
STATES = pytest.mark.parametrize(
    ("name", "state", "load"),
    [("cord", "plain", 30.0), ("cord", "buckled", 40.0), ("hemitropic", "plain", 0.25), ("hemitropic", "buckled", 0.2)],
)
SIGMAS = (-30.0, -3.0, -0.1, 0.0, 0.1, 2.0, 40.0)


def at(name: str, state: str, formulation: str, load: float) -> tuple[System, PETSc.Vec]:
    """System and state, its phase conditions set."""
    system, x = getattr(small_states, state)(name, formulation, 7, 3, load)
    system.set_phase(x)
    return system, x


def whole(vector: PETSc.Vec) -> np.ndarray:
    """All of a vector on every rank."""
    return np.concatenate(vector.comm.tompi4py().allgather(vector.array_r))


def check(factors: Mumps, matrix: PETSc.Mat, right: PETSc.Vec) -> None:
    """Compare inertia and a solution with dense linear algebra."""
    dense, out = gathered(matrix).toarray(), right.duplicate()
    factors(matrix)
    assert factors.inertia() == ((np.linalg.eigvalsh(dense) < 0).sum(), 0)
    factors.solve(right, out)
    expected = np.linalg.solve(dense, whole(right))
    np.testing.assert_allclose(whole(out), expected, rtol=0, atol=1e-8 * abs(expected).max())


@pytest.mark.few(2)
@pytest.mark.versions
@FORMULATIONS
@STATES
def test_inertia_and_solutions(name: str, state: str, formulation: str, load: float) -> None:
    system, x = at(name, state, formulation, load)
    inertia, factors = Inertia(system), Mumps("cholesky")
    right = inertia.seed(1)
    for sigma in SIGMAS:
        matrix = inertia.at(x).matrix
        matrix.axpy(-sigma, inertia.metric, PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN)
        check(factors, matrix, right)


@pytest.mark.skipif(MPI.COMM_WORLD.size == 1, reason="compares several ranks with one")
@pytest.mark.parametrize(("formulation", "elements"), [("reduced", 5000), ("pointwise", 2000)])
def test_long_rods(formulation: str, elements: int) -> None:
    """Their index, their eigenvalue nearest zero, and the left-most ones are those of the elimination on one rank."""
    found = []
    for comm in (MPI.COMM_SELF, MPI.COMM_WORLD):
        solver = Solver(small_states.scene("cord"), Discretization(formulation, elements, 1), comm).equilibria
        system = solver.system
        for factors in (solver.inertia.factors, system.lu):
            assert isinstance(factors, Mumps if comm.size > 1 else Chain)
        system.set_phase(None)
        x, outcome = solver.at_load(solver.start(20.0), 20.0)
        assert outcome.converged
        verdict = Assessor(solver)(x, number=3)
        assert verdict.certified
        factored = solver.inertia.at(x)
        factored.count()
        nearest, _ = factored.nearest(1, accuracy=1e-9)
        found.append([verdict.negative, verdict.zero, *nearest, *verdict.values])
    np.testing.assert_allclose(*found, rtol=1e-7)
