"""Equilibria of a sweep: at a load, and from load to load along one path.

At a given load Newton's method finds an equilibrium, and beyond a fold, or where the path bends sharply, that of
another path.  A state is on the path if it is as near to where the last ones lead as a part of the step.  Steps are
halved until it is: on a smooth path that ends, before a fold never.  Positions, rotations and strains are looked at
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
from rodfem.errors import ConvergenceError, SceneError

PARTS = (1, 2, 4, 8)
"""Numbers of steps to a load that are tried, one after the other."""
DRIVEN = 1e-7
"""Drift, over the rod's lowest bending eigenvalue, above which loads drive a motion that nothing holds."""
ASTRAY = 0.05
"""Distance from a prediction, over the step that it predicts, beyond which a state may be of another path."""
FLOOR = 1e-8
"""The same in natural sizes, within which it is on the path whatever the step."""
LEAST = 1e-6
"""Least step, over the range of loads."""
PART = 1e-2
"""Part of a step at whose end a state tells in which direction the path goes on."""


def at_load(solver: BranchSolver, guess: PETSc.Vec, load: float) -> PETSc.Vec:
    """Equilibrium at a load from a ``guess`` nearby, in more and more steps; raises :class:`ConvergenceError`."""
    begin = solver.system.scalar(guess)
    for parts in PARTS:
        x = guess
        for part in range(1, parts + 1):
            x, outcome = solver.at_load(x, load if part == parts else begin + (load - begin) * part / parts)
            if not outcome.converged:
                break
        else:
            require_balance(solver, x)
            return x
    raise ConvergenceError(f"No equilibrium at {solver.system.scene.load} = {load:g}: use a smaller range.")


def require_balance(solver: BranchSolver, x: PETSc.Vec) -> None:
    """Raise :class:`SceneError` where the loads of a state ``x`` drive a motion that nothing holds."""
    system = solver.system
    if system.drift(x) > DRIVEN * system.stiffness_scale:
        raise SceneError(
            f"There is no equilibrium at {system.scene.load} = {system.scalar(x):g}: nothing holds the rod against the "
            f"{' or the '.join(system.free_motions(x))}, and the loads drive it; hold that motion at one end, or "
            "balance the loads."
        )


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
        """Equilibrium on the path at a ``load`` further on; raises :class:`ConvergenceError`.  Collective."""
        last = self.known[-1]
        while last.load != load:
            last = self._next(last, load)
            self.known = [*self.known[1 - ROWS :], last]
        return last.x

    def _next(self, last: Point, load: float) -> Point:
        """Next state of the path, at the ``load`` or on the way to it."""
        ahead = load - last.load
        size = min(abs(ahead), self.step)
        while size > 0.0:
            there = load if size >= abs(ahead) else last.load + copysign(size, ahead)
            x = self._found(there)
            if x is not None:
                self.step = max(2.0 * size, self.step)
                return replace(last, x=x, load=there)
            self.step = max(size / 2, self.least)
            size = size / 2 if size > self.least else 0.0
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
        near = last.load + PART * (load - last.load)
        y, outcome = solver.at_load(last.x, near)
        return self._predicted([replace(last, x=y, load=near), last], load) if outcome.converged else None

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
        if (off > np.maximum(ASTRAY * step, FLOOR)).any():
            return None
        require_balance(self.solver, x)
        return x

    def _sizes(self, change: PETSc.Vec) -> np.ndarray:
        """Largest entry of each field of a ``change`` of state, in natural sizes, the same on all ranks."""
        system = self.solver.system
        values = system.in_units(change, -1).array_r
        mine = [float(abs(values[of]).max(initial=0.0)) for of in self.blocks]
        return np.max(system.comm.allgather(mine), axis=0)
