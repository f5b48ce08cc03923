"""Error bars of the special points of a sweep, by a richer discretisation."""

from __future__ import annotations

import numpy as np
from petsc4py import PETSc

from rodfem.adaptivity.error_estimate import OrdinateBound, bound
from rodfem.continuation.branch import SpecialPoint
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.kinds import DIVERGENCE, FLUTTER
from rodfem.diagram.collisions import Mean, Measuring, located_flutter, zero_near
from rodfem.diagram.equilibria import at_load
from rodfem.fem.shape import Transfer, halved, richer_system
from rodfem.stability.cluster import Cluster, as_vectors
from rodfem.stability.nonsymmetric import NonsymmetricSolver
from rodfem.tolerances import ROUND_OFF, round_off

WIDTH = 0.01
"""Half width of the piece on which a flutter load is looked for, relative to it or to the range."""
MEAN = 10.0
"""Round-off of the mean of two eigenvalues that meet, relative to it, over that of the load."""


class SweepErrors:
    """Estimates the errors of special points on the mesh of one solver, over a ``span`` of loads."""

    def __init__(self, solver: BranchSolver, span: tuple[float, float]) -> None:
        """Make the richer discretisation."""
        self.solver, self.span, self.units = solver, span, solver.system.scene.units
        system = solver.system
        self.richer = BranchSolver(richer_system(system))
        self.eigensolver = NonsymmetricSolver(self.richer.system)
        self.transfer = Transfer(system, self.richer.system)
        self.rho = halved(system.fields.discretization.degree)
        self.ordinate = OrdinateBound(solver.shape, self.richer.shape)

    def estimate(self, s: SpecialPoint) -> None:
        """Set all error bars of a special point, or none: then raises :class:`~rodfem.errors.ConvergenceError`."""
        point, richer, rho = s.point, self.richer, self.rho
        guess = self.transfer(point.x, state=True)
        x = at_load(richer, guess, point.load)
        left = round_off(point.ordinate, self.units.ordinate)
        of_ordinate = of_load = self.ordinate(point.x, x, left, rho)
        if s.kind == FLUTTER:
            load, left, mu, doubt = self._flutter(guess, s)
            of_load = max(bound(point.load, load, left, rho), s.located_to)
            s.omega2_error = bound(s.omega2, mu, max(doubt, MEAN * abs(mu) * ROUND_OFF), rho)
        elif s.kind == DIVERGENCE:
            cluster = self._cluster(s)
            still = cluster.size - abs(s.negative_after - s.negative_before)
            mean = Mean(Measuring(richer, self.eigensolver, x), cluster, still)
            load, left = zero_near(mean, point.load, self.units.load)
            of_load = max(bound(point.load, load, max(left, s.located_to), rho), s.located_to)
        if s.kind in (FLUTTER, DIVERGENCE):
            of_ordinate += self._moved(x, s, of_load)
        s.error_estimate, s.ordinate_error = of_load, of_ordinate  # none of them where one is not estimated

    def _moved(self, x: PETSc.Vec, s: SpecialPoint, bar: float) -> float:
        """Change of the ordinate from ``x`` on over the ``bar`` of a special point's load, up to half of the range."""
        low, high = sorted(self.span)
        step = min(bar, (high - low) / 2) * (1.0 if s.point.load < (low + high) / 2 else -1.0)
        moved = at_load(self.richer, x, s.point.load + step)
        return abs(self.richer.shape.ordinate(moved) - self.richer.shape.ordinate(x))

    def _cluster(self, s: SpecialPoint) -> Cluster:
        """The cluster of a special point on the richer discretisation."""
        assert s.cluster is not None
        vectors = as_vectors(self.solver.system, s.cluster.basis)
        columns = [self.transfer(v, state=False).array_r.real for v in vectors]
        return Cluster(np.stack(columns, axis=1), s.cluster.mean)

    def _flutter(self, guess: PETSc.Vec, s: SpecialPoint) -> tuple[float, float, float, float]:
        """Flutter load on the richer discretisation, its uncertainty there, the double eigenvalue and that of it."""
        measured, cluster = Measuring(self.richer, self.eigensolver, guess), self._cluster(s)
        if s.note:  # double there, whatever the mesh
            return s.point.load, 0.0, measured(s.point.load, cluster).cluster.mean, 0.0
        width = WIDTH * max(abs(s.point.load), abs(self.span[1] - self.span[0]))
        located = located_flutter(measured, cluster, s.point.load, width)
        return located.load, located.uncertainty, located.cluster.mean, located.mean_uncertainty
