"""Two-sided eigenproblem of a rod under loads without a potential: biorthonormal right and left eigenvectors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rodfem.errors import ConvergenceError
from rodfem.linalg.matrices import local_rows, rounding_of
from rodfem.stability import motion_names
from rodfem.stability.cluster import DRAWN
from rodfem.stability.frequencies import Frequencies
from rodfem.stability.inertia import NOISE
from rodfem.stability.nonsymmetric import NonsymmetricPencil

SAME = 1e-6
"""Relative difference below which a left and a right eigenvalue are paired."""


@dataclass(frozen=True)
class TwoSided:
    """Eigenvalues ``values`` (k,) nearest zero of non-negative imaginary part, backward ``errors``, motions ``kinds``.

    ``right`` X and ``left`` Z (n, k) on this rank's n unknowns: ``X^* M X = 1`` for each, ``X^t M X`` real and
    positive, ``Z^t M X`` the unit matrix.  ``weighed`` is ``M Z``.  The ``noise`` (k,) of the eigenvalues is what
    round-off of the matrix may make of them, to first order, and what the eigensolver left: near a double one, where
    left and right vectors are nearly orthogonal, it is as much more as they are.
    """

    values: np.ndarray
    errors: np.ndarray
    kinds: tuple[str, ...]
    right: np.ndarray
    left: np.ndarray
    weighed: np.ndarray
    noise: np.ndarray


def two_sided(pencil: NonsymmetricPencil, number: int) -> TwoSided:
    """Compute ``number`` biorthonormal left/right eigenpairs nearest zero, those of rigid motions left out.

    These have a zero eigenvalue, and under a thrust that follows the rod no vectors of their own: turning it
    accelerates it.

    Raises :class:`ConvergenceError` if a right eigenvalue has no left partner, or the mesh has fewer of them.
    """
    right, left = (pencil.near_zero(2 * number, left=left) for left in (False, True))
    chosen = sorted(moving(right, number), key=lambda i: right.values[i].real)
    partners: list[int] = []
    for value in right.values[chosen]:
        distance = abs(left.values - value)
        distance[partners] = np.inf
        partners.append(int(np.argmin(distance)))
        if distance[partners[-1]] > SAME * abs(value):
            raise ConvergenceError(
                f"The left mode of the eigenvalue {value:.6g} was not found: ask for fewer modes, or change the load."
            )
    comm = pencil.system.comm
    X, Z = alone(pencil, right.vectors[:, chosen]), left.vectors[:, partners]
    Z = Z @ np.linalg.inv(comm.allreduce(Z.T @ pencil.weighed(X)).T)
    values = right.values[chosen]
    quotients = comm.allreduce(np.sum(Z * (local_rows(pencil.matrix) @ np.concatenate(comm.allgather(X))), axis=0))
    rounded = np.array([rounding_of(pencil.matrix, z, x) for z, x in zip(Z.T, X.T, strict=True)])
    return TwoSided(
        values,
        right.errors[chosen],
        tuple(right.kinds[i] for i in chosen),
        X,
        Z,
        pencil.weighed(Z),
        NOISE * rounded + DRAWN * abs(quotients - values),
    )


def moving(found: Frequencies, number: int) -> list[int]:
    """Places of the ``number`` eigenvalues ``found`` nearest zero, nearest first: one of each pair, no rigid motion.

    Raises :class:`ConvergenceError` where there are fewer.
    """
    places = [i for i in upper(found.values, len(found.values)) if found.kinds[i] != motion_names.RIGID]
    if len(places) < number:
        raise ConvergenceError(
            f"The mesh has {len(places)} modes, not {number}: ask for fewer, or use a richer discretisation."
        )
    return places[:number]


def upper(values: np.ndarray, number: int) -> list[int]:
    """Places of the ``number`` of ``values`` nearest zero that have no negative imaginary part: one of each pair."""
    return [int(i) for i in np.argsort(abs(values), kind="stable") if values[i].imag >= 0.0][:number]


def alone(pencil: NonsymmetricPencil, vectors: np.ndarray) -> np.ndarray:
    """Columns ``X`` (n, k) of ``vectors`` with ``X^* M X = 1``, and ``X^t M X`` real and positive, for each."""
    comm, X = pencil.system.comm, vectors
    X = X / np.sqrt(comm.allreduce(np.sum(X.conj() * pencil.weighed(X), axis=0)).real)
    return np.asarray(X * np.exp(-0.5j * np.angle(comm.allreduce(np.sum(X * pencil.weighed(X), axis=0)))))
