r"""Eigenpairs of a pencil without symmetry, followed from load to load: predicted, and improved on alternate sides.

The wanted eigenvalues of ``S x = mu M x`` are those nearest to a shift ``a``: the greatest ``nu = 1 / (mu - a)`` of ``B
= (S - a M)^-1 M``.  Some more, the guards, are followed with them.  Single vectors are not smooth where two eigenvalues
meet, but bases of the right and the left invariant subspace of all are, as functions of the load, as long as no other
eigenvalue joins them: a polynomial fitted to those at the last loads predicts them, ``X`` and ``Y``.  A step of inverse
iteration on one side, with one LU factorisation of ``S - a M``, ::

    X1 = (S - a M)^-1 M X        or        Y1 = (S - a M)^-t M Y,

shrinks what it has of an eigenvalue ``nu'`` outside by ``nu'/nu``.  The pencil projected on both sides, ::

    A w = nu N w,    N = Y^t M X,    A = Y^t M B X = Y^t M X1 = Y1^t M X,

has the eigenvalues with an error that is the product of the errors on both sides (Parlett, Math. Comp. 28 (1974) 679;
Bai, Demmel, Dongarra, Ruhe & van der Vorst, Templates for the Solution of Algebraic Eigenvalue Problems, 2000, section
7.3).  Of the bases of the same subspaces, those that differ from the prediction across the other side alone, ::

    X' = X1 A^-1 N,    Y^t M (X' - X) = 0        or        Y' = Y1 A^-t N^t,    (Y' - Y)^t M X = 0,

go on as smoothly as the prediction does, and ``E = X' - X``, ``F = Y' - Y`` are its errors.  With a left vector ``u``
such that ``u^t N w = 1`` the relative error of ``nu`` is at most about ::

    |F u| |E w| |nu| / (1 - r)^2,

in the norm of the mass, ``r`` being the ratio of the least followed ``nu`` to this one; the condition of ``nu`` is in
the sizes of ``u`` and ``w``.  This is the error before the step: the step makes it smaller.

What a prediction has of an eigenvalue outside goes on to the next one, magnified by the extrapolation and shrunk by the
step.  A polynomial through the last four loads magnifies it up to 15 times, one of second degree fitted to the last six
three times: what is left of the guards' neighbours dies out.

The product of two predictions is far below round-off.  So one side is improved at one load, and the other one at the
next; that which rests is taken to have the error that was measured when it was improved, once: that of a prediction.
It may rest only while what the polynomial misses of the next power of the load is no more than it was then, and the
error of the side that is improved does not grow much.  Where the bound does not hold, both sides are improved, as often
as it takes.

Eigenvalues that come from outside are what some columns more see, the probes: power iteration from load to load, in the
complement of all that is followed, has the size of the greatest ``nu'`` there.  Random vectors that are mixed into it
keep it from forgetting the others.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, nan

import numpy as np

from rodfem.errors import ConvergenceError
from rodfem.stability.finite_pairs import SPARE
from rodfem.stability.frequencies import ALIKE, EPS, Frequencies, orthonormal
from rodfem.stability.nonsymmetric import NonsymmetricPencil
from rodfem.stability.outside import enclosed
from rodfem.stability.subspaces import LEFT, RIGHT, Subspaces

GUARDS = 2
"""Number of eigenvalues that are followed beyond those that are wanted."""
DEGREE, SUPPORT = 2, 6
"""Degree of the polynomial of the prediction, and number of loads that it is fitted to, at most eight."""
BEGINNING, AT_ONCE = 20, 3
"""At the first load, how often the bases are made orthonormal, at most, and steps on either side after each time."""
AGAIN = 4
"""Steps on either side that bring the bases of one load to the one before."""
STEPS = 10
"""Steps of inverse iteration at one load, at most."""
ERROR = 1e-13
"""Error of ``nu``, over the greatest, that is round-off: what SLEPc is asked for."""
CONDITION = 1e8
"""Condition of an eigenvalue above which the bases are hardly bases: round-off, times that, is what SLEPc leaves."""
GROWN = 3.0
"""Growth of the error of a prediction from one load to the next up to which that of the other side is no larger."""
SAME = 1e-6
"""Relative difference of predictions that are equally good."""
VECTOR = 1e-4
"""Error of a vector before the last step, relative in the mass, below which the vector serves."""


@dataclass(frozen=True)
class _Ritz:
    """Pairs in the span of a right and a left basis: ``nu`` (p,), the vectors' coefficients ``w`` (p, p).

    ``errors`` (p,) of ``nu`` and ``inexact`` (p,) of the vectors, in the mass, are relative, and those before the step.
    ``conditions`` (p,) are those of ``nu`` as numbers that the bases determine.
    """

    nu: np.ndarray
    w: np.ndarray
    errors: np.ndarray
    inexact: np.ndarray
    conditions: np.ndarray

    def nearest(self, number: int) -> np.ndarray:
        """Places of the ``number`` greatest, those nearest to the shift."""
        return np.argsort(-abs(self.nu), kind="stable")[:number]

    def known(self, chosen: np.ndarray, shift: float) -> bool:
        """Whether the ``chosen`` ones, nearest first, are known.

        Errors are relative to the greatest ``nu``, but not to that of an eigenvalue near the ``shift`` itself.
        """
        sizes = abs(self.nu[chosen])
        return bool(
            (self.errors[chosen] * sizes).max() <= ERROR * min(sizes[0], 1.0 / shift)
            and self.inexact[chosen].max() <= VECTOR
            and self.conditions[chosen].max() <= CONDITION
        )

    def whole(self, chosen: np.ndarray) -> bool:
        """Whether no pair is cut in two by the choice."""
        return abs(self.nu[chosen].imag.sum()) <= ALIKE * abs(self.nu[chosen[-1]])


class _Past:
    """Bases of one side at the last loads at which they were improved, and the polynomial fitted to them.

    The ``error`` is that of the last prediction that was improved, in the mass.
    """

    def __init__(self, load: float, basis: np.ndarray) -> None:
        """Begin with a basis (n, p) at a load."""
        self.bases, self.loads = np.zeros((SUPPORT, *basis.shape)), list[float]()
        self.reach = self.reached = 0.0
        self.error = inf
        self._next = 0
        self.keep(load, basis, once=False)

    def predict(self, spaces: Subspaces, side: int, load: float) -> None:
        """Predict the basis of a side at a load."""
        self.reach = spaces.predict(side, DEGREE, np.array(self.loads) - load, self.bases)

    def keep(self, load: float, basis: np.ndarray, *, once: bool) -> None:
        """Keep the basis (n, p) at a load, improved there after it was predicted, instead of the oldest one.

        Of a basis that was improved ``once`` the error of the prediction was measured; else only that of later steps.
        """
        self._once = once
        self.reached = self.reach if len(self.loads) == SUPPORT else 0.0
        self.bases[self._next] = basis
        self.loads[self._next : self._next + 1] = [load]
        self._next = (self._next + 1) % SUPPORT

    @property
    def rests(self) -> bool:
        """Whether the last prediction is at least as good as the one whose error was measured.

        The error is a derivative times what the polynomial misses of the next power of the load.
        """
        return self._once and self.reach <= self.reached * (1.0 + SAME)


class FollowedPairs:
    """Follows the eigenvalues nearest to a shift along the loads of a sweep; on one rank, with the chain's factors.

    Where they cannot be followed :meth:`at` returns None, and they are to be solved for anew.
    """

    def __init__(self, number: int, shift: float) -> None:
        """Follow ``number`` eigenvalues nearest to ``shift``, as many as :meth:`NonsymmetricPencil.near` returns."""
        self.number, self.shift = number, shift
        self._spaces: Subspaces | None = None
        self._past: list[_Past] = []
        self._turn, self._load = RIGHT, nan

    @property
    def lost(self) -> bool:
        """Whether nothing is followed."""
        return not self._past

    def begin(self, pencil: NonsymmetricPencil, load: float) -> None:
        """Begin anew, from any vectors, with the invariant subspaces of a ``pencil`` at a load.

        Nothing is followed where they do not converge: the next eigenvalues are nearly as near to the shift.
        """
        self.end()
        try:
            spaces = self._taken(pencil)
            if spaces is not None and self._iterated(pencil, spaces):
                self._past = [_Past(load, basis) for basis in spaces.bases]
        except (ConvergenceError, np.linalg.LinAlgError):
            return

    def _taken(self, pencil: NonsymmetricPencil) -> Subspaces | None:
        """The bases, to be improved for a pencil; None where it has no factors along the rod."""
        factors = pencil.eliminated(self.shift)
        if factors is None:
            return None
        mass = pencil.mass_in_units()
        if self._spaces is None:
            self._spaces = Subspaces(mass, self.number + SPARE + GUARDS)
        self._spaces.take(mass, factors)
        return self._spaces

    def _iterated(self, pencil: NonsymmetricPencil, spaces: Subspaces) -> bool:
        """Iterate the bases from any vectors; whether they converge."""
        mass, bases = pencil.mass_in_units(), spaces.bases
        bases[RIGHT][:] = bases[LEFT][:] = np.random.default_rng(1).normal(size=bases[RIGHT].shape)
        for _ in range(BEGINNING):
            for basis in bases:
                basis[:] = orthonormal(pencil.system.comm, basis, mass @ basis)
            for _ in range(AT_ONCE):
                spaces.improve(RIGHT)
                spaces.improve(LEFT)
            found = _ritz(spaces)
            if found.known(found.nearest(self.number + SPARE), self._natural(pencil)):
                return True
        return False

    def _natural(self, pencil: NonsymmetricPencil) -> float:
        """Size of the shift in the unit of the eigenvalues."""
        return abs(self.shift) / pencil.system.scene.units.omega2

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

    def certified(self, pencil: NonsymmetricPencil, load: float) -> Frequencies | None:
        """The eigenvalues that the bases have at a load, where these are proved to be all, solved for anew, else None.

        They have neither vectors nor order.  Bases of another load are improved for this one, and kept as they were.
        """
        if self.lost:
            return None
        try:
            with pencil.system.clock("stability"):
                return self._certified(pencil, load)
        except (ConvergenceError, np.linalg.LinAlgError):  # a projection is singular
            return None

    def _certified(self, pencil: NonsymmetricPencil, load: float) -> Frequencies | None:
        factors, spaces = pencil.eliminated(self.shift), self._taken(pencil)
        if factors is None or spaces is None:
            return None
        kept = [basis.copy() for basis in spaces.bases]
        for _ in range(0 if load == self._load else AGAIN):
            spaces.improve(RIGHT)
            spaces.improve(LEFT)
        found = enclosed(spaces.bases[RIGHT], spaces.bases[LEFT], pencil.mass_in_units(), factors)
        for basis, before in zip(spaces.bases, kept, strict=True):
            basis[:] = before
        number = self.number + SPARE
        if found is None or not found.proves(number):
            return None
        one = pencil.system.scene.units.omega2
        nu = found.nu[np.argsort(-abs(found.nu), kind="stable")[:number]]
        return Frequencies(self.shift + one / nu, np.zeros(number), one=one)

    def _followed(self, pencil: NonsymmetricPencil, load: float) -> Frequencies | None:
        """The same; raises :class:`numpy.linalg.LinAlgError` where a projection is singular."""
        with pencil.system.clock("stability"):
            spaces, self._load = self._taken(pencil), load
            if spaces is None:
                return None
            for side, past in enumerate(self._past):
                past.predict(spaces, side, load)
            improved = list[int]()
            for step in range(STEPS):
                side, other = self._turn, LEFT if self._turn == RIGHT else RIGHT
                spaces.improve(side)
                improved.append(side)
                self._turn = other
                if step == 0 and not (self._steady(side, spaces) and self._past[other].rests):
                    continue
                found = _ritz(spaces)
                chosen = found.nearest(self.number + SPARE)
                if found.known(chosen, self._natural(pencil)):
                    for kept in set(improved):
                        self._past[kept].keep(load, spaces.bases[kept], once=improved.count(kept) == 1)
                    nearer = spaces.outside > abs(found.nu[chosen[-1]])
                    return None if nearer or not found.whole(chosen) else self._frequencies(pencil, found, chosen)
        return None

    def _steady(self, side: int, spaces: Subspaces) -> bool:
        """Whether a side that has just been predicted and improved had hardly more error than at the load before."""
        squared = max(float(np.trace(spaces.changes[side])), 0.0)  # below zero by round-off
        before, self._past[side].error = self._past[side].error, squared**0.5
        return self._past[side].error <= GROWN * before

    def _frequencies(self, pencil: NonsymmetricPencil, found: _Ritz, chosen: np.ndarray) -> Frequencies:
        """Frequencies of the ``chosen`` pairs, whose motions have no names yet."""
        assert self._spaces is not None
        chosen = chosen[np.argsort((1.0 / found.nu[chosen]).real, kind="stable")]
        units = pencil.system.scene.units
        values = self.shift / units.omega2 + (1.0 / found.nu[chosen]).astype(complex)
        vectors, weighed = self._spaces.combined(found.w[:, chosen])
        return pencil.unnamed(values, found.errors[chosen], vectors, weighed)


def _ritz(spaces: Subspaces) -> _Ritz:
    """Ritz pairs from what the last step has projected."""
    nu, w = np.linalg.eig(spaces.matrix)
    u = np.linalg.inv(spaces.overlap @ w).T
    beyond, beyond_left = _sizes(spaces.changes[RIGHT], w), _sizes(spaces.changes[LEFT], u)
    size, size_left = np.linalg.norm(w, axis=0), np.linalg.norm(u, axis=0)  # the bases are about orthonormal
    inside = np.maximum(1.0 - abs(nu).min() / abs(nu), EPS)
    return _Ritz(nu, w, beyond * beyond_left * abs(nu) / inside**2, beyond / size, size * size_left)


def _sizes(products: np.ndarray, w: np.ndarray) -> np.ndarray:
    """Sizes (p,) of combinations ``w`` (p, p) of vectors with these ``products`` (p, p)."""
    return np.sqrt(np.maximum((w.conj() * (products @ w)).real.sum(axis=0), 0.0))
