"""The load at which eigenvalues of a rod under loads without a potential collide, between two loads of a sweep."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import chebyshev

from rodfem.continuation.interpolant import SHARP, in_doubt, real_root, zero_uncertainty
from rodfem.errors import ConvergenceError
from rodfem.stability.cluster import Cluster, Measured
from rodfem.tolerances import ROUND_OFF

RANK = 1e-6
"""Relative distance of eigenvalues above which their vectors span their invariant subspace well."""
ENOUGH = 1e-8
"""Uncertainty of a load, relative to it, at which an interval that is no better than the last one ends the search."""

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
    half, best, clear = width, Located(load, np.inf, cluster, *3 * (np.nan,), load), load
    t = np.cos(np.pi * (np.arange(6)[::-1] + 0.5) / 6)
    for _ in range(12):
        nodes = [float(node) for node in load + half * t]
        found = [at(node, cluster) for node in nodes]
        d, mean = np.array([f.discriminant for f in found]), np.array([f.cluster.mean for f in found])
        series = chebyshev.chebfit(t, d, 5)
        root = real_root(series, 0.0)
        clearest, node = max(zip(found, nodes, strict=True), key=lambda pair: pair[0].spread)
        if clearest.spread > RANK:
            cluster, clear = clearest.cluster, node
        if root is None:
            slope = (d[-1] - d[0]) / (2 * half)
            if not slope:
                break
            load += float(np.clip(-(d[0] + d[-1]) / 2 / slope, -2 * half, 2 * half))
            continue
        load += half * root
        means = chebyshev.chebfit(t, mean, 5)
        cluster = Cluster(cluster.basis, float(chebyshev.chebval(root, means)))
        uncertainty = max(half * zero_uncertainty(series, root, in_doubt(series)), ROUND_OFF * abs(load))
        if abs(root) < 1 and uncertainty < best.uncertainty:
            slope, drift = (float(chebyshev.chebval(root, chebyshev.chebder(f))) / half for f in (series, means))
            best = Located(load, uncertainty, cluster, slope, drift, in_doubt(means), clear)
        elif best.uncertainty < ENOUGH * abs(load):
            break
        if best.uncertainty < SHARP * abs(load):
            break
        half /= 4
    if not np.isfinite(best.uncertainty):
        raise ConvergenceError(f"The flutter load near {load:.6g} could not be located: use a smaller range.")
    return best
