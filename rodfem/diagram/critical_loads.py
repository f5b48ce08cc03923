r"""Loads of flutter and of divergence between two loads of a sweep, from all eigenvalues at both.

Where two real ones collide and become a complex pair, the square of half their difference ``D = ((mu1 - mu2)/2)^2``
passes through zero.  Unlike the eigenvalues, which have a square root there, ``D`` is a smooth function of the load:
the discriminant of the pencil projected on the two of them.  Its zero is found by Chebyshev interpolation, at spectral
accuracy and without ever solving at the double eigenvalue.  A complex pair at one load goes on from that at the other
one whose plane has its vectors, and whose value is near; another one comes from two real ones that meet on the way.
Where a single real one passes through zero the rod diverges: the eigenvalue itself is smooth there.  A step in which
what is found does not explain the numbers at both ends is parted.

Frequencies that meet and part again, or pass through zero and back, between two rows show in neither.  In ``nu``
(:mod:`rodfem.stability.spectrum`) ``D`` of two real ones vanishes where they meet, ``-D`` of a complex pair, and
``mu`` of a single one where it passes through zero.  A parabola through three rows tells where each is lowest; where
that comes near zero, the sweep has a load more.  Eigenvalues are known again at the neighbours of a row by their
vectors: with ``Z^t Y = 1`` for the left and right ones at the row, ``|Z^t Y'|`` is greatest for the same motion.  Two
real ones meet only where the load couples them, and not by a potential: with ``E`` the change of ``Z^t T Y``, to first
order

    D = ((nu_i + E_ii - nu_j - E_jj) / 2)^2 + E_ij E_ji,

and the product is negative there.  All others cross, or turn away from one another.  Multiple eigenvalues are left out,
and so is the upper half of a mesh's: it tells of the mesh rather than of the rod.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise
from math import isnan, nan
from typing import NamedTuple

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.curves import zero_between
from rodfem.continuation.eigenvalue_curves import SHARP, Located, assignment, interpolated_zero, locate_flutter
from rodfem.continuation.kinds import DIVERGENCE, FLUTTER, Kind
from rodfem.diagram.equilibria import at_load
from rodfem.errors import ConvergenceError
from rodfem.stability.cluster import Cluster, ClusterNoise, Measured, measure, noise_of, real_span
from rodfem.stability.nonsymmetric import ALIKE, MULTIPLE, NonsymmetricPencil, NonsymmetricSolver, groups
from rodfem.stability.spectrum import SHIFT, Spectrum, inside, times
from rodfem.tolerances import ROUND_OFF, SAME_LOAD, SAME_SPECIAL, TINY, round_off, unit

PARTS, PART = 100, 0.47
"""Times that steps of a sweep are parted, at most, and where: not in the middle, which is likely to be special."""
NEARER, CLOSEST = 10, 1e-6  # loads at which a meeting is looked for, at most, and their least distance, over a step
SMALL, CLEAR, ONE = 0.3, 100.0, 0.9
"""Relative distance of two eigenvalues that do not meet in a step; products of changes, over their noise, that are none
of round-off; square of the cosine of two vectors that are nearly one."""
JUST_MET = 1e-4
"""Imaginary part, relative to the eigenvalue, below which a pair may be two real ones that meet, and round-off."""
MOVED, OUTSIDE = 0.3, 0.2
"""Change of a complex eigenvalue, relative, and share of its vector outside a pair's plane, of another one."""


@dataclass(frozen=True)
class Side:
    """One end of a step: its ``load``, the equilibrium ``x`` there, and its ``spectrum``."""

    load: float
    x: PETSc.Vec
    spectrum: Spectrum


@dataclass
class Critical:
    """A critical load, before its state is evaluated, at which a cluster of eigenvalues collides or passes zero."""

    kind: Kind
    load: float
    change: int  # of the number of unstable eigenvalues
    uncertainty: float
    omega2: float
    cluster: Cluster | None = None  # None where round-off hides a collision: the pair is complex at both ends
    note: str = ""
    zeros: int = 0  # eigenvalues of the cluster that are zero at all loads, those of rigid motions


def cluster_at(pencil: NonsymmetricPencil, spectrum: Spectrum, places: list[int]) -> Cluster:
    """Cluster of some eigenvalues of a state's ``spectrum``, and the conjugates of complex ones."""
    found = pencil.frequencies(spectrum, np.array(places))
    conjugates = [found.vectors.conj()] if found.values.imag.any() else []
    vectors = np.concatenate([found.vectors, *conjugates], axis=1)
    return Cluster(real_span(pencil, vectors), float(found.values.real.mean()))


class Measuring:
    """A cluster of eigenvalues against the load: at the equilibrium near a ``guess``."""

    def __init__(self, solver: BranchSolver, eigensolver: NonsymmetricSolver, guess: PETSc.Vec) -> None:
        self.solver, self.eigensolver, self.guess = solver, eigensolver, guess

    def __call__(self, load: float, cluster: Cluster) -> Measured:
        """Measure a cluster; raises :class:`ConvergenceError` where it is not found."""
        return measure(self.pencil(load), cluster)

    def noise(self, load: float, cluster: Cluster) -> ClusterNoise:
        """Round-off of what is measured; raises :class:`ConvergenceError` where the cluster is not found."""
        pencil = self.pencil(load)
        return noise_of(pencil, measure(pencil, cluster))

    def pencil(self, load: float) -> NonsymmetricPencil:
        """Pencil at a load."""
        return self.eigensolver.at(at_load(self.solver, self.guess, load))


def located_flutter(measured: Measuring, cluster: Cluster, load: float, width: float) -> Located:
    """Collision of a ``measured`` ``cluster``, from about a ``load`` on, in pieces of the half ``width`` at first."""
    found = locate_flutter(measured, cluster, load, width)
    noise, clear = measured.noise(found.clear, found.cluster), measured(found.clear, found.cluster)
    moved = (noise.of_discriminant + clear.split) / abs(found.slope)
    left = noise.of_mean + clear.split / max(2 * float(np.sqrt(abs(clear.discriminant))), TINY)
    return replace(found, uncertainty=found.uncertainty + moved, left=found.left + left)


@dataclass(frozen=True)
class Mean:
    """Mean of the eigenvalues of a ``measured`` ``cluster`` against the load, ``zeros`` of which are zero at all loads.

    Vectors of those are no better than round-off: where there are any, the eigenvalues nearest zero are taken.
    """

    measured: Measuring
    cluster: Cluster
    zeros: int

    def __call__(self, load: float) -> float:
        """Mean at a load; raises :class:`ConvergenceError` where the cluster is not found."""
        if not self.zeros:
            return self.measured(load, self.cluster).cluster.mean
        pencil, size = self.measured.pencil(load), self.cluster.size
        values = pencil.nearest(size + 2, SHIFT * pencil.system.scene.units.omega2).values
        return float(values[np.argsort(abs(values), kind="stable")[:size]].real.mean())

    def noise(self, load: float) -> float:
        """Round-off of the matrix in the mean, which does not scatter; unknown, and zero, where some are zero."""
        return 0.0 if self.zeros else self.measured.noise(load, self.cluster).mean


class CriticalLoads:
    """Locates the critical loads between two loads of a sweep."""

    def __init__(self, solver: BranchSolver, eigensolver: NonsymmetricSolver, warn: Callable[[str], None]) -> None:
        """Take equilibria and their eigenvalues from the solvers; ``warn`` gets sentences on what is not clear."""
        self.solver, self.eigensolver, self.warn = solver, eigensolver, warn
        self.units, self._load = solver.system.scene.units, solver.system.scene.load
        self._zeros = self._parted = 0
        self._ahead = list[Meeting]()
        self.poles = list[int]()  # in the last step: changes of the number of negative eigenvalues through infinity

    def critical_loads(self, a: Side, b: Side, behind: Side | None, zeros: int) -> list[Critical]:
        """What happens between two rows, ``a`` and ``b``, in its order: collisions, and real ones that vanish."""
        self._zeros, self.poles = zeros, []
        sides = [a, *self._met(a, b, behind), b]
        events = [event for step in pairwise(sides) for event in self._step(*step)]
        return sorted(events, key=lambda event: abs(event.load - a.load))

    def _met(self, a: Side, b: Side, behind: Side | None) -> list[Side]:
        """Loads of a step at which eigenvalues come nearest to one another, or to zero, and may meet; in its order."""
        ahead, self._ahead = self._ahead, []
        for meeting in meetings(a, b, behind) if behind else ():
            beyond = (meeting.load - b.load) * (b.load - a.load) > 0.0
            (self._ahead if beyond else ahead).append(meeting)
        out = [a]
        for meeting in sorted(ahead, key=lambda m: abs(m.load - a.load)):
            if min(abs(meeting.load - side.load) for side in (*out, b)) > CLOSEST * abs(b.load - a.load):
                out.append(self._nearest(out[-1], b, meeting))
        return out[1:]

    def _nearest(self, a: Side, b: Side, meeting: Meeting) -> Side:
        """Where the eigenvalues of a ``meeting`` are nearest, or a load where they met."""
        low, high, mine = a, b, self._side(a, meeting.load)
        for _ in range(NEARER):
            found = [m.load for m in meetings(low, mine, high) if abs(m.mean - meeting.mean) < 0.01 * abs(m.mean)]
            load = min(found, key=lambda at: abs(at - mine.load), default=mine.load)
            move = (load - mine.load) / (b.load - a.load)
            if mine.spectrum.numbers != a.spectrum.numbers or abs(move) < CLOSEST:
                break
            low, high = (mine, high) if move > 0.0 else (low, mine)
            mine = self._side(mine, load)
        return mine

    def _side(self, a: Side, load: float) -> Side:
        """A load of a step that begins at a side: the equilibrium, and its eigenvalues."""
        x = at_load(self.solver, a.x, load)
        return Side(load, x, self.eigensolver.at(x).spectrum)

    def _step(self, a: Side, b: Side) -> list[Critical]:
        """What happens in a step, which is parted where not all of it is clear."""
        try:
            return (self._whole if a.spectrum.order == 2 else self._of_rates)(a, b)
        except ConvergenceError as trouble:
            if self._parted == PARTS or abs(b.load - a.load) < CLOSEST * unit(a.load, one=self.units.load):
                self.warn(str(trouble))
                return []
        self._parted += 1
        middle = self._side(a, a.load + PART * (b.load - a.load))
        return self._step(a, middle) + self._step(middle, b)

    def _whole(self, a: Side, b: Side) -> list[Critical]:
        """What happens in a step that is not parted; raises :class:`ConvergenceError` where that is not clear."""
        events = self._collisions(a, b)
        negative = [event for event in events if event.omega2 < 0]
        first, last = len(a.spectrum.negative), len(b.spectrum.negative)
        passed = last - first + sum(event.change for event in negative)
        for event in negative:  # both are unstable before and after
            event.change = 0
        if passed and not negative:
            return events + self._diverging(a, b, first, last)
        if passed or not (negative or same_negative(a.spectrum, b.spectrum)):
            raise ConvergenceError(
                f"What becomes of the negative eigenvalues, {first} at {self._load} = {a.load:.6g} and {last} at "
                f"{b.load:.6g}, is not clear: use a smaller range."
            )
        return events

    def _of_rates(self, a: Side, b: Side) -> list[Critical]:
        """The same of rates: where the real part of a complex pair vanishes, and real ones that do.

        Two real ones that collide are as unstable after that as before.
        """
        common = pairs_in_common(b.spectrum, a.spectrum)
        before, after = (set(side.spectrum.growing.tolist()) for side in (a, b))
        crossing = [i for i, j in common.items() if (i in after) != (j in before)]
        alike = groups(b.spectrum.values[crossing], np.inf, MULTIPLE)
        events = [self._oscillating(a, b, [crossing[i] for i in group]) for group in alike]
        met = 2 * (len(after - {*common}) - len(before - {*common.values()}))
        first, last = len(a.spectrum.negative) - met, len(b.spectrum.negative)
        if met and first != last:
            where = f"{self._load} = {a.load:.6g} and {b.load:.6g}"
            raise ConvergenceError(f"What becomes of the rates between {where} is not clear: use a smaller range.")
        return events if first == last else events + self._diverging(a, b, first, last)

    def _oscillating(self, a: Side, b: Side, places: list[int]) -> Critical:
        """Load at which the mean real part of complex pairs vanishes, by their ``places`` at ``b``."""
        cluster = cluster_at(self.eigensolver.at(b.x), b.spectrum, places)
        mean = Mean(Measuring(self.solver, self.eigensolver, a.x), cluster, 0)
        low, high = sorted((a.load, b.load))
        near = min((low, high), key=lambda load: abs(mean(load)))
        if abs(mean(near)) > a.spectrum.zero:
            if mean(low) * mean(high) > 0.0:
                raise ConvergenceError(f"A pair was lost between {low:.6g} and {high:.6g}: use a smaller range.")
            near = zero_between(mean, low, high, CLOSEST * (high - low))
        load, uncertainty = interpolated_zero(mean, mean.noise, near, self.units.load)
        inside = min(max(load, low), high)
        found = mean.measured(inside, cluster)
        uncertainty += abs(load - inside)
        sign = 1 if places[0] in b.spectrum.growing else -1
        return Critical(FLUTTER, inside, sign * cluster.size, uncertainty, found.frequency**2, found.cluster)

    def _diverging(self, a: Side, b: Side, first: int, last: int) -> list[Critical]:
        """Loads at which real eigenvalues pass through zero, from ``first`` negative ones to ``last``."""
        numbers = range(min(first, last), max(first, last))
        loads = [self._vanishing(a, b, number) for number in numbers]
        found = np.sort([load for load in loads if not isnan(load)])
        apart = np.diff(found) >= SAME_SPECIAL * unit(a.load, one=self.units.load)
        sign, bounds = 1 if last > first else -1, sorted((a.load, b.load))
        self.poles += [sign] * (len(loads) - len(found))
        groups = np.split(found, np.flatnonzero(apart) + 1)
        return [self._divergence(a, group.tolist(), bounds, sign) for group in groups if len(group)]

    def _vanishing(self, a: Side, b: Side, number: int) -> float:
        """Load at which the real eigenvalue of this number vanishes, at an end to round-off; nan for a pole."""
        sides = {a.load: a, b.load: b}

        def mu(load: float) -> float:
            """Real eigenvalues near the origin, in ascending order, but for those that are zero at all loads."""
            values = (sides.get(load) or self._side(a, load)).spectrum.values
            real = values[values.imag == 0].real
            return float(np.sort(real[np.argsort(abs(real), kind="stable")][self._zeros :])[number])

        low, high = sorted(sides)
        try:
            for load in (low, high):
                if abs(mu(load)) <= sides[low].spectrum.zero:
                    return load
            found = zero_between(mu, low, high, ROUND_OFF * max(abs(low), abs(high)))
            # beyond a pole the others have other numbers: one of them jumps
            pole = abs(mu(found)) > max(min(abs(mu(low)), abs(mu(high))) / 2, self.units.omega2)
        except (IndexError, ValueError) as trouble:
            raise ConvergenceError(
                f"Divergence between {low:.6g} and {high:.6g} could not be located: use a smaller range."
            ) from trouble
        if pole:  # of a rod whose mass is all at a few points, where these do not move
            self.warn(
                f"At {self._load} = {found:.8g} an eigenvalue changes its sign through infinity, not zero: a motion "
                "without inertia loses or regains its stability, and counts; give it a mass or a rotary inertia."
            )
        return nan if pole else found

    def _divergence(self, a: Side, loads: list[float], bounds: list[float], sign: int) -> Critical:
        """Divergence of as many eigenvalues as ``loads``, where their mean, which is smooth, is zero."""
        at, number = self._side(a, loads[0]), len(loads)
        places = np.argsort(abs(at.spectrum.values), kind="stable")[: number + self._zeros]
        own = places[at.spectrum.values[places].imag >= 0.0].tolist()
        cluster = cluster_at(self.eigensolver.at(at.x), at.spectrum, own)
        mean = Mean(Measuring(self.solver, self.eigensolver, a.x), cluster, self._zeros)
        load, uncertainty = interpolated_zero(mean, mean.noise, loads[0], self.units.load)
        uncertainty = max(uncertainty, abs(loads[-1] - loads[0]), SHARP * unit(load, one=self.units.load))
        inside = min(max(load, bounds[0]), bounds[1])
        uncertainty += abs(load - inside)
        return Critical(DIVERGENCE, inside, sign * number, uncertainty, 0.0, cluster, zeros=self._zeros)

    def _collisions(self, a: Side, b: Side) -> list[Critical]:
        """Collisions between two loads, those at one load together; raises :class:`ConvergenceError`."""
        events, common = list[Critical](), pairs_in_common(b.spectrum, a.spectrum)
        born = [i for i in b.spectrum.upper.tolist() if i not in common]
        gone = [i for i in a.spectrum.upper.tolist() if i not in common.values()]
        for sign, here, there, chosen in ((1, b, a, born), (-1, a, b, gone)):
            for group in groups(here.spectrum.values[chosen], np.inf, MULTIPLE):
                event = self._end(here, there, [chosen[i] for i in group])
                event.change *= sign
                self._add(events, event)
        return events

    def _add(self, events: list[Critical], event: Critical) -> None:
        """Take a collision together with others at its load; none is to be found twice."""
        near = SAME_LOAD * unit(event.load, one=self.units.load)
        known = next((e for e in events if e.cluster and event.cluster and abs(e.load - event.load) < near), None)
        if known is None:
            events.append(event)
            return
        if known.change * event.change > 0 and not event.note:
            raise ConvergenceError(f"Two pairs collide at {self._load} = {event.load:.8g}: use a smaller range.")
        known.change += event.change
        known.uncertainty = max(known.uncertainty, event.uncertainty + abs(known.load - event.load))
        if abs(event.omega2) < abs(known.omega2):
            known.omega2, known.cluster = event.omega2, event.cluster

    def _end(self, here: Side, there: Side, upper: list[int]) -> Critical:
        """Collision, on the way ``there``, of pairs complex ``here``."""
        cluster = cluster_at(self.eigensolver.at(here.x), here.spectrum, upper)
        other = measure(self.eigensolver.at(there.x), cluster)
        D, scale, mean = other.discriminant, abs(other.values).max(), other.cluster.mean
        just_met = abs(D) < (JUST_MET * scale) ** 2
        if abs(D) < (MULTIPLE * scale) ** 2:
            return self._at_once(here, there, other)
        if D > 0 or just_met:
            try:
                return self._located(here, there, cluster, just_met=just_met)
            except ConvergenceError:
                if D > 0:
                    raise
        elif -D > 4.0 * there.spectrum.noise[abs(there.spectrum.values - mean).argmin()] ** 2:
            raise ConvergenceError(
                f"The eigenvalue {here.spectrum.values[upper[0]]:.6g} at {self._load} = {here.load:.6g} was not "
                "followed to where it becomes complex: use a smaller range."
            )
        return Critical(FLUTTER, there.load, cluster.size, np.inf, mean)

    def _at_once(self, here: Side, there: Side, measured: Measured) -> Critical:
        """Frequencies that are double ``there``, and complex next to it, on the way from ``here``."""
        side = ">" if here.load > there.load else "<"
        note = (
            f"the frequencies are double at {self._load} = {there.load:.6g} and become complex at once: "
            f"flutter at every {self._load} {side} {there.load:.6g} next to it"
        )
        floor, cluster = round_off(there.load, self.units.load), measured.cluster
        return Critical(FLUTTER, there.load, cluster.size, floor, cluster.mean, cluster, note)

    def _located(self, here: Side, there: Side, cluster: Cluster, *, just_met: bool) -> Critical:
        """Collision of a cluster between two loads, which may have ``just_met``; raises :class:`ConvergenceError`."""
        measured, width = Measuring(self.solver, self.eigensolver, here.x), abs(here.load - there.load)
        located = located_flutter(measured, cluster, (there.load + here.load) / 2, width)
        load, uncertainty, apart = located.load, located.uncertainty, abs(located.load - there.load)
        outside = (load - there.load) * (here.load - there.load) < 0
        if apart <= uncertainty or (outside and just_met and apart < JUST_MET * width):
            load, uncertainty = there.load, uncertainty + apart  # at that row, at which they count as real
        low, high = sorted((here.load, there.load))
        inside = low - uncertainty <= load <= high + uncertainty and located.uncertainty <= width
        if not inside or located.slope * (here.load - there.load) > 0:
            raise ConvergenceError(
                f"Frequencies that are complex at {self._load} = {here.load:.6g} meet at {load:.6g}, which is none of "
                "this step: use a smaller range."
            )
        return Critical(FLUTTER, load, cluster.size, uncertainty, located.cluster.mean, located.cluster)


def pairs_in_common(mine: Spectrum, others: Spectrum) -> dict[int, int]:
    """Places of complex eigenvalues of positive imaginary part, and those of the other state that they go on from."""
    here, there = mine.upper, others.upper
    if not len(here) or not len(there):
        return {}
    a, b = mine.values[here][:, None], others.values[there][None, :]
    distance, outside = abs(a - b) / abs(a), 1.0 - _shares(mine, others)
    rows, columns = assignment(distance + outside)
    near = (distance < MOVED) & (outside < OUTSIDE)
    return {int(here[i]): int(there[j]) for i, j in zip(rows.tolist(), columns.tolist(), strict=True) if near[i, j]}


def _shares(mine: Spectrum, others: Spectrum) -> np.ndarray:
    """Shares (k, m) of vectors of complex pairs in the planes of another state's; of equal ones in all of them."""
    there, vectors = others.upper, others.coordinates(mine)[:, mine.upper]
    shares = np.zeros((len(mine.upper), len(there)))
    for group in groups(others.values[there], np.inf, ALIKE):
        w = others.pairs.right[:, there[group]]
        shares[:, group] = inside(np.concatenate([w.real, w.imag], axis=1), vectors)[:, None]
    return shares


def same_negative(a: Spectrum, b: Spectrum) -> bool:
    """Whether the negative eigenvalues of two states, as many, are the same ones, by values or by vectors."""
    before, after = (np.sort(found.values[found.negative].real) for found in (a, b))
    if np.allclose(after, before, rtol=1e-3, atol=0.0):  # near rigid motions vectors are round-off
        return True
    basis = b.pairs.right[:, b.negative].real
    return bool(inside(basis, b.coordinates(a)[:, a.negative].real).min() >= 1.0 - OUTSIDE)


class Meeting(NamedTuple):
    """A ``load`` at which eigenvalues of this ``mean`` may meet, or one may vanish."""

    load: float
    mean: float


def meetings(before: Side, row: Side, behind: Side) -> list[Meeting]:
    """What comes near zero between a row and its neighbours."""
    mine, size = row.spectrum, row.spectrum.right.shape[0]
    if not (mine.complete and before.spectrum.right.shape[0] == behind.spectrum.right.shape[0] == size):
        return []  # too many to find all of them, or sections have mass at some loads only
    count = len(mine.values)
    if count > 12:
        count = max(12, count // 2)
        count += int(mine.values[count - 1].imag < 0.0)  # of a pair that comes first
    first, back = _neighbour(mine, before.spectrum, count)
    last, ahead = _neighbour(mine, behind.spectrum, count)
    nu = np.array([first, mine.pairs.nu[:count], last])
    t = abs(before.load - row.load) / abs(behind.load - row.load)
    found = _single(mine, nu, t)
    if mine.order == 2:
        found = _pairs(mine, nu, np.array([back * back.T, ahead * ahead.T]), t) + found
    return [Meeting(row.load + at * (behind.load - row.load), mean) for at, mean in found]


def _neighbour(row: Spectrum, other: Spectrum, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Eigenvalues (k,) of a neighbour, as the row has them, and the change of ``Z^t T Y`` to it (k, k)."""
    left = times(row.lower, row.pairs.left[:count].T).T
    places, others = assignment(-abs(left @ other.right))
    matched = row.pairs.nu[:count].astype(complex)
    matched[places] = other.pairs.nu[others]
    projected = left @ times(other.inverse, times(other.lower.T, row.right[:, :count]))
    return matched, projected - np.diag(row.pairs.nu[:count])


def _pairs(row: Spectrum, nu: np.ndarray, products: np.ndarray, t: float) -> list[tuple[float, float]]:
    """Where pairs come near one another, two real ones or a complex one and its conjugate, and their means."""
    count = nu.shape[1]
    values, noise, right = row.values[:count], row.pairs.noise[:count], row.pairs.right[:, :count]
    i, j = np.triu_indices(count, 1)
    one = abs((right.conj().T @ right)[i, j]) ** 2 > ONE
    real, apart = (values.imag[i] == 0.0) & (values.imag[j] == 0.0), abs(nu[1, i] - nu[1, j])
    size = np.minimum(abs(nu[1, i]), abs(nu[1, j]))
    multiple = (apart < ALIKE * size) & ~one
    alone = ~np.isin(np.arange(count), [*i[multiple], *j[multiple]])
    conjugate = (values.imag[i] != 0.0) & (abs(nu[1, i] - nu[1, j].conj()) < ALIKE * size)
    D = np.where(real, 1.0, -1.0) * ((nu[:, i] - nu[:, j]) ** 2).real / 4.0
    rounded = (CLEAR * np.maximum(noise[i], noise[j])) ** 2
    coupled = (products[:, i, j].real < -rounded) | one | conjugate
    coupled &= (apart < SMALL * size) & (real | conjugate) & alone[i] & alone[j] & (D[[0, 2]] > rounded).all(axis=0)
    return [(at, float((values[i[n]] + values[j[n]]).real / 2)) for n, at in _lowest(D, t, coupled)]


def _single(row: Spectrum, nu: np.ndarray, t: float) -> list[tuple[float, float]]:
    """Where eigenvalues come near zero, and do not pass through it, and what they are at the row."""
    imaginary = row.values[: nu.shape[1]].imag
    real = np.flatnonzero(imaginary == 0.0 if row.order == 2 else imaginary >= 0.0)
    mu = row.shift + (1.0 / nu[:, real]).real
    ends = (mu[0] * mu[2] > 0.0) & (np.minimum(abs(mu[0]), abs(mu[2])) > row.zero / row.one)
    found = _lowest(np.sign(mu[0]) * mu, t, np.array([ends, ends]))
    return [(at, float(row.values[real[n]].real)) for n, at in found]


def _lowest(f: np.ndarray, t: float, allowed: np.ndarray) -> list[tuple[int, float]]:
    """Where parabolas through ``f`` (3, k), at ``-t``, 0 and 1, are lowest near zero, as ``allowed``: column, place."""
    back, ahead = (f[1] - f[0]) / t, f[2] - f[1]
    bend = (ahead - back) / (1.0 + t)
    slope = ahead - bend
    with np.errstate(divide="ignore", invalid="ignore"):
        at = np.where(bend > 0.0, -slope / (2.0 * bend), np.inf)
        low = f[1] + at * (slope + at * bend)
    ends = np.minimum(f[0], f[2])
    inside = (-t < at) & (at < 1.0) & np.where(at >= 0.0, allowed[1], allowed[0]) & (ends > 0.0)
    return [(int(n), float(at[n])) for n in np.flatnonzero(inside & (low < 0.7 * ends))]
