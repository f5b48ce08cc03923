r"""Loci of special points in the plane of two parameters: the boundary of stability.

A fold, a branch point, a flutter or a divergence load ``lam`` of a scene moves as another of its parameters does.  Its
curve in the plane of both is followed by pseudo-arclength continuation of the equations that define it, in the space of
the state and *both* parameters (see :mod:`rodfem.codim2.singular` and :mod:`rodfem.codim2.collision`): neither is the
independent one, so that the curve may turn back with respect to either, and a fold's curve goes through cusps, where it
is smooth but for its projection on the plane.  Both directions are followed, to the bounds, exactly, or to where the
special point changes its kind.

Arclength is measured with the parameters relative to the widths of their bounds, and the state in its metric.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from petsc4py import PETSc

from rodfem.codim2.criterion import Criterion
from rodfem.codim2.curve import Half, Tracer
from rodfem.codim2.locus import Locus, Mark
from rodfem.codim2.locus_errors import Errors, criterion_of, errors_of, not_integrated
from rodfem.codim2.others import NEAREST, UNSTABLE, all_looked_at, unstable
from rodfem.codim2.parameter_plane import Interval, LocusPoint, Plane
from rodfem.codim2.singular import null_vectors
from rodfem.continuation.branch import SpecialPoint
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.kinds import BRANCH_POINT, DIVERGENCE, FLUTTER, KINDS
from rodfem.continuation.static_solver import StaticSolver
from rodfem.continuation.step_control import StepControl
from rodfem.errors import ConvergenceError, InputError
from rodfem.output.files import mesh_of
from rodfem.stability.cluster import as_vectors
from rodfem.stability.inertia import Inertia
from rodfem.stability.nonsymmetric import NonsymmetricSolver

STEPS = StepControl(first=0.01, largest=0.04, smallest=1e-6, aim=2e-3, most=1000)
"""Steps of a locus, as shares of the bounds."""
BESIDE = 1e-3
"""Distance of a load beside a divergence load at which the unstable eigenvalues are counted, over the bounds."""


class Curve(NamedTuple):
    """``nodes`` of a curve, its rows with ``marks``, the row of its ``start``, and why it ``ended`` on either side."""

    nodes: list[LocusPoint]
    marks: dict[int, str]
    start: int
    ended: tuple[str, str]


def locus(
    solver: StaticSolver,
    special: SpecialPoint,
    parameter: str,
    bounds: tuple[Interval, Interval],
    steps: StepControl = STEPS,
    error_bars: int = 5,
    *,
    doubtful: bool = False,
) -> Locus:
    """Follow a special point in the plane of the scene's load and a second parameter, to both sides.

    Parameters
    ----------
    solver
        The :class:`~rodfem.continuation.branch_solver.BranchSolver` that found the special point, or for flutter and
        divergence the :class:`~rodfem.continuation.static_solver.StaticSolver` of the sweep.  It is left as it was.
    special
        A fold, a branch point, a flutter load or a divergence load.
    parameter
        Name of the second parameter of the scene.
    bounds
        Intervals of the load and of the second parameter, on which the curve ends exactly.
    steps
        Control of the step; lengths are relative to the bounds.
    error_bars
        At how many rows, besides the marked ones, the error of the discretisation is estimated; 0: at none.
    doubtful
        Whether the mesh leaves the index beside the special point open, so that it does not resolve the curve.

    Raises
    ------
    InputError
        For a parameter, bounds or a kind of special point that make no sense.
    ConvergenceError
        Where the special point itself is not found again.
    """
    system, scene = solver.system, solver.system.scene
    plane = Plane(system, parameter, bounds)
    p = np.array([special.point.load, scene.parameters[parameter].value])
    if plane.outside(p) is not None:
        raise InputError(
            f"The special point at {scene.load} = {p[0]:g}, {parameter} = {p[1]:g} is outside the bounds: widen them."
        )
    with system.clock.scope("locus"), plane.kept():
        system.line = plane.along(p, 0)
        guess = _guess(solver, special, p)
        criterion = criterion_of(solver, plane, special.kind, guess)
        try:
            first = criterion.correct(p, special.point.x, (np.array([0.0, 1.0]) * plane.width, None), guess, 0.1)
        except ConvergenceError as trouble:
            raise ConvergenceError(
                f"The {special.kind} at {scene.load} = {p[0]:.8g} has no locus in {scene.load} and {parameter}: it is "
                f"not found again there ({trouble}); use more elements."
            ) from trouble
        tracer = Tracer(criterion, plane, steps)
        found = _both_sides(tracer, first)
        crossings = _crossings(tracer, found, first, float(p[1]))
        errors = errors_of(solver, special.kind, plane, found.nodes, found.marks, error_bars)
        lower = _lower_side(solver, plane, special, first)
        if doubtful or special.resolved is False:
            errors = errors._replace(unresolved=list(range(len(found.nodes))))
        doubt = not_integrated(solver, plane, found.nodes, errors.error)
        nearest = _nearest(solver, criterion, plane, first)
    located = _locus(solver, special, (plane.names, bounds), found, crossings, errors, lower)
    located.note = " ".join(f"Locus of the {special.kind}: {words}" for words in (doubt, nearest) if words)
    return located


def _locus(
    solver: StaticSolver,
    special: SpecialPoint,
    plane: tuple[tuple[str, str], tuple[Interval, Interval]],
    found: Curve,
    crossings: list[tuple[float, float]],
    errors: Errors,
    lower: int,
) -> Locus:
    """The curve that was found in a ``plane``, its names and bounds, with what a file of it says about the scene."""
    scene, nodes, (names, bounds) = solver.system.scene, found.nodes, plane
    rest, k = np.array([n.rest for n in nodes]), _changing(special, nodes[found.start])
    load, other = (scene.parameters[name] for name in names)
    return Locus(
        scene=scene.name,
        title=scene.title or scene.name,
        kind=special.kind,
        names=names,
        labels=(load.label or names[0], other.label or names[1]),
        ordinate_name=scene.ordinate.name,
        bounds=bounds,
        values=np.array([n.p for n in nodes]),
        ordinate=np.array([n.ordinate for n in nodes]),
        natural=solver.units.ordinate,
        index=np.stack([rest, np.where(rest >= 0, rest + k, -1)], axis=1),
        lower=lower,
        omega2=np.array([n.omega2 for n in nodes]),
        located_to=np.array([n.located_to for n in nodes]),
        error=errors.error,
        unresolved=errors.unresolved,
        planar=bool(scene.planar),
        marks=[Mark(kind, row) for row, kind in sorted(found.marks.items())],
        start=found.start,
        ended=found.ended,
        constants={name: v.value for name, v in scene.parameters.items() if name not in names},
        discretization=mesh_of(solver.system),
        states=[n.x for n in nodes],
        crossings=crossings,
        words=(load.words, other.words),
        units=(load.unit, other.unit),
    )


def _nearest(solver: StaticSolver, criterion: Criterion, plane: Plane, node: LocusPoint) -> str:
    """Sentence on the eigenvalues that an index counts, where these are not all of the mesh; or empty."""
    if criterion.others != UNSTABLE:
        return ""
    solver.system.line = plane.along(node.p, 0)
    solver.system.set_load(node.x, float(node.p[0]))
    return "" if all_looked_at(NonsymmetricSolver(solver.system).at(node.x)) else f"{NEAREST}."


def _crossings(tracer: Tracer, found: Curve, first: LocusPoint, level: float) -> list[tuple[float, float]]:
    """Load and ordinate at the start, and wherever else the curve passes the second parameter's value there."""
    crossings = [(float(first.p[0]), first.ordinate)]
    for side in (found.nodes[: found.start][::-1], found.nodes[found.start + 1 :]):
        for a, b in pairwise(side):
            if (a.p[1] - level) * (b.p[1] - level) < 0:
                crossings += [(float(n.p[0]), n.ordinate) for n in tracer.points.crossed(a, b, 1, level)]
    return crossings


def _both_sides(tracer: Tracer, first: LocusPoint) -> Curve:
    """The curve through the ``first`` point, to both sides."""
    onwards = tracer.run(first)
    backwards = Half([first], ended="closed curve")
    if onwards.ended != "closed curve":
        backwards = tracer.run(first.reversed())
    start = len(backwards.nodes) - 1
    marks = {start - i: kind for i, kind in backwards.marks.items()}
    marks |= {start + i: kind for i, kind in onwards.marks.items()}
    return Curve(backwards.nodes[:0:-1] + onwards.nodes, marks, start, (backwards.ended, onwards.ended))


def _guess(solver: StaticSolver, special: SpecialPoint, p: np.ndarray) -> LocusPoint:
    """The special point as a point of the plane; raises :class:`InputError` for a kind that has no locus."""
    if special.kind.line is None:
        kinds = ", ".join(name for name, kind in KINDS.items() if kind.line is not None)
        raise InputError(f"A point of the kind {special.kind!r} has no locus: choose one of {kinds}.")
    if special.kind.singular and not isinstance(solver, BranchSolver):
        raise InputError("The locus of a fold or a branch point needs the solver that found it.")
    x, left = special.point.x, list[PETSc.Vec]()
    modes = list(special.null_vectors)
    if special.kind == FLUTTER:
        if special.cluster is None or special.note:
            raise InputError(f"This flutter has no locus: {special.note or 'it was not found by a sweep'}.")
        modes = as_vectors(solver.system, special.cluster.basis)
    if special.kind == DIVERGENCE:
        number = abs(special.negative_after - special.negative_before)
        modes, left = null_vectors(Inertia(solver.system), x, number)
    return LocusPoint(
        p, x, p, x, p, omega2=special.omega2 if special.kind == FLUTTER else np.nan, modes=modes, left=left
    )


def _changing(special: SpecialPoint, node: LocusPoint) -> int:
    """By how much the index changes across a locus at a node."""
    if special.kind == FLUTTER:  # two that have diverged are as unstable as a complex pair
        return 0 if node.omega2 < 0 else len(node.modes)
    return len(node.modes) if special.kind == DIVERGENCE else special.multiplicity


def _lower_side(solver: StaticSolver, plane: Plane, special: SpecialPoint, node: LocusPoint) -> int:
    """Side of the load, -1 or 1, on which the index is the lower one beside a special point; 0: unknown."""
    if special.kind == FLUTTER:
        return node.lower
    if special.kind == DIVERGENCE:
        solver.system.line = plane.along(node.p, 0)
        loads = node.p[0] + BESIDE * plane.width[0] * np.array([-1.0, 1.0])
        states = (solver.at_load(node.x, float(load))[0] for load in loads)
        below, above = (unstable(NonsymmetricSolver(solver.system).at(x)) for x in states)
        return int(np.sign(below - above))
    change = special.negative_after - special.negative_before
    if special.kind != BRANCH_POINT or special.test_function != "mu":
        return 0
    return int(-np.sign(change * special.point.slope))
