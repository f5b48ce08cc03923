"""Curves of eigenvalues against the load of a sweep: which goes on from which, and the load at which two collide.

Curves cross where two motions have nothing to do with one another and their eigenvalues pass by each other, and meet
where two become a complex pair.  Eigenvalues alone do not distinguish the two; eigenvectors do.  A vector goes on from
a curve as far as it lies in the span of that curve's vectors at the load before, in the mass: all of them, where an
eigenvalue is multiple.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from warnings import catch_warnings, simplefilter

import numpy as np
from mpi4py import MPI
from numpy.polynomial import chebyshev

from rodfem.continuation.crossings import REAL
from rodfem.errors import ConvergenceError
from rodfem.stability.cluster import Cluster, Measured
from rodfem.stability.nonsymmetric import ALIKE, Frequencies, groups, orthonormal, product, squares
from rodfem.tolerances import ROUND_OFF, TINY, unit

SHARP, ENOUGH = 1e-11, 1e-8
"""Uncertainties of a load, relative to it, at which the search ends: at once, and at an interval that is no better."""
NODES = np.cos(np.pi * (np.arange(6)[::-1] + 0.5) / 6)
"""Places at which a number is interpolated, on [-1, 1]."""
OUTSIDE = 1.5
"""Distance from the middle, in half lengths of its interval, up to which a series is extrapolated to a zero."""

AROUND = (1e-4, 1e-5, 1e-6)  # half widths, relative to a divergence load, over which its eigenvalues are sampled

AtLoad = Callable[[float, Cluster], Measured]
Number = Callable[[float], float]


class Curves:
    """Numbers the curves of eigenvalues from one load to the next."""

    def __init__(self, comm: MPI.Comm) -> None:
        """Begin without any curve; the ranks of ``comm`` share the rod."""
        self.comm, self.count = comm, 0
        self._last: Frequencies | None = None
        self._numbers: list[int] = []
        self._basis = np.zeros((0, 0))
        self._span = self._begin = np.zeros(0, dtype=int)

    def numbers(self, found: Frequencies, *, keep: bool = True) -> list[int]:
        """Numbers of the curves of eigenvalues found at a state, which go on from the load before.

        Without ``keep`` the next load goes on from the one before all the same.
        """
        numbers = [-1] * len(found.values)
        last = self._last
        energy = np.maximum(squares(self.comm, found.vectors, found.weighed), TINY)
        if last is not None:
            cost = self._distances(last, found, abs(product(self.comm, self._basis, found.weighed)) ** 2 / energy)
            rows, columns = assignment(cost)
            for i, j, c in zip(rows.tolist(), columns.tolist(), cost[rows, columns].tolist(), strict=True):
                if c < 1.0:  # else another curve begins
                    numbers[j] = self._numbers[i]
        fresh = [j for j, number in enumerate(numbers) if number < 0]
        for j in fresh:
            numbers[j] = self.count
            self.count += 1
        if keep:
            self._last, self._numbers = found, numbers
            self._keep(found, energy)
        return numbers

    def _distances(self, last: Frequencies, found: Frequencies, parts: np.ndarray) -> np.ndarray:
        """Share of each vector found outside the span of each one before, plus the relative change of the values.

        ``parts`` are its shares along the vectors of those spans.
        """
        outside = 1.0 - np.minimum(np.add.reduceat(parts, self._begin, axis=0), 1.0)[self._span]
        a, b = last.values[:, None], found.values[None, :]
        return np.asarray(outside + abs(a - b) / np.maximum(np.maximum(abs(a), abs(b)), min(found.one, found.natural)))

    def _keep(self, found: Frequencies, energy: np.ndarray) -> None:
        """Keep a basis of the span of each group of equal eigenvalues, orthonormal in the mass."""
        together = groups(found.values, found.far, ALIKE)
        self._span = np.empty(len(found.values), dtype=int)
        for number, group in enumerate(together):
            self._span[group] = number
        sizes = [len(group) for group in together]
        self._begin = np.cumsum([0, *sizes[:-1]])
        order = [j for group in together for j in group]
        self._basis = (found.vectors / np.sqrt(energy))[:, order]
        for group, begin in zip(together, self._begin.tolist(), strict=True):
            if len(group) > 1:
                spanned = orthonormal(self.comm, found.vectors[:, group], found.weighed[:, group])
                self._basis[:, begin : begin + len(group)] = spanned


def assignment(cost: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows and columns, a pair for each of the fewer, whose entries in ``cost`` (m, k) have the least sum."""
    from scipy.optimize import linear_sum_assignment  # slow to load

    rows, columns = linear_sum_assignment(cost)
    return np.asarray(rows), np.asarray(columns)


@dataclass(frozen=True)
class Located:
    """Load of a collision, and the ``cluster`` there."""

    load: float
    uncertainty: float  # for the given mesh
    cluster: Cluster
    slope: float  # derivative of D in the load
    drift: float  # derivative of the mean
    left: float  # what its interpolation leaves open of the mean
    clear: float  # a load near by at which the eigenvalues are apart


def locate_flutter(at: AtLoad, cluster: Cluster, load: float, width: float) -> Located:
    """Load at which ``D`` of a cluster vanishes, from about ``load``; raises :class:`ConvergenceError`.

    Chebyshev interpolation on a piece, of the half length ``width`` at first, that is moved to the zero and shrunk
    until the last coefficient says that it is sharp.  The cluster is that where its eigenvalues are farthest apart.
    """
    best, clear, half = Located(load, np.inf, cluster, *3 * (np.nan,), load), load, width
    for _ in range(12):
        found = [(at(node, cluster), node) for node in (load + half * NODES).tolist()]
        clearest, node = max(found, key=lambda pair: pair[0].spread)
        if clearest.spread > 1e-6:  # their vectors span the invariant subspace well
            cluster, clear = clearest.cluster, node
        series, means = _series(found)
        root = real_root(series)
        if root is None:
            load += half * _secant(found[0][0].discriminant, found[-1][0].discriminant)
            continue
        load += half * root
        cluster = Cluster(cluster.basis, float(chebyshev.chebval(root, means)))
        uncertainty = max(half * zero_uncertainty(series, root, in_doubt(series)), ROUND_OFF * abs(load))
        better = abs(root) < 1 and uncertainty < best.uncertainty
        if better:
            slope, drift = _rate(series, root) / half, _rate(means, root) / half
            best = Located(load, uncertainty, cluster, slope, drift, in_doubt(means), clear)
        if best.uncertainty < (SHARP if better else ENOUGH) * abs(load):
            break
        half /= 4
    if not np.isfinite(best.uncertainty):
        raise ConvergenceError(f"The flutter load near {load:.6g} could not be located: use a smaller range.")
    return best


def interpolated_zero(mean: Number, noise: Number, load: float, one: float) -> tuple[float, float]:
    """Load near ``load`` at which a ``mean`` of eigenvalues vanishes, and what its ``noise`` leaves open.

    Both are functions of the load, of natural size ``one``; raises :class:`ConvergenceError`.
    """
    found = list[tuple[float, float]]()
    for half in (width * unit(load, one=one) for width in AROUND):
        try:
            series = interpolant([mean(load + half * t) for t in NODES.tolist()])
            root = real_root(series)
            if root is None:
                continue
            doubt = in_doubt(series) + noise(load + half * root)
        except ConvergenceError:
            continue
        found.append((half * zero_uncertainty(series, root, doubt), load + half * root))
        if found[-1][0] < ENOUGH * unit(load, one=one):
            break
    if not found:
        raise ConvergenceError(f"The divergence load near {load:.6g} could not be located: use a smaller range.")
    uncertainty, at = min(found)
    return at, uncertainty


def zero_near(mean: Number, noise: Number, load: float, one: float) -> tuple[float, float]:
    """The same on another mesh than that of a ``load``, by secants first."""
    from scipy.optimize import newton  # slow to load

    step = AROUND[-1] * unit(load, one=one)
    with catch_warnings():  # two equal values end the secants
        simplefilter("ignore", RuntimeWarning)
        near = newton(mean, load, x1=load + step, tol=step, full_output=True, disp=False)[0]
    return interpolated_zero(mean, noise, float(near), one)


def _series(found: Sequence[tuple[Measured, float]]) -> tuple[np.ndarray, np.ndarray]:
    """Series of ``D``, and of the mean of the cluster."""
    return interpolant([f.discriminant for f, _ in found]), interpolant([f.cluster.mean for f, _ in found])


def _secant(first: float, last: float) -> float:
    """Zero of a line with these values at -1 and 1, at most 2 away from the middle; there where it is level."""
    return 2 * float(np.clip((first + last) / 2 / (first - last), -1, 1)) if first != last else 0.0


def _rate(series: np.ndarray, at: float) -> float:
    """Derivative of a Chebyshev series."""
    return float(chebyshev.chebval(at, chebyshev.chebder(series)))


def interpolant(values: Sequence[float]) -> np.ndarray:
    """Chebyshev series on [-1, 1] through values at the :data:`NODES`."""
    return chebyshev.chebfit(NODES, values, len(NODES) - 1)


def real_root(series: np.ndarray) -> float | None:
    """Real zero nearest to the middle of a Chebyshev series on [-1, 1], or a little outside; None without one."""
    roots = chebyshev.chebroots(series)
    real = roots[(abs(roots.imag) < REAL) & (abs(roots.real) <= OUTSIDE)].real
    return float(real[np.argmin(abs(real))]) if len(real) else None


def zero_uncertainty(series: np.ndarray, root: float, doubt: float) -> float:
    """How far a ``doubt`` about values of a Chebyshev series can move its ``root``."""
    slope = _rate(series, root)
    return doubt / abs(slope) if slope else float("inf")


def in_doubt(series: np.ndarray) -> float:
    """Size of what a Chebyshev series leaves open of values that are measured: its last coefficient, or their noise.

    Coefficients that do not decay are those of noise, of which the last one is small as often as not: an eigenvalue
    near zero along a whole branch moves by much of itself with what Newton's method leaves of a state.
    """
    before, between, last = abs(series[-3:])
    return float(last if 100 * last < before else 5 * max(before, between, last))
