"""The end of a branch at which the smallest stretch vanishes, sharpened on finer meshes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.arc import Arc
from rodfem.continuation.branch import Point, SpecialPoint
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.kinds import END
from rodfem.errors import ConvergenceError
from rodfem.fem.fields import HIGHEST
from rodfem.fem.system import System
from rodfem.roots import zero_between
from rodfem.tolerances import INSIDE, ROUND_OFF, unit

LOCATED = 1e-10
"""Uncertainty of the load at which the stretch vanishes on one mesh, relative to it or to one."""
ALONG = 1e-11
"""Arclength, in the metric, to which a stretch vanishes."""
ASIDE = 1e-4
"""Distance before an end at which the stretch vanishes, relative to the step, at which the index is counted."""
FIRST, LONGER, STEPS = 2e-4, 1.7, 14
"""First step, in spans, to where it vanishes on a richer mesh, growth of the next ones, and their number."""


def last_admissible(solver: BranchSolver, a: Point, b: Point) -> Point:
    """The point between ``a`` and ``b`` at which the smallest stretch vanishes."""
    arc, first = Arc(solver, a, b), a.arclength + INSIDE * (b.arclength - a.arclength)
    return arc.point(zero_between(lambda s: solver.shape.stretch(arc.state(s)), first, b.arclength, ALONG))


def before_the_end(solver: BranchSolver, a: Point, last: Point) -> Point | None:
    """A point right before the ``last`` admissible one after the row ``a``; None if it is not found.

    At the end a rod that is squeezed to nothing has no stiffness against some motions, whose eigenvalues are zero.
    """
    try:
        return Arc(solver, a, last).point(last.arclength - ASIDE * (last.arclength - a.arclength))
    except ConvergenceError:
        return None


def end_at_zero_stretch(solver: BranchSolver, last: Point, *, error_bars: bool) -> SpecialPoint:
    """The end at the ``last`` admissible point, on finer meshes where ``error_bars`` are asked for.

    A note says where those fail.
    """
    located = LOCATED * unit(last.load, one=solver.units.load)
    end = SpecialPoint(END, last, last.negative, last.negative, located, test_function="stretch")
    if error_bars:
        try:
            with solver.system.clock.scope("error bars"):
                _sharpen(solver, end)
        except ConvergenceError as trouble:
            end.note = f"no error estimate: {trouble}"
    return end


def _sharpen(solver: BranchSolver, end: SpecialPoint) -> None:
    """Sharpen an end at which the smallest stretch vanishes; raises :class:`ConvergenceError` if that fails.

    A strain converges like ``h^k`` only.  The point is computed on meshes two and four times as fine, one degree richer
    (the forms of :class:`Enriched` serve); the finer one is kept.  Its error is a quarter of their difference at most,
    all of it for linear elements.
    """
    system, d = solver.system, solver.system.fields.discretization
    sample, found = solver.shape.sample(end.point.x), list[Point]()
    for factor in (2, 4):
        mesh = d.finer(factor, richer=int(d.degree < HIGHEST))
        fine = BranchSolver(System(system.scene, mesh, system.comm, system.clock, symmetries=system.symmetries))
        x = _vanishing(fine, fine.shape.restore(sample), end.point)
        point = replace(end.point, x=x, tangent=None, load=fine.system.scalar(x), energy=fine.energy(x))
        found.append(replace(point, ordinate=fine.shape.ordinate(x), stretch=fine.shape.stretch(x)))
        sample = fine.shape.sample(x)
    before, point = found
    end.point = replace(point, x=solver.shape.restore(sample))
    end.located_to = LOCATED * unit(point.load, one=solver.units.load)
    left = 1.0 if d.degree == 1 else 0.25
    end.error_estimate = max(left * abs(point.load - before.load), end.located_to)
    end.ordinate_error = max(left * abs(point.ordinate - before.ordinate), end.located_to)
    end.note = f"its load was computed with {4 * d.elements} elements of degree {d.degree + 1}"


def _vanishing(solver: BranchSolver, x: PETSc.Vec, coarse: Point) -> PETSc.Vec:
    """State of a mesh, near ``x``, at which the smallest stretch vanishes, to round-off."""
    states = {coarse.load: x}

    @cache
    def stretch(load: float) -> float:
        nearest = min(states, key=lambda known: abs(known - load))
        states[load], outcome = solver.at_load(states[nearest], load, reach=1.0)
        if not outcome.converged:
            raise ConvergenceError(f"no equilibrium near load {load:.8g} on the finer mesh")
        return solver.shape.stretch(states[load])

    scene = solver.system.scene
    load = _bracketed_zero(stretch, coarse, abs(scene.span[1] - scene.span[0]))
    return states[load]


def _bracketed_zero(stretch: Callable[[float], float], coarse: Point, span: float) -> float:
    """Load at which ``stretch`` vanishes: bracketed by steps from the coarse load along the branch, then solved for."""
    a, value = coarse.load, stretch(coarse.load)
    step = np.copysign(FIRST * span, coarse.slope if value > 0 else -coarse.slope)
    for _ in range(STEPS):
        if abs(value) <= ROUND_OFF:  # it has no sign
            return a
        b, other = a + step, stretch(a + step)
        if value * other <= 0 and abs(other) > ROUND_OFF:
            return zero_between(stretch, a, b, ROUND_OFF * span)
        a, value, step = b, other, LONGER * step
    raise ConvergenceError("the zero of the stretch was not found on the finer mesh")
