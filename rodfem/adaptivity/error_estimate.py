"""Error bars: every special point is computed again on a richer discretisation, started from the first.

Elements half as long, of one degree more.  With errors ``e`` of the first and ``e'`` of the richer result their
difference is ``d = e - e'``, so that ``|e| <= |d| / (1 - rho)`` with ``rho >= |e' / e|``.  Halving alone leaves
``2^-(degree+1)`` of what elements miss of a smooth state, and about the square of that of loads, and of positions at
vertices.  How smooth it is the last Legendre coefficients of the strains on the two meshes tell, whose ratio bounds
that of loads and positions amply.  To that comes what location and arithmetic leave open of the richer result.

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
from dataclasses import dataclass

import numpy as np
from petsc4py import PETSc

from rodfem.adaptivity.grading import SmoothnessIndicator, weights_of
from rodfem.continuation.arc import STEADY, stepped
from rodfem.continuation.branch import NormalForm, Point, SpecialPoint
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.event_piece import nearest
from rodfem.continuation.kinds import FOLD
from rodfem.continuation.normal_form import Origin, alike, normal_form_of, ordinate_along
from rodfem.continuation.singular import SingularSystem, load_uncertainty
from rodfem.errors import ConvergenceError
from rodfem.fem.newton import correct
from rodfem.fem.shape import Shape, Transfer, halved, richer_system
from rodfem.linalg.orthogonal import combine, orthonormalize
from rodfem.problem.events import Event
from rodfem.tolerances import ROUND_OFF, round_off, same_place

RESOLVED_TO = 0.1
"""Relative change of the strains on the richer mesh, up to which a mesh resolves a state: a tenth.  Its square, of the
order of which errors of loads are, is one per cent."""
RESOLVED = 1e-9
"""Last coefficients smaller than this, of all or of one radian along the rod, are round-off."""
LEFT = 0.5
"""Part of an error of an event that is left at most: that of a number of the nodes falls with their distance."""


def bound(value: complex, richer: complex, left: float, rho: float, about: float = 0.0) -> float:
    """Bound of the error of a ``value`` of which ``rho`` is left in the ``richer`` one, itself uncertain by ``left``.

    ``about`` is the largest change of such a value near by: by accident the value itself may change by less.
    """
    change = abs(richer - value)
    return change + rho / (1 - rho) * max(change, about) + left


class OrdinateBound:
    """Bounds the errors of ordinates of states on the mesh of a ``coarse`` shape by those of a ``richer`` one."""

    def __init__(self, coarse: Shape, richer: Shape) -> None:
        self.coarse, self.richer = coarse, richer
        scene, fields = coarse.system.scene, coarse.system.fields
        vertices = fields.all_vertices()
        places = [p for p in scene.ordinate.places if not any(same_place(p, v, scene.length) for v in vertices)]
        tried = np.empty(0)
        for p in places:
            i = int(np.searchsorted(vertices, p))
            # three places for each zero of the polynomial
            tried = np.linspace(vertices[i - 1], vertices[i], 3 * fields.discretization.degree + 2)[1:-1]
        self._tried = [(float(s), coarse.weights(float(s)), richer.weights(float(s))) for s in tried]

    def __call__(self, x: PETSc.Vec, again: PETSc.Vec, left: float, rho: float) -> float:
        """Return a bound of the error of the ordinate of a state, ``x`` on the first mesh and ``again`` on the richer.

        The ordinate of the latter is uncertain by ``left``, and has ``rho`` of the error.
        """
        return bound(self.coarse.ordinate(x), self.richer.ordinate(again), left, rho, self._change(x, again))

    def _change(self, x: PETSc.Vec, again: PETSc.Vec) -> float:
        """Largest change of the ordinate over the element in which it is taken; none at a vertex, or of an integral.

        The ordinate is evaluated at its own place, with the changes of position and rotation of all others.
        """
        if not self._tried:
            return 0.0
        first, second = self.coarse.system.at(x), self.richer.system.at(again)
        of = self.richer.system.scene.ordinate
        r, q = self.richer.place(second, of.s or 0.0)
        value, largest = float(of.of(r, q)), 0.0
        for s, weights, richer in self._tried:
            before, after = self.coarse.place(first, s, weights), self.richer.place(second, s, richer)
            turned = q + after[1] - before[1]
            moved = of.of(r + after[0] - before[0], turned / np.sqrt(turned @ turned))
            largest = max(largest, abs(float(moved) - value))
        return largest


@dataclass(frozen=True)
class Again:
    """A point computed again: ``x``, ``load``, ``ordinate``, and ``load_left``, ``ordinate_left``, their uncertainties.

    ``ordinate_error`` bounds the error of the first ordinate, ``rho`` is the part of the first errors that is left, and
    ``changed`` the relative change of the strains of the state or of its null vector, the larger one.
    """

    x: PETSc.Vec
    load: float
    ordinate: float
    load_left: float
    ordinate_left: float
    ordinate_error: float
    rho: float
    changed: float

    @property
    def resolved(self) -> bool:
        """Whether the first discretisation resolves the state: otherwise the errors may exceed their bounds."""
        return self.changed <= RESOLVED_TO

    def unlike(self, load: float) -> str:
        """Sentence on a state at a ``load`` that is not resolved."""
        return (
            f"The richer mesh has another state at load {load:.8g}: its strains differ by {self.changed:.2g} of "
            f"themselves, more than {RESOLVED_TO:g}; use more elements."
        )

    def errors(self, point: Point) -> tuple[float, float]:
        """Bounds of the errors in load and ordinate of the point as first computed."""
        return bound(point.load, self.load, self.load_left, self.rho), self.ordinate_error


class Enriched:
    """A second, richer discretisation of the system of a solver, and its estimates.

    ``origins`` are branch points that were located there, each with the special point of the first discretisation, and
    the part of the error that is left.
    """

    def __init__(self, solver: BranchSolver) -> None:
        self.coarse, self.system = solver, richer_system(solver.system)
        self.solver = BranchSolver(self.system)
        self.transfer = Transfer(solver.system, self.system)
        self.origins: list[tuple[SpecialPoint, Origin, float]] = []
        self._at_loads: dict[tuple[int, float], tuple[Point, Again]] = {}
        self._ordinate = OrdinateBound(solver.shape, self.solver.shape)
        weights = weights_of(self.system.scene)
        self._coarse, self.indicator = (SmoothnessIndicator(each, weights) for each in (solver, self.solver))

    def rho(self, before: Sequence[PETSc.Vec], after: Sequence[PETSc.Vec]) -> float:
        """Ratio of the errors of a state (and its null vector) on the richer discretisation and on the first."""
        degree = self.coarse.system.fields.discretization.degree
        first, last = self._coarse.unresolved(before[0], before[1:]), self.indicator.unresolved(after[0], after[1:])
        if degree < 3 or last < RESOLVED:  # the last coefficients are the strains themselves, or round-off
            return halved(degree)
        # the last coefficients may be small by coincidence; beyond three quarters neither mesh resolves the state
        return max(halved(degree), min(2 * last / max(first, RESOLVED), 0.75))

    def estimate(self, special: SpecialPoint) -> None:
        """Set ``error_estimate`` and ``ordinate_error`` of a special point, and whether it is ``resolved``.

        They are infinite if the richer discretisation does not find the point, and no bounds if the point is not
        resolved.
        """
        if special.test_function == "stretch":
            return  # it has its own estimate: see :mod:`rodfem.adaptivity.zero_stretch`
        point, at_a_load = special.point, not special.kind.solved
        self.system.damping = self.coarse.system.damping
        try:
            if special.event is not None:
                again = self._at_event(point, special.event)
            else:
                again = self.again(point, fixed_load=True) if at_a_load else self._located(special)
        except ConvergenceError as trouble:
            special.error_estimate = special.ordinate_error = float("inf")
            special.resolved = False
            special.note = "; ".join(filter(None, (special.note, f"no error estimate: {trouble}")))
            return
        load_error, special.ordinate_error = again.errors(point)
        special.resolved = again.resolved
        special.error_estimate = special.ordinate_error if at_a_load else max(load_error, special.located_to)

    def again(self, point: Point, *, fixed_load: bool) -> Again:
        """Solve for a point on the richer discretisation, at its load, once, or across its tangent.

        One more step of Newton's method tells what arithmetic leaves open.  Raises :class:`ConvergenceError` if there
        is none.
        """
        key = id(point), self.system.damping
        if fixed_load and key in self._at_loads:
            return self._at_loads[key][1]
        found = self._again(point, fixed_load=fixed_load)
        if fixed_load:
            self._at_loads[key] = point, found
        return found

    def _again(self, point: Point, *, fixed_load: bool) -> Again:
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
        x = stepped(self.solver, x, row)
        last = system.scalar(x), self.solver.shape.ordinate(x)
        moved = np.abs(np.subtract(last, (load, ordinate)))
        left = STEADY * moved + ROUND_OFF * np.maximum((units.load, units.ordinate), np.abs(last))
        changed = self.indicator.changed(first, x, state=True)
        rho = self.rho([point.x], [x])
        ordinate_error = self._ordinate(point.x, x, float(left[1]), rho)
        return Again(x, *last, float(left[0]), float(left[1]), ordinate_error, rho, changed)

    def law(self, special: SpecialPoint, direction: PETSc.Vec, law: NormalForm) -> None:
        """Set the uncertainty of a law of the first discretisation: that of the rod's law, infinite without another."""
        self.system.damping = self.coarse.system.damping
        way, again, rho = self.transfer(direction, state=False), None, 0.0
        for known, origin, left in self.origins:
            if known is special:
                again, rho = normal_form_of(self.solver, origin, way), left
        if again is None or not alike(again, law):
            law.uncertainty = float("inf")
        else:
            law.uncertainty = bound(law.coefficient, again.coefficient, again.uncertainty, rho)

    def _at_event(self, point: Point, event: Event) -> Again:
        """The point of the richer discretisation at which an event happens: the nearest one, of several."""
        x, tangent = self.transfer(point.x, state=True), self.transfer(point.tangent, state=False)
        node, along = nearest(self.solver, event, x, tangent)
        found, units = node.kept.x, self.solver.units
        load, ordinate = self.system.scalar(found), self.solver.shape.ordinate(found)
        slope = abs(ordinate_along(self.solver, found, tangent))
        load_left = abs(point.slope) * along + round_off(load, units.load)
        left = slope * along + round_off(ordinate, units.ordinate)
        changed = self.indicator.changed(x, found, state=True)
        rho = max(self.rho([point.x], [found]), LEFT)
        ordinate_error = self._ordinate(point.x, found, left, rho)
        return Again(found, load, ordinate, load_left, left, ordinate_error, rho, changed)

    def _located(self, special: SpecialPoint) -> Again:
        """The fold or branch point on the richer discretisation, and its ordinate: the same singular system."""
        solver, point, metric = self.solver, special.point, self.solver.inertia.metric
        x, k = self.transfer(point.x, state=True), special.multiplicity
        modes = [self.transfer(v, state=False) for v in (*special.null_vectors, *special.nearby)]
        orthonormalize(modes, metric)
        opposite = special.test_function == "mu" and special.negative_before == special.negative_after
        found = SingularSystem(solver, modes, 1 if opposite else k, fold=special.kind == FOLD).solve(x)
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
        self.origins.append((special, Origin(found.x, found.load, ordinate, load_left, left), rho))
        ordinate_error = self._ordinate(point.x, found.x, left, rho)
        return Again(found.x, found.load, ordinate, load_left, left, ordinate_error, rho, changed)
