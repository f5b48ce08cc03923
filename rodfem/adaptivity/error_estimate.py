"""Error bars: every special point is computed again on a richer discretisation, started from the first.

Elements half as long, of one degree more.  With errors ``e`` of the first and ``e'`` of the richer result their
difference is ``d = e - e'``, so that ``|e| <= |d| / (1 - rho)`` with ``rho >= |e' / e|``.  Halving alone leaves
``2^-(degree+1)`` of what elements miss of a smooth state, and about the square of that of loads, and of positions at
vertices.  How smooth it is the last Legendre coefficients of the strains on the two meshes tell, whose ratio bounds
that of loads and positions amply.  To that comes what location and arithmetic leave open of the richer result.

The end of a branch at which the smallest stretch vanishes is sharpened on finer meshes: a strain converges like
``h^k`` only.  It is computed on meshes two and four times as fine, one degree richer, of which the finer one is kept.
Its error is a quarter of their difference at most, all of it for linear elements.

All of this is asymptotic, and a single value may agree on two meshes by accident; norms do not.  If the strains of the
state, or of its null vector, differ between the two meshes by more than :data:`RESOLVED_TO` of themselves, the first
mesh does not resolve the state, and ``d`` is no bound.  Of an event ``rho`` is at least what a sum over nodes has: half
of it.

A centreline misses ``h^(2d)`` at vertices, and inside of elements of degree d far more: ``h^(d+2)`` times an
oscillating polynomial, a combination of ``P_d`` and its neighbours.  Near a zero of it two meshes agree by accident.
Of an ordinate that is taken inside of an element ``rho`` is therefore of the largest change over that element.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any

import numpy as np
from petsc4py import PETSc

from rodfem.adaptivity.grading import SmoothnessIndicator
from rodfem.continuation.arc import STEADY, Arc, nearest_event, stepped
from rodfem.continuation.branch import NormalForm, Point, SpecialPoint
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.curves import zero_between
from rodfem.continuation.kinds import END, FOLD
from rodfem.continuation.normal_form import Origin, alike, normal_form_of, ordinate_along
from rodfem.continuation.singular import SingularSystem, load_uncertainty
from rodfem.errors import ConvergenceError
from rodfem.fem.fields import HIGHEST
from rodfem.fem.newton import correct
from rodfem.fem.resultants import NAMES
from rodfem.fem.shape import Shape, halved, richer, transferred
from rodfem.linalg.orthogonal import combine, orthonormalize
from rodfem.problem.events import Event, Level
from rodfem.tolerances import INSIDE, ROUND_OFF, round_off, same_place, unit

RESOLVED_TO = 0.1
"""Relative change of the strains on the richer mesh, up to which a mesh resolves a state: a tenth.  Its square, of the
order of which errors of loads are, is one per cent."""
RESOLVED = 1e-9  # last coefficients smaller than this, of all or of one radian along the rod, are round-off
LEFT = 0.5  # part of an error of an event that is left at most: that of a number of the nodes falls with their distance
LOCATED = 1e-10  # uncertainty of the load at which the stretch vanishes on one mesh, relative to it or to one


def bound(value: complex, richer: complex, left: float, rho: float, about: float = 0.0) -> float:
    """Bound of the error of a ``value`` of which ``rho`` is left in the ``richer`` one, itself uncertain by ``left``.

    ``about`` is the largest change of such a value near by: by accident the value itself may change by less.
    """
    change = abs(richer - value)
    return change + rho / (1 - rho) * max(change, about) + left


def derived(
    solvers: tuple[BranchSolver, BranchSolver], states: tuple[PETSc.Vec, PETSc.Vec, PETSc.Vec], rho: float
) -> dict[str, np.ndarray]:
    """Bounds of the errors of what follows from a state, by name: see :meth:`BranchSolver.derived`; collective.

    ``states`` are that on the first mesh, on the richer one, and a change of this one that its location leaves open.  A
    component of a vector may agree on two meshes by accident, and is bounded by the largest one.  The bar of a profile
    is that of its largest error along the rod.
    """
    (coarse, richer), (x, again, open_to) = solvers, states
    s, units = coarse.shape.sample(x)["s"], coarse.units
    acting = np.array([[units.force], [units.moment]])
    sizes: dict[str, Any] = {"reactions": acting, "r": units.length, "strain": 1.0, "curvature": 1 / units.length}
    sizes |= {"force": units.force, "moment": units.moment, "spectrum": units.omega2}
    before, out = coarse.derived(x, s, coarse.modes), dict[str, np.ndarray]()
    after, last = (richer.derived(y, s, coarse.modes) for y in (again, again + open_to))
    for name, value in after.items():
        change, left = abs(value - before[name]), STEADY * abs(last[name] - value)
        left = left + ROUND_OFF * np.maximum(abs(value), sizes.get(name, units.energy))
        if name in ("r", *NAMES):
            change, left = change.max(), left.max()
        about = change.max(axis=-1, keepdims=True) if change.ndim > 1 else change
        out[name] = change + rho / (1 - rho) * about + left
    return out


class OrdinateBound:
    """Bounds the errors of ordinates of states on the mesh of a ``coarse`` shape by those of a ``richer`` one."""

    def __init__(self, coarse: Shape, richer: Shape) -> None:
        self.coarse, self.richer = coarse, richer
        scene, fields = coarse.system.scene, coarse.system.fields
        vertices = fields.all_vertices
        places = [p for p in scene.ordinate.places if not any(same_place(p, v, scene.length) for v in vertices)]
        tried = np.empty(0)
        for p in places:
            i = int(np.searchsorted(vertices, p))
            # three places for each zero of the polynomial
            tried = np.linspace(vertices[i - 1], vertices[i], 3 * fields.discretization.degree + 2)[1:-1]
        self._tried = [(float(s), coarse.weights(float(s)), richer.weights(float(s))) for s in tried]

    def __call__(self, x: PETSc.Vec, again: PETSc.Vec, left: float, rho: float) -> float:
        """Bound of the error of the ordinate of a state, ``x`` on the first mesh and ``again`` on the richer."""
        return bound(self.coarse.ordinate(x), self.richer.ordinate(again), left, rho, self._change(x, again))

    def _change(self, x: PETSc.Vec, again: PETSc.Vec) -> float:
        """Largest change of the ordinate over the element in which it is taken; none at a vertex, or of an integral."""
        if not self._tried:
            return 0.0
        first, second = self.coarse.system.at(x), self.richer.system.at(again)
        of = self.richer.system.scene.ordinate
        r, q = self.richer.place(second, of.s or 0.0)
        value, largest = float(of.of(r, q)), 0.0
        for s, weights, finer in self._tried:
            before, after = self.coarse.place(first, s, weights), self.richer.place(second, s, finer)
            turned = q + after[1] - before[1]
            moved = of.of(r + after[0] - before[0], turned / np.sqrt(turned @ turned))
            largest = max(largest, abs(float(moved) - value))
        return largest


@dataclass(frozen=True)
class RicherPoint(Origin):
    """A point computed again on a richer mesh, and what is left open; ``rho`` is the part of the errors left there."""

    rho: float
    changed: float
    last: PETSc.Vec

    @property
    def resolved(self) -> bool:
        """Whether the first mesh resolves the state: otherwise the errors may exceed their bounds."""
        return self.changed <= RESOLVED_TO

    def unlike(self, load: float) -> str:
        """Sentence on a state at a ``load`` that is not resolved."""
        return (
            f"The richer mesh has another state at load {load:.8g}: its strains differ by {self.changed:.2g} of "
            f"themselves, more than {RESOLVED_TO:g}; use more elements."
        )


class Enriched:
    """A second, richer mesh of the system of a solver, and its estimates."""

    def __init__(self, solver: BranchSolver) -> None:
        self.coarse, self.system = solver, solver.system.on_mesh(richer(solver.system))
        self.solver = BranchSolver(self.system)
        self.transfer = partial(transferred, solver.shape, self.system)
        self.origins: list[tuple[SpecialPoint, RicherPoint]] = []
        self._at_loads: dict[tuple[int, float], tuple[Point, RicherPoint]] = {}
        self.of_ordinate = OrdinateBound(solver.shape, self.solver.shape)
        self._coarse, self.indicator = SmoothnessIndicator(solver), SmoothnessIndicator(self.solver)

    def rho(self, before: Sequence[PETSc.Vec], after: Sequence[PETSc.Vec]) -> float:
        """Ratio of the errors of a state (and its null vector) on the richer mesh and on the first."""
        degree = self.coarse.system.fields.discretization.degree
        first, last = self._coarse.unresolved(before[0], before[1:]), self.indicator.unresolved(after[0], after[1:])
        if degree < 3 or last < RESOLVED:  # the last coefficients are the strains themselves, or round-off
            return halved(degree)
        # the last coefficients may be small by coincidence; beyond three quarters neither mesh resolves the state
        return max(halved(degree), min(2 * last / max(first, RESOLVED), 0.75))

    def errors(self, point: Point, again: RicherPoint) -> tuple[float, float]:
        """Bounds of the errors in load and ordinate of a point as first computed, by that computed ``again``."""
        of_load = bound(point.load, again.load, again.load_left, again.rho)
        return of_load, self.of_ordinate(point.x, again.x, again.ordinate_left, again.rho)

    def estimate(self, special: SpecialPoint) -> None:
        """Set the errors of a special point, infinite if the richer mesh has none, and whether it is ``resolved``."""
        if special.test_function == "stretch":
            return  # it has its own estimate: see :func:`end_at_zero_stretch`
        point, at_a_load = special.point, not special.kind.solved
        self.system.damping = self.coarse.system.damping
        try:
            if special.event is not None:
                again = self._at_event(point, special.event)
            else:
                again = self.solve(point, fixed_load=True) if at_a_load else self._located(special)
        except ConvergenceError as trouble:
            special.error_estimate = special.ordinate_error = float("inf")
            special.resolved = False
            special.note = "; ".join(filter(None, (special.note, f"no error estimate: {trouble}")))
            return
        load_error, special.ordinate_error = self.errors(point, again)
        special.resolved = again.resolved
        special.error_estimate = special.ordinate_error if at_a_load else max(load_error, special.located_to)
        special.bounds = cache(partial(derived, (self.coarse, self.solver), (point.x, again.x, again.last), again.rho))

    def solve(self, point: Point, *, fixed_load: bool) -> RicherPoint:
        """Solve for a point on the richer mesh, at its load, once, or across its tangent; or ConvergenceError."""
        if not fixed_load:
            return self._solve(point, fixed_load=False)
        key = id(point), self.system.damping
        if key not in self._at_loads:
            self._at_loads[key] = point, self._solve(point, fixed_load=True)
        return self._at_loads[key][1]

    def _solve(self, point: Point, *, fixed_load: bool) -> RicherPoint:
        system, x = self.system, self.transfer(point.x, state=True)
        first = x.copy()
        row = self.solver.axis
        if not fixed_load and point.tangent is not None:
            row = self.solver.row(self.transfer(point.tangent, state=False))
        if not correct(system, x, row, reach=1.0).converged:
            raise ConvergenceError(
                f"the richer discretisation has no equilibrium near load {point.load:.8g}: use more elements"
            )
        units = system.scene.units
        load, ordinate = system.scalar(x), self.solver.shape.ordinate(x)
        before, x = x, stepped(self.solver, x, row)
        last = system.scalar(x), self.solver.shape.ordinate(x)
        moved = np.abs(np.subtract(last, (load, ordinate)))
        left = STEADY * moved + ROUND_OFF * np.maximum((units.load, units.ordinate), np.abs(last))
        changed = self.indicator.changed(first, x, state=True)
        return RicherPoint(x, *last, float(left[0]), float(left[1]), self.rho([point.x], [x]), changed, x - before)

    def law(self, special: SpecialPoint, direction: PETSc.Vec, law: NormalForm) -> None:
        """Set the uncertainty of a law of the first mesh: that of the rod's law, infinite without another."""
        self.system.damping = self.coarse.system.damping
        way, again, rho = self.transfer(direction, state=False), None, 0.0
        for known, origin in self.origins:
            if known is special:
                again, rho = normal_form_of(self.solver, origin, way), origin.rho
        law.uncertainty = float("inf")
        if again is not None and alike(again, law):
            law.uncertainty = bound(law.coefficient, again.coefficient, again.uncertainty, rho)

    def _at_event(self, point: Point, event: Event | Level) -> RicherPoint:
        """The point of the richer mesh at which an event happens: the nearest one, of several."""
        x, tangent = self.transfer(point.x, state=True), self.transfer(point.tangent, state=False)
        node, along = nearest_event(self.solver, event, x, tangent)
        found, units = node.kept.x, self.solver.units
        load, ordinate = self.system.scalar(found), self.solver.shape.ordinate(found)
        slope = abs(ordinate_along(self.solver, found, tangent))
        load_left = abs(point.slope) * along + round_off(load, units.load)
        left = slope * along + round_off(ordinate, units.ordinate)
        changed = self.indicator.changed(x, found, state=True)
        rho = max(self.rho([point.x], [found]), LEFT)
        return RicherPoint(found, load, ordinate, load_left, left, rho, changed, tangent * along)

    def _located(self, special: SpecialPoint) -> RicherPoint:
        """The fold or branch point on the richer mesh, and its ordinate: the same singular system."""
        solver, point, metric = self.solver, special.point, self.solver.inertia.metric
        x, k = self.transfer(point.x, state=True), special.multiplicity
        modes = [self.transfer(v, state=False) for v in (*special.null_vectors, *special.nearby)]
        orthonormalize(modes, metric)
        found = SingularSystem(solver, modes, k, fold=special.kind == FOLD).solve(x)
        if found is None:
            raise ConvergenceError(f"the richer discretisation has no such point near load {point.load:.8g}")
        ordinate, units = solver.shape.ordinate(found.x), solver.units
        moved = max(abs(solver.shape.ordinate(found.x + found.last * sign) - ordinate) for sign in (-1.0, 1.0))
        uncertain = 0.0 if special.kind == FOLD else load_uncertainty(solver, found)
        load_left = uncertain + round_off(found.load, units.load)
        left = STEADY * moved + round_off(ordinate, units.ordinate)
        relaxed, indicator = [v.copy() for v in found.modes], self.indicator
        orthonormalize(relaxed, metric)
        sharp = combine(relaxed, np.array([(metric * v).dot(modes[0]) for v in relaxed]))
        rho = self.rho([point.x, special.null_vectors[0]], [found.x, sharp])
        changed = max(indicator.changed(x, found.x, state=True), indicator.changed(modes[0], sharp, state=False))
        again = RicherPoint(found.x, found.load, ordinate, load_left, left, rho, changed, found.last)
        self.origins.append((special, again))
        return again


def last_admissible(solver: BranchSolver, a: Point, b: Point) -> Point:
    """The point between ``a`` and ``b`` at which the smallest stretch vanishes."""
    arc, h = Arc(solver, a, b), b.arclength - a.arclength
    first, along = a.arclength + INSIDE * h, 1e-11  # an arclength, in the metric
    known = zero_between(lambda s: solver.shape.stretch(arc.curve(s)[0]), first, b.arclength, along)
    stretch = cache(lambda s: solver.shape.stretch(arc.state(s)))
    ends = max(first, known - 1e-3 * h), min(b.arclength, known + 1e-3 * h)  # the curve is nearly right
    if not stretch(ends[0]) > 0 >= stretch(ends[1]):
        ends = first, b.arclength
    return arc.point(zero_between(stretch, *ends, along))


def before_the_end(solver: BranchSolver, a: Point, last: Point) -> Point | None:
    """A point right before the ``last`` admissible one after the row ``a``, at which to count; None if not found.

    At the end a rod that is squeezed to nothing has no stiffness against some motions, whose eigenvalues are zero.
    """
    aside = 1e-4 * (last.arclength - a.arclength)  # a part of the step
    try:
        return Arc(solver, a, last).point(last.arclength - aside)
    except ConvergenceError:
        return None


def located(solver: BranchSolver, last: Point) -> float:
    """Uncertainty of the load of the ``last`` admissible point on one mesh."""
    return LOCATED * unit(last.load, one=solver.units.load)


def end_at_zero_stretch(solver: BranchSolver, last: Point, *, error_bars: bool) -> SpecialPoint:
    """The end at the ``last`` admissible point, sharpened where ``error_bars`` are asked for, or a note why not."""
    end = SpecialPoint(END, last, last.negative, last.negative, located(solver, last), test_function="stretch")
    if error_bars:
        try:
            with solver.system.clock.scope("error bars"):
                _sharpen(solver, end)
        except ConvergenceError as trouble:
            end.note = f"no error estimate: {trouble}"
    return end


def _sharpen(solver: BranchSolver, end: SpecialPoint) -> None:
    """Sharpen an end at which the smallest stretch vanishes; raises :class:`ConvergenceError` if that fails."""
    d = solver.system.fields.discretization
    sample, found = solver.shape.sample(end.point.x), list[Point]()
    for factor in (2, 4):
        mesh = d.finer(factor, richer=int(d.degree < HIGHEST))  # the forms of :class:`Enriched` serve
        fine = solver.on_mesh(mesh)
        x = _vanishing(fine, fine.shape.restore(sample), end.point)
        point = replace(end.point, x=x, tangent=None, load=fine.system.scalar(x), energy=fine.system.at(x).energy())
        found.append(replace(point, ordinate=fine.shape.ordinate(x), stretch=fine.shape.stretch(x)))
        sample = fine.shape.sample(x)
    before, point = found
    end.point = replace(point, x=solver.shape.restore(sample))
    end.located_to = located(solver, point)
    left = 1.0 if d.degree == 1 else 0.25
    end.error_estimate = max(left * abs(point.load - before.load), end.located_to)
    end.ordinate_error = max(left * abs(point.ordinate - before.ordinate), end.located_to)
    end.note = f"its load was computed with {4 * d.elements} elements of degree {d.degree + 1}"


def _vanishing(solver: BranchSolver, x: PETSc.Vec, coarse: Point) -> PETSc.Vec:
    """State of a mesh, near ``x``, at which the smallest stretch vanishes, by secants along the branch."""
    from scipy.optimize import newton  # slow to load

    states, span = {coarse.load: x}, solver.system.scene.span

    @cache
    def stretch(load: float) -> float:
        nearest = min(states, key=lambda known: abs(known - load))
        states[load], outcome = solver.at_load(states[nearest], load, reach=1.0)
        if not outcome.converged:
            raise ConvergenceError(f"no equilibrium near load {load:.8g} on the finer mesh")
        return solver.shape.stretch(states[load])

    width = abs(span[1] - span[0])
    second = coarse.load + np.copysign(2e-4 * width, coarse.slope * stretch(coarse.load))  # of the range
    within = 0.01 * LOCATED * width
    load, found = newton(stretch, coarse.load, x1=second, tol=within, full_output=True, disp=False)
    if not found.converged or abs(stretch(load)) > LOCATED:
        raise ConvergenceError("the zero of the stretch was not found on the finer mesh")
    return states[load]
