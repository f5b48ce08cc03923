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

from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from petsc4py import PETSc

from rodfem.codim2.criterion import Criterion
from rodfem.codim2.curve import Half, Tracer
from rodfem.codim2.locus_errors import Errors, criterion_of, errors_of, hidden_changes, sharp_rows, without_smoothness
from rodfem.codim2.others import NEAREST, UNSTABLE, all_looked_at, unstable
from rodfem.codim2.parameter_plane import Interval, LocusPoint, Plane
from rodfem.codim2.singular import null_vectors
from rodfem.continuation.branch import SpecialPoint
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.kinds import BRANCH_POINT, DIVERGENCE, FLUTTER, KINDS
from rodfem.continuation.static_solver import StaticSolver
from rodfem.continuation.step_control import StepControl
from rodfem.errors import ConvergenceError, InputError
from rodfem.file_format import LOCUS, read_json
from rodfem.output.digits import number
from rodfem.output.files import mesh_of, save_json
from rodfem.problem.units import Units
from rodfem.stability.cluster import as_vectors
from rodfem.stability.inertia import Inertia
from rodfem.stability.nonsymmetric import NonsymmetricSolver
from rodfem.tolerances import NEGLIGIBLE, same_special

STEPS = StepControl(first=0.01, largest=0.04, smallest=1e-6, aim=2e-3, most=1000)
"""Steps of a locus, as shares of the bounds."""
SHARP = 9
"""Number of points at which it is asked whether the elements resolve what changes along the rod."""
BESIDE = 1e-3
"""Distance of a load beside a divergence load at which the unstable eigenvalues are counted, over the bounds."""

COARSE = "This mesh does not resolve all states: errors of `at least` that may be larger; use more elements."
"""Under the rows of a locus of which some are not resolved."""
AS_THEY_ARE = tuple(
    "scene title kind ordinate_name natural start lower planar unresolved constants discretization note".split()
)
"""Entries of a file that are attributes of a locus."""


@dataclass
class Mark:
    """A row of a locus where something happens: ``kind`` says what."""

    kind: str
    row: int


@dataclass
class Locus:
    """A curve of special points in the plane of two parameters, one row a point, in order along the curve.

    ``scene`` and ``title`` name the rod, ``labels`` are those of the two parameters in mathematics, and
    ``ordinate_name`` is that of the ordinate.  ``constants`` holds all parameters of the scene, and ``discretization``
    formulation, elements and degree.

    Attributes
    ----------
    kind
        ``fold``, ``branch point``, ``flutter`` or ``divergence``.
    names, bounds
        The two parameters, the scene's load first, and their intervals.
    values
        Both parameters, (n, 2).
    ordinate, natural
        The scene's ordinate, (n,), and its natural size, of which round-off is a part.
    index
        Index of the equilibria on the two sides of the curve, (n, 2): the eigenvalues that vanish on it positive, and
        negative.  Under loads without a potential the number of unstable eigenvalues, of those nearest to zero.
    lower
        Side of the load on which the index is the lower one at the start: -1 below, 1 above, 0 where it is not known,
        as for a fold.
    omega2
        The double eigenvalue of flutter, (n,), nan for others.
    located_to
        How far the parameters are uncertain for the given discretisation, (n, 2): of turning points, cusps and ends
        also along the curve.
    error
        How far, measured across the curve, that of a discretisation one degree richer is away in either parameter, (n,
        2); of turning points, cusps and ends how far those of that curve are, so also along it.  It is nan where it was
        not asked for, inf where the richer one does not find the point.
    unresolved
        Rows whose state, or null vector, the discretisation does not resolve, as far as that was examined, where errors
        may exceed their bounds: all of them where it does not resolve the special point.
    planar
        Whether the rod is kept in a plane: the index is that of changes in it, and stability is not that in space.
    marks
        Rows at which the curve turns in a parameter, cusps, and rows (away from the start) before which another
        eigenvalue has passed through zero, not located.
    start
        Row of the special point from which the curve was started.
    ended
        Why it ends, at its first and at its last row.
    states
        State vector of each row, of the system on which the locus was computed; not saved.
    crossings
        Load and ordinate at the start, and wherever else the curve passes the second parameter's value there.
    words
        What the two parameters are, for the axes of pictures; empty where the scene does not say it.
    units
        Names of their units; empty where they have none.
    note
        Why errors that were asked for are not estimated; empty where they are.
    """

    scene: str
    title: str
    kind: str
    names: tuple[str, str]
    labels: tuple[str, str]
    ordinate_name: str
    bounds: tuple[Interval, Interval]
    values: np.ndarray
    ordinate: np.ndarray
    index: np.ndarray
    lower: int
    omega2: np.ndarray
    located_to: np.ndarray
    error: np.ndarray
    marks: list[Mark]
    start: int
    ended: tuple[str, str]
    constants: dict[str, float]
    discretization: dict[str, Any]
    states: list[PETSc.Vec] = field(default_factory=list)
    crossings: list[tuple[float, float]] = field(default_factory=list)
    words: tuple[str, str] = ("", "")
    units: tuple[str, str] = ("", "")
    note: str = ""
    natural: float = 1.0
    planar: bool = False
    unresolved: list[int] = field(default_factory=list)

    def passes(self, special: SpecialPoint, units: Units) -> bool:
        """Whether the curve passes the line of its start again at another special point.

        The scene, that of both, has the natural sizes ``units``.
        """
        return self.kind == special.kind and any(_same(special, there, units) for there in self.crossings)

    def data(self) -> dict[str, Any]:
        """Plain lists, numbers and strings for a file; what was not computed is None."""
        columns: dict[str, list] = {name: self.values[:, i].tolist() for i, name in enumerate(self.names)}
        columns["ordinate"] = self.ordinate.tolist()
        for key, table in (("index", self.index), ("located_to", self.located_to)):
            columns[key] = table.tolist()
        columns["error"] = [[v if np.isfinite(v) else None for v in row] for row in self.error.tolist()]
        columns["omega2"] = [None if np.isnan(v) else v for v in self.omega2.tolist()]
        out = {"format": LOCUS.mark(), **{name: getattr(self, name) for name in AS_THEY_ARE}}
        return out | {
            "parameters": list(self.names),
            "labels": list(self.labels),
            "words": list(self.words),
            "units": list(self.units),
            "bounds": [list(b) for b in self.bounds],
            "columns": columns,
            "without_estimate": np.flatnonzero(np.isinf(self.error[:, 0])).tolist(),
            "marks": [{"kind": m.kind, "row": m.row} for m in self.marks],
            "ended": list(self.ended),
            "crossings": [list(crossing) for crossing in self.crossings],
        }

    @classmethod
    def read(cls, path: Path) -> Locus:
        """Read what :meth:`save` has written, but for the states; raises :class:`InputError` where that is missing."""
        data = read_json(path, LOCUS, ("parameters", "columns", "marks", "crossings", "lower"))
        columns, (first, second) = data["columns"], data["parameters"]
        tables: dict[str, Any] = {
            key: np.array(columns[key], dtype=float) for key in ("ordinate", "located_to", "error", "omega2")
        }
        tables["error"][data["without_estimate"]] = np.inf
        return cls(
            **{name: data[name] for name in AS_THEY_ARE if name in data},
            names=(first, second),
            labels=tuple(data["labels"]),
            words=tuple(data.get("words", ("", ""))),
            units=tuple(data.get("units", ("", ""))),
            bounds=(tuple(data["bounds"][0]), tuple(data["bounds"][1])),
            values=np.array([columns[first], columns[second]]).T,
            index=np.array(columns["index"]),
            marks=[Mark(mark["kind"], mark["row"]) for mark in data["marks"]],
            ended=tuple(data["ended"]),
            crossings=[(load, ordinate) for load, ordinate in data["crossings"]],
            **tables,
        )

    def starts_at(self, special: SpecialPoint, units: Units) -> bool:
        """Whether the curve was started from a special point of its scene, which has the natural sizes ``units``."""
        return self.kind == special.kind and _same(special, self.crossings[0], units)

    def save(self, path: Path) -> None:
        """Write :meth:`data` as JSON, whole or not at all; call it on one rank."""
        save_json(self.data(), path)

    def text(self, rows: int = 12) -> str:
        """Rows of the curve for the terminal: some of them, its ends, and all that are marked."""
        n, marks = len(self.values), {m.row: m.kind for m in self.marks}
        shown = sorted({0, n - 1, self.start, *marks, *np.linspace(0, n - 1, min(rows, n)).astype(int).tolist()})
        lines = [
            f"\nLocus of the {self.kind} in {self.names[0]} and {self.names[1]} (in parentheses the estimated error "
            "of the discretisation across the curve, where it was asked for; of the ordinate it was not)",
            f"  {self.names[0]:<24} {self.names[1]:<24} {'ordinate':<14} index{' in its plane' * self.planar}",
        ]
        for i in shown:
            each, resolved = zip(self.values[i], self.error[i], strict=True), i not in self.unresolved
            pair = [f"{v:.10g}" if np.isnan(e) else number(v, e, resolved) for v, e in each]
            ordinate = self.ordinate[i] if abs(self.ordinate[i]) > NEGLIGIBLE * self.natural else 0.0
            index = f"{self.index[i, 0]}|{self.index[i, 1]}" if self.index[i, 0] >= 0 else ""
            note = "start" if i == self.start else marks.get(i, "")
            lines.append(f"  {pair[0]:<24} {pair[1]:<24} {ordinate:<14.8g} {index:<6} {note}".rstrip())
        lines.append(f"  {n} points; ends: {self.ended[0]}; {self.ended[1]}")
        return "\n".join([*lines, *filter(None, [self.note, COARSE * bool(self.unresolved)])])


def _same(special: SpecialPoint, place: tuple[float, float], units: Units) -> bool:
    """Whether a special point of a scene of these natural sizes has the load and the ordinate of a ``place``."""
    point = special.point
    return same_special((point.load, point.ordinate), special.located_to, place, (units.load, units.ordinate))


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
        tracer = Tracer(criterion, plane, steps, p)
        found = _both_sides(tracer, first)
        crossings = _crossings(tracer, found, first, float(p[1]))
        errors = errors_of(solver, special.kind, plane, found.nodes, found.marks, error_bars)
        lower = _lower_side(solver, plane, special, first)
        if doubtful or special.resolved is False:
            errors = errors._replace(unresolved=list(range(len(found.nodes))))
        reasons = without_smoothness(solver, plane, found.nodes, errors.error)
        hidden = hidden_changes(solver, plane, found.nodes)
        nearest = _nearest(solver, criterion, plane, first)
        rows, sharp = sharp_rows(solver, plane, found.nodes, SHARP)
        errors.error[rows] = np.nan
        errors = errors._replace(unresolved=sorted({*errors.unresolved, *rows}))
    located = _locus(solver, special, (plane.names, bounds), found, crossings, errors, lower)
    said = [tracer.doubt, sharp, hidden, nearest, reasons.sentence if reasons else ""]
    located.note = " ".join(f"Locus of the {special.kind}: {words}" for words in said if words)
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
