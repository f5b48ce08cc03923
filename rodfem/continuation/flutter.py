"""The load at which eigenvalues of a rod under loads without a potential collide, between two loads of a sweep."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import chebyshev

from rodfem.continuation.crossings import REAL
from rodfem.errors import ConvergenceError
from rodfem.stability.cluster import Cluster, Measured
from rodfem.tolerances import ROUND_OFF

RANK = 1e-6
"""Relative distance of eigenvalues above which their vectors span their invariant subspace well."""
ENOUGH = 1e-8
"""Uncertainty of a load, relative to it, at which an interval that is no better than the last one ends the search."""

NODES = np.cos(np.pi * (np.arange(6)[::-1] + 0.5) / 6)
"""Places at which a number is interpolated, on [-1, 1]."""
SHARP = 1e-11
"""Uncertainty of a load, relative to it, at which the search ends."""
DECAY, NOISY = 100.0, 5.0
"""Ratio of a coefficient to the last but one after it above which a series decays; safety factor where it does not."""
OUTSIDE = 1.5
"""Distance from the middle, in half lengths of its interval, up to which a series is extrapolated to a zero."""

AtLoad = Callable[[float, Cluster], Measured]


@dataclass(frozen=True)
class Located:
    """Load of a collision, its ``uncertainty`` for the given mesh, and the ``cluster`` there.

    ``slope`` is the derivative of ``D`` in the load, ``drift`` that of the mean, and ``left`` what its interpolation
    leaves open of the mean.  At the load ``clear``, near by, the eigenvalues are apart.
    """

    load: float
    uncertainty: float
    cluster: Cluster
    slope: float
    drift: float
    left: float
    clear: float

    @property
    def mean_uncertainty(self) -> float:
        """Uncertainty of the mean of the cluster."""
        return self.left + abs(self.drift) * self.uncertainty


def locate_flutter(at: AtLoad, cluster: Cluster, load: float, width: float) -> Located:
    """Load at which ``D`` of a cluster vanishes, from about ``load``; raises :class:`ConvergenceError`.

    Chebyshev interpolation on a piece that is moved to the zero and shrunk until the last coefficient says that it is
    sharp.  The cluster is taken over from where its eigenvalues are farthest apart.  ``at`` computes eigenvalues at a
    load, ``width`` is the first half length of the piece, in the load.
    """
    best, clear, half = Located(load, np.inf, cluster, *3 * (np.nan,), load), load, width
    for _ in range(12):
        nodes = [float(node) for node in load + half * NODES]
        found = [at(node, cluster) for node in nodes]
        clearest, node = max(zip(found, nodes, strict=True), key=lambda pair: pair[0].spread)
        if clearest.spread > RANK:
            cluster, clear = clearest.cluster, node
        series, means = interpolant([f.discriminant for f in found]), interpolant([f.cluster.mean for f in found])
        root = real_root(series)
        if root is None:
            load += half * _secant(found[0].discriminant, found[-1].discriminant)
            continue
        load += half * root
        cluster = Cluster(cluster.basis, float(chebyshev.chebval(root, means)))
        uncertainty = max(half * zero_uncertainty(series, root, in_doubt(series)), ROUND_OFF * abs(load))
        better = abs(root) < 1 and uncertainty < best.uncertainty
        if better:
            slope, drift = (float(chebyshev.chebval(root, chebyshev.chebder(f))) / half for f in (series, means))
            best = Located(load, uncertainty, cluster, slope, drift, in_doubt(means), clear)
        if best.uncertainty < (SHARP if better else ENOUGH) * abs(load):
            break
        half /= 4
    if not np.isfinite(best.uncertainty):
        raise ConvergenceError(f"The flutter load near {load:.6g} could not be located: use a smaller range.")
    return best


def _secant(first: float, last: float) -> float:
    """Zero of a line with these values at -1 and 1, at most 2 away from the middle; there where it is level."""
    return 2 * float(np.clip((first + last) / 2 / (first - last), -1, 1)) if first != last else 0.0


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
    slope = float(chebyshev.chebval(root, chebyshev.chebder(series)))
    return doubt / abs(slope) if slope else float("inf")


def in_doubt(series: np.ndarray) -> float:
    """Size of what a Chebyshev series leaves open of values that are measured: its last coefficient, or their noise.

    Coefficients that do not decay are those of noise, of which the last one is small as often as not: an eigenvalue
    near zero along a whole branch moves by much of itself with what Newton's method leaves of a state.
    """
    before, between, last = abs(series[-3:])
    return float(last if DECAY * last < before else NOISY * max(before, between, last))
