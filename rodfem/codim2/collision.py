r"""Where two frequencies of a rod under a load without a potential collide, in the plane of two parameters.

Two eigenvalues ``mu1``, ``mu2`` of the pencil ``S x = mu M x`` collide where ``D = ((mu1 - mu2)/2)^2`` vanishes (see
:mod:`rodfem.stability.cluster`: two pairs of equal ones where the rod bends alike in all planes).  The eigenvalues have
a square root there, but ``D`` is smooth in both parameters, so that ``D(a, b) = 0`` is a smooth curve as long as the
gradient of ``D`` does not vanish: the boundary of flutter (Seyranian & Mailybaev, *Multiparameter
Stability Theory with Mechanical Applications*, World Scientific 2003, chapters 2 and 5).  A point of it is found on a
given line of the plane by the secant method for ``D``, its tangent from central differences.  Pairs that are equal by
a symmetry have one ``D``; where they part, their mean is no boundary, and the curve ends.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace

import numpy as np
from petsc4py import PETSc

from rodfem.codim2.criteria import FEWER, SPLIT
from rodfem.codim2.plane import Destroyed, Guess, LocusPoint, Plane
from rodfem.codim2.unstable import UNSTABLE, unstable
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.errors import ConvergenceError
from rodfem.stability.cluster import Cluster, Measured, as_vectors, measure, noise_of
from rodfem.stability.nonsymmetric import NonsymmetricSolver
from rodfem.tolerances import ROUND_OFF

FIRST = 1e-4
"""First step of the secants, relative to the bounds."""
SHARP, NOISE = 1e-12, 1e-4
"""Steps of the secants that end them: by their own size, or where they no longer shrink."""
FAR = 1e-6
"""Step of the secants from which on they tell the slope of ``D``."""
DIFFERENCE = 1e-3
"""Step of the central differences of ``D``, relative to the bounds."""
INSIDE = 0.01
"""Greatest such step over the distance from what is not admissible, as a mass of zero: ``D`` has a pole there."""
Zero = tuple[float, float, Measured, PETSc.Vec]
"""Place of a zero of ``D`` on a line of parameters, its uncertainty, the cluster and the state there."""


class Collision:
    """Corrects points of the plane to where two eigenvalues near ``omega2`` collide."""

    others = UNSTABLE

    def __init__(self, solver: BranchSolver, plane: Plane) -> None:
        """Allocate the pencil."""
        self.solver, self.plane = solver, plane
        self.eigensolver = NonsymmetricSolver(solver.system)

    def length(self, dp: np.ndarray, dx: PETSc.Vec) -> float:
        """Size of a step: parameters over the widths of their bounds."""
        return float(np.linalg.norm(dp / self.plane.width))

    def correct(self, guess: Guess, near: LocusPoint, reach: float = 1.0) -> LocusPoint:
        """As :class:`~rodfem.codim2.plane.Criterion` says; the direction of the state plays no part.

        Raises :class:`ConvergenceError`, and :class:`Destroyed` where pairs that met at once do not any more.
        """
        node, here = self._onto(guess, near, reach)
        width, system, p, x, omega2 = self.plane.width, self.solver.system, node.p, node.x, node.omega2
        basis, forward = _basis(near), guess[2] / width
        gradient, clearest = np.zeros(2), here
        steps = np.minimum(DIFFERENCE, INSIDE * self.plane.room(p) / width)
        for which in (0, 1):
            system.line = self.plane.line(p, self.plane.axis(which))
            step = float(steps[which])
            low, high = (self._measured(h, x, Cluster(basis, omega2))[0] for h in (-step, step))
            gradient[which] = (high.discriminant - low.discriminant) / (2 * step)
            clearest = max((clearest, low, high), key=lambda m: m.spread)
        if not np.linalg.norm(gradient):
            raise ConvergenceError("the discriminant is constant")
        if here.split > FEWER * max(omega2**2, system.scene.units.omega2**2):
            raise Destroyed(f"its {here.cluster.size // 2} pairs of eigenvalues do not meet together any more")
        dq = np.array([-gradient[1], gradient[0]]) / np.linalg.norm(gradient)
        orientation = 1 if dq @ forward >= 0 else -1
        basis = clearest.cluster.basis
        rest = unstable(self.eigensolver.at(self.plane.at(p, x)), basis.shape[1], basis)
        return replace(
            node,
            dp=orientation * dq * width,
            orientation=orientation,
            located_to=node.located_to + SPLIT * here.split * abs(gradient) / (gradient @ gradient) * width,
            modes=as_vectors(system, basis),
            rest=rest + (here.cluster.size if omega2 < 0 else 0),
            lower=int(np.sign(gradient[0])),
        )

    def onto(self, guess: Guess, near: LocusPoint) -> LocusPoint:
        """See :class:`~rodfem.codim2.plane.Criterion`."""
        return self._onto(guess, near, 1.0)[0]

    def _onto(self, guess: Guess, near: LocusPoint, reach: float) -> tuple[LocusPoint, Measured]:
        """Point of the curve on the line, and the cluster there; the tangent is the one that was given."""
        p, x, dp, _ = guess
        width, system = self.plane.width, self.solver.system
        forward = dp / width / np.linalg.norm(dp / width)
        across = np.array([-forward[1], forward[0]])
        system.line = self.plane.line(p, across * width)
        t, last, here, x = self._collide(x, Cluster(_basis(near), near.omega2), reach)
        p = p + t * across * width
        x = self.plane.at(p, x)
        located = np.maximum(last * abs(across) * width, ROUND_OFF * np.maximum(self.plane.sizes, abs(p)))
        ordinate, still = self.solver.shape.ordinate(x), system.new_vector()
        return LocusPoint(p, x, forward * width, still, located, ordinate=ordinate, omega2=here.cluster.mean), here

    def _collide(self, x: PETSc.Vec, cluster: Cluster, reach: float) -> Zero:
        """Zero of ``D`` on the system's line of parameters.

        Secants take ``D`` from the eigenvalues, whose round-off is that of an eigensolver: they end near the zero, or
        where they no longer shrink.  The last digits are by ``D`` of both subspaces, right and left.
        """
        t, other = 0.0, FIRST
        now, x = self._measured(t, x, cluster)
        at_other = self._measured(other, x, cluster)[0].discriminant
        before = np.inf
        slope = (at_other - now.discriminant) / (other - t)
        for _ in range(12):
            if now.discriminant == at_other:
                break
            step = -now.discriminant * (other - t) / (at_other - now.discriminant)
            if abs(step) < SHARP or (abs(step) < NOISE and abs(step) > 0.3 * before):
                return self._by_both_sides((t, abs(step), now, x), slope)
            if abs(other - t) > FAR:
                slope = (at_other - now.discriminant) / (other - t)
            other, at_other, before = t, now.discriminant, abs(step)
            t += step
            if abs(t) > reach:
                break
            now, x = self._measured(t, x, Cluster(cluster.basis, now.cluster.mean))
        raise ConvergenceError("two eigenvalues do not collide near by")

    def _by_both_sides(self, found: Zero, slope: float) -> Zero:
        """Correct a zero of ``D`` that was ``found`` twice, by its ``slope``.

        The uncertainty is the last change and the round-off of ``D``.  Where left vectors are not found, as beside a
        double zero at times, the zero stays that of the eigenvalues, uncertain by the last change of the secants.
        """
        t, _, now, x = found
        with suppress(ConvergenceError):
            for _ in range(2):
                noise = noise_of(self.eigensolver.at(x), now)
                step = -noise.two_sided / slope
                t += step
                now, x = self._measured(t, x, now.cluster)
                found = t, abs(step) + abs(noise.discriminant / slope), now, x
        return found

    def _measured(self, t: float, guess: PETSc.Vec, cluster: Cluster) -> tuple[Measured, PETSc.Vec]:
        """The cluster at ``t`` on the system's line of parameters, and the state there."""
        x, outcome = self.solver.at_load(guess, t)
        if not outcome.converged:
            raise ConvergenceError("no equilibrium is found there")
        return measure(self.eigensolver.at(x), cluster), x


def _basis(near: LocusPoint) -> np.ndarray:
    """Basis (n, size) of the invariant subspace at a point, this rank's n unknowns."""
    return np.stack([v.array_r.real for v in near.modes], axis=1)
