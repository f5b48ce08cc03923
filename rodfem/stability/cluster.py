r"""Eigenvalues of a rod under loads without a potential that meet, followed by their invariant subspace.

Two eigenvalues are not smooth where they meet, and their vectors become one; what belongs to both is smooth in every
parameter as long as no other eigenvalue joins them: their invariant subspace, their mean ``c``, and the mean square of
their distances from it, ``D = ((mu1 - mu2)/2)^2``, positive before and negative after the collision.

A rod that bends alike in all planes has all eigenvalues twice, and two pairs meet at once.  They are one cluster of
four, with ``c`` the mean of all and ``D`` the mean of ``(mu - c)^2``: the same numbers, and as smooth.  Which
eigenvalues are the cluster's is decided by the share of their vectors in the invariant subspace of a state nearby, not
by their values or by the names of their motions: the vectors of a double eigenvalue are any in a plane.

With bases ``V`` and ``W`` of the right and left invariant subspace of ``k`` eigenvalues, ``W^t M V = I``, and ``B =
W^t S V - c I`` of trace zero, their mean ``c`` and ``D = tr B^2 / k`` change with the matrix ``S`` by

    dc = tr(W^t dS V) / k,                dD = 2 tr(B W^t dS V) / k,

to first order.  Errors of the entries of ``S``, independent and ``eps |S_ij|`` large, add up to

    eps (sum_ij (S_ij Z_ij)^2)^(1/2),     Z = W V^t / k       and       Z = 2 W B^t V^t / k.

Bases of the subspaces may be any: ``Z`` is the same.  A Chebyshev interpolant shows no more of this than scatters from
load to load: rounding of one matrix at neighbouring loads is much the same.

The error of the eigensolver comes to that.  ``W^t S V`` with both bases is in error by the product of theirs, so that
it shows how far off are the eigenvalues by which the cluster was measured (Parlett, Math. Comput. 28 (1974) 679).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rodfem.errors import ConvergenceError
from rodfem.linalg.matrices import EPS, local_rows
from rodfem.stability.inertia import NOISE
from rodfem.stability.nonsymmetric import REAL, STILL, Frequencies, NonsymmetricPencil, squares
from rodfem.tolerances import TINY

FARTHER = 3.0
"""Times the first distance of the shift from the mean, eigenvalues are sought that were not found at first."""
DRAWN = 3.0
"""Uncertainty that an eigensolver leaves of a collision, in units of the error that it made at one load."""


@dataclass(frozen=True)
class Cluster:
    """Real ``basis`` (n, size) of an invariant subspace, this rank's n unknowns, and its eigenvalues' ``mean``."""

    basis: np.ndarray
    mean: float

    @property
    def size(self) -> int:
        """Number of eigenvalues."""
        return int(self.basis.shape[1])


@dataclass(frozen=True)
class Measured:
    """``D``, the eigenvalues and the invariant subspace of a cluster at one state."""

    discriminant: float
    values: np.ndarray
    cluster: Cluster

    @property
    def frequency(self) -> float:
        """Mean of the imaginary parts, of rates of decay the frequency."""
        return float(abs(self.values.imag).mean())

    @property
    def spread(self) -> float:
        """Distance of the eigenvalues from their mean, relative: how distinct they and their vectors are."""
        return float(np.sqrt(abs(self.discriminant)) / max(abs(self.values).max(), TINY))

    @property
    def split(self) -> float:
        """By how much the ``D`` of pairs that are taken for one may differ; round-off where there is one pair."""
        return float(abs((self.values - self.cluster.mean) ** 2 - self.discriminant).max())


def measure(pencil: NonsymmetricPencil, cluster: Cluster) -> Measured:
    """Find at a state a cluster known from a state nearby; raises :class:`ConvergenceError`."""
    found, chosen = members(pencil, real_span(pencil, cluster.basis), cluster)
    values = found.values[chosen]
    here = Cluster(real_span(pencil, found.vectors[:, chosen]), float(values.real.mean()))
    return Measured(float(((values - here.mean) ** 2).mean().real), values, here)


def members(
    pencil: NonsymmetricPencil, basis: np.ndarray, cluster: Cluster, *, left: bool = False
) -> tuple[Frequencies, list[int]]:
    """Eigenvalues of a ``pencil`` near the mean of a ``cluster``, and the places of its own by shares in a ``basis``.

    Vectors are right ones, or ``left`` ones.  Of left vectors, orthogonal to the right ones of all other eigenvalues,
    any share is enough.  Right vectors are not orthogonal: rigid motions of a floating rod may have a greater share
    than its own, and belong to no cluster away from zero.  Raises :class:`ConvergenceError`.
    """
    size, offset = cluster.size, 1e-3 * pencil.system.scene.units.omega2  # at zero the matrix may be singular
    shift = 0.97 * cluster.mean if abs(cluster.mean) > offset else -offset
    for number, times in ((size + 2, 1.0), (3 * size + 10, FARTHER)):  # one next to the shift takes digits from others
        found = pencil.nearest(number, cluster.mean + times * (shift - cluster.mean), left=left)
        energy = squares(pencil.system.comm, found.vectors, found.weighed)
        share = (abs(pencil.product(basis, found.weighed)) ** 2).sum(axis=0) / energy
        if found.floating and abs(cluster.mean) > offset:
            share[abs(found.values) < STILL * found.far] = 0.0
        chosen = closed(found.values, share, size)
        if len(chosen) == size and share[chosen].min() > (REAL if left else 0.25):
            return found, chosen
    raise ConvergenceError(f"The {size} eigenvalues near {cluster.mean:.6g} are not found again: use a smaller range.")


def closed(values: np.ndarray, share: np.ndarray, size: int) -> list[int]:
    """Places of the ``size`` eigenvalues (k,) with the greatest shares (k,), closed under conjugation, or fewer.

    Where a third one comes by it may have a greater share than one of a complex pair.
    """
    order = np.argsort(-share, kind="stable")
    above, real = (order[of[order]] for of in (values.imag > 0, values.imag == 0))
    partner = [int(np.argmin(abs(values - values[i].conj()))) for i in above]
    best: list[int] = []
    for pairs in range(min(len(above), size // 2) + 1):
        chosen = [*above[:pairs].tolist(), *partner[:pairs], *real[: size - 2 * pairs].tolist()]
        if (len(chosen), share[chosen].sum()) > (len(best), share[best].sum()):
            best = chosen
    return sorted(best)


def real_span(pencil: NonsymmetricPencil, vectors: np.ndarray) -> np.ndarray:
    """Real basis (n, k), orthonormal in the mass, of the span of ``vectors`` (n, k), closed under conjugation."""
    parts = np.concatenate([vectors.real, vectors.imag], axis=1) if np.iscomplexobj(vectors) else vectors
    squares, turn = np.linalg.eigh(pencil.product(parts, pencil.weighed(parts)))
    last = slice(len(squares) - vectors.shape[1], None)
    return np.asarray(parts @ (turn[:, last] / np.sqrt(np.maximum(squares[last], TINY))))


class ClusterNoise(NamedTuple):
    """Uncertainty of the ``mean`` and of the ``discriminant`` of a cluster by round-off in the matrix.

    ``mean_left`` and ``discriminant_left`` are what the eigensolver left open.
    """

    mean: float
    discriminant: float
    mean_left: float
    discriminant_left: float

    @property
    def of_mean(self) -> float:
        """Uncertainty of the mean by both."""
        return self.mean + DRAWN * self.mean_left

    @property
    def of_discriminant(self) -> float:
        """Uncertainty of the discriminant by both."""
        return self.discriminant + DRAWN * self.discriminant_left


def both_sides(pencil: NonsymmetricPencil, cluster: Cluster) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """``V``, ``W`` and ``W^t S V`` of a cluster; :class:`ConvergenceError` if its left vectors are not found."""
    V, size = cluster.basis, cluster.size
    found, chosen = members(pencil, V, cluster, left=True)
    W = real_span(pencil, found.vectors[:, chosen])
    product = pencil.product(W, pencil.weighed(V))
    if np.linalg.matrix_rank(product) < size:
        raise ConvergenceError(f"the left vectors of {size} eigenvalues near {cluster.mean:.6g} are not found")
    W = W @ np.linalg.inv(product).T
    return V, W, pencil.product(W, (local_rows(pencil.matrix) @ pencil.system.whole(V)).real)


def sides(pencil: NonsymmetricPencil, cluster: Cluster) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """``V``, ``W`` and ``W^t S V`` of a cluster known from near by; those that collide span them ill at once."""
    if pencil.system.scene.inertia.order == 1:
        return both_sides(pencil, measure(pencil, cluster).cluster)
    target = cluster.mean - 1e-3 * max(abs(cluster.mean), pencil.system.scene.units.omega2)  # next to it
    V, W = (pencil.iterated(cluster.basis, target, left=left) for left in (False, True))
    W = W @ np.linalg.inv(pencil.product(W, pencil.weighed(V))).T
    A = pencil.product(W, (local_rows(pencil.matrix) @ pencil.system.whole(V)).real)
    pencil.complete(V, np.linalg.inv(A))
    return V, W, A


def noise_of(pencil: NonsymmetricPencil, measured: Measured) -> ClusterNoise:
    """Uncertainties of a cluster by round-off; :class:`ConvergenceError` if its left vectors are not found."""
    size, mean = measured.cluster.size, measured.cluster.mean
    V, W, A = both_sides(pencil, measured.cluster)
    rows, every, B = local_rows(pencil.matrix), pencil.system.whole(V), A - mean * np.eye(size)

    def of(left: np.ndarray) -> float:
        squares = abs(rows.data * np.einsum("ij,ij->i", np.repeat(left, np.diff(rows.indptr), 0), every[rows.indices]))
        return float(NOISE * EPS / size * np.sqrt(pencil.system.comm.allreduce(float(squares @ squares))))

    off = float(np.trace(B)) / size
    inside = B - off * np.eye(size)
    discriminant = float(np.trace(inside @ inside)) / size
    left = abs(off), abs(discriminant - measured.discriminant)
    return ClusterNoise(of(W), of(2 * W @ B.T), *left)
