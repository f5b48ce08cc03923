r"""Newton's method on deflated equations, preceded by a few steps of gradient flow.

Multiplied by the deflation operator (Farrell, Birkisson & Funke, SIAM J. Sci. Comput. 37 (2015) A2026-A2045) ::

    G(x) = M(x) F(x),    M(x) = prod_i (1 / d_i(x)^2 + 1),    d_i(x) = distance of x from the known equilibrium i,

the equations ``F`` keep all their solutions but the known ones, and Newton's method on ``G`` from the same guess must
go elsewhere, or fail.  No matrix of ``G`` is formed: it differs from ``M F'`` by a matrix of rank one, so that its
Newton step is the plain one ``p = -F'^-1 F``, rescaled (Sherman & Morrison) ::

    step = p / (1 - grad log M . p),    grad log M . p = -sum_i 2 <x - x_i, p> / (d_i^2 (1 + d_i^2)).

The distance is that of the system's metric (root mean square rotation, with the centreline where it is an unknown):
at a given load the rotation determines the strains and multipliers of a rod with a convex energy, and these have no
common unit.  A known equilibrium stands for its orbit (:mod:`rodfem.deflation.group_orbit`), and ``d_i`` is the
distance from the nearest point of that, where the gradient of ``d_i^2`` is still ``2 (x - x_i)``.

Far from equilibrium, multipliers that fit the guess matter more than anything else.  A few steps of gradient flow
(backward Euler: Newton's method with ``K + alpha M`` for ``K``) find them, and lead to where branches are.  Of guesses
turned by 0.8 from a straight hemitropic rod 4 of 20 led to a buckled state without these steps, and 20 of 20 with them.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, isfinite, nan

from petsc4py import PETSc

from rodfem.continuation.branch_solver import BranchSolver
from rodfem.deflation.group_orbit import Orbits
from rodfem.fem.newton import LARGEST, Correction, Limits, NewtonResult, linear_step, newton, relative_size
from rodfem.tolerances import NEGLIGIBLE, TINY

MOST = 60
"""Deflated Newton steps of one try."""
NEAR = 1e-4
"""Plain Newton steps below this, in the metric and relative in natural sizes, end the deflated iteration: the plain one
takes over."""
FLOW = (10.0, 3.0, 1.0, 0.3, 0.1, 0.03)
"""Reciprocal time steps of the gradient flow, over the rod's lowest bending eigenvalue."""


class DeflatedNewton:
    """Iterates towards equilibria at a fixed load that are not among the ``known`` ones."""

    def __init__(self, solver: BranchSolver) -> None:
        """Start with nothing known."""
        self.solver, self.system = solver, solver.system
        self.known = Orbits(self.system)

    def flow(self, x: PETSc.Vec, alphas: Sequence[float] = FLOW) -> None:
        """Steps of gradient flow from ``x``, in place: towards constraints, lower energy, and multipliers that fit."""
        system = self.system
        for alpha in alphas:
            system.set_phase(None)
            # backward Euler for M x' = -F(x), linearised: (S + alpha M) dx = -F
            step = linear_step(system, x, self.solver.axis, alpha * self.solver.inertia.scale)
            size = nan if step is None else system.norm(step)
            if step is None or not isfinite(size) or not self._advance(x, step, -min(1.0, LARGEST / max(size, TINY))):
                return

    def approach(self, x: PETSc.Vec) -> NewtonResult:
        """Deflated Newton steps from ``x``, in place, until a plain step is small.

        A step is never longer than ``LARGEST``, and is halved while it leads to where the stored energy has no value.
        """
        system = self.system

        def iteration(fresh: bool) -> Correction | None:
            system.set_phase(x)
            step = linear_step(system, x, self.solver.axis)
            if step is None:
                return None
            step.scale(-1.0)
            distance = system.norm(step)
            # the plain step measures the distance from a solution of F = 0: plain Newton converges from here
            size = max(distance, relative_size(system, x, step))
            if isfinite(size) and size >= NEAR:
                factor = self.rescaling(x, step)
                factor *= min(1.0, LARGEST / max(abs(factor) * distance, TINY))
                if not self._advance(x, step, factor):
                    return None
            return Correction(distance, size)

        return newton(iteration, Limits(MOST, inf, NEAR))

    def rescaling(self, x: PETSc.Vec, step: PETSc.Vec) -> float:
        """Factor that makes a plain Newton step at ``x`` the step of the deflated equations."""
        # grad log M . p, a sum over the known equilibria: see the module
        image = self.system.metric * step
        slope = 0.0
        for d, apart in self.known.nearest(x):
            d = max(d, NEGLIGIBLE)
            slope -= 2 * apart.dot(image) / (d * d * (1 + d * d))
        return 1.0 / (1.0 - slope) if abs(1.0 - slope) > NEGLIGIBLE else 1.0 / NEGLIGIBLE

    def _advance(self, x: PETSc.Vec, step: PETSc.Vec, factor: float) -> bool:
        """Add ``factor`` times a step, halved while the stored energy has no value there; False if it never has."""
        system, equations = self.system, self.system.new_vector()
        for _ in range(10):
            trial = x + step * factor
            self._normalise(trial)
            system.at(trial).residual(equations)
            if isfinite(equations.norm()):
                trial.copy(x)
                return True
            factor /= 2
        return False

    def _normalise(self, x: PETSc.Vec) -> None:
        """Make the nodal quaternions of ``x`` of unit length."""
        state, f = self.system.at(x), self.system.fields
        normalised = {f.turning.name: f.turning.normalised(state.turned)}
        self.system.vector(f.filled(state.named | normalised), state.drifts).copy(x)
