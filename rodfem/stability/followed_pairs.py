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

    |F T_l u| |E T w| / |nu| / (1 - r)^2,         T w = nu w,  T_l u = nu u  but for these errors,

in the norm of the mass, ``r`` being the ratio of the least followed ``nu`` to this one; the condition of ``nu`` is in
the sizes of ``u`` and ``w``.  This is the error before the step: the step makes it smaller.

An eigenvalue that comes from outside is what a column more sees, the probe: power iteration from load to load, in the
complement of all that is followed, has the size of the greatest ``nu'`` there.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import prod, sqrt
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


class _Span(NamedTuple):
    """Some vectors (n, p) and their products with the mass."""

    vectors: np.ndarray
    images: np.ndarray


@dataclass(frozen=True)
class _Ritz:
    """Pairs in the span of a right and a left basis: ``nu`` (p,), the vectors' coefficients ``w`` (p, p).

    ``errors`` (p,) of ``nu`` and ``inexact`` (p,) of the vectors, in the mass, are relative, and those before the step.
    ``basis`` (n, p) is the right one, ``projected`` (p, p) the projected mass.
    """

    nu: np.ndarray
    w: np.ndarray
    errors: np.ndarray
    inexact: np.ndarray
    basis: np.ndarray
    projected: np.ndarray

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
        self._loads: list[float] = []
        self._past: list[np.ndarray] = []
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
                self._past, self._loads = [self._first(pencil, factors)], [load]
        except (ConvergenceError, np.linalg.LinAlgError):
            return

    def _first(self, pencil: NonsymmetricPencil, factors: Elimination) -> np.ndarray:
        """Left and right basis (n, 2 p) of the first load; raises :class:`ConvergenceError` as SLEPc does."""
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
        return np.concatenate([left, right], axis=1)

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
                    self._loads = [*self._loads[1 - SUPPORT :], load]
                    nearer = outside > abs(found.nu[chosen[-1]])
                    return None if nearer else self._frequencies(pencil, found, chosen)
        return None

    def _frequencies(self, pencil: NonsymmetricPencil, found: _Ritz, chosen: np.ndarray) -> Frequencies:
        values = self.shift / pencil.system.scene.units.omega2 + 1.0 / found.nu[chosen]
        vectors = found.basis @ found.w[:, chosen]
        return pencil.frequencies(values.astype(complex), found.errors[chosen], vectors.astype(complex))

    def _step(self, mass: sp.csr_matrix, factors: Elimination, sides: np.ndarray) -> tuple[np.ndarray, _Ritz, float]:
        """One step of inverse iteration: bases (n, 2 p), Ritz pairs, and the size of the greatest ``nu`` outside."""
        both = sides.shape[1]
        block = np.empty((len(sides), both + 1))
        block[:, :-1], block[:, -1] = sides, self._probe
        images, solved = mass @ block, np.empty_like(block)
        left, right = slice(both // 2), slice(both // 2, both)
        solved[:, left] = factors.solve_transposed(images[:, left])
        solved[:, both // 2 :] = factors.solve(images[:, both // 2 :])
        ahead = mass @ solved
        before, after = (
            [_Span(v[:, side], m[:, side]) for side in (right, left)] for v, m in ((block, images), (solved, ahead))
        )
        sides, found = _ritz(*before, *after)
        share = np.linalg.solve(found.projected, solved[:, left].T @ ahead[:, -1])
        probe, image = (v[:, -1] - v[:, right] @ share for v in (solved, ahead))
        norm = sqrt(max(probe @ image, TINY))
        outside = norm / sqrt(max(self._probe @ images[:, -1], TINY))
        self._probe = probe / norm
        return sides, found, outside

    def _predicted(self, load: float) -> np.ndarray:
        """Bases at a load by the polynomial, Lagrange's, through those at the last ones."""
        out = np.zeros_like(self._past[0])
        for a, sides in zip(self._loads, self._past, strict=True):
            out += prod((load - b) / (a - b) for b in self._loads if b != a) * sides
        return out


def _ritz(right: _Span, left: _Span, solved: _Span, dual: _Span) -> tuple[np.ndarray, _Ritz]:
    """Bases (n, 2 p) that go on after a step from ``right`` and ``left`` to ``solved`` and ``dual``, and Ritz pairs.

    Ritz vectors are eigenvectors of ``T`` up to the error that is measured.
    """
    before, after = left.vectors.T @ right.images, left.images.T @ solved.vectors
    projected, inverse = dual.vectors.T @ solved.images, np.linalg.inv(after)
    nu, w = np.linalg.eig(inverse @ projected)
    u = (np.linalg.inv(w) @ inverse).T
    on_right, beyond = _gone_on(right, solved, inverse @ before, w)
    on_left, beyond_left = _gone_on(left, dual, inverse.T @ before.T, u)
    size = np.sqrt((w.conj() * w).real.sum(axis=0))  # the basis is about orthonormal
    inside = np.maximum(1.0 - abs(nu).min() / abs(nu), EPS)
    errors = beyond * beyond_left * abs(nu) / inside**2
    return np.concatenate([on_left, on_right], axis=1), _Ritz(nu, w, errors, beyond / size, solved.vectors, projected)


def _gone_on(old: _Span, new: _Span, turn: np.ndarray, w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Basis (n, p) of the new span that goes on from the old one, and how far its vectors are from those before.

    ``turn`` (p, p) is ``T^-1``, and ``w`` (p, p) are the coefficients of the vectors; distances are in the mass.
    """
    vectors = new.vectors @ turn
    gram = (vectors - old.vectors).T @ (new.images @ turn - old.images)
    return vectors, np.sqrt(np.maximum((w.conj() * (gram @ w)).real.sum(axis=0), 0.0))
