"""Collisions of eigenvalues between two loads of a sweep, and zeros of the mean of a cluster of them.

A complex pair at one load goes on from that at the other one whose plane has its vectors, and whose value is near.
Another one comes from two real eigenvalues that meet on the way.  They are followed by their invariant subspace.  The
mean of eigenvalues that pass through zero together is smooth in the load.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from warnings import catch_warnings, simplefilter

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.eigenvalue_curves import (
    ENOUGH,
    NODES,
    Located,
    assignment,
    in_doubt,
    interpolant,
    locate_flutter,
    real_root,
    zero_uncertainty,
)
from rodfem.continuation.kinds import FLUTTER, Kind
from rodfem.diagram.equilibria import at_load
from rodfem.errors import ConvergenceError
from rodfem.stability.cluster import Cluster, ClusterNoise, Measured, measure, noise_of, real_span
from rodfem.stability.nonsymmetric import ALIKE, MULTIPLE, NonsymmetricPencil, NonsymmetricSolver, groups
from rodfem.stability.spectrum import SHIFT, Spectrum, inside
from rodfem.tolerances import SAME_LOAD, TINY, round_off, unit

JUST_MET = 1e-4
"""Imaginary part, relative to the eigenvalue, below which a pair may be two real ones that meet, and round-off."""
MOVED, OUTSIDE = 0.3, 0.2
"""Change of a complex eigenvalue, relative, and share of its vector outside a pair's plane, of another one."""
AROUND = (1e-4, 1e-5, 1e-6)  # half widths, relative to a divergence load, over which its eigenvalues are sampled


@dataclass(frozen=True)
class Side:
    """One end of a step: its ``load``, the equilibrium ``x`` there, and its ``spectrum``."""

    load: float
    x: PETSc.Vec
    spectrum: Spectrum


@dataclass
class Critical:
    """A critical load, before its state is evaluated, at which a cluster of eigenvalues collides or passes zero.

    ``change`` is that of the number of unstable eigenvalues; ``zeros`` of the cluster, those of rigid motions, are
    zero at all loads.  Without a cluster round-off hides the collision: the pair is complex at both ends of the step.
    """

    kind: Kind
    load: float
    change: int
    uncertainty: float
    omega2: float
    cluster: Cluster | None = None
    note: str = ""
    zeros: int = 0


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


def cluster_at(pencil: NonsymmetricPencil, spectrum: Spectrum, places: list[int]) -> Cluster:
    """Cluster of some eigenvalues of a state's ``spectrum``, and the conjugates of complex ones."""
    found = pencil.of(spectrum, np.array(places))
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


class Collisions:
    """Finds the eigenvalues of a sweep that collide in a step."""

    def __init__(self, solver: BranchSolver, eigensolver: NonsymmetricSolver) -> None:
        self.solver, self.eigensolver = solver, eigensolver
        self.units, self._load = solver.system.scene.units, solver.system.scene.load

    def between(self, a: Side, b: Side) -> list[Critical]:
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
            raise ConvergenceError(
                f"Two pairs end in one collision at {self._load} = {event.load:.8g}: use a smaller range."
            )
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
                if 0 < D < (ALIKE * scale) ** 2:
                    return self._at_once(here, there, other)
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
        values = pencil.near(size + 2, SHIFT * pencil.system.scene.units.omega2).values
        return float(values[np.argsort(abs(values), kind="stable")[:size]].real.mean())

    def noise(self, load: float) -> float:
        """Round-off of the matrix in the mean, which does not scatter; unknown, and zero, where some are zero."""
        return 0.0 if self.zeros else self.measured.noise(load, self.cluster).mean


def interpolated_zero(mean: Mean, load: float, one: float) -> tuple[float, float]:
    """Load near ``load`` at which a ``mean`` of eigenvalues vanishes, and what its round-off leaves open."""
    found = list[tuple[float, float]]()
    for half in (width * unit(load, one=one) for width in AROUND):
        try:
            series = interpolant([mean(load + half * t) for t in NODES.tolist()])
            root = real_root(series)
            if root is None:
                continue
            doubt = in_doubt(series) + mean.noise(load + half * root)
        except ConvergenceError:
            continue
        found.append((half * zero_uncertainty(series, root, doubt), load + half * root))
        if found[-1][0] < ENOUGH * unit(load, one=one):
            break
    if not found:
        raise ConvergenceError(f"The divergence load near {load:.6g} could not be located: use a smaller range.")
    uncertainty, at = min(found)
    return at, uncertainty


def zero_near(mean: Mean, load: float, one: float) -> tuple[float, float]:
    """The same on another mesh than that of a ``load``, by secants first."""
    from scipy.optimize import newton  # slow to load

    step = AROUND[-1] * unit(load, one=one)
    with catch_warnings():  # two equal values end the secants
        simplefilter("ignore", RuntimeWarning)
        near = newton(mean, load, x1=load + step, tol=step, full_output=True, disp=False)[0]
    return interpolated_zero(mean, float(near), one)
