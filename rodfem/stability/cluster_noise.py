r"""What round-off in the matrix of a rod under loads without a potential may make of eigenvalues that meet.

With bases ``V`` and ``W`` of the right and left invariant subspace of ``k`` eigenvalues, ``W^t M V = I``, and ``B =
W^t S V - c I`` of trace zero, their mean ``c`` and ``D = tr B^2 / k`` change with the matrix ``S`` by

    dc = tr(W^t dS V) / k,                dD = 2 tr(B W^t dS V) / k,

to first order.  Errors of the entries of ``S``, independent and ``eps |S_ij|`` large, add up to

    eps (sum_ij (S_ij Z_ij)^2)^(1/2),     Z = W V^t / k       and       Z = 2 W B^t V^t / k.

Bases of the subspaces may be any: ``Z`` is the same.  A Chebyshev interpolant shows no more of this than scatters from
load to load: rounding of one matrix at neighbouring loads is much the same.

The error of the eigensolver comes to that.  ``W^t S V`` with both bases is in error by the product of theirs, so that
it tells how far off are the eigenvalues by which the cluster was measured (Parlett, Math. Comput. 28 (1974) 679).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rodfem.errors import ConvergenceError
from rodfem.linalg.matrices import local_rows
from rodfem.stability.cluster import Measured, members, real_span
from rodfem.stability.inertia import EPS, NOISE
from rodfem.stability.nonsymmetric import NonsymmetricPencil

DRAWN = 3.0
"""Uncertainty that an eigensolver leaves of a collision, in units of the error that it made at one load."""


class ClusterNoise(NamedTuple):
    """Uncertainty of the ``mean`` and of the ``discriminant`` of a cluster by round-off in the matrix.

    What the eigensolver left open of the two, ``mean_left`` and ``discriminant_left``, is added to it.  The ``square``
    is ``|B|^2 / k``: the magnitude of ``D`` where vectors are orthogonal, much more where they are nearly one.
    ``two_sided`` is ``D`` by both bases, which has less of that error than the eigenvalues have.
    """

    mean: float
    discriminant: float
    mean_left: float
    discriminant_left: float
    square: float
    two_sided: float

    @property
    def of_mean(self) -> float:
        """Uncertainty of the mean by both."""
        return self.mean + DRAWN * self.mean_left

    @property
    def of_discriminant(self) -> float:
        """Uncertainty of the discriminant by both."""
        return self.discriminant + DRAWN * self.discriminant_left


def noise_of(pencil: NonsymmetricPencil, measured: Measured) -> ClusterNoise:
    """Uncertainties of a cluster by round-off, at the state of its pencil.

    Raises :class:`ConvergenceError` where the left vectors of its eigenvalues are not found.
    """
    V, size = measured.cluster.basis, measured.cluster.size
    found, chosen, _ = members(pencil, V, measured.cluster, left=True)
    weighed = pencil.weighed(V)
    W = real_span(pencil, found.vectors[:, chosen])
    product = pencil.product(W, weighed)
    if np.linalg.matrix_rank(product) < size:
        raise ConvergenceError(f"the left vectors of {size} eigenvalues near {measured.cluster.mean:.6g} are not found")
    W = W @ np.linalg.inv(product).T
    rows = local_rows(pencil.matrix)
    every = np.concatenate(pencil.system.comm.allgather(V))
    B = pencil.product(W, (rows @ every).real) - measured.cluster.mean * np.eye(size)

    def of(left: np.ndarray) -> float:
        squares = abs(rows.data * np.einsum("ij,ij->i", np.repeat(left, np.diff(rows.indptr), 0), every[rows.indices]))
        return float(NOISE * EPS / size * np.sqrt(pencil.system.comm.allreduce(float(squares @ squares))))

    off = float(np.trace(B)) / size
    inside = B - off * np.eye(size)
    discriminant = float(np.trace(inside @ inside)) / size
    left = abs(off), abs(discriminant - measured.discriminant)
    return ClusterNoise(of(W), of(2 * W @ B.T), *left, float((inside**2).sum()) / size, discriminant)
