"""Gram-Schmidt in a metric, against dense linear algebra, for vectors that are nearly dependent."""

import numpy as np
from petsc4py import PETSc

from rodfem.linalg.orthogonal import orthonormalize, project_out

SIZE = 12


def test_orthonormal_vectors_of_a_metric() -> None:
    rng = np.random.default_rng(1)
    root = rng.normal(size=(SIZE, SIZE))
    dense = root @ root.T + np.eye(SIZE)
    metric = PETSc.Mat().createDense((SIZE, SIZE), array=dense, comm=PETSc.COMM_SELF)
    metric.assemble()
    table = rng.normal(size=(4, SIZE))
    table[3] = table[0] + 1e-9 * table[3]
    vectors = [PETSc.Vec().createWithArray(row.copy(), comm=PETSc.COMM_SELF) for row in table]
    orthonormalize(vectors, metric)
    found = np.array([v.array_r for v in vectors])
    np.testing.assert_allclose(found @ dense @ found.T, np.eye(4), atol=1e-13)
    assert np.linalg.matrix_rank(np.vstack([found[:3], table[:3]]), tol=1e-10) == 3  # they span the same
    other = PETSc.Vec().createWithArray(rng.normal(size=SIZE), comm=PETSc.COMM_SELF)
    expected = other.array_r - found.T @ (found @ dense @ other.array_r)
    project_out(other, vectors, metric, times=2)
    np.testing.assert_allclose(other.array_r, expected, atol=1e-12)
