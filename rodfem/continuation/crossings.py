r"""Where eigenvalues pass zero between two states of a branch: roots of the reduced stiffness matrix.

Between two states with the same border the cubic Hermite interpolant of ``H``, their reduced stiffness matrix
(:mod:`rodfem.stability.reduced_stiffness`),

    H(t) = A0 + A1 t + A2 t^2 + A3 t^3,      0 <= t <= 1,

is singular at the eigenvalues of a pencil of order 3k: all of them at once.  A real one is a crossing, of whatever
kind: several at one place, opposite ones, pairs that cancel, folds.  A complex one near the axis is a pair that the
interpolant does not tell from a near miss, and asks for one state more, as do several in one piece, and a change of the
index across the border, by which the piece is too long for it.

Most pieces have none, and one test says so: in the eigenvectors of ``H(0) + H(1)`` all four control matrices of
Bernstein have a positive definite block, and a negative definite one.  Then so has each of their means, and a matrix of
this shape is regular.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import scipy.linalg
from numpy.polynomial import Polynomial

from rodfem.stability.dense import FINITE
from rodfem.stability.reduced_stiffness import negative
from rodfem.tolerances import TINY

AXIS = 0.4
"""Imaginary part of a root, in pieces, below which it may be a pair of crossings."""
REAL = 1e-6
"""Imaginary part below which a zero of an interpolant, in lengths of its interval, is real."""
DEEPEST = 8
"""Divisions of a piece."""
SHORTEST = 1e-8
"""Length of a piece, in the metric, that is not divided."""
SAME, ALIKE = 1e-12, 0.9
"""Distance of crossings, in the metric, that are one; cosine of the modes of different ones, at most."""


@dataclass(frozen=True, eq=False)
class Node:
    """A state at a place ``s``: its reduced stiffness ``H``, the ``slope`` of that in s, both (k, k).

    The index across the border is ``far``, and ``kept`` is what is to be known of the state besides.
    """

    s: float
    H: np.ndarray
    slope: np.ndarray
    far: int
    kept: Any = None

    @property
    def index(self) -> int:
        """Number of negative eigenvalues."""
        return self.far + negative(self.H)


@dataclass(frozen=True)
class Crossing:
    """Eigenvalues that pass zero at ``s``: ``vectors`` (k, m) of H, the index ``before`` and ``after``.

    The ``piece`` is that between two nodes in which they do, ``width`` the distance of the first from the last of them.
    """

    s: float
    vectors: np.ndarray
    before: int
    after: int
    piece: tuple[Node, Node]
    width: float = 0.0


def coefficients(a: Node, b: Node) -> list[np.ndarray]:
    """Of the cubic in t from 0 to 1."""
    h = b.s - a.s
    d = b.H - a.H
    return [a.H, h * a.slope, 3 * d - h * (2 * a.slope + b.slope), h * (a.slope + b.slope) - 2 * d]


def clear(a: Node, b: Node) -> bool:
    """Whether the cubic between two nodes is regular for a reason that costs little to see."""
    h = (b.s - a.s) / 3
    control = np.stack([a.H, a.H + h * a.slope, b.H - h * b.slope, b.H])
    values, vectors = np.linalg.eigh(a.H + b.H)
    n = int((values < 0).sum())
    turned = vectors.T @ control @ vectors
    return bool(
        (n == 0 or np.linalg.eigvalsh(turned[:, :n, :n])[:, -1].max() < 0)
        and (n == len(values) or np.linalg.eigvalsh(turned[:, n:, n:])[:, 0].min() > 0)
    )


def roots(a: Node, b: Node) -> np.ndarray:
    """All places t at which the cubic is singular, (3k,) complex."""
    A = coefficients(a, b)
    # congruence: units in which the largest of the matrices is of size one in each direction
    size = np.sqrt(sum(abs(np.diagonal(X)) for X in A)) + TINY
    A = [X / np.outer(size, size) for X in A]
    k = len(A[0])
    one, zero = np.eye(k), np.zeros((k, k))
    left = np.block([[zero, one, zero], [zero, zero, one], [-A[0], -A[1], -A[2]]])
    right = np.eye(3 * k)
    right[2 * k :, 2 * k :] = A[3]
    p, q = scipy.linalg.eig(left, right, right=False, homogeneous_eigvals=True)
    keep = abs(q) > FINITE * abs(p)
    return p[keep] / q[keep]


def at(a: Node, b: Node, t: float) -> np.ndarray:
    """The cubic at t."""
    A = coefficients(a, b)
    return np.asarray(A[0] + t * (A[1] + t * (A[2] + t * A[3])))


def rate(a: Node, b: Node, t: float) -> np.ndarray:
    """Its derivative in t."""
    A = coefficients(a, b)
    return np.asarray(A[1] + t * (2 * A[2] + 3 * t * A[3]))


def crossings(
    a: Node,
    b: Node,
    solve: Callable[[Node, Node, float], Node | None],
    tolerance: float,
    misses: list[Node],
    depth: int = 0,
) -> list[Crossing]:
    """All crossings between two nodes ``a``, ``b``; ``solve`` makes a node between two others.

    The piece is one of a larger one that was divided ``depth`` times.  Eigenvalues of several modes that are within the
    ``tolerance`` of zero at one place pass it there.  ``misses`` gets nodes at which an eigenvalue is nearly zero, and
    does not pass it.
    """
    h = b.s - a.s
    if a.far == b.far and clear(a, b):
        return []
    found = roots(a, b)
    real = np.sort(found.real[(abs(found.imag) < REAL) & (found.real >= 0) & (found.real <= 1)])
    near = found[(abs(found.imag) >= REAL) & (abs(found.imag) < AXIS) & (found.real > 0.02) & (found.real < 0.98)]
    groups = together(a, b, real, tolerance)
    ask = None
    if a.far != b.far:
        ask = 0.47
    elif len(groups) > 1:
        gaps = [q[0] - p[-1] for p, q in pairwise(groups)]
        i = int(np.argmax(gaps))
        ask = float(np.clip((groups[i][-1] + groups[i + 1][0]) / 2, 0.01, 0.99))
    elif len(near):
        ask = float(near[abs(near.imag).argmin()].real)
    if ask is not None and depth < DEEPEST and h > SHORTEST:
        middle = solve(a, b, a.s + ask * h)
        if middle is not None:
            known = len(misses)
            out = crossings(a, middle, solve, tolerance, misses, depth + 1)
            out += crossings(middle, b, solve, tolerance, misses, depth + 1)
            if not out and a.far == b.far and len(misses) == known:
                misses.append(middle)
            return out
    out, index = [], a.index
    for group in groups:
        t = float(np.mean(group))
        values, vectors = np.linalg.eigh(at(a, b, t))
        own = vectors[:, np.argsort(abs(values))[: len(group)]]
        change = -int(np.sign(np.linalg.eigvalsh(own.T @ rate(a, b, t) @ own)).sum())
        out.append(Crossing(a.s + t * h, own, index, index + change, (a, b), (group[-1] - group[0]) * h))
        index += change
    return out


def places(a: Node, b: Node, order: int) -> list[float]:
    """Where a cubic of one row vanishes, or its derivative of an ``order``: all t from 0 to 1, rising."""
    cubic = Polynomial([float(A[0, 0]) for A in coefficients(a, b)])
    found = cubic.deriv(order).roots()
    return sorted(float(t.real) for t in found if abs(t.imag) < REAL and 0.0 <= t.real <= 1.0)


def together(a: Node, b: Node, places: np.ndarray, tolerance: float) -> list[list[float]]:
    """``places`` of crossings between nodes ``a``, ``b`` in order, in groups.

    A group has those of different modes that are one point within the ``tolerance``.
    """
    out: list[list[float]] = []
    before, fast = np.zeros(len(a.H)), 0.0
    for t in places.tolist():
        values, vectors = np.linalg.eigh(at(a, b, t))
        v = vectors[:, abs(values).argmin()]
        speed, apart = abs(float(v @ rate(a, b, t) @ v)), t - out[-1][-1] if out else 1.0
        alike = abs(v @ before) >= ALIKE and apart * (b.s - a.s) >= SAME
        if out and apart * max(speed, fast) <= tolerance and not alike:
            out[-1].append(t)
        else:
            out.append([t])
        before, fast = v, speed
    return out
