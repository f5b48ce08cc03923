"""Equilibria on small discretisations, each computed once: on the first branch, and buckled along its lowest mode."""

from functools import cache
from typing import Any

import demo_cases
import hemitropic_cases
import numpy as np
from petsc4py import PETSc

from rodfem import Discretization, Scene, Solver
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.fem.system import System
from rodfem.kumar_healey.coordinates import Coordinates
from rodfem.kumar_healey.reduction import ReducedPencil


def scene(name: str) -> Scene:
    return hemitropic_cases.scene() if name == "hemitropic" else demo_cases.scene(name)


@cache
def solver(name: str, formulation: str, elements: int, degree: int) -> BranchSolver:
    return Solver(scene(name), Discretization(formulation, elements, degree)).equilibria


@cache
def plain(name: str, formulation: str, elements: int, degree: int, load: float) -> tuple[System, PETSc.Vec]:
    """State on the branch that starts at the undeformed rod."""
    found = solver(name, formulation, elements, degree)
    found.system.set_phase(None)
    x = found.start(0.0)
    for part in np.linspace(0.0, load, 5)[1:] if name == "ruler" else [load]:
        x, outcome = found.at_load(x, part)
        assert outcome.converged
    return found.system, x


@cache
def buckled(name: str, formulation: str, elements: int, degree: int, load: float) -> tuple[System, PETSc.Vec]:
    """State that Newton's method finds from the former, moved along its left-most mode."""
    system, x = plain(name, formulation, elements, degree, load)
    mode = unit_mode(system, x)
    for amplitude in (0.6, 1.0, 1.3, 0.4):
        guess = x.copy()
        guess.axpy(amplitude, mode)
        system.set_phase(guess)
        y, outcome = solver(name, formulation, elements, degree).at_load(guess, load)
        change = y - x
        if outcome.converged and system.norm(change) > 0.1:
            return system, y
    raise AssertionError(f"no buckled state of {name} was found at {load}")


def unit_mode(system: System, x: PETSc.Vec) -> PETSc.Vec:
    """Left-most mode of the state ``x`` as a vector of the system, of norm 1."""
    coordinates = Coordinates(system)
    pencil, rows = coordinates.assemble(x), coordinates.blocks.rows
    found = ReducedPencil(pencil).nearest(2, -100.0)
    lowest = found.vectors[:, abs(found.values - found.values[0]) < 1e-6 * abs(found.values[0])]
    every: Any = pencil.T @ lowest
    # of a line or a plane of modes the one that a fixed functional likes best: the same on fine and on coarse meshes
    full = every @ np.linalg.solve(every.T @ every, every.T @ np.linspace(1.0, 1.4, len(every)))
    mode, (mine, places) = system.new_vector(), coordinates.blocks.own(rows)
    mode.array[places] = full[mine]
    mode.scale(1.0 / system.norm(mode))
    return mode
