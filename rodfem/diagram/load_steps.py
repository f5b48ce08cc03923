"""Steps of a sweep from load to load along one path of equilibria, halved where it is not clear that they stay on it.

At a given load Newton's method finds an equilibrium, and beyond a fold, or where the path bends sharply, that of
another path.  A state is on the path if it is where the last ones lead: as far from there as a part of the step, or
less.  Steps that are halved get there on a smooth path, and before a fold never; across a kink of the loads the least
step does, whose change is that of the directions before and after it.  Positions, rotations and strains are looked at
each by itself, since a rod that is pressed together much may turn by little.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import copysign, inf

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.branch import Point
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.prediction import ROWS, across_orbit, predict_at_load
from rodfem.diagram.held import require_held
from rodfem.errors import ConvergenceError

ASTRAY = 0.05
"""Distance from a prediction, relative to the step that it predicts, beyond which a state may be of another path."""
STILL = 1e-8
"""The same in natural sizes, within which it is on the path whatever the step."""
LEAST = 1e-6
"""Least step, relative to the range of loads."""
STEEPEST = 2.0
"""Change of a state over the least step, relative to that of the steeper one of the directions at its ends."""
BESIDE = 1e-2
"""Part of a step at whose end a state tells in which direction the path goes on."""


class LoadSteps:
    """Equilibria on one path, load by load."""

    def __init__(self, solver: BranchSolver, first: Point, span: tuple[float, float]) -> None:
        """Begin at the ``first`` point of a sweep over a ``span`` of loads, on the mesh of the ``solver``."""
        self.solver, self.least = solver, LEAST * abs(span[1] - span[0])
        self.known = [first]
        self.step = inf
        f = solver.system.fields
        begin, end = solver.system.metric.getOwnershipRange()
        numbers = [f.number[f.dofs[block.name]].ravel() for block in f.blocks if not block.multiplier]
        self.blocks = [of[(begin <= of) & (of < end)] - begin for of in numbers]

    def to(self, load: float) -> PETSc.Vec:
        """Equilibrium on the path at a ``load`` further on.

        Raises :class:`ConvergenceError` where the path cannot be followed to there, and :class:`SceneError` where a
        load drives a motion that nothing holds.  Collective.
        """
        last = self.known[-1]
        while last.load != load:
            following = self._next(last, load)
            if following is None:
                following, self.known = self._across_a_kink(last, load), []
            self.known, last = [*self.known[1 - ROWS :], following], following
        return last.x

    def _next(self, last: Point, load: float) -> Point | None:
        """Next state of the path, at the ``load`` or on the way to it; None where no step is short enough."""
        size = min(abs(load - last.load), self.step)
        while size > 0.0:
            there = self._beyond(last, size, load)
            x = self._found(there)
            if x is not None:
                self.step = max(2.0 * size, self.step)
                return replace(last, x=x, load=there)
            self.step = max(size / 2, self.least)
            size = size / 2 if size > self.least else 0.0
        return None

    def _beyond(self, last: Point, size: float, load: float) -> float:
        """Load one step of some ``size`` further on, at most ``load``."""
        ahead = load - last.load
        return load if size >= abs(ahead) else last.load + copysign(size, ahead)

    def _across_a_kink(self, last: Point, load: float) -> Point:
        """State one least step further on, from which the path has another direction.

        Raises :class:`ConvergenceError` where the directions before and after the step do not explain the change.
        """
        there = self._beyond(last, self.least, load)
        by = BESIDE * (there - last.load)
        x, outcome = self.solver.at_load(last.x, there)
        ends = [self.solver.at_load(state, at) for state, at in ((last.x, last.load - by), (x, there + by))]
        if outcome.converged and all(end.converged for _, end in ends):
            slopes = [self._sizes(y - state) / BESIDE for (y, _), state in zip(ends, (last.x, x), strict=True)]
            if (self._sizes(x - last.x) <= np.maximum(STEEPEST * np.max(slopes, axis=0), STILL)).all():
                require_held(self.solver, x)
                return replace(last, x=x, load=there)
        name, at = self.solver.system.scene.load, f"{last.load:.8g}"
        raise ConvergenceError(
            f"The equilibrium at {name} = {at} could not be followed to {load:.6g}: near {at} its path turns back, at "
            "a fold where stability changes, or bends too sharply, or ends. A sweep follows the load alone: use a "
            "smaller range, or another parameter as the load."
        )

    def _found(self, load: float) -> PETSc.Vec | None:
        """Equilibrium on the path at a ``load``; None where there is none, or none that is surely on it.

        The last ones tell where the path leads if it is smooth between them, whose distances are not halved; a tangent
        at the last one tells it of steps that are short enough.
        """
        solver, last = self.solver, self.known[-1]
        if len(self.known) > 1 and (x := self._predicted(self.known, load)) is not None:
            return x
        beside = last.load + BESIDE * (load - last.load)
        y, outcome = solver.at_load(last.x, beside)
        return self._predicted([replace(last, x=y, load=beside), last], load) if outcome.converged else None

    def _predicted(self, known: Sequence[Point], load: float) -> PETSc.Vec | None:
        """Equilibrium at a ``load`` to which the ``known`` ones lead; None where none is found, or another one."""
        system, last = self.solver.system, known[-1].x
        predicted = predict_at_load(system, known, load)
        if system.drifts:  # where a state is on its orbit is arbitrary: it stays there
            across_orbit(system, last, predicted, system.new_vector())
        x, outcome = self.solver.at_load(predicted, load)
        if not outcome.converged:
            return None
        off, step = (self._sizes(x - other) for other in (predicted, last))
        if (off > np.maximum(ASTRAY * step, STILL)).any():
            return None
        require_held(self.solver, x)
        return x

    def _sizes(self, change: PETSc.Vec) -> np.ndarray:
        """Largest entry of each field of a ``change`` of state, in natural sizes, the same on all ranks."""
        system = self.solver.system
        values = system.in_units(change, -1).array_r
        mine = [float(abs(values[of]).max(initial=0.0)) for of in self.blocks]
        return np.max(system.comm.allgather(mine), axis=0)
