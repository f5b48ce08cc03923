"""Loads of flutter and of divergence between two loads of a sweep.

Where two real ones collide and become a complex pair, the square of half
their difference ``D = ((mu1 - mu2)/2)^2`` passes through zero.  Unlike the eigenvalues, which have a square root
there, ``D`` is a smooth function of the load: the discriminant of the pencil projected on the two of them.  Its zero
is found by Chebyshev interpolation, at spectral accuracy and without ever solving at the double eigenvalue.  Where a
single real one passes through zero the rod diverges: the eigenvalue itself is smooth there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.polynomial import chebyshev
from petsc4py import PETSc

from rodfem.continuation.branch import Point
from rodfem.continuation.flutter import ENOUGH, Located, locate_flutter, unmatched
from rodfem.continuation.interpolant import SHARP, in_doubt, real_root, zero_uncertainty
from rodfem.continuation.kinds import DIVERGENCE, FLUTTER, Kind
from rodfem.continuation.static_solver import StaticSolver
from rodfem.diagram.frequency_rows import Row, leftmost
from rodfem.diagram.held import at_load
from rodfem.errors import ConvergenceError
from rodfem.roots import zero_between
from rodfem.stability.cluster import Cluster, Measured, cluster_of, measure
from rodfem.stability.cluster_noise import ClusterNoise, noise_of
from rodfem.stability.frequencies import MULTIPLE, REAL, Frequencies
from rodfem.stability.nonsymmetric import SHIFT, NonsymmetricPencil, NonsymmetricSolver
from rodfem.tolerances import ROUND_OFF, round_off, unit

SAME = 1e-9
"""Loads, or eigenvalues, that differ by less than this, relative to them, are one."""
BESIDE = 1e-6
"""Relative distance of the first two loads of a secant method."""
AROUND = (1e-4, 1e-5, 1e-6)
"""Half widths, relative to a divergence load, over which its eigenvalues are sampled."""
CLEAR = 1e-4
"""Distance from a collision, relative to a step of the sweep, at which its eigenvalues are counted: they are apart."""
TOGETHER = 1e-6
"""Divergence loads that differ by less than this, relative, are those of a multiple eigenvalue with its round-off."""


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


class CriticalLoads:
    """Locates the critical loads between two loads of a sweep."""

    def __init__(
        self, solver: StaticSolver, eigensolver: NonsymmetricSolver, number: int, warn: Callable[[str], None]
    ) -> None:
        """Know what computes equilibria (``solver``) and their ``number`` of eigenvalues, and whom to ``warn``.

        The ``eigensolver`` is that of the pencils.
        """
        self.solver, self.eigensolver, self.number, self.warn = solver, eigensolver, number, warn
        self.units, self._load, self._still = solver.system.scene.units, solver.system.scene.load, 0

    def between(self, first: Row, second: Row) -> list[Critical]:
        """Critical loads between two rows, in their order: eigenvalues that collide, real ones that pass through zero.

        Where the rows are neighbours, ``first`` comes before ``second`` in the sweep.
        """
        (a, before), (b, after) = ((row.point, row.found) for row in (first, second))
        self._before, self._still = after, min(before.still(), after.still())
        events = self._collisions(a, b, before, after)
        negative = [event for event in events if event.omega2 < 0]
        for event in negative:  # both are unstable before and after
            event.change = 0
        known = {a.load: before, b.load: after}
        for piece in self._pieces(a, b, [event.load for event in negative]):
            counts = [(known[x] if x in known else self._near(a.x, x)).diverged() for x in piece]
            events += self._diverging(a.x, piece, *counts)
        return sorted(events, key=lambda e: abs(e.load - a.load))

    @staticmethod
    def _pieces(a: Point, b: Point, collisions: list[float]) -> list[tuple[float, float]]:
        """Ranges of the load between ``a`` and ``b``, in their order, in which no two negative eigenvalues collide.

        Where two do, fewer are real on one side: what passes through zero has another number in ascending order.
        """
        width, edges = b.load - a.load, [a.load]
        for load in sorted(collisions, key=lambda x: abs(x - a.load)):
            edges += [load - CLEAR * width, load + CLEAR * width]
        edges.append(b.load)
        return [(x, y) for x, y in zip(edges[::2], edges[1::2], strict=True) if (y - x) * width > 0]

    def _collisions(self, a: Point, b: Point, before: Frequencies, after: Frequencies) -> list[Critical]:
        """Collisions between two loads, those at one and the same load together."""
        events: list[Critical] = []
        for here, there, found, others, sign in ((b, a, after, before, 1), (a, b, before, after, -1)):
            for chosen in unmatched(found, others.values):
                try:
                    event = self._collision(here, there, found, chosen)
                except ConvergenceError as trouble:
                    value = found.values[chosen[0]]
                    self.warn(
                        f"The eigenvalue {value:.6g} at {self._load} = {here.load:.6g} was not "
                        f"followed to where it becomes complex ({str(trouble).rstrip('.')}): use a smaller range."
                    )
                    continue
                if event is None:
                    continue
                event.change *= sign
                same = [e for e in events if abs(e.load - event.load) < SAME * unit(e.load, one=self.units.load)]
                if same:
                    same[0].change += event.change
                    if abs(event.omega2) < abs(same[0].omega2):
                        same[0].omega2, same[0].cluster = event.omega2, event.cluster
                else:
                    events.append(event)
        return events

    def _collision(self, here: Point, there: Point, found: Frequencies, chosen: list[int]) -> Critical | None:
        """Collision, on the way ``there``, of eigenvalues complex ``here``; None where they are complex there too."""
        cluster = cluster_of(self.eigensolver.at(here.x), found, chosen)
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
        if other.discriminant < 0:
            return None
        located = located_flutter(
            Measuring(self.solver, self.eigensolver, here.x),
            cluster,
            (there.load + here.load) / 2,
            abs(here.load - there.load),
        )
        return Critical(FLUTTER, located.load, cluster.size, located.uncertainty, located.cluster.mean, located.cluster)

    def _diverging(self, guess: PETSc.Vec, span: tuple[float, float], first: int, last: int) -> list[Critical]:
        """Locate the loads at which real eigenvalues pass through zero, from ``first`` negative ones to ``last``.

        At the loads of the ``span``, in the order of the sweep, so many are negative.
        """
        loads = sorted(span)
        found: list[float] = []
        for number in range(min(first, last), max(first, last)):

            def mu(load: float, number: int = number) -> float:
                return self._real(guess, load)[number]

            try:
                found.append(self._zero(mu, loads[0], loads[1]))
            except (ConvergenceError, IndexError, ValueError):
                self.warn(
                    f"Divergence between {span[0]:.6g} and {span[1]:.6g} could not be located: use a smaller range."
                )
                return []
        together: list[list[float]] = []
        for load in sorted(found):
            if together and abs(load - together[-1][0]) < TOGETHER * unit(load, one=self.units.load):
                together[-1].append(load)
            else:
                together.append([load])
        out = []
        for group in together:
            try:
                out.append(self._divergence(guess, group, loads, 1 if last > first else -1))
            except ConvergenceError as trouble:
                self.warn(str(trouble))
        return out

    def _zero(self, mu: Callable[[float], float], low: float, high: float) -> float:
        """Load at which ``mu`` vanishes: a bound where it does there but for noise, in which its sign says nothing."""
        for load in (low, high):
            if abs(mu(load)) <= REAL * self.units.omega2:
                return load
        return zero_between(mu, low, high, ROUND_OFF * max(abs(low), abs(high)))

    def _divergence(self, guess: PETSc.Vec, loads: list[float], bounds: list[float], sign: int) -> Critical:
        """Divergence of as many eigenvalues as ``loads``, where their mean, which is smooth, is zero.

        Those that are zero at all loads are among them: there they are not told apart, and they add nothing.  The load
        is within ``bounds``.
        """
        pencil, number = self.eigensolver.at(at_load(self.solver, guess, loads[0])), len(loads)
        size = number + self._still
        found = pencil.near(size + 2, SHIFT * self.units.omega2)
        cluster = cluster_of(pencil, found, np.argsort(abs(found.values), kind="stable")[:size].tolist())
        mean = Mean(Measuring(self.solver, self.eigensolver, guess), cluster, self._still)
        load, uncertainty = interpolated_zero(mean, loads[0], self.units.load)
        uncertainty = max(uncertainty, abs(loads[-1] - loads[0]), SHARP * unit(load, one=self.units.load))
        inside = min(max(load, bounds[0]), bounds[1])
        load, uncertainty = inside, uncertainty + abs(load - inside)
        return Critical(DIVERGENCE, load, sign * number, uncertainty, 0.0, cluster, still=self._still)

    def _real(self, guess: PETSc.Vec, load: float) -> list[float]:
        """Real eigenvalues at a load near the origin, in ascending order, but for those that are zero at all loads."""
        real = [v.real for v in self._near(guess, load).values if v.imag == 0]
        return sorted(sorted(real, key=abs)[self._still :])

    def _near(self, guess: PETSc.Vec, load: float) -> Frequencies:
        """Eigenvalues at a load near the origin, and what became of the complex ones after it."""
        return leftmost(self.eigensolver.at(at_load(self.solver, guess, load)), self.number, self._before)


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


def located_flutter(measured: Measuring, cluster: Cluster, load: float, width: float) -> Located:
    """Collision as :func:`~rodfem.continuation.flutter.locate_flutter` finds it; round-off of the matrix counts, too.

    Of a ``measured`` ``cluster``, from about the ``load`` on, in pieces of the half ``width`` at first.  Raises
    :class:`ConvergenceError` where that does.
    """
    found = locate_flutter(measured, cluster, load, width)
    noise = measured.noise(found.clear, found.cluster)
    moved = abs(noise.discriminant / found.slope)
    return replace(found, uncertainty=found.uncertainty + moved, left=found.left + noise.mean)


def interpolated_zero(mean: Mean, load: float, one: float) -> tuple[float, float]:
    """Load near ``load`` at which a ``mean`` of eigenvalues vanishes, and what its round-off leaves open.

    At loads of natural size ``one`` it is sampled over the widest of :data:`AROUND`, and interpolated: its scatter
    shows in the last coefficients.  Where a collision is as near, the mean is not smooth, or there is none: then over
    a narrower one.  Raises :class:`ConvergenceError` where it does not vanish near by.
    """
    nodes, found = np.cos(np.pi * (np.arange(6)[::-1] + 0.5) / 6), []
    for half in (width * unit(load, one=one) for width in AROUND):
        try:
            series = chebyshev.chebfit(nodes, [mean(load + half * t) for t in nodes.tolist()], 5)
            root = real_root(series, 0.0)
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
    """Load near ``load``, of natural size ``one``, at which a ``mean`` of eigenvalues vanishes.

    Also what round-off of the mean leaves open of it.
    """
    from scipy.optimize import newton  # slow to load

    step = BESIDE * unit(load, one=one)
    found = float(newton(mean, load, x1=load + step, tol=round_off(load, one)))
    slope = (mean(found + step) - mean(found - step)) / (2 * step)
    return found, abs(mean.noise(found) / slope)
