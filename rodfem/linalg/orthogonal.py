"""Orthogonal vectors in a metric, by Gram-Schmidt."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from petsc4py import PETSc

from rodfem.tolerances import TINY


def generic(numbers: np.ndarray, which: int = 0) -> np.ndarray:
    """Entries of a vector with these ``numbers``: it has a part along every mode; others for another ``which``."""
    return np.asarray(np.sin((1.0 + which) * (1.0 + 0.731 * numbers)) + 0.3)


def project_out(vector: PETSc.Vec, basis: Sequence[PETSc.Vec], metric: PETSc.Mat, times: int = 1) -> None:
    """Make ``vector`` orthogonal to orthonormal ones, in place; done ``times`` two also where little of it is left.

    The ``basis`` is orthonormal in the ``metric`` (n, n), as is the result.
    """
    for _ in range(times):
        for other in basis:
            vector.axpy(-(metric * other).dot(vector), other)


def normalize(vector: PETSc.Vec, metric: PETSc.Mat) -> None:
    """Give a vector unit length in a metric, in place."""
    vector.scale(1.0 / max(np.sqrt(max(vector.dot(metric * vector), 0.0)), TINY))


def orthonormalize(vectors: list[PETSc.Vec], metric: PETSc.Mat) -> None:
    """Make vectors orthonormal in a metric, in place, by Gram-Schmidt twice."""
    for _ in range(2):
        for i, v in enumerate(vectors):
            normalize(v, metric)
            project_out(v, vectors[:i], metric)
            normalize(v, metric)


def combine(vectors: list[PETSc.Vec], weights: np.ndarray) -> PETSc.Vec:
    """Linear combination of vectors."""
    out = vectors[0].duplicate()
    out.set(0.0)
    out.maxpy(list(weights), vectors)
    return out
