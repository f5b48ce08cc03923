"""Equilibria at given loads: Newton's method from a guess, from the scene's start, or by going downhill."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from math import inf

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.branch import Point, SpecialPoint
from rodfem.continuation.kinds import Kind
from rodfem.errors import ConvergenceError, SceneError
from rodfem.fem.convexity import Convexity
from rodfem.fem.newton import FAR, NewtonResult, correct, linear_step, relax
from rodfem.fem.resultants import Resultants
from rodfem.fem.shape import Shape
from rodfem.fem.state import Energies
from rodfem.fem.system import System
from rodfem.fem.values import LOAD, NodalValues
from rodfem.linalg.chain import Chain
from rodfem.linalg.factorization import Factors
from rodfem.problem.units import Units

STILL = 1e-6
"""Damping of Newton's method at a singular first state, over the lowest bending eigenvalue."""
HOLDS = 1e6
"""Damping that holds a state while the multipliers of its constraints are found, over the lowest bending eigenvalue."""
STRAYED = 0.3
"""If Newton's method moves the initial guess farther than this (metric norm), the result is not accepted as the first
state; an equilibrium nearer than this to the start is the one that is meant."""
HELD = 1e-8
"""Drift scalar, over the lowest bending eigenvalue, above which phase conditions hold a state off the equilibrium."""


class StaticSolver:
    """Computes equilibria of one :class:`~rodfem.fem.system.System` at given loads, and their shapes."""

    def __init__(self, system: System) -> None:
        """Tabulate the shape; ``mesh`` is the number of this discretisation where there are several."""
        self.system, self.mesh = system, 0
        self.shape = Shape(system)
        self.axis = system.load_axis()

    def start(self, load: float, bent: float = 0.0) -> PETSc.Vec:
        """First guess at ``load``: the scene's ``start`` rotation, undeformed strains, zero forces.

        ``bent`` is the size, in radian, of a smooth rotation on top: a taut straight rod is a singular place to start.
        """
        system, f = self.system, self.system.fields
        x = f.coordinates(f.discretization.degree)
        turned = f.turning.start(system.scene.start, x.ravel(), system.scene.interval)
        if bent:
            along = (x.ravel() - system.scene.interval[0]) / system.scene.length
            turned = f.turning.turned(turned, bent * _bend(along))
        undeformed = np.array([1.0 if i == 2 else 0.0 for i in system.scene.free_strains])
        named = {f.turning.name: turned.reshape(*x.shape, -1), "v": undeformed, LOAD: load}
        return self.shape.with_centreline(NodalValues(f, f.filled(named), system.line))

    @cached_property
    def resultants(self) -> Resultants:
        """Strains, contact forces and moments of the states, compiled when they are first asked for."""
        return Resultants(self.shape)

    @cached_property
    def convexity(self) -> Convexity:
        """Convexity of the stored energy, where it varies: from state to state, along the rod, or with the load."""
        return Convexity(self.system, self.system.scene.load)

    def lost_convexity(self, x: PETSc.Vec) -> str:
        """Why a branch ends at the state ``x``, where the stored energy is not convex any more; empty where it is."""
        return "" if self.convexity.holds(x) else self.not_convex(x)

    def not_convex(self, x: PETSc.Vec) -> str:
        """Why a branch ends at a state ``x`` along which the stored energy is not convex."""
        return f"the stored energy is not convex any more at {self.system.scene.load} = {self.system.scalar(x):.6g}"

    def require_convexity(self, x: PETSc.Vec) -> None:
        """Raise :class:`SceneError` for a state ``x`` to begin with along which the stored energy is not convex."""
        if self.lost_convexity(x):
            raise SceneError(
                f"The stored energy is not convex somewhere along the state at {self.system.scene.load} = "
                f"{self.system.scalar(x):g}: choose constants that make it so, or another load."
            )

    @property
    def units(self) -> Units:
        """Natural sizes of the rod's numbers."""
        return self.system.scene.units

    def given(self, kind: Kind, point: Point) -> SpecialPoint:
        """Special point at a load that is given."""
        return SpecialPoint.given(kind, point, self.units.load)

    def at_load(self, guess: PETSc.Vec, load: float, reach: float = FAR) -> tuple[PETSc.Vec, NewtonResult]:
        """Equilibrium at exactly ``load`` by Newton's method from ``guess``, at a distance of ``reach`` at most."""
        x = guess.copy()
        self.system.set_load(x, load)
        outcome = correct(self.system, x, self.axis, reach)
        self.system.set_load(x, load)  # steps at fixed load may have moved it by round-off
        return x, outcome

    def first(self, load: float) -> tuple[PETSc.Vec, NewtonResult]:
        """First equilibrium at ``load``, from the scene's start: by Newton's method, or else by going downhill.

        Newton's method begins without forces.  Where it strays from a start that has an equilibrium right beside it,
        found from the forces that balance the start best, that is the first one, stable or not.  The way down is also
        taken where Newton's method ends at an unstable equilibrium that is nowhere near the start.  Of a family of
        equilibria it is the one next to the start, whatever round-off would make of it.
        """
        guess = self.start(load)
        x, outcome = self.at_load(guess, load)
        if not (outcome.converged and self._turned(guess, x) < STRAYED):
            near, found = self.at_load(self._balanced(guess), load)
            if found.converged and self._turned(guess, near) < STRAYED:
                x, outcome = near, found
        if outcome.converged and self._turned(guess, x) >= STRAYED:
            outcome, good = self._examined(x, outcome)
        else:
            good = outcome.converged
        if good and not self.may_move(x):
            return x, outcome
        damping, self.system.damping = self.system.damping, STILL * self.system.stiffness_scale
        still, found = self.at_load(guess, load)  # the start may be one of a family, along which it need not move
        self.system.damping = damping
        if found.converged and self._turned(guess, still) < STRAYED:
            return still, found
        if good:
            return x, outcome
        other = self.downhill(load)
        return other if other[1].converged else (x, outcome)

    def _balanced(self, x: PETSc.Vec) -> PETSc.Vec:
        """The state ``x`` with the multipliers of its constraints that balance it best, a least-squares estimate.

        One step of Newton's method with so much damping that nothing else moves.  Without the forces in it, rotations
        of a free rod under dead loads cost nothing: Newton's method leaves even an equilibrium, in any direction.
        """
        system = self.system
        system.set_phase(x)
        step = linear_step(system, x, self.axis, HOLDS * system.stiffness_scale)
        return x.copy() if step is None else x - step

    def _turned(self, guess: PETSc.Vec, x: PETSc.Vec) -> float:
        """Distance of two states without that of their strains, in the metric: a straight rod may stretch far."""
        difference, f = x - guess, self.system.fields
        if "v" in f.dofs:
            begin, end = difference.getOwnershipRange()
            strains = f.number[f.dofs["v"]].ravel()
            difference.array[strains[(begin <= strains) & (strains < end)] - begin] = 0.0
        return self.system.norm(difference)

    def downhill(self, load: float) -> tuple[PETSc.Vec, NewtonResult]:
        """Equilibrium at ``load`` by going downhill from the scene's start, and from there bent a little.

        A stable state is preferred.  From a symmetrical start the way down may end on a saddle, and where it passes one
        slowly it depends on the mesh whether it stays there: from a saddle it goes on, along its most unstable mode.
        """
        first: tuple[PETSc.Vec, NewtonResult] | None = None
        for bent in (0.0, 0.4, 0.8):
            x, outcome = self._relaxed(self.start(load, bent))
            outcome, stable = self._examined(x, outcome)
            if stable:
                return x, outcome
            if first is None or (outcome.converged and not first[1].converged):
                first = x, outcome
        assert first is not None
        if not first[1].converged:
            return first
        beside, longest = self.off(first[0], self.start(load))
        found = self._relaxed(beside, longest, lambda x: self._examined(x, first[1])[1])
        return found if found[1].converged else first

    def _examined(self, x: PETSc.Vec, outcome: NewtonResult) -> tuple[NewtonResult, bool]:
        """The iteration that led to ``x``, and whether that is stable.

        It has not converged where eigenvalues cannot be counted: a state so far away that it is round-off is none.
        """
        if not outcome.converged:
            return outcome, False
        try:
            return outcome, self.is_stable(x)
        except ConvergenceError:
            return replace(outcome, converged=False), False

    def _relaxed(
        self, x: PETSc.Vec, longest: float = inf, accepts: Callable[[PETSc.Vec], bool] = lambda x: True
    ) -> tuple[PETSc.Vec, NewtonResult]:
        """Equilibrium downhill from the state ``x``, which moves there, at its load; see :func:`relax`."""
        load = self.system.scalar(x)
        outcome = relax(self.system, x, self.axis, longest=longest, accepts=accepts)
        for _ in range(3):  # phase conditions taken far away may hold a state off the equilibrium
            if outcome.converged and self.system.drift(x) > HELD * self.system.stiffness_scale:
                x, outcome = self.at_load(x, load)
        return x, outcome

    def off(self, x: PETSc.Vec, start: PETSc.Vec) -> tuple[PETSc.Vec, float]:
        """State beside the saddle ``x``, and the longest time step of the way down; here nothing is a saddle."""
        return x.copy(), inf

    def factors(self) -> list[Factors]:
        """All factors that this solver makes."""
        return [self.system.lu]

    def notices(self) -> list[str]:
        """Sentences for the record that nobody has read: symmetries that were none, factors by the last resort."""
        out = self.system.verification.read()
        for factors in self.factors():
            if isinstance(factors, Chain) and factors.times:
                out.append(
                    f"{factors.times} matrices could not be factored along the rod, too many pivots were delayed: "
                    "MUMPS factored them."
                )
                factors.times = 0
        return out

    def is_stable(self, x: PETSc.Vec) -> bool:
        """Whether an equilibrium is stable, as far as is known without counting."""
        return True

    def may_move(self, x: PETSc.Vec) -> bool:
        """Whether an equilibrium is one of a family that no symmetry explains, as far as is known without counting."""
        return False

    def energies(self, x: PETSc.Vec) -> Energies:
        """Stored and potential energy of the equilibrium ``x``, and what the load does work on."""
        return self.system.at(x).energies()

    def energy(self, x: PETSc.Vec) -> float:
        """Stored energy of the state ``x``."""
        return self.system.at(x).energy()


def _bend(x: np.ndarray) -> np.ndarray:
    """Smooth rotation vector of size about one that vanishes at both ends, (m, 3); ``x`` (m,) in [0, 1]."""
    return np.outer(np.sin(np.pi * x), (0.6, 0.8, 0.3)) + np.outer(np.sin(2 * np.pi * x), (0.5, -0.4, 0.2))
