"""Left-most eigenvalues at the loads of a sweep: followed from load to load, and certified.

They are followed from the first load on (:mod:`rodfem.stability.followed_pairs`).  A certificate is due at the last
load, at every :data:`EVERY`-th, and on both sides of every change of the numbers of complex and of negative
eigenvalues.  It is a proof that none is missing (:mod:`rodfem.stability.outside`).  Where that fails, at the first
load, where eigenvalues come near one another, and where they were not followed to the accuracy that SLEPc is asked for,
they are solved for anew: from nothing and by SLEPc those nearest to a shift below zero, and by a complex shift the
pairs that may be farther.  Rows are open until the next certificate: what is found anew has to be what was followed.
Where it is not, all open rows are solved for anew.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.branch import Point
from rodfem.stability.finite_pairs import SHIFT
from rodfem.stability.followed_pairs import FollowedPairs
from rodfem.stability.frequencies import ALIKE, NEAR_ZERO, REAL, Frequencies, groups, named
from rodfem.stability.nonsymmetric import BEYOND, NonsymmetricPencil, NonsymmetricSolver
from rodfem.stability.slow_motions import begins_slowly, without_round_off
from rodfem.tolerances import unit

FREQUENCIES = 6
"""Number of frequencies recorded at each load where nobody asks for another."""
SEEN = 0.5
"""A pair within this fraction of the distance from the origin to the farthest eigenvalue found was found again."""
OTHER = 3.0
"""Times this, the shift is another one, from which the same eigenvalues must be found."""
BESIDE = 1e-4
"""Relative distance of a shift from the pair that is sought there."""
AGAIN = 1e-7
"""Eigenvalues of two shifts that differ by less than this, relative to them or to one, were found twice."""
EVERY = 20
"""Loads from one certificate to the next."""
NEAR = 1e-3
"""Relative distance of recorded eigenvalues below which they are solved for anew, unless they are one: multiple."""
AGREED = 1e-8
"""Difference of an inverse eigenvalue followed and one found anew, over the greatest: far ones of SLEPc have 1e-10."""
WORTH, LONGEST = 4, 16
"""Loads for which to follow is worth its beginning; most loads solved for anew before it is tried again."""
NONE = Frequencies(np.zeros(0, dtype=complex), np.zeros(0))


@dataclass
class Row:
    """A ``point`` of a sweep and what was ``found`` there, ``anew`` by SLEPc, and the rotation field, ``turned``."""

    point: Point
    found: Frequencies
    turned: np.ndarray
    anew: bool


class FrequencyRows:
    """Finds the eigenvalues at points that follow one another, and gives them away when they are certified."""

    def __init__(self, eigensolver: NonsymmetricSolver, number: int) -> None:
        """Find ``number`` eigenvalues and some more."""
        self.eigensolver, self.number = eigensolver, number
        units = eigensolver.system.scene.units
        self.followed = FollowedPairs(sought(number), SHIFT * units.omega2)
        self._open: list[Row] = []
        self._first: Frequencies | None = None
        self._certified = self._before = NONE
        self._numbers = _numbers(NONE)
        self._kept = self._pause = self._resting = 0

    def first(self, x: PETSc.Vec) -> str:
        """Find the eigenvalues of ``x``, the state of the first point; in words, if any, what other shifts find."""
        self._first = leftmost(self.eigensolver.at(x), self.number)
        self.eigensolver.slow = begins_slowly(self._first)
        if self.eigensolver.slow:
            self._first = leftmost(self.eigensolver.at(x), self.number)
        return differ(self.eigensolver.at(x), self.number, self._first)

    def add(self, point: Point) -> list[Row]:
        """Find the eigenvalues at the next point; rows that are certified by now, in their order."""
        pencil = self.eigensolver.at(point.x)
        found = self._followed(pencil, point)
        numbers = None if found is None else _numbers(found)
        changed = numbers != self._numbers
        if found is not None and not changed and len(self._open) < EVERY - 1 and not near(found, self.number + 1):
            self._open.append(Row(point, found, pencil.turned, anew=False))
            self._before, self._kept = found, self._kept + 1
            return []
        done = self.finish() if changed else []
        if done:
            pencil = self.eigensolver.at(point.x)
        if found is not None and not near(found, self.number + 1) and self._proved(pencil, point, found):
            self._open.append(Row(point, found, pencil.turned, anew=False))
            return done + self._close()
        anew, self._first = self._first or leftmost(pencil, self.number, self._before), None
        if found is not None and agree(found, anew):
            kept = found if len(found.values) == len(anew.values) else anew
            self._open.append(Row(point, kept, pencil.turned, anew=True))
            self._pause = 0
        else:
            self._begin(pencil, point)
            self._solve_anew()
            self._open.append(Row(point, anew, pencil.turned, anew=True))
        return done + self._close()

    def _followed(self, pencil: NonsymmetricPencil, point: Point) -> Frequencies | None:
        """What was followed to a point, None where nothing was."""
        found = self.followed.at(pencil, point.load)
        if found is None:
            return None
        return in_order(without_round_off(pencil, found))

    def _proved(self, pencil: NonsymmetricPencil, point: Point, found: Frequencies) -> bool:
        """Whether what was followed to a point is proved to be all that is as near to the shift."""
        certified = self.followed.certified(pencil, point.load)
        return certified is not None and agree(found, certified) and not _beyond(self._certified, found)

    def finish(self) -> list[Row]:
        """Certify the last point: all rows that are left."""
        if self._open:
            row, before = self._open[-1], self._open[-2].found if len(self._open) > 1 else self._certified
            pencil = self.eigensolver.at(row.point.x)
            if not (
                self._proved(pencil, row.point, row.found) or agree(row.found, leftmost(pencil, self.number, before))
            ):
                self.followed.end()
                self._solve_anew()
        return self._close()

    def _close(self) -> list[Row]:
        done, self._open = self._open, []
        if done:
            self._name([row for row in done if not row.found.kinds])
            self._certified = self._before = done[-1].found
            self._numbers = _numbers(self._before)
        return done

    def _name(self, rows: list[Row]) -> None:
        """Name the motions of rows, all at once."""
        if rows:
            found = named(self.eigensolver.system, [(row.found, row.turned) for row in rows], self.number)
            for row, frequencies in zip(rows, found, strict=True):
                row.found = frequencies

    def _solve_anew(self) -> None:
        """Solve anew for all rows that are open."""
        before = self._certified
        for row in self._open:
            before = row.found = leftmost(self.eigensolver.at(row.point.x), self.number, before)
            row.anew = True

    def _begin(self, pencil: NonsymmetricPencil, point: Point) -> None:
        """Begin to follow at a point, but not at each of those where that was of no use."""
        if self._resting:
            self._resting -= 1
            self.followed.end()
            return
        if self._kept < WORTH and self._certified is not NONE:
            self._resting = self._pause = min(2 * self._pause + 1, LONGEST)
        self._kept = 0
        self.followed.begin(pencil, point.load)


def sought(number: int) -> int:
    """Number of eigenvalues to ask for where ``number`` are recorded."""
    return max(number, FREQUENCIES) + BEYOND


def near(found: Frequencies, number: int) -> bool:
    """Whether two of the first ``number`` eigenvalues are near each other, but not one that is multiple."""
    values = found.values[:number]
    sizes = np.maximum(abs(values), NEAR_ZERO * min(abs(values).max(), found.far))
    apart = abs(values[:, None] - values) / np.maximum(sizes[:, None], sizes)
    return bool(((apart < NEAR) & (apart > ALIKE)).any())


def leftmost(pencil: NonsymmetricPencil, number: int, before: Frequencies = NONE) -> Frequencies:
    """Left-most eigenvalues: those near the origin, and what became of the complex ones ``before``.

    A complex shift looks for a pair that may be farther from the origin than all that the real shift found.  At least
    ``number`` are sought.
    """
    one = pencil.system.scene.units.omega2
    found = pencil.near(sought(number), SHIFT * one)
    pairs = _beyond(before, found)
    found = without_round_off(pencil, found)
    for pair in pairs:
        found = _joined(found, pencil.near(2, pair * (1 + BESIDE)))
    return in_order(found)


def _beyond(before: Frequencies, found: Frequencies) -> list[complex]:
    """Pairs of the load ``before`` that may be farther from the origin than all that was found from the real shift."""
    reach = SEEN * abs(found.values).max()
    return [v for v in before.values.tolist() if v.imag > 0 and abs(v) > reach]


def differ(pencil: NonsymmetricPencil, number: int, found: Frequencies) -> str:
    """Eigenvalues, in words, that were ``found`` and that another shift does not find alike; empty where it does.

    Of the ``pencil`` ``number`` or more are sought.

    Eigenvalues of a singular pencil, ``S x = M x = 0`` for some ``x``, are any numbers, with residuals of round-off; so
    are those that round-off makes of the infinite ones of a pencil that is badly scaled.  Both change with the shift.
    So do two that are about to meet, by the root of round-off, but not their mean.
    """
    other = in_order(pencil.near(sought(number), OTHER * SHIFT * found.one))
    if agree(found, other) or agree(with_means(found), with_means(other)):
        return ""
    first, second = (
        ", ".join(f"{v:.6g}" if v.imag else f"{v.real:.6g}" for v in f.values[:2].tolist()) for f in (found, other)
    )
    return f"beginning with {first} from one shift and with {second} from another"


def with_means(found: Frequencies) -> Frequencies:
    """Frequencies with their mean for those that are near one another."""
    values = np.empty_like(found.values)
    for group in groups(found.values, found.far, NEAR):
        values[group] = found.values[group].mean()
    return replace(found, values=values)


def _joined(found: Frequencies, beside: Frequencies) -> Frequencies:
    """Frequencies with those of a complex shift, and their conjugates, that are not among them."""
    for i, value in enumerate(beside.values.tolist()):
        both = (value, value.conjugate()) if abs(value.imag) > REAL * abs(value) else (value,)
        for v in both:
            if (abs(v - found.values) > AGAIN * unit(v, one=found.one)).all():
                columns = (x[:, i : i + 1] for x in (beside.vectors, beside.weighed))
                column, weighed = (x if v == value else x.conj() for x in columns)
                found = Frequencies(
                    np.append(found.values, v),
                    np.append(found.errors, beside.errors[i]),
                    (*found.kinds, beside.kinds[i]),
                    np.concatenate([found.vectors, column], axis=1),
                    np.concatenate([found.weighed, weighed], axis=1),
                    found.one,
                    found.floating,
                    found.floor,
                )
    return found


def in_order(found: Frequencies) -> Frequencies:
    """Frequencies by their real parts, without imaginary parts that are round-off."""
    values = np.where(abs(found.values.imag) < REAL * abs(found.values), found.values.real, found.values)
    order = np.lexsort((values.imag, np.round(values.real / min(found.one, found.natural), 6)))
    if (np.diff(order) == 1).all():
        return replace(found, values=values)
    return Frequencies(
        values[order],
        found.errors[order],
        tuple(found.kinds[i] for i in order) if found.kinds else (),
        found.vectors[:, order],
        found.weighed[:, order],
        found.one,
        found.floating,
        found.floor,
    )


def agree(followed: Frequencies, anew: Frequencies) -> bool:
    """Whether each eigenvalue followed is one that was found anew, and conversely, as far as both go."""
    shift = SHIFT * followed.one
    nu, other = (1.0 / (found.values - shift) for found in (followed, anew))
    tolerance = AGREED * abs(other).max()
    least = max(abs(nu).min(), abs(other).min()) + tolerance
    return _among(nu[abs(nu) > least], other, tolerance) and _among(other[abs(other) > least], nu, tolerance)


def _among(some: np.ndarray, others: np.ndarray, tolerance: float) -> bool:
    """Whether each of ``some`` numbers is one of ``others``, a different one for each."""
    left = others.tolist()
    for value in some.tolist():
        distance, place = min((abs(value - v), i) for i, v in enumerate(left)) if left else (np.inf, 0)
        if distance > tolerance:
            return False
        left.pop(place)
    return True


def _numbers(found: Frequencies) -> tuple[int, int, int]:
    """Numbers of complex, of negative, and of unstable eigenvalues."""
    return int((found.values.imag != 0).sum()), found.diverged(), found.unstable(found.noise)
