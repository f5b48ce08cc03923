"""Loci of special points in the plane of two parameters: the boundary of stability.

A fold, a branch point, a flutter or a divergence load ``lam`` of a scene moves as another of its parameters does.  Its
curve in the plane of both is followed by pseudo-arclength continuation of the equations that define it
(:mod:`rodfem.codim2.criteria`), in the space of the state and *both* parameters: neither is the independent one, so
that the curve may turn back with respect to either, and goes through cusps.  Both directions are followed, to the
bounds, exactly, or to where the special point changes its kind.  Arclength is measured with the parameters relative to
the widths of their bounds, and the state in its metric.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
from petsc4py import PETSc

from rodfem import compat
from rodfem.adaptivity.error_estimate import RESOLVED_TO, Enriched, bound
from rodfem.codim2.adjoint import restoration
from rodfem.codim2.criteria import (
    DIFFERENCE,
    UNSTABLE,
    Collision,
    Criterion,
    Destroyed,
    Interval,
    LocusPoint,
    Oscillation,
    Plane,
    Singular,
    interpolant,
    null_vectors,
    predict,
    unstable,
)
from rodfem.codim2.locus import Locus, Mark, Row
from rodfem.codim2.points import Codim2Points, place
from rodfem.continuation.branch import SpecialPoint
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.curves import ALIGNED, ROWS
from rodfem.continuation.follow import StepControl
from rodfem.continuation.kinds import BRANCH_POINT, CROSSES, DIVERGENCE, FLUTTER, FOLD, GAP, KINDS
from rodfem.errors import ConvergenceError, InputError
from rodfem.fem.checks import Convexity, QuadratureCheck
from rodfem.fem.shape import halved
from rodfem.stability.nonsymmetric import NonsymmetricSolver
from rodfem.tolerances import INSIDE, same_special

STEPS = StepControl(first=0.01, largest=0.04, smallest=1e-6, aim=2e-3, most=1000)
"""Steps of a locus, as shares of the bounds."""
Vectors = list[PETSc.Vec]
REACH = 1e-6  # distance, in the metric, that a point on a line of parameters may move by, however short the step
NEAREST = "the index is that of the frequencies nearest zero: the mesh has too many unknowns to find all of them"


def criterion_of(solver: BranchSolver, plane: Plane, kind: str, near: LocusPoint) -> Criterion:
    """Defining equations in a ``plane`` of a ``kind`` of special points, ``near`` one; ``solver`` has the mesh."""
    if kind != FLUTTER:
        return Singular(solver, plane, near, fold=kind == FOLD)
    return (Collision if solver.system.scene.inertia.order == 2 else Oscillation)(solver, plane)


class Half:
    """One direction of a curve from a node: its ``nodes``, marks by their number, and why it ``ended``."""

    def __init__(self, points: Codim2Points, convexity: Convexity, start: LocusPoint) -> None:
        self.points, self.convexity = points, convexity
        self.criterion, self.plane = points.criterion, points.plane
        self.nodes, self.steps = [start], [start]  # these without what lies between two steps
        self.marks, self.ended = dict[int, str](), start.ended
        if over := self.plane.outside(start.p + INSIDE * start.dp):
            self.ended = self.ended or self._bound(*over)

    def run(self, control: StepControl) -> Half:
        """Follow to an end."""
        step, failures = control.first, 0
        while not self.ended and len(self.steps) < control.most:
            compat.destroy_garbage(self.criterion.solver.system.comm)
            # beyond a sharp bend the polynomial through the last nodes has another tangent than the curve
            recent = self.steps[-ROWS:] if failures < 2 else self.steps[-1:]
            try:
                moved = self._advance(recent, step)
            except Destroyed as trouble:
                self.ended = str(trouble)
            except ConvergenceError as trouble:
                step, failures = step / 2, failures + 1
                if step < control.smallest:
                    self.ended = f"no convergence with steps of {control.smallest:g}: {trouble}"
            else:
                step, failures = control.after(step, moved, min(len(recent), 3) + 1), 0
        self.ended = self.ended or f"{control.most} points reached"
        return self

    def _advance(self, recent: list[LocusPoint], step: float) -> float:
        """Add the next node, predicted by ``recent`` ones, and what is before it; how far it is from its prediction."""
        node, moved, bound = self._step(recent, step)
        last = self.steps[-1]
        self.ended = node.ended or self._lost_convexity(last, node) or self._insert(last, node)
        if not self.ended:
            self.nodes.append(node)
            self.ended = bound or self._closed(last, node)
        self.steps.append(node)
        return moved

    def _step(self, recent: list[LocusPoint], step: float) -> tuple[LocusPoint, float, str]:
        """Next node, how far it is from its prediction, and the bound that it is on; ConvergenceError to retry."""
        last = recent[-1]
        guess = predict(recent, last.s + step)
        p, x, dp, dx = guess
        if (over := self.plane.outside(p)) is None:
            node = self._place(last, self.criterion.correct(guess, last, 0.5 * step))
            if (over := self.plane.outside(node.p)) is None:
                if self._cosine(node, dp, dx) < ALIGNED or node.s - last.s > 2 * step:
                    raise ConvergenceError("the curve bends too sharply")
                if node.orientation != last.orientation and not self._leads_across(last, node):
                    raise ConvergenceError("the curve turns before another one")
                return node, self.criterion.length(p - node.p, x - node.x), ""
            p = node.p
        which, bound = over
        p, x, dp, dx = predict(recent, last.s + (bound - last.p[which]) / (p[which] - last.p[which]) * step)
        p[which] = bound
        node = self.criterion.correct((p, x, self.plane.axis(which), None), last, max(0.5 * step, REACH))
        node.p[which] = bound
        node = self._place(last, node if self._cosine(node, dp, dx) >= 0 else node.reversed())
        if self.plane.outside(node.p) is not None or node.s - last.s > 2 * step:
            raise ConvergenceError("it leaves near a corner of the bounds")
        return node, 0.0, self._bound(which, bound)

    def _leads_across(self, a: LocusPoint, b: LocusPoint) -> bool:
        """Whether the curve through ``a`` leads to ``b``, on another side of its tangent, across a second curve.

        Two curves that nearly cross are the two sides of a gap: each turns, and a step may lead from one to the other.
        Smaller and smaller steps towards the crossing tell.
        """
        here, step = a, (b.s - a.s) / 2
        while step > 0.1 * GAP:
            try:
                guess = predict([here], here.s + step)
                node = self._place(here, self.criterion.correct(guess, here, 0.5 * step))
                if node.orientation != here.orientation or self._cosine(node, here.dp, here.dx) < ALIGNED:
                    raise ConvergenceError("the curve turns, or another one crosses it")
            except ConvergenceError:
                step /= 2
                continue
            here = node
            if here.s > b.s or self._cosine(here, a.dp, a.dx) < ALIGNED:
                return False
        return True

    def _bound(self, which: int, bound: float) -> str:
        return f"{self.plane.names[which]} = {bound:g}, its bound"

    def _place(self, last: LocusPoint, node: LocusPoint) -> LocusPoint:
        node.s = last.s + self.criterion.length(node.p - last.p, node.x - last.x)
        return node

    def _cosine(self, node: LocusPoint, dp: np.ndarray, dx: PETSc.Vec) -> float:
        """Cosine between a node's tangent and a direction."""
        size = self.criterion.length(dp, dx)
        dp, dx = dp / size, dx / size
        a, b = self.criterion.length(node.dp + dp, node.dx + dx), self.criterion.length(node.dp - dp, node.dx - dx)
        return (a * a - b * b) / 4

    def _insert(self, last: LocusPoint, node: LocusPoint) -> str:
        """Insert what lies between the last node and the next one; a reason if the curve ends there."""
        rows, ended = self.points.rows(last, node)
        for row, kind in rows:
            self.marks[len(self.nodes)] = kind
            self.nodes.append(row)
        if not ended and last.rest != node.rest:
            self.marks[len(self.nodes)] = self.criterion.others
        elif not ended and last.orientation != node.orientation:
            self.marks[len(self.nodes)] = CROSSES
        return ended

    def _closed(self, a: LocusPoint, b: LocusPoint) -> str:
        """Why the curve ends if it passes its beginning again between two nodes."""
        start = self.steps[0]
        whole, part = (b.p - a.p) / self.plane.width, (start.p - a.p) / self.plane.width
        size = float(np.linalg.norm(whole))
        if len(self.steps) < 3 or not size or not 0 < part @ whole <= size**2:
            return ""
        p, x, dp, dx = interpolant(a, b, a.s + (part @ whole) / size**2 * (b.s - a.s))
        near = self.criterion.length(p - start.p, x - start.x) < 0.1 * (b.s - a.s)
        if not near or self._cosine(start, dp, dx) < ALIGNED:
            return ""
        self.nodes.append(start)
        return "closed curve"

    def _lost_convexity(self, last: LocusPoint, node: LocusPoint) -> str:
        """Why a curve ends between two nodes, if the stored energy is not convex at the second one; empty if it is."""
        if not self.convexity.alters or self.convexity.holds(self.plane.at(node.p, node.x)):
            return ""
        scales = self.convexity.scales(self.plane.at(last.p, last.x))
        lost = self.points.located(last, node, lambda n: self.convexity.margin(self.plane.at(n.p, n.x), scales))
        return f"the stored energy is not convex any more near {self.plane.words((lost or node).p)}"


class RicherMesh:
    """The curve of a ``criterion`` for a ``kind`` of special points, ``near`` one, on a mesh one degree richer."""

    def __init__(self, criterion: Criterion, kind: str, near: LocusPoint) -> None:
        self.richer, plane = Enriched(criterion.solver), criterion.plane
        plane = Plane(self.richer.system, plane.names[1], plane.intervals)
        self.rho = halved(criterion.solver.system.fields.discretization.degree)
        self.criterion = criterion_of(self.richer.solver, plane, kind, self._transferred(near))

    def compare(self, node: LocusPoint) -> tuple[list[float], bool]:
        """Bounds of the errors of both parameters, and whether the mesh resolves the state; or ConvergenceError."""
        near, resolved = self._transferred(node), True
        if node.sought is None:
            found = self.solve(node)
            there, located_to = found.p, found.located_to
            resolved = self._changed(near, found) <= RESOLVED_TO
        else:
            sought = place(self.criterion, near, node.sought, node.windows)
            there, located_to = sought.p, sought.dp
        each = zip(node.p, there, node.located_to + located_to, strict=True)
        return [bound(*pair, self.rho) for pair in each], resolved

    def solve(self, node: LocusPoint) -> LocusPoint:
        """The point of the richer mesh across the curve; raises :class:`ConvergenceError`."""
        near = self._transferred(node)
        return self.criterion.correct((node.p, near.x, node.dp, None), near, 0.1)

    def _transferred(self, node: LocusPoint) -> LocusPoint:
        x, dx = self.richer.transfer(node.x, state=True), self.richer.transfer(node.dx, state=False)
        modes, left = ([self.richer.transfer(v, state=False) for v in side] for side in (node.modes, node.left))
        return replace(node, x=x, dx=dx, modes=modes, left=left)

    def _changed(self, near: LocusPoint, found: LocusPoint) -> float:
        """Relative change of the strains of a state, or of one of its null vectors."""
        norm, changed = self.richer.system.norm, self.richer.indicator.changed
        pairs = zip(near.modes[: near.multiplicity], found.modes, strict=False)
        of_modes = [changed(v / norm(v), w / norm(w), state=False) for v, w in pairs]
        return max([changed(near.x, found.x, state=True), *of_modes])


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

    On ``bounds``, their intervals, the curve ends exactly; lengths of ``steps`` are relative to them.  Errors are
    estimated at the marked rows and so many others, ``error_bars``.  The ``solver`` is that of the special point, and
    is left as it was; ``doubtful``: its mesh leaves the index next to the point open.
    """
    plane = Plane(solver.system, parameter, bounds)
    with solver.system.clock.scope("locus"), restoration(plane.system):
        curve = Curve(solver, special, plane, doubtful=doubtful or special.resolved is False)
        curve.follow(steps)
        found = curve.locus(*curve.errors(error_bars))
        found.crossings = [(n.load, n.ordinate) for n in curve.rows(1, float(curve.first.p[1]))]
        notes = filter(None, (curve.not_integrated(found.error), curve.nearest()))
    found.note = " ".join(f"Locus of the {special.kind}: {words}" for words in notes)
    return found


class Curve:
    """The curve of a special point of a diagram, the ``first`` one, in a plane: ``nodes`` with ``marks`` by number."""

    def __init__(self, solver: BranchSolver, special: SpecialPoint, plane: Plane, *, doubtful: bool) -> None:
        """Find the point again; of a ``doubtful`` one no row is resolved."""
        load, parameter = plane.names
        p = np.array([special.point.load, solver.system.scene.parameters[parameter].value])
        if plane.outside(p) is not None:
            raise InputError(
                f"The special point at {load} = {p[0]:g}, {parameter} = {p[1]:g} is outside the bounds: widen them."
            )
        check_special(solver, special)
        self.solver, self.special, self.plane, self.doubtful = solver, special, plane, doubtful
        guess = self._guess(p)
        self.criterion = criterion_of(solver, plane, special.kind, guess)
        self.points = Codim2Points(self.criterion)
        try:
            self.first = self.criterion.correct((p, guess.x, plane.axis(1), None), guess, 0.1)
        except ConvergenceError as trouble:
            raise ConvergenceError(
                f"The {special.kind} at {load} = {p[0]:.8g} has no locus in {load} and {parameter}: it is not found "
                f"again there ({trouble}); use more elements."
            ) from trouble

    def _guess(self, p: np.ndarray) -> LocusPoint:
        """The special point as a point ``p`` of the plane."""
        x = self.plane.at(p, self.special.point.x.copy())
        modes, left, multiplicity = modes_of(self.solver, self.special, x)
        omega2 = self.special.omega2 if self.special.kind == FLUTTER else np.nan
        return LocusPoint(p, x, p, x, p, omega2=omega2, modes=modes, left=left, multiplicity=multiplicity)

    def follow(self, steps: StepControl) -> None:
        """Follow the curve to both sides."""
        convexity = Convexity(self.plane.system, *self.plane.names)
        onwards = Half(self.points, convexity, self.first).run(steps)
        back, ended = Half(self.points, convexity, self.first.reversed()), onwards.ended
        if onwards.ended != "closed curve":
            ended = back.run(steps).ended
        self.start = len(back.nodes) - 1
        self.nodes, self.ended = [n.reversed() for n in back.nodes[:0:-1]] + onwards.nodes, (ended, onwards.ended)
        self.marks = {self.start - i: kind for i, kind in back.marks.items()}
        self.marks |= {self.start + i: kind for i, kind in onwards.marks.items()}

    def errors(self, number: int) -> tuple[np.ndarray, list[int]]:
        """Bounds (n, 2) of the errors of marked rows and a ``number`` of others, nan elsewhere; rows not resolved."""
        error = np.full((len(self.nodes), 2), np.nan)
        unresolved = set(range(len(error))) if self.doubtful else set[int]()
        if not number:
            return error, sorted(unresolved)
        rows = sorted({*np.linspace(0, len(error) - 1, number).round().astype(int).tolist(), *self.marks})
        richer = RicherMesh(self.criterion, self.special.kind, self.nodes[rows[0]])
        for row in rows:
            compat.destroy_garbage(self.criterion.solver.system.comm)
            try:
                error[row], resolved = richer.compare(self.nodes[row])
                unresolved |= set() if resolved else {row}
            except ConvergenceError:
                error[row] = np.inf
        neighbours = [{*rows[max(i - 1, 0) : i + 2]} for i in range(len(rows))]
        pairs = zip(rows, neighbours, strict=True)
        return error, sorted(unresolved | {row for row, near in pairs if self.nodes[row].sought and near & unresolved})

    def not_integrated(self, error: np.ndarray) -> str:
        """Take the errors away of rows at which the mesh does not integrate the equations; a clause on the first."""
        check, said = QuadratureCheck(self.solver.system), ""
        for row in np.flatnonzero(np.isfinite(error[:, 0])):
            node = self.nodes[row]
            if words := check(self.plane.at(node.p, node.x)):
                error[row] = np.nan
                said = said or f"at {self.plane.words(node.p, 6)} {words}"
        return said

    def nearest(self) -> str:
        """Words on the eigenvalues that the index counts, where these are not all of the mesh; or empty."""
        if self.criterion.others != UNSTABLE:
            return ""
        x = self.plane.at(self.first.p, self.first.x)
        return "" if NonsymmetricSolver(self.solver.system).at(x).spectrum.complete else f"{NEAREST}."

    def rows(self, which: int, value: float) -> list[Row]:
        """Rows at which parameter ``which`` has a ``value``, solved for on the mesh, each once, the start first."""
        with restoration(self.plane.system):
            found = self._crossings(which, value)
        other, sizes = 1 - which, (float(self.plane.sizes[1 - which]), self.solver.units.ordinate)
        places = [(float(n.p[other]), n.ordinate) for n in found]
        return [
            Row(float(n.p[0]), float(n.p[1]), n.ordinate, n.omega2, self._index(n), tuple(n.located_to.tolist()))
            for i, n in enumerate(found)
            if not any(same_special(places[i], float(n.located_to[other]), place, sizes) for place in places[:i])
        ]

    def _crossings(self, which: int, value: float) -> list[LocusPoint]:
        """Points at which parameter ``which`` has a ``value``, those nearest to the start first."""
        found = list[LocusPoint]()
        for a, b in pairwise([self.nodes[0], *self.nodes]):
            if b.p[which] == value:
                found.append(b)
            elif (a.p[which] - value) * (b.p[which] - value) < 0 and a.s < b.s:
                found += self._crossed(a, b, which, value)
        return sorted(found, key=lambda n: abs(n.s))

    def _crossed(self, a: LocusPoint, b: LocusPoint, which: int, value: float) -> list[LocusPoint]:
        """Point between neighbours ``a``, ``b`` where parameter ``which`` has a ``value``; none if not located."""
        node, axis = self.points.located(a, b, lambda n: float(n.p[which]) - value), self.plane.axis(which)
        if node is None:
            return []
        try:
            there = self.criterion.correct((np.where(axis, value, node.p), node.x, axis, None), node, REACH)
        except ConvergenceError:
            return [node]
        return [replace(there, s=node.s)]

    def locus(self, error: np.ndarray, unresolved: list[int]) -> Locus:
        """The rows of the curve, with their errors."""
        return Locus(
            system=self.solver.system,
            kind=self.special.kind,
            names=self.plane.names,
            bounds=self.plane.intervals,
            values=self._column("p"),
            ordinate=self._column("ordinate"),
            omega2=self._column("omega2"),
            located_to=self._column("located_to"),
            index=np.array([self._index(n) for n in self.nodes]),
            lower=self._lower_side(),
            error=error,
            unresolved=unresolved,
            marks=[Mark(kind, row) for row, kind in sorted(self.marks.items())],
            start=self.start,
            ended=self.ended,
            states=[n.x for n in self.nodes],
            solve=self.rows,
        )

    def _column(self, name: str) -> np.ndarray:
        return np.array([getattr(n, name) for n in self.nodes])

    def _index(self, node: LocusPoint) -> tuple[int, int]:
        """Index on the two sides of the curve, -1 where it was not counted."""
        change = self.first.multiplicity
        if self.special.kind == FLUTTER:  # two that have diverged are as unstable as a complex pair
            change = 0 if self.first.omega2 < 0 else len(self.first.modes)
        return node.rest, node.rest + change if node.rest >= 0 else -1

    def _lower_side(self) -> int:
        """Side of the load, -1 or 1, on which the index is the lower one next to the special point; 0: unknown."""
        special, solver, node = self.special, self.solver, self.first
        if special.kind in (FLUTTER, DIVERGENCE):
            x = self.plane.at(node.p, node.x)
            loads = node.p[0] + DIFFERENCE * self.plane.width[0] * np.array([-1.0, 1.0])
            pencils = NonsymmetricSolver(solver.system)
            below, above = (unstable(pencils.at(solver.at_load(x, float(load))[0])) for load in loads)
            return int(np.sign(below - above))
        change = special.negative_after - special.negative_before
        if special.kind != BRANCH_POINT or special.test_function != "mu":
            return 0
        return int(-np.sign(change * special.point.slope))


def modes_of(solver: BranchSolver, special: SpecialPoint, x: PETSc.Vec) -> tuple[Vectors, Vectors, int]:
    """Modes of a ``special`` point at ``x``, left ones where they are others, and how many of them vanish."""
    if special.kind == FLUTTER and special.cluster is not None:
        return solver.system.vectors(special.cluster.basis), [], 0
    if special.kind != DIVERGENCE:
        return [*special.null_vectors, *special.nearby], [], special.multiplicity
    number = abs(special.negative_after - special.negative_before)
    return *null_vectors(solver, x, number), number


def check_special(solver: BranchSolver, special: SpecialPoint) -> None:
    """Raise :class:`InputError` for a special point that has no locus."""
    if special.kind.line is None:
        kinds = ", ".join(name for name, kind in KINDS.items() if kind.line is not None)
        raise InputError(f"A point of the kind {special.kind!r} has no locus: choose one of {kinds}.")
    if special.kind.singular and not solver.conservative:
        raise InputError("The locus of a fold or a branch point needs the solver that found it.")
    if special.kind == FLUTTER and (special.note or special.cluster is None):
        raise InputError(f"This flutter has no locus: {special.note or 'no file has its modes, trace the rod again'}.")
