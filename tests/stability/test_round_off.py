"""Round-off of a quadratic form against its definition, entry by entry of a dense matrix."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp
from mpi4py import MPI

from rodfem.linalg.matrices import petsc_matrix
from rodfem.stability.round_off import quotient_error, rounding

pytestmark = pytest.mark.alone

EPS = np.finfo(float).eps


def test_rounding_of_a_product() -> None:
    """``eps (sum_ij (v_i S_ij x_j)^2)^(1/2)``, blocks and vectors of all ranks together."""
    comm = MPI.COMM_WORLD
    own = sp.random(9, 9, density=0.4, random_state=comm.rank, format="csr")
    matrix = petsc_matrix(comm, own)
    v, x = matrix.createVecRight(), matrix.createVecRight()
    v.array[:], x.array[:] = np.random.default_rng(comm.rank).normal(size=(2, 9))
    parts = (v.array_r[:, None] * own.toarray() * x.array_r) ** 2
    assert rounding(matrix, v, x) == pytest.approx(EPS * np.sqrt(comm.allreduce(parts.sum())), rel=1e-12)
    parts = (v.array_r[:, None] * own.toarray() * v.array_r) ** 2
    assert quotient_error(matrix, v) == pytest.approx(10 * EPS * np.sqrt(comm.allreduce(parts.sum())), rel=1e-12)
