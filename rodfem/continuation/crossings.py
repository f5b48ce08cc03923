r"""Where eigenvalues pass zero between two states of a branch: roots of the reduced stiffness matrix.

Between two states with the same border the cubic Hermite interpolant of ``H``, their reduced stiffness matrix
(:mod:`rodfem.stability.reduced_stiffness`),

    H(t) = A0 + A1 t + A2 t^2 + A3 t^3,      0 <= t <= 1,

is singular at the eigenvalues of a pencil of order 3k: all of them at once.  A real one is a crossing, of whatever
kind.  A complex one near the axis is a pair that the interpolant does not tell from a near miss, and asks for one state
more, as do several in one piece, and a change of the index across the border, by which the piece is too long for it.

Most pieces have none, and one test says so: in the eigenvectors of ``H(0) + H(1)`` all four control matrices of
Bernstein have a positive definite block, and a negative definite one.  Then so has each of their means, and a matrix of
this shape is regular.

The cubic through nodes at a and b is off by ``(s - a)^2 (s - b)^2 H''''/4!``.  A third node shows the fourth
derivative: the row before, or a state in the piece.  If what that leaves open may hide a crossing, the piece is
divided: the blocks are definite with that margin, and an eigenvalue that passes zero is faster than the margin changes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
import scipy.linalg
from numpy.polynomial import Polynomial

from rodfem.stability.spectrum import FINITE
from rodfem.tolerances import TINY

AXIS, REAL = 0.4, 1e-6
"""Imaginary parts of a root, in pieces: below the first it may be a pair of crossings, below the second it is real."""
DEEPEST, SHORTEST = 8, 1e-8
"""Divisions of a piece, at most; length of a piece, in the metric, that is not divided."""
SAFE = 20.0
"""Times the fourth derivative at one place that bounds it in a piece, and what the cubic is off against rates."""
PLACES = np.linspace(0.02, 0.98, 49)
"""Where other eigenvalues are compared with zero, in pieces."""


def negative(H: np.ndarray) -> int:
    """Number of negative eigenvalues of a symmetric matrix."""
    return int((np.linalg.eigvalsh(H) < 0).sum())


@dataclass(frozen=True, eq=False)
class Node:
    """A state at a place ``s``: its reduced stiffness ``H``, the ``slope`` of that in s, both (k, k)."""

    s: float
    H: np.ndarray
    slope: np.ndarray
    far: int  # the index across the border
    kept: Any = None  # what else is known of the state

    @property
    def index(self) -> int:
        """Number of negative eigenvalues."""
        return self.far + negative(self.H)


@dataclass(frozen=True)
class Crossing:
    """Eigenvalues that pass zero at ``s`` in a ``piece`` between two nodes."""

    s: float
    vectors: np.ndarray  # (k, m), of H
    before: int  # the index on either side
    after: int
    rest: int  # the index at it, but for these
    piece: tuple[Node, Node]
    uneven: float  # their mean rate over the slowest


def coefficients(a: Node, b: Node) -> list[np.ndarray]:
    """Of the cubic in t from 0 to 1."""
    h = b.s - a.s
    d = b.H - a.H
    return [a.H, h * a.slope, 3 * d - h * (2 * a.slope + b.slope), h * (a.slope + b.slope) - 2 * d]


def cubic_value(a: Node, b: Node, t: float, order: int = 0) -> np.ndarray:
    """The cubic at t, or its derivative."""
    h, u = b.s - a.s, 1 - t
    if order:
        return np.asarray(6 * t * u * (b.H - a.H) + h * u * (1 - 3 * t) * a.slope + h * t * (3 * t - 2) * b.slope)
    ends = (1 + 2 * t) * u * u * a.H + t * t * (3 - 2 * t) * b.H
    return np.asarray(ends + h * t * u * (u * a.slope - t * b.slope))


def roots(a: Node, b: Node) -> np.ndarray:
    """All places t at which the cubic is singular, (3k,) complex."""
    A = coefficients(a, b)
    # congruence: units in which the largest of the matrices is of size one in each direction
    size = np.sqrt(sum(abs(np.diagonal(X)) for X in A)) + TINY
    A = [X / np.outer(size, size) for X in A]
    k = len(A[0])
    one, zero = np.eye(k), np.zeros((k, k))
    left = np.block([[zero, one, zero], [zero, zero, one], [-A[0], -A[1], -A[2]]])
    p, q = scipy.linalg.eig(left, scipy.linalg.block_diag(one, one, A[3]), right=False, homogeneous_eigvals=True)
    keep = abs(q) > FINITE * abs(p)
    return p[keep] / q[keep]


def places(a: Node, b: Node, order: int) -> list[float]:
    """Where a cubic of one row vanishes, or its derivative of an ``order``: all t from 0 to 1, rising."""
    h, first, last = (b.s - a.s) / 3, a.H.item(), b.H.item()
    control = np.diff(np.array([first, first + h * a.slope.item(), last - h * b.slope.item(), last]), order)
    if control.min() > 0 or control.max() < 0:
        return []
    cubic = Polynomial([A.item() for A in coefficients(a, b)])
    found = cubic.deriv(order).roots()
    return sorted(float(t.real) for t in found if abs(t.imag) < REAL and 0.0 <= t.real <= 1.0)


def fourth(a: Node, b: Node, c: Node | None) -> np.ndarray:
    """Size ``|H''''|/4!`` of the fourth derivative (k, k), by what node ``c`` is off the cubic, and its slope.

    Without another node it is that of the second and third term: in a short first step they are larger.
    """
    h = b.s - a.s
    if c is None:
        return _size(np.stack(coefficients(a, b)[2:]), np.full(2, h**4))
    left, right = c.s - a.s, c.s - b.s
    steep = 2 * abs(left * right) * max(abs(left + right), h / 2)  # in the middle slopes do not tell
    off = np.stack([c.H - cubic_value(a, b, left / h), c.slope - cubic_value(a, b, left / h, 1) / h])
    return _size(off, np.array([(left * right) ** 2, steep]))


def _size(matrices: np.ndarray, scales: np.ndarray) -> np.ndarray:
    """Sum of the absolute values ``(X^2)^(1/2)`` of symmetric ``matrices`` (m, k, k) over ``scales`` (m,)."""
    values, vectors = np.linalg.eigh(matrices)
    return np.asarray((vectors * (abs(values) / scales[:, None])[:, None, :] @ vectors.swapaxes(1, 2)).sum(axis=0))


def off(a: Node, b: Node, size: np.ndarray) -> np.ndarray:
    """What the cubic may be off in the middle, by the ``size`` of a :func:`fourth` derivative."""
    return np.asarray(SAFE * (b.s - a.s) ** 4 / 16 * size)


def clear(a: Node, b: Node, off: np.ndarray) -> bool:
    """Whether ``H``, from which the cubic is ``16 t^2 (1 - t)^2 off`` at most, is regular between two nodes.

    That is a multiple of the middle one of Bernstein's quartics, in which the cubic has these control matrices.
    """
    if a.far != b.far:
        return False
    h = (b.s - a.s) / 3
    left, right = a.H + h * a.slope, b.H - h * b.slope
    control = np.stack([a.H, (a.H + 3 * left) / 4, (left + right) / 2, (3 * right + b.H) / 4, b.H])
    values, vectors = np.linalg.eigh(a.H + b.H)
    n, turned = int((values < 0).sum()), vectors.T @ control @ vectors
    margin = np.zeros_like(turned)
    margin[2] = 16 / 6 * vectors.T @ off @ vectors
    try:
        for definite in (-(turned + margin)[:, :n, :n], (turned - margin)[:, n:, n:]):
            np.linalg.cholesky(definite)
    except np.linalg.LinAlgError:
        return False
    return True


@dataclass
class Zeros:
    """Finds crossings."""

    solve: Callable[[Node, Node, float], Node | None]  # makes a node between two others
    tolerance: float  # of eigenvalues of several modes that pass zero at one place
    misses: list[Node] = field(default_factory=list)  # where an eigenvalue is nearly zero, and does not pass it

    def crossings(self, a: Node, b: Node, size: np.ndarray, depth: int = 0) -> list[Crossing]:
        """All crossings in a piece divided ``depth`` times, by the ``size`` of its :func:`fourth` derivative."""
        bound = off(a, b, size)
        if clear(a, b, bound):
            return []
        found = roots(a, b)
        groups = together(a, b, found, self.tolerance)
        t, miss = _division(a, b, found, groups, bound)
        short = depth >= DEEPEST or b.s - a.s <= SHORTEST
        middle = None if t is None or short else self.solve(a, b, a.s + t * (b.s - a.s))
        if middle is None:
            return _passed(a, b, groups)
        known, size = len(self.misses), fourth(a, b, middle)
        out = [*self.crossings(a, middle, size, depth + 1), *self.crossings(middle, b, size, depth + 1)]
        if miss and not out and len(self.misses) == known:
            self.misses.append(middle)
        return out


def _passed(a: Node, b: Node, groups: list[list[float]]) -> list[Crossing]:
    """Crossings at the roots of the cubic, in ``groups``; the index on either side of each is that of the cubic."""
    between = [a.far + negative(cubic_value(a, b, (p[-1] + q[0]) / 2)) for p, q in pairwise(groups)]
    sides, out, h = pairwise([a.index, *between, a.far + negative(b.H)]), list[Crossing](), b.s - a.s
    for group, (before, after) in zip(groups, sides, strict=False):
        own, others, rates = _passing(a, b, group)
        rest, s = a.far + int((others < 0).sum()), a.s + float(np.mean(group)) * h
        uneven = float(abs(rates).mean() / max(abs(rates).min(), TINY))
        out.append(Crossing(s, own, before, after, rest, (a, b), uneven))
    return out


def _division(
    a: Node, b: Node, found: np.ndarray, groups: list[list[float]], off: np.ndarray
) -> tuple[float | None, bool]:
    """Where a piece is to be divided, None if it need not, and whether that is at a near miss of zero."""
    group = groups[0] if groups else []
    if a.far != b.far:
        return 0.47, False
    if len(groups) > 1:
        _, last, first = max((q[0] - p[-1], p[-1], q[0]) for p, q in pairwise(groups))
        return float(np.clip((last + first) / 2, 0.01, 0.99)), False
    near = found[(abs(found.imag) >= REAL) & (abs(found.imag) < AXIS) & (found.real > 0) & (found.real < 1)]
    if len(near):
        return float(np.clip(near[abs(near.imag).argmin()].real, 0.02, 0.98)), True
    if _alone(a, b, group, off):
        return None, False
    place = float(np.mean(group or [0.94]))
    return (place + float(place < 0.5)) / 2, False


def _alone(a: Node, b: Node, group: list[float], off: np.ndarray) -> bool:
    """Whether no other eigenvalue passes zero than those of a ``group``, which are fast enough to pass it once."""
    near = np.zeros(len(PLACES), dtype=bool)
    if group:
        own, _, rates = _passing(a, b, group)
        if abs(rates).min() <= SAFE * np.linalg.norm(own.T @ off @ own, 2):
            return False
        near = abs(PLACES - np.mean(group)) < 0.1  # next to the group its own are near zero
    t = PLACES[:, None, None]
    A = coefficients(a, b)
    values, vectors = np.linalg.eigh(A[0] + t * (A[1] + t * (A[2] + t * A[3])))
    doubt = 16 * PLACES[:, None] ** 2 * (1 - PLACES[:, None]) ** 2 * (vectors * (off @ vectors)).sum(axis=1)
    return bool(((abs(values) <= doubt).sum(axis=1) <= near * len(group)).all())


def _passing(a: Node, b: Node, group: list[float]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vectors (k, m) of the eigenvalues that pass zero in a ``group``, all others, and the rates (m,) of these in t."""
    t, m = float(np.mean(group)), len(group)
    values, vectors = np.linalg.eigh(cubic_value(a, b, t))
    order = np.argsort(abs(values))
    own = vectors[:, order[:m]]
    return own, values[order[m:]], np.linalg.eigvalsh(own.T @ cubic_value(a, b, t, 1) @ own)


def together(a: Node, b: Node, found: np.ndarray, tolerance: float) -> list[list[float]]:
    """Real roots in order; those of different modes that are one point within the ``tolerance`` are a group."""
    out: list[list[float]] = []
    before, fast = np.zeros(len(a.H)), 0.0
    for t in np.sort(found.real[(abs(found.imag) < REAL) & (found.real >= 0) & (found.real <= 1)]).tolist():
        values, vectors = np.linalg.eigh(cubic_value(a, b, t))
        v = vectors[:, abs(values).argmin()]
        speed, apart = abs(float(v @ cubic_value(a, b, t, 1) @ v)), t - out[-1][-1] if out else 1.0
        alike = abs(v @ before) >= 0.9 and apart * (b.s - a.s) >= 1e-12  # one mode, at two places
        if out and apart * max(speed, fast) <= tolerance and not alike:
            out[-1].append(t)
        else:
            out.append([t])
        before, fast = v, speed
    return out
