"""Collisions of eigenvalues between two loads of a sweep, and zeros of the mean of a cluster of them.

A complex pair at one load goes on from that at the other one whose plane has its vectors, and whose value is near.
Another one comes from two real eigenvalues that meet on the way.  They are followed by their invariant subspace.  The
mean of eigenvalues that pass through zero together is smooth in the load.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from warnings import catch_warnings, simplefilter

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.eigenvalue_curves import assignment
from rodfem.continuation.flutter import (
    ENOUGH,
    NODES,
    Located,
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
from rodfem.tolerances import TINY, round_off, unit

SAME = 1e-9
"""Loads, or eigenvalues, that differ by less than this, relative to them, are one."""
JUST_MET = 1e-4
"""Imaginary part, relative to the eigenvalue, below which a pair may be two real ones that meet, and round-off."""
MOVED, OUTSIDE = 0.3, 0.2
"""Change of a complex eigenvalue, relative, and share of its vector outside a pair's plane, of another one."""
SECANT = 1e-6
"""Relative distance of the first two loads of a secant method."""
AROUND = (1e-4, 1e-5, 1e-6)
"""Half widths, relative to a divergence load, over which its eigenvalues are sampled."""


@dataclass(frozen=True)
class Side:
    """One end of a step: its ``load``, the equilibrium ``x`` there, and its ``spectrum``."""

    load: float
    x: PETSc.Vec
    spectrum: Spectrum


@dataclass
class Critical:
    """A critical ``load`` of some ``kind``, before its state is evaluated, with a ``note``.

    Its ``cluster`` of eigenvalues collides or passes through zero at ``omega2``; ``still`` of them, those of rigid
    motions, are zero at all loads.  ``uncertainty`` is what the location leaves open of the load, ``change`` is that of
    the number of unstable eigenvalues.
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
class Findings:
    """What happens in a step: ``events``, what ``entered`` (less what left), and ``doubts``, in words, where not all.

    Complex eigenvalues that ``entered`` are complex at both loads, but by no more than round-off at the first one.
    """

    events: list[Critical] = field(default_factory=list)
    entered: int = 0
    doubts: list[str] = field(default_factory=list)

    def __add__(self, other: Findings) -> Findings:
        """What happens in two steps, one after the ``other``."""
        return Findings(self.events + other.events, self.entered + other.entered, self.doubts + other.doubts)


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
    """Finds the eigenvalues of a sweep that collide in a step."""

    def __init__(self, solver: BranchSolver, eigensolver: NonsymmetricSolver) -> None:
        """Take equilibria from the ``solver``, pencils from the ``eigensolver``."""
        self.solver, self.eigensolver = solver, eigensolver
        self.units, self._load = solver.system.scene.units, solver.system.scene.load

    def between(self, a: Side, b: Side) -> Findings:
        """Collisions between two loads, those at one and the same load together."""
        findings, common = Findings(), pairs_in_common(b.spectrum, a.spectrum)
        born = [i for i in b.spectrum.upper.tolist() if i not in common]
        gone = [i for i in a.spectrum.upper.tolist() if i not in common.values()]
        for sign, here, there, chosen in ((1, b, a, born), (-1, a, b, gone)):
            for group in groups(here.spectrum.values[chosen], np.inf, MULTIPLE):
                upper = [chosen[i] for i in group]
                try:
                    event = self._end(here, there, upper)
                except ConvergenceError as trouble:
                    findings.doubts.append(
                        f"The eigenvalue {here.spectrum.values[upper[0]]:.6g} at {self._load} = {here.load:.6g} was "
                        f"not followed to where it becomes complex ({str(trouble).rstrip('.')}): use a smaller range."
                    )
                    continue
                if event is None:
                    findings.entered += 2 * sign * len(upper)
                else:
                    event.change *= sign
                    self._add(findings, event, here)
        return findings

    def _add(self, findings: Findings, event: Critical, here: Side) -> None:
        """Take a collision, followed from ``here``, together with others at its load; none is to be found twice."""
        same = [e for e in findings.events if abs(e.load - event.load) < SAME * unit(e.load, one=self.units.load)]
        if not same:
            findings.events.append(event)
            return
        known = same[0]
        if known.change * event.change > 0 and self._common(known, event, here) > 0.5:
            findings.doubts.append(
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
        """Collision, on the way ``there``, of pairs complex ``here``; None if, by round-off, they are so there, too."""
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
        """Collision of a cluster between two loads, which may have ``just_met``; raises :class:`ConvergenceError`."""
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
    """A cluster of eigenvalues against the load: at the equilibrium near a ``guess``."""

    def __init__(self, solver: BranchSolver, eigensolver: NonsymmetricSolver, guess: PETSc.Vec) -> None:
        """Compute nothing yet."""
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
    """Collision of a ``measured`` ``cluster``, from about a ``load`` on, in pieces of the half ``width`` at first.

    Round-off of the matrix counts (see :func:`~rodfem.continuation.flutter.locate_flutter`).  So does that pairs that
    are taken for one may meet at loads, and at eigenvalues, of their own.  Raises :class:`ConvergenceError`.
    """
    found = locate_flutter(measured, cluster, load, width)
    noise, clear = measured.noise(found.clear, found.cluster), measured(found.clear, found.cluster)
    moved = (noise.of_discriminant + clear.split) / abs(found.slope)
    left = noise.of_mean + clear.split / max(2 * float(np.sqrt(abs(clear.discriminant))), TINY)
    return replace(found, uncertainty=found.uncertainty + moved, left=found.left + left)


@dataclass(frozen=True)
class Mean:
    """Mean of the eigenvalues of a ``measured`` ``cluster`` against the load, ``still`` of which are zero at all loads.

    Vectors of those are no better than round-off: where there are any, the eigenvalues nearest zero are taken.
    """

    measured: Measuring
    cluster: Cluster
    still: int

    def __call__(self, load: float) -> float:
        """Mean at a load; raises :class:`ConvergenceError` where the cluster is not found."""
        if not self.still:
            return self.measured(load, self.cluster).cluster.mean
        pencil, size = self.measured.pencil(load), self.cluster.size
        values = pencil.near(size + 2, SHIFT * pencil.system.scene.units.omega2).values
        return float(values[np.argsort(abs(values), kind="stable")[:size]].real.mean())

    def noise(self, load: float) -> float:
        """Round-off of the matrix in the mean, which does not scatter; unknown, and zero, where some are zero."""
        return 0.0 if self.still else self.measured.noise(load, self.cluster).mean


def interpolated_zero(mean: Mean, load: float, one: float) -> tuple[float, float]:
    """Load near ``load`` at which a ``mean`` of eigenvalues vanishes, and what its round-off leaves open.

    At loads of natural size ``one`` it is sampled over the widest of :data:`AROUND`, and interpolated: its scatter
    shows in the last coefficients.  Where a collision is as near, the mean is not smooth, or there is none: then over
    a narrower one.  Raises :class:`ConvergenceError` where it does not vanish near by.
    """
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
    """Load near ``load``, of natural size ``one``, at which a ``mean`` vanishes, and what its round-off leaves open.

    By secants; raises :class:`ConvergenceError` where it does not vanish near.
    """
    from scipy.optimize import newton  # slow to load

    step = SECANT * unit(load, one=one)
    with catch_warnings():  # two equal values end the secants
        simplefilter("ignore", RuntimeWarning)
        found, result = newton(mean, load, x1=load + step, tol=round_off(load, one), full_output=True, disp=False)
    slope = (mean(found + step) - mean(found - step)) / (2 * step)
    left = mean.noise(found)
    if not result.converged:  # round-off of the mean may be more than the tolerance
        left = max(left, abs(mean(found)))
        if left > step * abs(slope):
            raise ConvergenceError(f"No divergence load was found near {load:.6g}: use a smaller range.")
    return float(found), abs(left / slope)
