"""Loads at which the mean of a cluster of eigenvalues, which is smooth, passes through zero: divergence."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING
from warnings import catch_warnings, simplefilter

import numpy as np

from rodfem.continuation.flutter import ENOUGH, NODES, in_doubt, interpolant, real_root, zero_uncertainty
from rodfem.errors import ConvergenceError
from rodfem.stability.cluster import Cluster
from rodfem.stability.spectrum import SHIFT
from rodfem.tolerances import round_off, unit

if TYPE_CHECKING:
    from rodfem.diagram.collisions import Measuring

BESIDE = 1e-6
"""Relative distance of the first two loads of a secant method."""
AROUND = (1e-4, 1e-5, 1e-6)
"""Half widths, relative to a divergence load, over which its eigenvalues are sampled."""


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
    """Load near ``load``, of natural size ``one``, at which a ``mean`` of eigenvalues vanishes.

    Also what round-off of the mean leaves open of it.  Raises :class:`ConvergenceError` where it does not vanish near.
    """
    from scipy.optimize import newton  # slow to load

    step = BESIDE * unit(load, one=one)
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
