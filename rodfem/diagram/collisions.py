"""Collisions of eigenvalues between two loads of a sweep: what becomes of each complex pair.

A pair at one load goes on from a pair at the other one, or from two real eigenvalues that have met, or from a pair that
was there already, farther from the origin than what is found.  Each is followed by its invariant subspace, unless its
value and its vectors leave no doubt.  A pair that ends in one that another was taken to go on from takes its place, and
the other one is followed.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.complex_pairs import paired, places, together, upper
from rodfem.continuation.flutter import Located, locate_flutter
from rodfem.continuation.kinds import FLUTTER, Kind
from rodfem.continuation.static_solver import StaticSolver
from rodfem.diagram.held import at_load
from rodfem.diagram.side import Side
from rodfem.errors import ConvergenceError
from rodfem.stability.cluster import Cluster, Measured, cluster_of, measure
from rodfem.stability.cluster_noise import ClusterNoise, noise_of
from rodfem.stability.frequencies import MULTIPLE
from rodfem.stability.nonsymmetric import NonsymmetricPencil, NonsymmetricSolver
from rodfem.tolerances import TINY, round_off, unit

SAME = 1e-9
"""Loads, or eigenvalues, that differ by less than this, relative to them, are one."""
JUST_MET = 1e-4
"""Imaginary part, relative to the eigenvalue, below which a pair may be two real ones that meet, and round-off."""


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

    Complex eigenvalues that ``entered`` are complex at both loads, but were not among those found at the first one.
    """

    events: list[Critical] = field(default_factory=list)
    entered: int = 0
    doubts: list[str] = field(default_factory=list)

    def and_then(self, other: Told) -> Told:
        """What happens in two steps, one after the ``other``."""
        return Told(self.events + other.events, self.entered + other.entered, self.doubts + other.doubts)


class Collisions:
    """Tells what becomes of the complex pairs of a sweep in a step."""

    def __init__(self, solver: StaticSolver, eigensolver: NonsymmetricSolver) -> None:
        """Know what computes equilibria (``solver``); the ``eigensolver`` is that of the pencils."""
        self.solver, self.eigensolver = solver, eigensolver
        self.units, self._load = solver.system.scene.units, solver.system.scene.load

    def between(self, a: Side, b: Side) -> Told:
        """Collisions between two loads, those at one and the same load together."""
        told, before = Told(), paired(self.solver.system.comm, b.found, a.found)
        self._follow(told, b, a, before, 1)
        self._follow(told, a, b, {there: here for here, there in before.items()}, -1)
        return told

    def _follow(self, told: Told, here: Side, there: Side, match: dict[int, int], sign: int) -> None:
        """Follow the pairs at one load that no ``match`` says what they go on from, to the other load.

        The ``sign`` is that of their number where they are born on the way back.
        """
        waiting = together(here.found, [i for i in upper(here.found) if i not in match])
        followed: set[int] = set()
        while waiting:
            chosen = waiting.pop(0)
            mine = [i for i in chosen if here.found.values[i].imag > 0]
            followed |= set(mine)
            try:
                end = self._end(here, there, chosen)
            except ConvergenceError as trouble:
                told.doubts.append(
                    f"The eigenvalue {here.found.values[chosen[0]]:.6g} at {self._load} = {here.load:.6g} was not "
                    f"followed to where it becomes complex ({str(trouble).rstrip('.')}): use a smaller range."
                )
                continue
            if isinstance(end, Critical):
                end.change *= sign
                self._add(told, end, here)
                continue
            known = places(there.found, end.values)
            taken = [i for i, place in match.items() if place in known]
            if not known:
                told.entered += sign * len(chosen)
            elif len(known) != len(mine) or followed & set(taken) or (sign < 0 and len(taken) != len(known)):
                told.doubts.append(
                    f"Which eigenvalues at {self._load} = {there.load:.6g} become {here.found.values[chosen[0]]:.6g} "
                    f"at {here.load:.6g} is not clear: use a smaller range."
                )
            else:
                for i in taken:
                    del match[i]
                match |= dict(zip(mine, known, strict=True))
                waiting += together(here.found, taken)

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

    def _end(self, here: Side, there: Side, chosen: list[int]) -> Critical | Measured:
        """Collision, on the way ``there``, of eigenvalues complex ``here``; where they are complex there too, these.

        Raises :class:`ConvergenceError` where it is none of both.
        """
        values = here.found.values[chosen]
        if 2 * (values.imag > 0).sum() != len(chosen):
            raise ConvergenceError("not all of its equals and conjugates are found")
        cluster = cluster_of(self.eigensolver.at(here.x), here.found, chosen)
        other = measure(self.eigensolver.at(there.x), cluster)
        scale = abs(other.values).max()
        if abs(other.discriminant) < (MULTIPLE * scale) ** 2:
            side = ">" if here.load > there.load else "<"
            note = (
                f"the frequencies are double at {self._load} = {there.load:.6g} and become complex at once: "
                f"flutter at every {self._load} {side} {there.load:.6g} next to it"
            )
            floor = round_off(there.load, self.units.load)
            return Critical(FLUTTER, there.load, cluster.size, floor, other.cluster.mean, other.cluster, note)
        just_met = abs(other.discriminant) < (JUST_MET * scale) ** 2 and not places(there.found, other.values)
        if other.discriminant < 0 and not just_met:
            return other
        located = located_flutter(
            Measuring(self.solver, self.eigensolver, here.x),
            cluster,
            (there.load + here.load) / 2,
            abs(here.load - there.load),
        )
        load, uncertainty, apart = located.load, located.uncertainty, abs(located.load - there.load)
        outside = (load - there.load) * (here.load - there.load) < 0
        if apart <= uncertainty or (outside and just_met and apart < JUST_MET * abs(here.load - there.load)):
            load, uncertainty = there.load, uncertainty + apart  # at that row, at which they still count as real
        low, high = sorted((here.load, there.load))
        if not low - uncertainty <= load <= high + uncertainty:
            raise ConvergenceError(f"two that meet at {load:.6g}, beyond this step, are not its own")
        if located.slope * (here.load - there.load) > 0:
            raise ConvergenceError(f"the two that meet at {load:.6g} are complex on the other side of it")
        return Critical(FLUTTER, load, cluster.size, uncertainty, located.cluster.mean, located.cluster)


class Measuring:
    """How a ``solver`` and its ``eigensolver`` measure a cluster at a load: at the equilibrium near ``guess``."""

    def __init__(self, solver: StaticSolver, eigensolver: NonsymmetricSolver, guess: PETSc.Vec) -> None:
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
