"""Two-sided eigenproblem of a rod under loads without a potential: biorthonormal right and left eigenvectors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rodfem.errors import ConvergenceError
from rodfem.stability.nonsymmetric import NonsymmetricPencil

SAME = 1e-6
"""Relative difference below which a left and a right eigenvalue are paired."""

REAL = 1e-10
"""Relative imaginary part below which an eigenvalue counts as real."""


@dataclass(frozen=True)
class TwoSided:
    """Eigenvalues ``values`` (k,) nearest zero of non-negative imaginary part, backward ``errors``, motions ``kinds``.

    ``right`` X and ``left`` Z (n, k) on this rank's n unknowns: ``X^* M X = 1`` for each, ``X^t M X`` real and
    positive, ``Z^t M X`` the unit matrix.  ``weighed`` is ``M Z``.
    """

    values: np.ndarray
    errors: np.ndarray
    kinds: tuple[str, ...]
    right: np.ndarray
    left: np.ndarray
    weighed: np.ndarray


def two_sided(pencil: NonsymmetricPencil, number: int) -> TwoSided:
    """Compute ``number`` biorthonormal left/right eigenpairs nearest zero.

    Raises :class:`ConvergenceError` if a right eigenvalue has no left partner.
    """
    right, left = (find(2 * number + 2, 0.0) for find in (pencil.near, pencil.left))
    upper = right.values.imag > -SAME * abs(right.values)  # one of each pair
    nearest = [i for i in np.argsort(abs(right.values), kind="stable") if upper[i]][:number]
    chosen = sorted(nearest, key=lambda i: right.values[i].real)
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
    X, Z = right.vectors[:, chosen], left.vectors[:, partners]
    X = X / np.sqrt(comm.allreduce(np.sum(X.conj() * pencil.weighed(X), axis=0)).real)
    X = X * np.exp(-0.5j * np.angle(comm.allreduce(np.sum(X * pencil.weighed(X), axis=0))))
    Z = Z @ np.linalg.inv(comm.allreduce(Z.T @ pencil.weighed(X)).T)
    values = right.values[chosen]
    return TwoSided(
        np.where(abs(values.imag) < REAL * abs(values), values.real, values),
        right.errors[chosen],
        tuple(right.kinds[i] for i in chosen),
        X,
        Z,
        pencil.weighed(Z),
    )
