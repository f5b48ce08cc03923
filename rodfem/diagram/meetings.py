r"""Frequencies of a sweep that meet and part again, or pass through zero and back, between two rows that show neither.

Of two real eigenvalues ``D = ((nu_i - nu_j)/2)^2`` is smooth in the load, and vanishes where they meet; of a complex
pair so does ``-D``; and a single one, ``mu``, where it passes through zero.  A parabola through three rows tells where
each is lowest.  Where that comes near zero, the sweep has a load more.

Eigenvalues are known again at the neighbours of a row by their vectors: with ``Z^t Y = 1`` for the left and right ones
at the row (:mod:`rodfem.stability.spectrum`), ``|Z^t Y'|`` is greatest for the same motion.  Two real ones meet only
where the load couples them, and not by a potential: with ``E`` the change of ``Z^t T Y``, to first order

    D = ((nu_i + E_ii - nu_j - E_jj) / 2)^2 + E_ij E_ji,

and the product is negative there.  All others cross, or turn away from one another.  Equal eigenvalues are one group:
``D`` has the means of two groups, and the trace of the product of their blocks.

The upper half of a mesh's eigenvalues is left out: it tells of the mesh rather than of the rod.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rodfem.continuation.eigenvalue_curves import assignment
from rodfem.stability.nonsymmetric import ALIKE, groups
from rodfem.stability.spectrum import Spectrum, times

LOWER = 0.7
"""Part of the values at both neighbours below which a lowest one is near zero."""
SMALL = 0.3
"""Relative distance of two eigenvalues from which on they do not meet in a step."""
CLEAR = 100.0
"""Products of the changes of two eigenvalues above this, over their noise, are none of round-off."""
ONE = 0.9
"""Square of the cosine of two vectors, of two groups the mean of its sums, from which on they are nearly one."""
SMALLEST = 12
"""Number of eigenvalues of which the upper half is not left out."""


class Meeting(NamedTuple):
    """What may vanish at a part ``t`` of a step: the eigenvalues at these ``places``, and their ``mean``."""

    t: float
    places: list[int]
    mean: float


class _Rows(NamedTuple):
    """Eigenvalues ``nu`` (3, k) at a row and its neighbours, and the products ``E_ij E_ji`` (2, k, k) at these."""

    nu: np.ndarray
    products: np.ndarray


def meetings(row: Spectrum, before: Spectrum, behind: Spectrum, t: float = 1.0) -> list[Meeting]:
    """What comes near zero between a ``row`` and its neighbours, in parts ``t`` of the step ahead.

    They are a part ``t`` of that step ``before`` the row, and the whole of it ``behind`` it.
    """
    if not (row.complete and row.right.shape[0] == before.right.shape[0] == behind.right.shape[0]):
        return []  # too many to find all of them, or sections have mass at some loads only
    count = len(row.values)
    if count > SMALLEST:
        count = max(SMALLEST, count // 2)
        count += int(abs(row.values[:count].imag.sum()) > ALIKE * abs(row.values[count - 1]))
    (first, back), (last, ahead) = (_neighbour(row, other, count) for other in (before, behind))
    rows = _Rows(np.array([first, row.condensed.pairs.nu[:count], last]), np.array([back * back.T, ahead * ahead.T]))
    return [*_pairs(row, rows, t), *_single(row, rows, t)]


def _neighbour(row: Spectrum, other: Spectrum, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Eigenvalues (k,) of a neighbour, as the row has them, and its ``T`` in the vectors of the row (k, k)."""
    mine, there = row.condensed, other.condensed
    left = times(mine.lower, mine.pairs.left[:count].T).T
    same = abs(left @ other.right)
    places, others = assignment(-same)
    matched = mine.pairs.nu[:count].astype(complex)
    matched[places] = there.pairs.nu[others]
    projected = left @ times(there.inverse, times(there.lower.T, row.right[:, :count]))
    return matched, projected - np.diag(mine.pairs.nu[:count])


def _pairs(row: Spectrum, rows: _Rows, t: float) -> list[Meeting]:
    """Pairs that come near one another: two groups of real ones, or a complex one and its conjugate."""
    count = rows.nu.shape[1]
    values, noise, right = row.values[:count], row.condensed.pairs.noise[:count], row.condensed.pairs.right[:, :count]
    parallel = abs(right.conj().T @ right) ** 2
    nu = np.where(values.imag == 0.0, rows.nu[1].real, rows.nu[1])
    alike = _split(groups(nu, float(abs(nu).max()), ALIKE), parallel)
    member = np.zeros((count, len(alike)))
    for g, group in enumerate(alike):
        member[group, g] = 1.0 / len(group)
    mean, one, products = rows.nu @ member, member.T @ parallel @ member, member.T @ rows.products @ member
    noise, imaginary = noise @ member, np.array([values[group[0]].imag != 0.0 for group in alike])
    i, j = np.triu_indices(len(alike), 1)
    real, apart = ~imaginary[i] & ~imaginary[j], abs(mean[1, i] - mean[1, j])
    size = np.minimum(abs(mean[1, i]), abs(mean[1, j]))
    conjugate = imaginary[i] & (abs(mean[1, i] - mean[1, j].conj()) < ALIKE * size)
    chosen = (apart < SMALL * size) & (real | conjugate)
    i, j, sign = i[chosen], j[chosen], np.where(real[chosen], 1.0, -1.0)
    D = sign * ((mean[:, i] - mean[:, j]) ** 2).real / 4.0
    rounded = (CLEAR * np.maximum(noise[i], noise[j])) ** 2
    coupled = (products[:, i, j].real < -rounded) | (one[i, j] > ONE) | (sign < 0.0)
    coupled &= (D[[0, 2]] > rounded).all(axis=0)
    found = [(alike[i[n]] + alike[j[n]], part) for n, part in _lowest(D, t, coupled)]
    return [Meeting(part, places, float(values[places].real.mean())) for places, part in found]


def _single(row: Spectrum, rows: _Rows, t: float) -> list[Meeting]:
    """Eigenvalues that come near zero, and do not pass through it."""
    real = np.flatnonzero(row.values[: rows.nu.shape[1]].imag == 0.0)
    mu = row.condensed.shift + 1.0 / rows.nu[:, real].real
    ends = (mu[0] * mu[2] > 0.0) & (np.minimum(abs(mu[0]), abs(mu[2])) > row.zero / row.one)
    found = _lowest(np.sign(mu[0]) * mu, t, np.array([ends, ends]))
    return [Meeting(part, [int(real[n])], float(row.values[real[n]].real)) for n, part in found]


def _split(alike: list[list[int]], parallel: np.ndarray) -> list[list[int]]:
    """Groups of equal eigenvalues; those whose vectors are nearly one are about to meet, and apart."""
    out = list[list[int]]()
    for group in alike:
        met = len(group) > 1 and (parallel[np.ix_(group, group)] - np.eye(len(group))).max() > ONE
        out += [[i] for i in group] if met else [group]
    return out


def _lowest(f: np.ndarray, t: float, allowed: np.ndarray) -> list[tuple[int, float]]:
    """Where parabolas through ``f`` (3, k), at ``-t``, 0 and 1, are lowest near zero, as ``allowed``: column, place."""
    back, ahead = (f[1] - f[0]) / t, f[2] - f[1]
    bend = (ahead - back) / (1.0 + t)
    slope = ahead - bend
    with np.errstate(divide="ignore", invalid="ignore"):
        at = np.where(bend > 0.0, -slope / (2.0 * bend), np.inf)
        low = f[1] + at * (slope + at * bend)
    behind = at >= 0.0
    ends = np.minimum(f[0], f[2])
    inside = (-t < at) & (at < 1.0) & np.where(behind, allowed[1], allowed[0]) & (ends > 0.0)
    return [(int(n), float(at[n])) for n in np.flatnonzero(inside & (low < LOWER * ends))]
