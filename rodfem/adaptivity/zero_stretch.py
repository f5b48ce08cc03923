"""The end of a branch at which the smallest stretch vanishes, sharpened on finer meshes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.branch import Point, SpecialPoint
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.kinds import END
from rodfem.errors import ConvergenceError
from rodfem.fem.fields import HIGHEST
from rodfem.fem.system import System
from rodfem.roots import zero_between
from rodfem.tolerances import ROUND_OFF, unit

LOCATED = 1e-10
"""Uncertainty of the load at which the stretch vanishes on one mesh, relative to it or to one."""
FIRST = 2e-4
"""First step, in spans, from there to where it vanishes on a richer mesh."""


class Stretch:
    """Smallest stretch as a function of the load, solved for once at each from the state before.

    Attributes
    ----------
    known
        State and smallest stretch at each load so far.
    """

    def __init__(self, solver: BranchSolver, x: PETSc.Vec) -> None:
        """Begin with a state ``x`` near those to come."""
        self.solver, self.known = solver, dict[float, tuple[PETSc.Vec, float]]()
        self._last = x

    def __call__(self, load: float) -> float:
        """Smallest stretch at a ``load``; raises :class:`ConvergenceError` where no equilibrium is found."""
        if load not in self.known:
            x, outcome = self.solver.at_load(self._last, load, reach=1.0)
            if not outcome.converged:
                raise ConvergenceError(f"no equilibrium near load {load:.8g} on the finer mesh")
            self._last = x
            self.known[load] = x, self.solver.shape.stretch(x)
        return self.known[load][1]


def zero_stretch(solver: BranchSolver, coarse: Point) -> SpecialPoint:
    """Sharpen the point at which the smallest stretch vanishes; raises :class:`ConvergenceError` where that fails.

    A strain converges like ``h^k`` only, far slower than a load does.  The point is computed on meshes two and
    four times as fine, one degree richer (the forms of :class:`Enriched` serve); the finer one is kept.  Its error is a
    quarter of their difference at most, all of it for linear elements.
    """
    system, d = solver.system, solver.system.fields.discretization
    sample = solver.shape.sample(coarse.x)
    found: list[tuple[float, float, float, float]] = []
    for factor in (2, 4):
        mesh = d.finer(factor, richer=int(d.degree < HIGHEST))
        fine = BranchSolver(System(system.scene, mesh, system.comm, system.clock, symmetries=system.symmetries))
        stretch = Stretch(fine, fine.shape.restore(sample))
        load = _bracketed_zero(stretch, coarse, abs(system.scene.span[1] - system.scene.span[0]))
        state, last = stretch.known[load]
        found.append((load, fine.shape.ordinate(state), fine.energy(state), last))
        sample = fine.shape.sample(state)
    (load2, ordinate2, *_), (load, ordinate, energy, last) = found
    x = solver.shape.restore(sample)
    point = replace(coarse, x=x, tangent=None, load=load, ordinate=ordinate, energy=energy, stretch=last)
    special = SpecialPoint(
        END,
        point,
        point.negative,
        point.negative,
        LOCATED * unit(load, one=solver.units.load),
        test_function="stretch",
    )
    left = 1.0 if d.degree == 1 else 0.25
    special.error_estimate = max(left * abs(load - load2), special.located_to)
    special.ordinate_error = max(left * abs(ordinate - ordinate2), special.located_to)
    special.note = f"its load was computed with {4 * d.elements} elements of degree {d.degree + 1}"
    return special


def _bracketed_zero(stretch: Callable[[float], float], coarse: Point, span: float) -> float:
    """Load at which ``stretch`` vanishes: bracketed by steps from the coarse load along the branch, then solved for.

    Within round-off of zero a stretch has no sign.
    """
    a, value = coarse.load, stretch(coarse.load)
    if abs(value) <= ROUND_OFF:
        return a
    step = np.copysign(FIRST * span, coarse.slope if value > 0 else -coarse.slope)
    for _ in range(14):
        b, other = a + step, stretch(a + step)
        if abs(other) <= ROUND_OFF:
            return b
        if value * other <= 0:
            return zero_between(stretch, a, b, ROUND_OFF * span)
        a, value, step = b, other, 1.7 * step
    raise ConvergenceError("the zero of the stretch was not found on the finer mesh")
