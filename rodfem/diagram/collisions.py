"""Loads at which a cluster of eigenvalues of a sweep collides, or its mean vanishes.

Eigenvalues are followed by their invariant subspace.  The mean of those that pass through zero together is smooth in
the load.
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
    in_doubt,
    interpolant,
    locate_flutter,
    real_root,
    zero_uncertainty,
)
from rodfem.continuation.kinds import Kind
from rodfem.diagram.equilibria import at_load
from rodfem.errors import ConvergenceError
from rodfem.stability.cluster import Cluster, ClusterNoise, Measured, measure, noise_of, real_span
from rodfem.stability.nonsymmetric import NonsymmetricPencil, NonsymmetricSolver
from rodfem.stability.spectrum import SHIFT, Spectrum
from rodfem.tolerances import TINY, unit

AROUND = (1e-4, 1e-5, 1e-6)  # half widths, relative to a divergence load, over which its eigenvalues are sampled


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
