r"""Eigenpairs of a pencil without symmetry, followed from load to load: predicted, and improved on both sides.

The wanted eigenvalues of ``S x = mu M x`` are those nearest to a shift ``a``: the greatest ``nu = 1 / (mu - a)`` of ``B
= (S - a M)^-1 M``.  Some more, the guards, are followed with them.  Single vectors are not smooth where two eigenvalues
meet, but bases of the right and the left invariant subspace of all are, as functions of the load, as long as no other
eigenvalue joins them: a polynomial through those at the last loads predicts them.  One step of block inverse iteration
on both sides, with one LU factorisation of ``S - a M``, ::

    X1 = (S - a M)^-1 M X,         Y1 = (S - a M)^-t M Y,

shrinks what they have of an eigenvalue ``nu'`` outside by ``nu'/nu``.  The pencil projected on both, ::

    (Y1^t M X1) w = nu (Y1^t (S - a M) X1) w = nu (Y^t M X1) w,

has the eigenvalues with an error that is the product of the errors on both sides (Parlett, Math. Comp. 28 (1974) 679;
Bai, Demmel, Dongarra, Ruhe & van der Vorst, Templates for the Solution of Algebraic Eigenvalue Problems, 2000, section
7.3).  Of the bases of the same subspaces, those that differ from the prediction across the other side alone, ::

    X' = X1 T^-1,    T = (Y^t M X)^-1 Y^t M X1,        Y^t M (X' - X) = 0,

and the same on the left, go on as smoothly as the prediction does, and ``E = X' - X``, ``F = Y' - Y`` are its errors.
With a left vector ``u`` such that ``u^t (Y^t M X1) w = 1`` the relative error of ``nu`` is at most about ::

    |F T_l u| |E T w| / |nu| / (1 - r)^2,

in the norm of the mass, ``r`` being the ratio of the least followed ``nu`` to this one; the condition of ``nu`` is in
the sizes of ``u`` and ``w``.  This is the error before the step: the step makes it smaller.

An eigenvalue that comes from outside is what a column more sees, the probe: power iteration from load to load, in the
complement of all that is followed, has the size of the greatest ``nu'`` there.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import prod
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

from rodfem.errors import ConvergenceError
from rodfem.linalg.chain import Elimination
from rodfem.stability.nonsymmetric import ALIKE, EPS, SPARE, Frequencies, NonsymmetricPencil, orthonormal
from rodfem.tolerances import TINY

GUARDS = 6
"""Number of eigenvalues that are followed beyond those that are wanted."""
SUPPORT = 4
"""Number of loads that the polynomial of the prediction goes through."""
BEGINNING = 12
"""Steps of inverse iteration on either side at the first load."""
STEPS = 5
"""Steps of inverse iteration at one load, at most."""
ERROR = 1e-13
"""Error of ``nu``, over the greatest, that is round-off: what SLEPc is asked for."""
VECTOR = 1e-4
"""Error of a vector before the last step, relative in the mass, below which the vector serves."""


@dataclass(frozen=True)
class _Sides:
    """Right and left basis (n, p) at a ``load``."""

    load: float
    right: np.ndarray
    left: np.ndarray


class _Span(NamedTuple):
    """Some vectors (n, p) and their products with the mass."""

    vectors: np.ndarray
    images: np.ndarray


@dataclass(frozen=True)
class _Ritz:
    """Pairs in the span of a right and a left basis: ``nu`` (p,), the vectors' coefficients ``w`` (p, p).

    ``errors`` (p,) of ``nu`` and ``inexact`` (p,) of the vectors, in the mass, are relative, and those before the step.
    ``basis`` (n, p) is the right one.
    """

    nu: np.ndarray
    w: np.ndarray
    errors: np.ndarray
    inexact: np.ndarray
    basis: np.ndarray

    def serves(self, chosen: np.ndarray, shift: float) -> bool:
        """Whether the ``chosen`` ones, nearest first, are known, and no pair is cut in two.

        Errors are relative to the greatest ``nu``, but not to that of an eigenvalue near the ``shift`` itself.
        """
        nu = self.nu[chosen]
        whole = abs(nu.imag.sum()) <= ALIKE * abs(nu[-1])
        return bool(
            whole
            and (self.errors[chosen] * abs(nu)).max() <= ERROR * min(abs(nu[0]), 1.0 / shift)
            and self.inexact[chosen].max() <= VECTOR
        )


class FollowedPairs:
    """Follows the eigenvalues nearest to a shift along the loads of a sweep; on one rank, with the chain's factors.

    Where they cannot be followed :meth:`at` returns None, and they are to be solved for anew.
    """

    def __init__(self, number: int, shift: float) -> None:
        """Follow ``number`` eigenvalues nearest to ``shift``, as many as :meth:`NonsymmetricPencil.near` returns."""
        self.number, self.shift = number, shift
        self._past: list[_Sides] = []
        self._probe = np.zeros(0)

    @property
    def lost(self) -> bool:
        """Whether nothing is followed."""
        return not self._past

    def begin(self, pencil: NonsymmetricPencil, load: float) -> None:
        """Begin anew with the invariant subspaces of a ``pencil`` at a load.

        The right one is SLEPc's, filled up with any vectors, of equal eigenvalues SLEPc may miss one; the left one is
        iterated from it.  Nothing is followed where the pencil has hardly more eigenvalues than are wanted.
        """
        self.end()
        try:
            factors = pencil.eliminated(self.shift)
            if factors is not None:
                self._past = [self._first(pencil, factors, load)]
        except (ConvergenceError, np.linalg.LinAlgError):
            return

    def _first(self, pencil: NonsymmetricPencil, factors: Elimination, load: float) -> _Sides:
        """Bases of the first load; raises :class:`ConvergenceError` where SLEPc finds nothing."""
        mass, size, rng = pencil.mass_in_units(), self.number + SPARE + GUARDS, np.random.default_rng(1)
        found = pencil.basis(self.number + GUARDS, self.shift)[:, :size]
        block = rng.normal(size=(len(found), size + 1))
        block[:, : found.shape[1]] = found
        right, left = block[:, :-1], block[:, :-1]
        for _ in range(BEGINNING):
            right, left = factors.solve(mass @ right), factors.solve_transposed(mass @ left)
            right, left = (orthonormal(pencil.system.comm, side, mass @ side) for side in (right, left))
        overlap = left.T @ (mass @ right)
        self._probe = block[:, -1] - right @ np.linalg.solve(overlap, left.T @ (mass @ block[:, -1]))
        return _Sides(load, right, left)

    def end(self) -> None:
        """Follow nothing."""
        self._past = []

    def at(self, pencil: NonsymmetricPencil, load: float) -> Frequencies | None:
        """Eigenvalues at the next load; None where they are not known as well as SLEPc has them."""
        try:
            return None if self.lost else self._followed(pencil, load)
        except (
            ConvergenceError,
            np.linalg.LinAlgError,
        ):  # the shift is an eigenvalue, or a projection singular
            return None

    def _followed(self, pencil: NonsymmetricPencil, load: float) -> Frequencies | None:
        """The same; raises :class:`numpy.linalg.LinAlgError` where a projection is singular."""
        with pencil.system.clock("stability"):
            factors = pencil.eliminated(self.shift)
            if factors is None:
                return None
            mass, sides = pencil.mass_in_units(), self._predicted(load)
            for _ in range(STEPS):
                sides, found, outside = self._step(mass, factors, sides)
                chosen = np.argsort(-abs(found.nu), kind="stable")[: self.number + SPARE]
                if found.serves(chosen, abs(self.shift) / pencil.system.scene.units.omega2):
                    self._past = [*self._past[1 - SUPPORT :], sides]
                    nearer = outside > abs(found.nu[chosen[-1]])
                    return None if nearer else self._frequencies(pencil, found, chosen)
        return None

    def _frequencies(self, pencil: NonsymmetricPencil, found: _Ritz, chosen: np.ndarray) -> Frequencies:
        values = self.shift / pencil.system.scene.units.omega2 + 1.0 / found.nu[chosen]
        vectors = found.basis @ found.w[:, chosen]
        return pencil.frequencies(values.astype(complex), found.errors[chosen], vectors.astype(complex))

    def _step(self, mass: sp.csr_matrix, factors: Elimination, sides: _Sides) -> tuple[_Sides, _Ritz, float]:
        """One step of inverse iteration: bases, Ritz pairs, and the size of the greatest ``nu`` outside."""
        size = sides.left.shape[1]
        block = np.column_stack([sides.left, sides.right, self._probe])
        images = mass @ block
        solved = np.column_stack([factors.solve_transposed(images[:, :size]), factors.solve(images[:, size:])])
        ahead = mass @ solved
        left, right = (
            [_Span(v[:, part], m[:, part]) for v, m in ((block, images), (solved, ahead))]
            for part in (slice(size), slice(size, 2 * size))
        )
        sides, found, projected = _ritz(sides.load, right, left)
        share = np.linalg.solve(projected, solved[:, :size].T @ ahead[:, -1])
        probe, image = (v[:, -1] - v[:, size:-1] @ share for v in (solved, ahead))
        norm = np.sqrt(max(probe @ image, TINY))
        outside = norm / np.sqrt(max(self._probe @ images[:, -1], TINY))
        self._probe = probe / norm
        return sides, found, float(outside)

    def _predicted(self, load: float) -> _Sides:
        """Bases at a load by the polynomial, Lagrange's, through those at the last ones."""
        loads = [p.load for p in self._past]
        weights = [prod((load - b) / (a - b) for b in loads if b != a) for a in loads]
        right = sum(w * p.right for w, p in zip(weights, self._past, strict=True))
        left = sum(w * p.left for w, p in zip(weights, self._past, strict=True))
        return _Sides(load, np.asarray(right), np.asarray(left))


def _ritz(load: float, right: list[_Span], left: list[_Span]) -> tuple[_Sides, _Ritz, np.ndarray]:
    """Bases that go on, and Ritz pairs, of the spans before and after a step on either side; the projected mass (p, p).

    The bases belong to a ``load``.
    """
    (x, x1), (y, y1) = right, left
    before, after, projected = y.vectors.T @ x.images, y.images.T @ x1.vectors, y1.vectors.T @ x1.images
    nu, w = np.linalg.eig(np.linalg.solve(after, projected))
    u = np.linalg.inv(after @ w).T
    of_right, beyond = _gone_on(x, x1, np.linalg.solve(after, before), w)
    of_left, beyond_left = _gone_on(y, y1, np.linalg.solve(after.T, before.T), u)
    size = _sizes(x1.vectors.T @ x1.images, w)
    inside = np.maximum(1.0 - abs(nu).min() / abs(nu), EPS)
    errors = beyond * beyond_left / abs(nu) / inside**2
    return _Sides(load, of_right, of_left), _Ritz(nu, w, errors, beyond / size, x1.vectors), projected


def _gone_on(old: _Span, new: _Span, turn: np.ndarray, w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Basis (n, p) of the new span that goes on from the old one, and how far vectors of the new one are outside it.

    ``turn`` (p, p) is ``T^-1``, and ``w`` (p, p) are the coefficients of the vectors.
    """
    vectors = new.vectors @ turn
    rest, images = vectors - old.vectors, new.images @ turn - old.images
    return vectors, _sizes(rest.T @ images, np.linalg.solve(turn, w))


def _sizes(gram: np.ndarray, w: np.ndarray) -> np.ndarray:
    """Norms (p,) of the vectors with the coefficients ``w`` (p, p), complex, in a basis with a Gram matrix (p, p)."""
    return np.asarray(np.sqrt(np.maximum((w.conj() * (gram @ w)).real.sum(axis=0), 0.0)))
