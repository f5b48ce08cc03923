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
    """Make ``vector`` orthogonal to an orthonormal ``basis`` in a metric, in place; twice where little may be left."""
    for _ in range(times):
        for other in basis:
            vector.axpy(-(metric * other).dot(vector), other)


def orthonormalize(vectors: list[PETSc.Vec], metric: PETSc.Mat) -> None:
    """Make vectors orthonormal in a metric, in place, by Gram-Schmidt twice."""
    duals: list[PETSc.Vec] = []
    for number, vector in enumerate(vectors):
        for _ in range(2 if number else 0):
            vector.maxpy([-dual.dot(vector) for dual in duals], vectors[:number])
        dual = metric * vector
        left = max(np.sqrt(max(vector.dot(dual).real, 0.0)), TINY)
        vector.scale(1.0 / left)
        dual.scale(1.0 / left)
        duals.append(dual)


def combine(vectors: list[PETSc.Vec], weights: np.ndarray) -> PETSc.Vec:
    """Linear combination of vectors."""
    out = vectors[0].duplicate()
    out.set(0.0)
    out.maxpy(list(weights), vectors)
    return out


def complement(metric: PETSc.Mat, vectors: Sequence[PETSc.Vec], known: Sequence[PETSc.Vec]) -> list[PETSc.Vec]:
    """Orthonormal basis in a metric of what ``vectors`` span other than the ``known`` ones, which are orthonormal.

    What is less than half of a vector is round-off, or the error of the vectors: it spans nothing new.
    """
    basis, out = list(known), []
    for vector in vectors:
        rest = vector.copy()
        project_out(rest, basis, metric, times=2)
        size, whole = (float(np.sqrt(max(v.dot(metric * v).real, 0.0))) for v in (rest, vector))
        if size > 0.5 * whole or not known:
            rest.scale(1.0 / size)
            out.append(rest)
            basis.append(rest)
    return out
