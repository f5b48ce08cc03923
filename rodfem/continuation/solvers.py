"""Pseudo-arclength continuation: following a curve of equilibria with control of the step.

The predictor extrapolates the last points of the branch by a polynomial in arclength (up to cubic); the corrector
is Newton's method on the plane through the prediction orthogonal to the predicted direction (Keller 1977).  The
step is chosen such that the corrector moves a prediction by a set distance: small where the curve bends, large
where it does not.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import inf

import numpy as np
from petsc4py import PETSc

from rodfem import compat
from rodfem.continuation.branch import Point, SpecialPoint
from rodfem.continuation.compiled_step import Checked, CompiledStep
from rodfem.continuation.corrector import SAME, STEPS, Corrector
from rodfem.continuation.kinds import Kind
from rodfem.continuation.prediction import across_orbit, predict
from rodfem.continuation.step_control import StepControl
from rodfem.errors import ConvergenceError
from rodfem.fem.convexity import Convexity
from rodfem.fem.fields import LOAD
from rodfem.fem.newton import TOLERANCE, NewtonResult, correct, limits, relax
from rodfem.fem.resultants import Resultants
from rodfem.fem.shape import Shape
from rodfem.fem.system import System
from rodfem.fem.values import NodalValues
from rodfem.linalg.factorization import AlongRod, Factors
from rodfem.problem.units import Units
from rodfem.stability.inertia import Index, Inertia
from rodfem.stability.out_of_plane import InSpace
from rodfem.stability.round_off import decide
from rodfem.stability.symmetric import SymmetricSolver

VERTICAL = 1e-8
"""Slope of the load (in spans per unit of arclength) below which it counts as constant along a branch."""
STILL = 1e-6
"""Damping of Newton's method at a singular first state, over the lowest bending eigenvalue."""
STRAYED = 0.3
"""If Newton's method moves the initial guess farther than this (metric norm), the result is not accepted as the first
state."""
ASIDE = 0.1
"""How far beside a saddle the way down goes on, in the metric."""
HELD = 1e-8
"""Drift scalar, over the lowest bending eigenvalue, above which phase conditions hold a state off the equilibrium."""
ALIGNED = 0.9
"""Least cosine between the direction of a prediction and the tangent at the corrected point."""
PILE = 64
"""Points of a branch after which the vectors that are not used any more are destroyed."""
ON_BOUND = 1e-8
"""Distance from a bound, in spans, below which a load counts as on it: branches of constant load may lie there."""


@dataclass(frozen=True)
class Step:
    """A step along a branch: the state ``x``, a prediction where it was not corrected, and its ``load``.

    Attributes
    ----------
    outcome
        The Newton iteration; None where none was made.
    tangent, index
        Of an equilibrium its unit tangent, and its index where one factorisation determines it.
    aligned
        Cosine between the direction of the prediction and the tangent.
    length
        Distance from the last row, in the metric.
    energy
        Stored energy, where it is known.
    """

    x: PETSc.Vec
    load: float
    outcome: NewtonResult | None = None
    tangent: PETSc.Vec | None = None
    index: Index | None = None
    aligned: float = -1.0
    length: float = 0.0
    energy: float | None = None


class StaticSolver:
    """Computes equilibria of one :class:`~rodfem.fem.system.System` at given loads, and their shapes."""

    def __init__(self, system: System) -> None:
        """Tabulate the shape; ``mesh`` is the number of this discretisation where there are several."""
        self.system, self.mesh = system, 0
        self.shape = Shape(system)
        self.axis = system.load_axis()

    def start(self, load: float, bent: float = 0.0) -> PETSc.Vec:
        """First guess at ``load``: the scene's ``start`` rotation, undeformed strains, zero forces.

        ``bent`` is the size, in radian, of a smooth rotation on top: a taut straight rod is a singular place to start.
        """
        system, f = self.system, self.system.fields
        x = f.coordinates(f.discretization.degree)
        turned = f.turning.start(system.scene.start, x.ravel(), system.scene.interval)
        if bent:
            along = (x.ravel() - system.scene.interval[0]) / system.scene.length
            turned = f.turning.turned(turned, bent * _bend(along))
        undeformed = np.array([1.0 if i == 2 else 0.0 for i in system.scene.free_strains])
        named = {f.turning.name: turned.reshape(*x.shape, -1), "v": undeformed, LOAD: load}
        return self.shape.with_centreline(NodalValues(f, f.filled(named), system.line))

    @cached_property
    def resultants(self) -> Resultants:
        """Strains, contact forces and moments of the states, compiled when they are first asked for."""
        return Resultants(self.shape)

    @property
    def units(self) -> Units:
        """Natural sizes of the rod's numbers."""
        return self.system.scene.units

    def given(self, kind: Kind, point: Point) -> SpecialPoint:
        """Special point at a load that is given."""
        return SpecialPoint.given(kind, point, self.units.load)

    def at_load(self, guess: PETSc.Vec, load: float, reach: float = 1e3) -> tuple[PETSc.Vec, NewtonResult]:
        """Equilibrium at exactly ``load`` by Newton's method from ``guess``."""
        x = guess.copy()
        self.system.set_load(x, load)
        outcome = correct(self.system, x, self.axis, reach=reach)
        self.system.set_load(x, load)  # steps at fixed load may have moved it by round-off
        return x, outcome

    def first(self, load: float) -> tuple[PETSc.Vec, NewtonResult]:
        """First equilibrium at ``load``, from the scene's start: by Newton's method, or else by going downhill.

        Also where Newton's method ends at an unstable one that is nowhere near the start.  Of a family of equilibria
        it is the one next to the start, whatever round-off would make of it.
        """
        guess = self.start(load)
        x, outcome = self.at_load(guess, load)
        good = outcome.converged and (self._turned(guess, x) < STRAYED or self.is_stable(x))
        if good and not self.may_move(x):
            return x, outcome
        damping, self.system.damping = self.system.damping, STILL * self.system.stiffness_scale
        still, found = self.at_load(guess, load)  # the start may be one of a family, along which it need not move
        self.system.damping = damping
        if found.converged and self._turned(guess, still) < STRAYED:
            return still, found
        if good:
            return x, outcome
        other = self.downhill(load)
        return other if other[1].converged else (x, outcome)

    def _turned(self, guess: PETSc.Vec, x: PETSc.Vec) -> float:
        """Distance of two states without that of their strains, in the metric: a straight rod may stretch far."""
        difference, f = x - guess, self.system.fields
        if "v" in f.dofs:
            begin, end = difference.getOwnershipRange()
            strains = f.number[f.dofs["v"]].ravel()
            difference.array[strains[(begin <= strains) & (strains < end)] - begin] = 0.0
        return self.system.norm(difference)

    def downhill(self, load: float) -> tuple[PETSc.Vec, NewtonResult]:
        """Equilibrium at ``load`` by going downhill from the scene's start, and from there bent a little.

        A stable state is preferred.  From a symmetrical start the way down may end on a saddle, and where it passes one
        slowly it depends on the mesh whether it stays there: from a saddle it goes on, along its most unstable mode.
        """
        first: tuple[PETSc.Vec, NewtonResult] | None = None
        for bent in (0.0, 0.4, 0.8):
            x, outcome = self._relaxed(self.start(load, bent))
            if outcome.converged and self.is_stable(x):
                return x, outcome
            if first is None or (outcome.converged and not first[1].converged):
                first = x, outcome
        assert first is not None
        if not first[1].converged:
            return first
        beside, longest = self.off(first[0], self.start(load))
        found = self._relaxed(beside, longest, self.is_stable)
        return found if found[1].converged else first

    def _relaxed(
        self, x: PETSc.Vec, longest: float = inf, accepts: Callable[[PETSc.Vec], bool] = lambda x: True
    ) -> tuple[PETSc.Vec, NewtonResult]:
        """Equilibrium downhill from the state ``x``, which moves there, at its load; see :func:`relax`."""
        load = self.system.scalar(x)
        outcome = relax(self.system, x, self.axis, longest=longest, accepts=accepts)
        for _ in range(3):  # phase conditions taken far away may hold a state off the equilibrium
            if outcome.converged and self.system.drift(x) > HELD * self.system.stiffness_scale:
                x, outcome = self.at_load(x, load)
        return x, outcome

    def off(self, x: PETSc.Vec, start: PETSc.Vec) -> tuple[PETSc.Vec, float]:
        """State beside the saddle ``x``, and the longest time step of the way down; here nothing is a saddle."""
        return x.copy(), inf

    def factors(self) -> list[Factors]:
        """All factors that this solver makes."""
        return [self.system.lu]

    def forget(self) -> None:
        """Forget what one computation leaves to the next, which then is the same whatever came before."""
        self.system.set_phase(None)
        for factors in self.factors():
            if isinstance(factors, AlongRod):
                factors.forget()

    def notices(self) -> list[str]:
        """Sentences for the record that nobody has read: symmetries that were none, factors by the last resort."""
        out = self.system.verification.read()
        for factors in self.factors():
            if isinstance(factors, AlongRod) and factors.times:
                out.append(
                    f"{factors.times} matrices could not be factored along the rod, too many pivots were delayed: "
                    "MUMPS factored them."
                )
                factors.times = 0
        return out

    def is_stable(self, x: PETSc.Vec) -> bool:
        """Whether an equilibrium is stable, as far as is known without counting."""
        return True

    def may_move(self, x: PETSc.Vec) -> bool:
        """Whether an equilibrium is one of a family that no symmetry explains, as far as is known without counting."""
        return False

    def energy(self, x: PETSc.Vec) -> float:
        """Stored energy of the state ``x``."""
        return self.system.at(x).energy()


class BranchSolver(StaticSolver):
    """Computes equilibria along branches, with their index and records.

    It owns what such a computation needs once: Newton's factors (in the system), the stability matrix, the shape.
    """

    def __init__(self, system: System, spectrum: int = 0) -> None:
        """Allocate matrices and tabulate the shape; with ``spectrum`` record that many left-most eigenvalues."""
        super().__init__(system)
        self.inertia = Inertia(system)
        self.corrector = Corrector(self.inertia)
        compiled = self.corrector.compiled if system.scene.conservative else None
        self._whole = None if compiled is None else CompiledStep(compiled)
        self.modes = spectrum
        self.spectrum = SymmetricSolver(self.inertia) if spectrum else None

    @cached_property
    def convexity(self) -> Convexity | None:
        """Convexity of the stored energy, where it varies along a branch."""
        scene = self.system.scene
        return Convexity(self.system) if not scene.is_quadratic() or scene.depends_on_s() else None

    @cached_property
    def space(self) -> InSpace | None:
        """Index in space of a planar rod, where all its loads have a potential there."""
        scene = self.system.scene
        return None if scene.planar is None or scene.without_potential(in_space=True) else InSpace(self.system)

    def factors(self) -> list[Factors]:
        """Those of Newton's method, and the symmetric ones that count."""
        return [*super().factors(), self.inertia.factors]

    def forget(self) -> None:
        """Forget the vectors that Newton's method carries along a branch, too."""
        super().forget()
        self.corrector.restart()

    def is_stable(self, x: PETSc.Vec) -> bool:
        """Whether the index of an equilibrium, the last one that a phase condition was taken at, is zero."""
        return self.inertia.at(x).count().negative == 0

    def off(self, x: PETSc.Vec, start: PETSc.Vec) -> tuple[PETSc.Vec, float]:
        """State beside the saddle ``x``, along its most unstable mode on the side of ``start``.

        Also the longest time step by which that mode grows: half of its time.
        """
        modes = SymmetricSolver(self.inertia).at(x).leftmost(1)
        beside, mode = x.copy(), modes.vectors[0]
        size = ASIDE / self.system.norm(mode)
        beside.axpy(size if self.row(mode).dot(start - x) >= 0 else -size, mode)
        self.system.set_load(beside, self.system.scalar(x))
        return beside, 0.5 / abs(float(modes.values[0]))

    def may_move(self, x: PETSc.Vec) -> bool:
        """Whether an equilibrium has more zero eigenvalues than symmetries that it breaks."""
        found = self.inertia.at(x)
        return found.count().zero > found.drifts

    def at_load(self, guess: PETSc.Vec, load: float, reach: float = 1e3) -> tuple[PETSc.Vec, NewtonResult]:
        """As for any equilibrium, with the symmetric factors unless they are too near singular."""
        x = guess.copy()
        self.system.set_load(x, load)
        outcome = self.corrector.correct(x, self.axis, reach=reach)
        return (x, outcome) if outcome is not None else super().at_load(guess, load, reach)

    def point(
        self,
        x: PETSc.Vec,
        arclength: float,
        tangent: PETSc.Vec | None,
        outcome: NewtonResult | None = None,
        index: Index | None = None,
        energy: float | None = None,
    ) -> Point:
        """Evaluate all records of the equilibrium ``x``; its index is counted, its energy summed, unless given.

        ``arclength`` and ``tangent`` are its place on the branch, ``outcome`` is the Newton iteration that led to it,
        ``index`` that of the factors, if they are those of ``x``.
        """
        system = self.system
        if index is None:
            index = decide(self.inertia.at(x)).index
        return Point(
            x=x,
            tangent=tangent,
            arclength=arclength,
            load=system.scalar(x),
            ordinate=self.shape.ordinate(x),
            energy=self.energy(x) if energy is None else energy,
            stretch=self.shape.stretch(x),
            negative=index.negative,
            zero=index.zero,
            slope=float("nan") if tangent is None else system.scalar(tangent),
            drift=system.drift(x),
            error=outcome.error if outcome else 0.0,
            spectrum=self._leftmost(x, index),
            negative_in_space=None if self.space is None else self.space.negative(x),
            mesh=self.mesh,
            determinant=index.determinant,
            nearest=index.nearest,
        )

    def _leftmost(self, x: PETSc.Vec, index: Index) -> list[float]:
        """Left-most eigenvalues by SLEPc, if asked for; :class:`ConvergenceError` where they contradict the inertia."""
        if self.spectrum is None:
            return []
        modes = self.spectrum.at(x).leftmost(self.modes)
        tolerance = self.inertia.tolerance / self.system.scene.length
        least, most = modes.negative(tolerance), modes.negative(-tolerance)
        if not least <= min(index.negative, self.modes) <= most or not modes.certified:
            raise ConvergenceError(
                f"SLEPc finds {least} negative eigenvalues at "
                f"{self.system.scene.load} = {self.system.scalar(x):.8g}, the inertia "
                f"{index.negative}: ask for more eigenvalues, or use a richer discretisation."
            )
        return [float(value) for value in modes.values]

    def step(self, known: Sequence[Point], s: float, bounds: tuple[float, float], reach: float) -> Step:
        """Predict from the ``known`` rows the equilibrium at arclength ``s``, and correct the prediction.

        In one call of compiled code where that serves.  A prediction whose load is not within the ``bounds`` is not
        corrected, nor one that turns back; ``reach`` bounds a correction, in the metric.
        """
        last, system = known[-1], self.system
        if self._whole is not None:
            made = self._whole(known, s, bounds, limits(system, STEPS, reach, TOLERANCE), SAME)
            if made is not None:
                index = self.corrector.index(made.found, made.below, made.nearest)
                numbers = made.aligned, made.length, made.energy
                return Step(made.x, system.scalar(made.x), made.outcome, made.tangent, index, *numbers)
        x, direction = predict(known, s)
        if system.symmetries:
            across_orbit(system, last.x, x, direction)
        load, row = system.scalar(x), self.row(direction)
        back = last.tangent is not None and row.dot(last.tangent) <= 0
        if back or not bounds[0] <= load <= bounds[1]:
            return Step(x, load)
        outcome, tangent, index = self.correct(x, row, reach)
        if tangent is None:
            return Step(x, load, outcome)
        return Step(x, system.scalar(x), outcome, tangent, index, row.dot(tangent), distance(system, last.x, x))

    def correct(
        self, x: PETSc.Vec, row: PETSc.Vec, reach: float
    ) -> tuple[NewtonResult, PETSc.Vec | None, Index | None]:
        """Correct a prediction in place; also its unit tangent on the side of ``row``, and its index, both at ``x``.

        The tangent is None without convergence, the index where one factorisation does not determine it.  ``row`` is
        the normal of the plane on which the equilibrium lies, and ``reach`` bounds how far ``x`` may move, in the
        metric.
        """
        outcome = self.corrector.correct(x, row, most=STEPS, reach=reach, tolerance=TOLERANCE)
        regular = outcome is not None
        if outcome is None:
            outcome = correct(self.system, x, row, most=STEPS, reach=reach)
        if not outcome.converged:
            return outcome, None, None
        at = self.corrector.corrected(x, outcome) if regular else self.corrector.factor(x)
        return outcome, at.along(row) if at else self._tangent(row, x), at.index if at else None

    def checked(self, x: PETSc.Vec) -> Checked | None:
        """What was checked at the state ``x`` by the step that led to it; None where that was no compiled one."""
        found = self._whole and self._whole.checked
        return found if found and found.x is x else None

    def damp(self, freedoms: int) -> None:
        """Keep Newton's method from moving along families of equilibria at one load, where there are any."""
        self.system.damping = self.inertia.tolerance if freedoms > 0 else 0.0

    def row(self, direction: PETSc.Vec) -> PETSc.Vec:
        """Row of the arclength equation for a direction: the metric times it, for a direction of unit size."""
        row = self.system.metric * direction
        row.scale(1.0 / self.system.norm(direction))
        return row

    def tangent(self, row: PETSc.Vec, at: PETSc.Vec | None = None) -> PETSc.Vec:
        """Unit tangent of the branch on the side to which ``row`` points.

        From the LU factors of the last correction, which belong to a state nearby; with ``at`` from new ones at that
        very state, symmetric where they serve.
        """
        regular = None if at is None else self.corrector.factor(at)
        return regular.along(row) if regular else self._tangent(row, at)

    def _tangent(self, row: PETSc.Vec, at: PETSc.Vec | None = None) -> PETSc.Vec:
        """The same by LU factors."""
        if at is not None:
            self.system.set_phase(at)
            self.system.at(at).factor(row)
        tangent = self.system.new_vector()
        solved = self.system.solve(self.axis, tangent)
        if not solved and at is not None:  # exactly singular: of all directions that across the null space
            self.system.at(at).factor(row, damping=self.inertia.tolerance)
            solved = self.system.solve(self.axis, tangent)
        size = self.system.norm(tangent) if solved else 0.0
        if not 0.0 < size < inf:
            load = "" if at is None else f" at {self.system.scene.load} = {self.system.scalar(at):.8g}"
            raise ConvergenceError(
                f"The equations{load} are singular, and the branch has no tangent: begin the range elsewhere, or use "
                "another number of elements."
            )
        tangent.scale(1.0 / size)
        return tangent

    def load_tangent(self, x: PETSc.Vec, increasing: bool) -> PETSc.Vec:
        """Unit tangent at the regular point ``x``, in the direction of in- or decreasing load."""
        tangent = self.tangent(self.axis, at=x)
        if not increasing:
            tangent.scale(-1.0)
        return tangent


def _bend(x: np.ndarray) -> np.ndarray:
    """Smooth rotation vector of size about one that vanishes at both ends, (m, 3); ``x`` (m,) in [0, 1]."""
    return np.outer(np.sin(np.pi * x), (0.6, 0.8, 0.3)) + np.outer(np.sin(2 * np.pi * x), (0.5, -0.4, 0.2))


def follow(
    solver: BranchSolver,
    points: list[Point],
    steps: StepControl,
    bounds: tuple[float, float],
    reach: Callable[[Point], float] = lambda point: float("inf"),
) -> Iterator[Point | str]:
    """Continue a branch from its last point, yielding accepted points; a string at the end says why it ended.

    ``bounds`` are the least and the greatest load; the branch ends exactly on them.  The caller appends (and may
    insert) points in ``points``.  The direction is that of the last point's tangent.  ``reach`` bounds the step from a
    point.  ``solver`` has the mesh, ``steps`` chooses the lengths of steps.
    """
    system, step = solver.system, steps.begin()
    span = abs(system.scene.span[1] - system.scene.span[0])
    low, high = (bound + sign * ON_BOUND * span for bound, sign in zip(bounds, (-1, 1), strict=True))
    solver.corrector.restart()
    while len(points) < steps.most:
        last = points[-1]
        if len(points) % PILE == 0:
            compat.destroy_garbage(system.comm)
        most = min(reach(last), steps.largest)
        step = min(step, most)
        known = points
        if system.damping and last.tangent is not None:  # across a family, along which the path is not determined
            known = [replace(last, tangent=solver.tangent(solver.row(last.tangent), at=last.x))]
        made = solver.step(known, last.arclength + step, (low, high), 0.5 * step)
        if not low <= made.load <= high or _on_bound(made.load, last, bounds, span):
            bound = min(bounds, key=lambda bound: abs(bound - made.load))
            point = _to_load(solver, points, made.load, bound, step, steps.smallest)
            if point is not None:
                yield point
                yield "end of range"
                return
        elif made.outcome is not None and made.tangent is not None and made.aligned > ALIGNED:
            place = last.arclength + made.length
            point = solver.point(made.x, place, made.tangent, made.outcome, made.index, made.energy)
            if steps.accepts(last, point):
                yield point
                order = 2 if system.damping else min(len(points) - 1, 3) + 1
                step = steps.after(step, made.outcome.moved, order)
                continue
        step /= 2
        if step < min(steps.smallest, 0.01 * most):
            why = f"steps below {steps.smallest:g}"
            if last.zero > (drifts := system.active_drifts(last.x)):
                why += f"; {last.zero - drifts} eigenvalues vanish there to working accuracy"
            yield f"no convergence at {system.scene.load} = {last.load:.6g} ({why})"
            return
    yield f"{steps.most} points reached"


def distance(system: System, a: PETSc.Vec, b: PETSc.Vec) -> float:
    """Distance of two states in the metric."""
    change = a.copy()
    change.aypx(-1.0, b)
    return system.norm(change)


def _on_bound(load: float, last: Point, bounds: tuple[float, float], span: float) -> bool:
    """Whether a step from ``last`` that changes the load ends on a bound of the range, but for round-off."""
    near = min(abs(bound - load) for bound in bounds)
    return near < ON_BOUND * span and abs(last.load - load) > 2 * ON_BOUND * span


def _to_load(
    solver: BranchSolver, points: list[Point], beyond: float, load: float, step: float, least: float
) -> Point | None:
    """Last point of a branch, exactly at ``load``; None where it is not accepted as any other point of the branch is.

    ``beyond`` is the load that a whole step leads to.  The step to ``load`` is a part of it, of length ``least`` or
    more, and Newton's method may go half as far from the prediction.
    """
    last, system = points[-1], solver.system
    fraction = (load - last.load) / (beyond - last.load)
    length = max(fraction * step, least)
    x, direction = predict(points, last.arclength + fraction * step)
    row = solver.row(direction)
    x, outcome = solver.at_load(x, load, reach=0.5 * length)
    if not outcome.converged:
        return None
    tangent = solver.load_tangent(x, beyond > last.load)
    if not row.dot(tangent) > ALIGNED:
        return None
    return solver.point(x, last.arclength + distance(system, last.x, x), tangent, outcome)
