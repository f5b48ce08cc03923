"""Which complex pair of eigenvalues of a sweep goes on from which of another load nearby.

By their values alone two pairs that meet at nearly the same load are mistaken for one another: what is born in a step
lies where the other one was before it.  A pair's vectors span a plane that is smooth where single ones are not, and
planes of different motions have little in common.
"""

from __future__ import annotations

import numpy as np
from mpi4py import MPI

from rodfem.continuation.eigenvalue_curves import assignment
from rodfem.stability.frequencies import ALIKE, MULTIPLE, Frequencies, groups, orthonormal, product, squares
from rodfem.tolerances import TINY

MOVED = 0.3
"""A complex eigenvalue that changes by more than this, relative, in a step may be another one."""
OUTSIDE = 0.2
"""Share of a vector outside the plane of a pair above which it may be another's: it is followed from there."""
AGAIN = 1e-6
"""Eigenvalues at one load that differ by less than this, relative, are one that was found twice."""


def upper(found: Frequencies) -> list[int]:
    """Places of the eigenvalues of positive imaginary part, one of each complex pair."""
    return [int(i) for i in np.flatnonzero(found.values.imag > 0)]


def paired(comm: MPI.Comm, found: Frequencies, others: Frequencies) -> dict[int, int]:
    """Places of complex eigenvalues of ``found``, of positive imaginary part, and those of ``others`` they go on from.

    The ranks of ``comm`` share the vectors.
    """
    mine, there = upper(found), upper(others)
    if not mine or not there:
        return {}
    a, b = found.values[mine][:, None], others.values[there][None, :]
    distance, outside = abs(a - b) / abs(a), 1.0 - _shares(comm, found, mine, others, there)
    rows, columns = assignment(distance + outside)
    near = (distance < MOVED) & (outside < OUTSIDE)
    return {mine[i]: there[j] for i, j in zip(rows.tolist(), columns.tolist(), strict=True) if near[i, j]}


def _shares(comm: MPI.Comm, found: Frequencies, mine: list[int], others: Frequencies, there: list[int]) -> np.ndarray:
    """Shares (k, m) of vectors of ``found`` in the planes of pairs of ``others``; of equal ones in those of all."""
    energy = np.maximum(squares(comm, found.vectors[:, mine], found.weighed[:, mine]), TINY)
    shares = np.zeros((len(mine), len(there)))
    for group in groups(others.values[there], others.far, ALIKE):
        vectors, weighed = (x[:, [there[i] for i in group]] for x in (others.vectors, others.weighed))
        both, weighed_both = (np.concatenate([x, x.conj()], axis=1) for x in (vectors, weighed))
        parts = product(comm, orthonormal(comm, both, weighed_both), found.weighed[:, mine])
        shares[:, group] = np.minimum((abs(parts) ** 2).sum(axis=0) / energy, 1.0)[:, None]
    return shares


def strange(comm: MPI.Comm, a: Frequencies, b: Frequencies, chosen: list[int], others: list[int]) -> bool:
    """Whether the fewer of eigenvalues ``chosen`` of ``a`` and ``others`` of ``b`` go on from some that are no others.

    That is so where a vector is outside the span of the others'; the ranks of ``comm`` share the vectors.
    """
    if len(chosen) > len(others):
        a, b, chosen, others = b, a, others, chosen
    if not chosen:
        return False
    basis = orthonormal(comm, b.vectors[:, others], b.weighed[:, others])
    energy = np.maximum(squares(comm, a.vectors[:, chosen], a.weighed[:, chosen]), TINY)
    inside = (abs(product(comm, basis, a.weighed[:, chosen])) ** 2).sum(axis=0) / energy
    return bool((1.0 - inside).max() > OUTSIDE)


def together(found: Frequencies, chosen: list[int]) -> list[list[int]]:
    """The ``chosen`` ones of :func:`upper`, equal ones together, each with as many conjugates as ``found`` has."""
    values, out = found.values, []
    for group in groups(values[chosen], found.far):
        members = [chosen[i] for i in group]
        mirrored = values[members[0]].conjugate()
        out.append([*members, *(j for j, v in enumerate(values) if abs(v - mirrored) < MULTIPLE * abs(v))])
    return out


def places(found: Frequencies, values: np.ndarray) -> list[int]:
    """Places of ``values`` (k,) of positive imaginary part among those ``found``; as many as are there."""
    out: list[int] = []
    for value in values[values.imag > 0].tolist():
        near = [i for i in upper(found) if abs(found.values[i] - value) < AGAIN * abs(value) and i not in out]
        out += sorted(near, key=lambda i: abs(found.values[i] - value))[:1]
    return out
