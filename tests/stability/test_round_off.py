"""Round-off of eigenvalues: of a quadratic form entry by entry, in wide bands, at states far from the rod's."""

from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
import ufl
from classics import column
from mpi4py import MPI
from petsc4py import PETSc

from rodfem import Attachment, ConvergenceError, Discretization, Scene, Solver, clamped, free
from rodfem.continuation.first_equilibrium import examined, first_equilibrium
from rodfem.fem.newton import NewtonResult
from rodfem.stability.inertia import Factored, Index
from rodfem.stability.near_zero import decide, resolve

EPS = np.finfo(float).eps


def petsc_matrix(comm: MPI.Comm, own: sp.csr_matrix) -> PETSc.Mat:
    """Block diagonal matrix, one block a rank, all equally large."""
    n = own.shape[0]
    csr = (own.indptr.astype(PETSc.IntType), (own.indices + comm.rank * n).astype(PETSc.IntType), own.data)
    return PETSc.Mat().createAIJ(((n, PETSc.DETERMINE),) * 2, csr=csr, comm=comm)


def test_zeros_of_symmetries_stay_zeros() -> None:
    """Of three eigenvalues in the band one is a symmetry's; the quotients of the others are 1e-3 and -2e-3."""
    matrix = petsc_matrix(MPI.COMM_SELF, sp.diags([1e-3, -2e-3, 5.0, 7.0]).tocsr())
    vectors = []
    for i in range(4):
        vectors.append(matrix.createVecRight())
        vectors[-1].setValue(i, 1.0)
        vectors[-1].assemble()
    inertia = SimpleNamespace(tolerance=0.01, resolution=0.01, scale=1.0)
    theta = np.array([1e-3, -2e-3, 5.0, 7.0])
    found: Any = SimpleNamespace(
        count=lambda: Index(2, 3), drifts=1, inertia=inertia, shift=0.0, matrix=matrix,
        nearest=lambda number, accuracy: (theta, vectors),
    )  # fmt: skip
    found.quotients, found.inside_band = (partial(f, found) for f in (Factored.quotients, Factored.inside_band))
    index = decide(found).index
    assert (index.negative, index.zero) == (3, 1)


@pytest.mark.few(1)
@pytest.mark.parametrize("place", [1e-6, 3e-6])
def test_a_band_wider_than_the_lowest_eigenvalue(place: float) -> None:
    """A short element leaves the signs of eigenvalues up to 8 to round-off; Euler's loads are 2.467, 4.935.

    Factors at the edge of such a band lead to other eigenvalues than those next to zero: the index was 0.
    """

    def push(c: Any) -> tuple[Any, ...]:
        return (0.0, 0.0, -c.P)

    rod = column("rod", (clamped(), free(push)), (0.0, 8.0), constants={"B2": 2.0},
                 attachments=(Attachment(place, force=push),))  # fmt: skip
    solver = Solver(rod).equilibria
    for load, index in ((1.0, 0), (3.0, 1), (6.0, 2)):
        found = solver.inertia.at(first_equilibrium(solver, load)[0])
        assert (decide(found).index.negative, *resolve(found)) == (index, index, index)


def stiffening(load: float) -> Scene:
    """A cantilever that stiffens as ``cosh``, with a force at its tip."""
    return column(
        "stiffening", (clamped(), free(lambda c: (c.P, 0.0, 0.0))), (0.0, load),
        energy=lambda v, k, c: sum(ufl.cosh(x) - 1 for x in k),
    )  # fmt: skip


@pytest.mark.long
def test_the_band_of_a_far_state_is_not_kept() -> None:
    """At curvatures of 100 the stiffness is 1e43, and all eigenvalues of such a state are round-off of one another."""
    solver = Solver(stiffening(1.0), Discretization(elements=4, degree=4)).equilibria
    system, x = solver.system, solver.start(0.5)
    far = x.copy()
    far.array[:] += 30 * np.sin(np.arange(len(far.array)))
    system.set_load(far, 0.5)
    with pytest.raises(ConvergenceError, match="out of all proportion"):
        decide(solver.inertia.at(far))
    outcome = NewtonResult(True, 1, 0.0, 0.0)
    assert examined(solver, far, outcome) == (NewtonResult(False, 1, 0.0, 0.0), False)
    assert examined(solver, x, outcome) == (outcome, True)
    assert decide(solver.inertia.at(x)).band < 1e-3
