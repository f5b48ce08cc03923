r"""Where two frequencies of a rod under a load without a potential collide, in the plane of two parameters.

Two eigenvalues ``mu1``, ``mu2`` of the pencil ``S x = mu M x`` collide where ``D = ((mu1 - mu2)/2)^2`` vanishes.  The
eigenvalues have a square root there, but ``D`` is smooth in both parameters, so that ``D(a, b) = 0`` is a smooth curve
as long as the gradient of ``D`` does not vanish: the boundary of flutter (Seyranian & Mailybaev, *Multiparameter
Stability Theory with Mechanical Applications*, World Scientific 2003, chapters 2 and 5).  A point of it is found on a
given line of the plane by the secant method for ``D``, its tangent from central differences.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
from petsc4py import PETSc

from rodfem.continuation import Equilibria
from rodfem.errors import ConvergenceError
from rodfem.loci.plane import Node, Plane
from rodfem.stability.vibration import Vibration
from rodfem.sweep import REAL

FIRST = 1e-4
"""First step of the secants, relative to the bounds."""
SHARP, NOISE = 1e-12, 1e-8
"""Steps of the secants that end them: by their own size, or where they no longer shrink."""
DIFFERENCE = 1e-3
"""Step of the central differences of ``D``, relative to the bounds."""


class Collision:
    """Corrects points of the plane to where two eigenvalues near ``omega2`` collide."""

    def __init__(self, solver: Equilibria, plane: Plane) -> None:
        """Allocate the pencil."""
        self.solver, self.plane = solver, plane
        self.vibration = Vibration(solver.system)

    def length(self, dp: np.ndarray, dx: PETSc.Vec) -> float:
        """Size of a step: parameters over the widths of their bounds."""
        return float(np.linalg.norm(dp / self.plane.width))

    def correct(
        self, p: np.ndarray, x: PETSc.Vec, tangent: tuple[np.ndarray, PETSc.Vec | None], near: Node, reach: float = 1.0
    ) -> Node:
        """Point of the curve on the line through ``p`` across ``tangent``; raises :class:`ConvergenceError`.

        ``near`` is a point of the curve whose double eigenvalue is close by.
        """
        width, forward = self.plane.width, tangent[0] / self.plane.width
        forward = forward / np.linalg.norm(forward)
        across = np.array([-forward[1], forward[0]])
        self.plane.line(p, across * width)
        t, last, omega2, x = self._collide(x, near.omega2, reach)
        p = p + t * across * width
        gradient = np.zeros(2)
        for which in (0, 1):
            self.plane.line(p, (np.arange(2) == which) * width)
            low, high = (self._discriminant(h, x, omega2)[0] for h in (-DIFFERENCE, DIFFERENCE))
            gradient[which] = (high - low) / (2 * DIFFERENCE)
        if not np.linalg.norm(gradient):
            raise ConvergenceError("the discriminant is constant")
        dq = np.array([-gradient[1], gradient[0]]) / np.linalg.norm(gradient)
        dq = dq if dq @ forward >= 0 else -dq
        self.plane.show(p)
        self.solver.system.set_load(x, float(p[0]))
        located = np.maximum(last * abs(across) * width, 1e-12 * np.maximum(1.0, abs(p)))
        ordinate = self.solver.shape.ordinate(x)
        return Node(p, x, dq * width, self.solver.system.new_vector(), located, ordinate=ordinate, omega2=omega2)

    def _collide(self, x: PETSc.Vec, omega2: float, reach: float) -> tuple[float, float, float, PETSc.Vec]:
        """Zero of ``D`` on the line last set, from t = 0, by secants: t, its last change, the double eigenvalue, state.

        Secants end where they no longer shrink: ``D`` has a round-off of about ``eps mu^2``.
        """
        t, other = 0.0, FIRST
        value, omega2, x = self._discriminant(t, x, omega2)
        at_other = self._discriminant(other, x, omega2)[0]
        before = np.inf
        for _ in range(12):
            if value == at_other:
                break
            step = -value * (other - t) / (at_other - value)
            if abs(step) < SHARP or (abs(step) < NOISE and abs(step) > 0.3 * before):
                return t, abs(step), omega2, x
            other, at_other, before = t, value, abs(step)
            t += step
            if abs(t) > reach:
                break
            value, omega2, x = self._discriminant(t, x, omega2)
        raise ConvergenceError("two eigenvalues do not collide near by")

    def _discriminant(self, t: float, guess: PETSc.Vec, center: float) -> tuple[float, float, PETSc.Vec]:
        """``D`` of the pair nearest to ``center`` at ``t`` on the line last set, its mean, and the state there.

        Two real eigenvalues are a pair only if they are of the same kind of motion: others pass by each other.
        """
        self.solver.system.set_phase(None)
        x, outcome = self.solver.at_load(guess, t)
        if not outcome.converged:
            raise ConvergenceError("no equilibrium is found there")
        self.vibration.assemble(x)
        found = self.vibration.near(4, 0.97 * center)
        best: tuple[float, float, float] | None = None
        for (i, a), (j, b) in combinations(enumerate(found.values), 2):
            both_real = abs(a.imag) + abs(b.imag) < REAL * abs(a) and found.kinds[i] == found.kinds[j]
            if both_real or abs(a - b.conjugate()) < REAL * abs(a):
                distance = abs((a + b) / 2 - center) + 0.1 * abs(a - b)
                if best is None or distance < best[0]:
                    best = (distance, float((((a - b) / 2) ** 2).real), float(((a + b) / 2).real))
        if best is None:
            raise ConvergenceError("no pair of eigenvalues is found there")
        return best[1], best[2], x
