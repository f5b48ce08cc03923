"""Collisions of eigenvalues between two loads of a sweep: complex pairs that are at one of them and not at the other.

A pair at one load goes on from that at the other one whose plane has its vectors, and whose value is near.  Another one
comes from two real eigenvalues that meet on the way.  They are followed by their invariant subspace.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.eigenvalue_curves import assignment
from rodfem.continuation.flutter import Located, locate_flutter
from rodfem.continuation.kinds import FLUTTER, Kind
from rodfem.diagram.held import at_load
from rodfem.errors import ConvergenceError
from rodfem.stability.cluster import Cluster, ClusterNoise, Measured, measure, noise_of, real_span
from rodfem.stability.nonsymmetric import ALIKE, MULTIPLE, NonsymmetricPencil, NonsymmetricSolver, groups
from rodfem.stability.spectrum import Spectrum, inside
from rodfem.tolerances import TINY, round_off, unit

SAME = 1e-9
"""Loads, or eigenvalues, that differ by less than this, relative to them, are one."""
JUST_MET = 1e-4
"""Imaginary part, relative to the eigenvalue, below which a pair may be two real ones that meet, and round-off."""
MOVED, OUTSIDE = 0.3, 0.2
"""Change of a complex eigenvalue, relative, and share of its vector outside a pair's plane, above which it is another.
"""


@dataclass(frozen=True)
class Side:
    """One end of a step: its ``load``, the equilibrium ``x`` there, and its ``spectrum``."""

    load: float
    x: PETSc.Vec
    spectrum: Spectrum


class Near(NamedTuple):
    """A ``side`` at which a ``cluster`` comes near a collision, or zero: the ``value`` is its discriminant, or mean."""

    side: Side
    cluster: Cluster
    value: float


@dataclass
class Critical:
    """A critical load, before its state is evaluated.

    Attributes
    ----------
    kind, load, uncertainty
        Flutter or divergence, the load, and what its location leaves open.
    change
        Change of the number of unstable eigenvalues.
    omega2, cluster
        The eigenvalue there, and the cluster of those that collide or pass through zero.
    note
        Remark in words.
    still
        Number of eigenvalues of the cluster that are zero at all loads: those of rigid motions.
    """

    kind: Kind
    load: float
    change: int
    uncertainty: float
    omega2: float
    cluster: Cluster | None = None
    note: str = ""
    still: int = 0


@dataclass
class Told:
    """What happens in a step: ``events``, what ``entered`` (less what left), and ``doubts``, in words, where not all.

    Complex eigenvalues that ``entered`` are complex at both loads, but by no more than round-off at the first one.
    """

    events: list[Critical] = field(default_factory=list)
    entered: int = 0
    doubts: list[str] = field(default_factory=list)

    def and_then(self, other: Told) -> Told:
        """What happens in two steps, one after the ``other``."""
        return Told(self.events + other.events, self.entered + other.entered, self.doubts + other.doubts)


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
        w = others.condensed.pairs.right[:, there[group]]
        shares[:, group] = inside(np.concatenate([w.real, w.imag], axis=1), vectors)[:, None]
    return shares


def others_negative(mine: Spectrum, others: Spectrum) -> bool:
    """Whether the fewer of the negative eigenvalues of two states go on from some that are not negative, by vectors."""
    if len(mine.negative) > len(others.negative):
        mine, others = others, mine
    if not len(mine.negative):
        return False
    basis = others.condensed.pairs.right[:, others.negative].real
    return bool(inside(basis, others.coordinates(mine)[:, mine.negative].real).min() < 1.0 - OUTSIDE)


class Collisions:
    """Tells which eigenvalues of a sweep collide in a step."""

    def __init__(self, solver: BranchSolver, eigensolver: NonsymmetricSolver) -> None:
        """Know what computes equilibria (``solver``); the ``eigensolver`` is that of the pencils."""
        self.solver, self.eigensolver = solver, eigensolver
        self.units, self._load = solver.system.scene.units, solver.system.scene.load

    def between(self, a: Side, b: Side) -> Told:
        """Collisions between two loads, those at one and the same load together."""
        told, common = Told(), pairs_in_common(b.spectrum, a.spectrum)
        born = [i for i in b.spectrum.upper.tolist() if i not in common]
        gone = [i for i in a.spectrum.upper.tolist() if i not in common.values()]
        for sign, here, there, chosen in ((1, b, a, born), (-1, a, b, gone)):
            for group in groups(here.spectrum.values[chosen], np.inf, MULTIPLE):
                self._follow(told, here, there, [chosen[i] for i in group], sign)
        return told

    def _follow(self, told: Told, here: Side, there: Side, upper: list[int], sign: int) -> None:
        """Follow equal complex pairs at one load, which have no counterpart at the other one, to where they collide."""
        try:
            event = self._end(here, there, upper)
        except ConvergenceError as trouble:
            told.doubts.append(
                f"The eigenvalue {here.spectrum.values[upper[0]]:.6g} at {self._load} = {here.load:.6g} was not "
                f"followed to where it becomes complex ({str(trouble).rstrip('.')}): use a smaller range."
            )
            return
        if event is None:
            told.entered += 2 * sign * len(upper)
        else:
            event.change *= sign
            self._add(told, event, here)

    def _add(self, told: Told, event: Critical, here: Side) -> None:
        """Take a collision, followed from ``here``, together with others at its load; none is to be found twice."""
        same = [e for e in told.events if abs(e.load - event.load) < SAME * unit(e.load, one=self.units.load)]
        if not same:
            told.events.append(event)
            return
        known = same[0]
        if known.change * event.change > 0 and self._common(known, event, here) > 0.5:
            told.doubts.append(
                f"Two pairs at {self._load} = {here.load:.6g} end in one collision at {event.load:.8g}: use a smaller "
                "range."
            )
            return
        known.change += event.change
        known.uncertainty = max(known.uncertainty, event.uncertainty + abs(known.load - event.load))
        if abs(event.omega2) < abs(known.omega2):
            known.omega2, known.cluster = event.omega2, event.cluster

    def _common(self, one: Critical, other: Critical, here: Side) -> float:
        """Share of the smaller cluster of two collisions in the other one's subspace, in the mass of a state."""
        assert one.cluster is not None and other.cluster is not None
        pencil = self.eigensolver.at(here.x)
        parts = pencil.product(one.cluster.basis, pencil.weighed(other.cluster.basis))
        return float((abs(parts) ** 2).sum() / min(parts.shape))

    def _end(self, here: Side, there: Side, upper: list[int]) -> Critical | None:
        """Collision, on the way ``there``, of pairs complex ``here``; None for some that are, by round-off, there too.

        Raises :class:`ConvergenceError` where it is none of both.
        """
        cluster = cluster_at(self.eigensolver.at(here.x), here.spectrum, upper)
        other = measure(self.eigensolver.at(there.x), cluster)
        scale = abs(other.values).max()
        if abs(other.discriminant) < (MULTIPLE * scale) ** 2:
            return self._at_once(here, there, other)
        just_met = abs(other.discriminant) < (JUST_MET * scale) ** 2
        if other.discriminant < 0 and not just_met:
            nearest = abs(there.spectrum.values - other.cluster.mean).argmin()
            if -other.discriminant <= 4.0 * there.spectrum.noise[nearest] ** 2:
                return None
            raise ConvergenceError("it is complex there, too")
        try:
            return self._located(here, there, cluster, just_met=just_met)
        except ConvergenceError:
            if other.discriminant < 0:
                return None
            if abs(other.discriminant) < (ALIKE * scale) ** 2:
                return self._at_once(here, there, other)
            raise

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
        """Collision of a cluster on the way from one load to another, where it may have ``just_met``.

        Raises :class:`ConvergenceError` where there is none.
        """
        measured, width = Measuring(self.solver, self.eigensolver, here.x), abs(here.load - there.load)
        located = located_flutter(measured, cluster, (there.load + here.load) / 2, width)
        load, uncertainty, apart = located.load, located.uncertainty, abs(located.load - there.load)
        if uncertainty > width:
            raise ConvergenceError("they part so slowly that where they met is not known to a step")
        outside = (load - there.load) * (here.load - there.load) < 0
        if apart <= uncertainty or (outside and just_met and apart < JUST_MET * width):
            load, uncertainty = there.load, uncertainty + apart  # at that row, at which they still count as real
        low, high = sorted((here.load, there.load))
        if not low - uncertainty <= load <= high + uncertainty:
            raise ConvergenceError(f"two that meet at {load:.6g}, beyond this step, are not its own")
        if located.slope * (here.load - there.load) > 0:
            raise ConvergenceError(f"the two that meet at {load:.6g} are complex on the other side of it")
        return Critical(FLUTTER, load, cluster.size, uncertainty, located.cluster.mean, located.cluster)


def cluster_at(pencil: NonsymmetricPencil, spectrum: Spectrum, places: list[int]) -> Cluster:
    """Cluster of some eigenvalues of a state's ``spectrum``, and the conjugates of complex ones."""
    found = pencil.of(spectrum, np.array([i for i in places if spectrum.values[i].imag >= 0.0]))
    conjugates = [found.vectors.conj()] if found.values.imag.any() else []
    vectors = np.concatenate([found.vectors, *conjugates], axis=1)
    return Cluster(real_span(pencil, vectors), float(found.values.real.mean()))


class Measuring:
    """How a ``solver`` and its ``eigensolver`` measure a cluster at a load: at the equilibrium near ``guess``."""

    def __init__(self, solver: BranchSolver, eigensolver: NonsymmetricSolver, guess: PETSc.Vec) -> None:
        """Compute nothing yet."""
        self.solver, self.eigensolver, self.guess = solver, eigensolver, guess

    def __call__(self, load: float, cluster: Cluster) -> Measured:
        """Measure the cluster; raises :class:`ConvergenceError` where it is not found."""
        return measure(self.pencil(load), cluster)

    def noise(self, load: float, cluster: Cluster) -> ClusterNoise:
        """Round-off of what is measured; raises :class:`ConvergenceError` where the cluster is not found."""
        pencil = self.pencil(load)
        return noise_of(pencil, measure(pencil, cluster))

    def pencil(self, load: float) -> NonsymmetricPencil:
        """Pencil at a load."""
        return self.eigensolver.at(at_load(self.solver, self.guess, load))


def located_flutter(measured: Measuring, cluster: Cluster, load: float, width: float) -> Located:
    """Collision as :func:`~rodfem.continuation.flutter.locate_flutter` finds it; round-off of the matrix counts, too.

    Of a ``measured`` ``cluster``, from about the ``load`` on, in pieces of the half ``width`` at first.  Pairs that are
    taken for one may meet at loads, and at eigenvalues, of their own: that counts, too.  Raises
    :class:`ConvergenceError` where that does.
    """
    found = locate_flutter(measured, cluster, load, width)
    noise, clear = measured.noise(found.clear, found.cluster), measured(found.clear, found.cluster)
    moved = (noise.of_discriminant + clear.split) / abs(found.slope)
    left = noise.of_mean + clear.split / max(2 * float(np.sqrt(abs(clear.discriminant))), TINY)
    return replace(found, uncertainty=found.uncertainty + moved, left=found.left + left)
