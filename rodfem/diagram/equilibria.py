"""Equilibria that a computation asks for: the first one, one at a load nearby, and from load to load along one path.

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
from numpy.typing import NDArray
from petsc4py import PETSc

from rodfem.continuation.branch import FIRST_BRANCH, Point
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.curves import ROWS, across_orbit, predict_at_load
from rodfem.continuation.first_equilibrium import first_equilibrium
from rodfem.errors import ConvergenceError, InputError, SceneError
from rodfem.fem.newton import NewtonResult
from rodfem.fem.shape import Shape
from rodfem.stability.dependence import may_depend, require_independent_constraints

BENT = 1e-6
"""Distance from the chord, over the rod's length, and rotation from the scene's start, in radian, that are none."""
ASTRAY, FLOOR, LEAST = 0.05, 1e-8, 1e-6
"""Distance from a prediction, over the step that it predicts, beyond which a state may be of another path; the same in
natural sizes, within which it is on the path whatever the step; least step, over the range of loads."""


def first_state(solver: BranchSolver, load: float) -> tuple[PETSc.Vec, NewtonResult]:
    """First equilibrium at ``load``; :class:`SceneError` for dependent constraints, :class:`Overfull` for its index."""
    start = solver.start(load)
    try:
        x, outcome = first_equilibrium(solver, load)
    except ConvergenceError:
        require_independent_constraints(solver.shape, start)
        raise
    if not outcome.converged:
        require_independent_constraints(solver.shape, start)
    elif may_depend(solver.shape, x):
        require_independent_constraints(solver.shape, x, start)
    if outcome.converged and solver.conservative and not solver.lost_convexity(x):
        check_index(solver, load, solver.inertia.at(x).count().negative)
    return x, outcome


def name_of_first(shape: Shape, states: Sequence[PETSc.Vec]) -> str:
    """Name of the first branch: that of the scene, or else what is true of its first ``states``."""
    scene = shape.system.scene
    if scene.states is not None:
        return scene.states
    if scene.closed:
        return "ring"
    return "straight" if all(is_straight(shape.sample(x)["r"]) for x in states) else FIRST_BRANCH


def is_straight(r: NDArray[np.float64]) -> bool:
    """Whether a centreline (n, 3) lies on the line through its ends, whatever its size."""
    chord, away = r[-1] - r[0], r - r[0]
    length = np.linalg.norm(np.diff(r, axis=0), axis=1).sum()
    across = np.linalg.norm(np.cross(away, chord), axis=1).max()
    return bool(across <= BENT * length * np.linalg.norm(chord))


class Overfull(InputError):
    """A state has more half-waves than its mesh can hold."""


def check_index(solver: BranchSolver, load: float, index: int) -> None:
    """Raise :class:`Overfull` for an ``index`` at a ``load`` that the nodes of the mesh cannot hold."""
    mesh = solver.system.fields.discretization
    nodes = mesh.elements * mesh.degree
    if index > max(0.9 * nodes, 4):
        raise Overfull(
            f"At {solver.system.scene.load} = {load:g} the rod has more half-waves than a mesh of {nodes} nodes can "
            f"hold (its index is {index} there): use smaller loads, or more elements (Discretization(elements=...)), "
            "or a start nearer to the equilibrium that is meant."
        )


def check_start(solver: BranchSolver, span: tuple[float, float]) -> None:
    """Raise :class:`Overfull` where the mesh cannot hold the index of the scene's start at an end of a ``span``."""
    for load in span if solver.conservative else ():
        index = _index(solver, load)
        if index is None:
            break
        check_index(solver, load, index)


def _index(solver: BranchSolver, load: float) -> int | None:
    """Index of the scene's start at a load; None where it is no equilibrium there, or its energy not convex."""
    start, system = solver.start(load), solver.system
    x, outcome = solver.at_load(start, load)
    turned = float(abs(system.at(x).turned - system.at(start).turned).max(initial=0.0))
    bent = load != system.scene.span[0] and max(system.comm.allgather(turned)) > BENT
    if not outcome.converged or bent or solver.lost_convexity(x):
        return None
    if may_depend(solver.shape, x):  # then a count is round-off
        require_independent_constraints(solver.shape, x, start)
    return solver.inertia.at(x).count().negative


def at_load(solver: BranchSolver, guess: PETSc.Vec, load: float) -> PETSc.Vec:
    """Equilibrium at a load from a ``guess`` nearby, in more and more steps; raises :class:`ConvergenceError`."""
    begin = solver.system.scalar(guess)
    for parts in (1, 2, 4, 8):
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
    if system.drift(x) > 1e-7 * system.stiffness_scale:  # of the lowest bending eigenvalue
        raise SceneError(
            f"There is no equilibrium at {system.scene.load} = {system.scalar(x):g}: nothing holds the rod against the "
            f"{' or the '.join(system.free_motions(x))}, and the loads drive it; hold that motion at one end, or "
            "balance the loads."
        )


class LoadSteps:
    """Equilibria on one path, load by load."""

    def __init__(self, solver: BranchSolver, first: Point, span: tuple[float, float]) -> None:
        self.solver, self.least = solver, LEAST * abs(span[1] - span[0])
        self.known, self.step = [first], inf

    def reach(self, load: float) -> PETSc.Vec:
        """Equilibrium on the path at a ``load`` further on; raises :class:`ConvergenceError`."""
        last = self.known[-1]
        while last.load != load:
            last = self._step(last, load)
            self.known = [*self.known[1 - ROWS :], last]
        return last.x

    def _step(self, last: Point, load: float) -> Point:
        """Next state of the path, at the ``load`` or on the way to it."""
        ahead = load - last.load
        size = min(abs(ahead), self.step)
        while size > 0.0:
            there = load if size >= abs(ahead) else last.load + copysign(size, ahead)
            x = self._equilibrium(there)
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

    def _equilibrium(self, load: float) -> PETSc.Vec | None:
        """Equilibrium on the path at a ``load``; None where there is none, or none that is surely on it."""
        solver, last = self.solver, self.known[-1]
        if len(self.known) > 1 and (x := self._predicted(self.known, load)) is not None:
            return x
        near = last.load + 0.01 * (load - last.load)
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
        astray, step = (self._sizes(x - other) for other in (predicted, last))
        if (astray > np.maximum(ASTRAY * step, FLOOR)).any():
            return None
        require_balance(self.solver, x)
        return x

    def _sizes(self, change: PETSc.Vec) -> np.ndarray:
        """Largest entry of each field of a ``change`` of state, in natural sizes, the same on all ranks."""
        system, units = self.solver.system, self.solver.units
        values, blocks = system.change(change), [block for block in system.fields.blocks if not block.multiplier]
        mine = [float(abs(values.values(block.name)).max(initial=0.0)) / units.of_field(block) for block in blocks]
        return np.max(system.comm.allgather(mine), axis=0)
