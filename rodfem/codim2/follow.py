"""Loci of special points in the plane of two parameters: the boundary of stability.

A fold, a branch point, a flutter or a divergence load ``lam`` of a scene moves as another of its parameters does.  Its
curve in the plane of both is followed by pseudo-arclength continuation of the equations that define it
(:mod:`rodfem.codim2.criteria`), in the space of the state and *both* parameters: neither is the independent one, so
that the curve may turn back with respect to either, and goes through cusps.  Both directions are followed, to the
bounds, exactly, or to where the special point changes its kind.  Arclength is measured with the parameters relative to
the widths of their bounds, and the state in its metric.

Errors of rows are how far the curve of a richer discretisation is away.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np
from petsc4py import PETSc

from rodfem.adaptivity.error_estimate import RESOLVED_TO, Enriched, bound
from rodfem.codim2.criteria import NEAREST, UNSTABLE, Collision, Singular, null_vectors, unstable
from rodfem.codim2.curve import Half, Tracer
from rodfem.codim2.locus import Locus, Mark, Row
from rodfem.codim2.plane import Criterion, Interval, LocusPoint, Plane
from rodfem.codim2.points import place
from rodfem.continuation.branch import SpecialPoint
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.kinds import BRANCH_POINT, DIVERGENCE, FLUTTER, FOLD, KINDS
from rodfem.continuation.step_control import StepControl
from rodfem.errors import ConvergenceError, InputError
from rodfem.fem.quadrature_check import QuadratureCheck
from rodfem.fem.shape import halved
from rodfem.output.files import mesh_of
from rodfem.stability.cluster import as_vectors
from rodfem.stability.nonsymmetric import NonsymmetricSolver
from rodfem.tolerances import same_special


class Errors(NamedTuple):
    """Bounds (n, 2) of the errors of rows, nan where they are not estimated, inf if the richer mesh finds no point.

    ``unresolved`` rows are those whose state, or null vectors, the mesh does not resolve.
    """

    error: np.ndarray
    unresolved: list[int]


def criterion_of(solver: BranchSolver, plane: Plane, kind: str, near: LocusPoint) -> Criterion:
    """Defining equations in a ``plane`` of a ``kind`` of special points, ``near`` one; ``solver`` has the mesh."""
    return Collision(solver, plane) if kind == FLUTTER else Singular(solver, plane, near, fold=kind == FOLD)


class RicherMesh:
    """The same locus, of a ``kind`` of special points in a ``plane``, on a discretisation one degree richer."""

    def __init__(self, solver: BranchSolver, kind: str, plane: Plane) -> None:
        """``solver`` has the mesh on which it was found."""
        self.richer, self.kind = Enriched(solver), kind
        self.plane = Plane(self.richer.system, plane.names[1], plane.intervals)
        self.rho = halved(solver.system.fields.discretization.degree)
        self._criterion: Criterion | None = None

    def compare(self, node: LocusPoint) -> tuple[list[float], bool]:
        """Bounds of the errors of both parameters, and whether the mesh resolves the state and its null vectors.

        Raises :class:`ConvergenceError`.
        """
        near = self._transferred(node)
        if self._criterion is None:
            self._criterion = criterion_of(self.richer.solver, self.plane, self.kind, near)
        resolved = True
        if node.sought is None:
            found = self._criterion.correct((node.p, near.x, node.dp, None), near, 0.1)
            there, located_to = found.p, found.located_to
            resolved = self._changed(near, found) <= RESOLVED_TO
        else:
            sought = place(self._criterion, self.plane, near, node.sought, node.windows)
            there, located_to = sought.p, sought.dp
        each = zip(node.p, there, node.located_to + located_to, strict=True)
        return [bound(*pair, self.rho) for pair in each], resolved

    def _transferred(self, node: LocusPoint) -> LocusPoint:
        x, dx = self.richer.transfer(node.x, state=True), self.richer.transfer(node.dx, state=False)
        modes, left = ([self.richer.transfer(v, state=False) for v in side] for side in (node.modes, node.left))
        return replace(node, x=x, dx=dx, modes=modes, left=left)

    def _changed(self, near: LocusPoint, found: LocusPoint) -> float:
        """Relative change of the strains of a state, or of one of its null vectors."""
        norm, modes = self.richer.system.norm, near.modes[: near.multiplicity]
        changes = [self.richer.indicator.changed(near.x, found.x, state=True)]
        for first, last in zip(modes, found.modes, strict=False):
            changes.append(self.richer.indicator.changed(first / norm(first), last / norm(last), state=False))
        return max(changes)


def errors_of(
    solver: BranchSolver, kind: str, plane: Plane, nodes: Sequence[LocusPoint], rows: Iterable[int]
) -> Errors:
    """Estimate errors at some ``rows`` of ``nodes``: the distance to the curve of a richer discretisation.

    It is measured across the curve, but for turning points and ends to those of the other curve.  ``solver``, ``kind``
    and ``plane`` are those of the locus.
    """
    error, rows, unresolved = np.full((len(nodes), 2), np.nan), sorted(rows), set[int]()
    if not rows:
        return Errors(error, [])
    richer = RicherMesh(solver, kind, plane)
    for row in rows:
        try:
            error[row], resolved = richer.compare(nodes[row])
            unresolved |= set() if resolved else {row}
        except ConvergenceError:
            error[row] = np.inf
    neighbours = [{*rows[max(i - 1, 0) : i + 2]} for i in range(len(rows))]
    doubtful = {row for row, near in zip(rows, neighbours, strict=True) if nodes[row].sought and near & unresolved}
    return Errors(error, sorted(unresolved | doubtful))


def not_integrated(solver: BranchSolver, plane: Plane, nodes: Sequence[LocusPoint], error: np.ndarray) -> str:
    """Take the errors away of ``nodes`` at which the mesh does not integrate the equations; a clause on the first.

    ``solver`` has found the locus in a ``plane``; ``error`` (n, 2) is changed.
    """
    check, said = QuadratureCheck(solver.system), ""
    for row in np.flatnonzero(np.isfinite(error[:, 0])):
        node = nodes[row]
        if words := check(plane.at(node.p, node.x)):
            error[row] = np.nan
            said = said or f"at {plane.words(node.p, 6)} {words}"
    return said


STEPS = StepControl(first=0.01, largest=0.04, smallest=1e-6, aim=2e-3, most=1000)
"""Steps of a locus, as shares of the bounds."""
COUNT_OFFSET = 1e-3
"""Distance of a load from a divergence load at which the unstable eigenvalues are counted, over the bounds."""
COLUMNS = "p", "rest", "ordinate", "omega2", "located_to"
"""Of the points of a curve what its rows have."""


def locus(
    solver: BranchSolver,
    special: SpecialPoint,
    parameter: str,
    bounds: tuple[Interval, Interval],
    steps: StepControl = STEPS,
    error_bars: int = 5,
    *,
    doubtful: bool = False,
) -> Locus:
    """Follow a ``special`` point in the plane of the scene's load and a second ``parameter``, to both sides.

    ``bounds`` are their intervals, on which the curve ends exactly; lengths of ``steps`` are relative to them.  Errors
    are estimated at the marked rows and so many others, ``error_bars``; 0: at none.  The ``solver`` is that of the
    special point, and is left as it was; ``doubtful``: its mesh leaves the index next to the point open.  Raises
    :class:`InputError` for a parameter, bounds or a kind that make no sense, :class:`ConvergenceError` if the special
    point is not found again.
    """
    system, scene = solver.system, solver.system.scene
    plane = Plane(system, parameter, bounds)
    p = np.array([special.point.load, scene.parameters[parameter].value])
    if plane.outside(p) is not None:
        raise InputError(
            f"The special point at {scene.load} = {p[0]:g}, {parameter} = {p[1]:g} is outside the bounds: widen them."
        )
    with system.clock.scope("locus"), plane.kept():
        of = _Followed(solver, special, plane)
        tracer = Tracer(of.criterion, plane, steps)
        curve = _both_sides(tracer, of.first)
        rows = np.linspace(0, len(curve.nodes) - 1, error_bars).round().astype(int).tolist()
        errors = errors_of(solver, special.kind, plane, curve.nodes, {*rows, *curve.marks} if error_bars else ())
        if doubtful or special.resolved is False:
            errors = errors._replace(unresolved=list(range(len(curve.nodes))))
        found = of.locus(curve, errors)
        start = of.rows(tracer, curve, 1, float(of.first.p[1]))
        found.crossings = list(map(attrgetter("load", "ordinate"), start))
        notes = not_integrated(solver, plane, curve.nodes, errors.error), of.nearest()
    found.solve = partial(of.rows, tracer, curve)
    found.note = " ".join(f"Locus of the {special.kind}: {words}" for words in notes if words)
    return found


@dataclass
class _Curve:
    """``nodes`` of a curve, its rows with ``marks``, the row of its ``start``, and why it ``ended`` on either side."""

    nodes: list[LocusPoint]
    marks: dict[int, str]
    start: int
    ended: tuple[str, str]


def _both_sides(tracer: Tracer, first: LocusPoint) -> _Curve:
    """The curve through the ``first`` point, to both sides."""
    onwards = tracer.run(first)
    backwards = Half([first], ended="closed curve")
    if onwards.ended != "closed curve":
        backwards = tracer.run(first.reversed())
    start = len(backwards.nodes) - 1
    marks = {start - i: kind for i, kind in backwards.marks.items()}
    marks |= {start + i: kind for i, kind in onwards.marks.items()}
    return _Curve(backwards.nodes[:0:-1] + onwards.nodes, marks, start, (backwards.ended, onwards.ended))


def _crossings(tracer: Tracer, curve: _Curve, which: int, value: float) -> list[LocusPoint]:
    """Points at which parameter ``which`` has a ``value``, each once, the start before others."""
    first, found = curve.nodes[curve.start], list[LocusPoint]()
    onwards = curve.nodes[curve.start :]
    backwards = [first.reversed(), *curve.nodes[: curve.start][::-1]]
    for side in (onwards, backwards):
        for a, b in pairwise([side[0], *side]):
            if b.p[which] == value:
                found.append(b)
            elif (a.p[which] - value) * (b.p[which] - value) < 0 and a.s < b.s:
                found += tracer.points.crossed(a, b, which, value)
    other, units, plane = 1 - which, tracer.criterion.solver.units, tracer.points.plane
    places = [(float(n.p[other]), n.ordinate) for n in found]

    def known(i: int) -> bool:
        left, sizes = float(found[i].located_to[other]), (float(plane.sizes[other]), units.ordinate)
        return any(same_special(places[i], left, place, sizes) for place in places[:i])

    return [node for i, node in enumerate(found) if not known(i)]


def _check(solver: BranchSolver, special: SpecialPoint) -> None:
    """Raise :class:`InputError` for a special point that has no locus."""
    if special.kind.line is None:
        kinds = ", ".join(name for name, kind in KINDS.items() if kind.line is not None)
        raise InputError(f"A point of the kind {special.kind!r} has no locus: choose one of {kinds}.")
    if special.kind.singular and not solver.conservative:
        raise InputError("The locus of a fold or a branch point needs the solver that found it.")
    if special.kind == FLUTTER and (special.cluster is None or special.note):
        raise InputError(f"This flutter has no locus: {special.note or 'it was not found by a sweep'}.")


class _Followed:
    """A special point of a diagram as the ``first`` one of its locus in a plane."""

    def __init__(self, solver: BranchSolver, special: SpecialPoint, plane: Plane) -> None:
        """Find it again; raises :class:`InputError` where it has no locus and :class:`ConvergenceError`."""
        _check(solver, special)
        self.solver, self.special, self.plane = solver, special, plane
        p = np.array([special.point.load, solver.system.scene.parameters[plane.names[1]].value])
        guess = self._guess(p)
        self.criterion: Criterion = criterion_of(solver, plane, special.kind, guess)
        try:
            self.first = self.criterion.correct((p, guess.x, plane.axis(1), None), guess, 0.1)
        except ConvergenceError as trouble:
            load, parameter = plane.names
            raise ConvergenceError(
                f"The {special.kind} at {load} = {p[0]:.8g} has no locus in {load} and {parameter}: it is not found "
                f"again there ({trouble}); use more elements."
            ) from trouble

    def _guess(self, p: np.ndarray) -> LocusPoint:
        """The special point as a point ``p`` of the plane."""
        solver, special = self.solver, self.special
        x, left = self.plane.at(p, special.point.x.copy()), list[PETSc.Vec]()
        modes, multiplicity = [*special.null_vectors, *special.nearby], special.multiplicity
        if special.kind == FLUTTER:
            assert special.cluster is not None
            modes, multiplicity = as_vectors(solver.system, special.cluster.basis), 0
        if special.kind == DIVERGENCE:
            multiplicity = abs(special.negative_after - special.negative_before)
            modes, left = null_vectors(solver, x, multiplicity)
        omega2 = special.omega2 if special.kind == FLUTTER else np.nan
        return LocusPoint(p, x, p, x, p, omega2=omega2, modes=modes, left=left, multiplicity=multiplicity)

    def locus(self, curve: _Curve, errors: Errors) -> Locus:
        """The curve that was found, with what a file of it says about the scene."""
        scene, nodes, names = self.solver.system.scene, curve.nodes, self.plane.names
        load, other = (scene.parameters[name] for name in names)
        columns: dict[str, Any] = {name: np.array([getattr(n, name) for n in nodes]) for name in COLUMNS}
        values, rest = columns.pop("p"), columns.pop("rest")
        return Locus(
            scene=scene.name,
            title=scene.title or scene.name,
            kind=self.special.kind,
            names=names,
            labels=(load.label or names[0], other.label or names[1]),
            ordinate_name=scene.ordinate.name,
            bounds=self.plane.intervals,
            values=values,
            **columns,
            natural=self.solver.units.ordinate,
            index=np.stack([rest, np.where(rest >= 0, rest + self._changing(), -1)], axis=1),
            lower=self._lower_side(),
            error=errors.error,
            unresolved=errors.unresolved,
            planar=bool(scene.planar),
            marks=[Mark(kind, row) for row, kind in sorted(curve.marks.items())],
            start=curve.start,
            ended=curve.ended,
            constants={name: v.value for name, v in scene.parameters.items() if name not in names},
            discretization=mesh_of(self.solver.system),
            states=[n.x for n in nodes],
            words=(load.words, other.words),
            units=(load.unit, other.unit),
        )

    def rows(self, tracer: Tracer, curve: _Curve, which: int, value: float) -> list[Row]:
        """Rows of a curve at which parameter ``which`` has a ``value``, solved for on the mesh of the locus."""
        with self.plane.kept():
            found = _crossings(tracer, curve, which, value)
        change = self._changing()
        sides = [(n.rest, n.rest + change if n.rest >= 0 else -1) for n in found]
        rest = [(n.ordinate, n.omega2, i, tuple(n.located_to.tolist())) for n, i in zip(found, sides, strict=True)]
        return [Row(float(n.p[0]), float(n.p[1]), *others) for n, others in zip(found, rest, strict=True)]

    def _changing(self) -> int:
        """By how much the index changes across the locus at the first point."""
        if self.special.kind == FLUTTER:  # two that have diverged are as unstable as a complex pair
            return 0 if self.first.omega2 < 0 else len(self.first.modes)
        return self.first.multiplicity

    def _lower_side(self) -> int:
        """Side of the load, -1 or 1, on which the index is the lower one next to the special point; 0: unknown."""
        special, solver, node = self.special, self.solver, self.first
        if special.kind == FLUTTER:
            return node.lower
        if special.kind == DIVERGENCE:
            x = self.plane.at(node.p, node.x)
            loads = node.p[0] + COUNT_OFFSET * self.plane.width[0] * np.array([-1.0, 1.0])
            pencils = NonsymmetricSolver(solver.system)
            below, above = (unstable(pencils.at(solver.at_load(x, float(load))[0])) for load in loads)
            return int(np.sign(below - above))
        change = special.negative_after - special.negative_before
        if special.kind != BRANCH_POINT or special.test_function != "mu":
            return 0
        return int(-np.sign(change * special.point.slope))

    def nearest(self) -> str:
        """Words on the eigenvalues that the index counts, where these are not all of the mesh; or empty."""
        if self.criterion.others != UNSTABLE:
            return ""
        x = self.plane.at(self.first.p, self.first.x)
        return "" if NonsymmetricSolver(self.solver.system).at(x).spectrum.complete else f"{NEAREST}."
