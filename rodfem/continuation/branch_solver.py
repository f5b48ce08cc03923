"""Equilibria at given loads and along branches: steps, tangents, and the index and records of each state.

*Tangent and index of a regular point* are those of one symmetric factorisation at that state.  With ``F_lam``, the
derivative of the equations in the load, ``z = (-S^-1 F_lam, 1)`` is a tangent, and the inertia of the factors of the
saddle matrix ``S`` is the index (:mod:`rodfem.stability.inertia`).  ``S`` is singular at a fold, and a count says
nothing about eigenvalues within its tolerance: both show in the same solves.  Of vectors ``v``, a generic one and
the border of the branch (:mod:`rodfem.stability.reduced_stiffness`), the least ``|v| / |S^-1 M v|`` is an upper bound
of the distance of the nearest eigenvalue from zero, and an estimate as good as they are rich in its vector.  If that is
too near zero, the tangent is by LU factors of the bordered matrix, and two shifts count.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import inf

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.branch import Point, SpecialPoint
from rodfem.continuation.curves import across_orbit, predict
from rodfem.continuation.kinds import Kind
from rodfem.continuation.natural_shape import natural_shape, sampled, uniform_turn
from rodfem.errors import ConvergenceError, SceneError
from rodfem.fem.checks import Convexity
from rodfem.fem.fields import Discretization
from rodfem.fem.newton import FAR, STEPS, NewtonResult, correct
from rodfem.fem.resultants import NAMES, Reactions, Resultants, reactions
from rodfem.fem.shape import Shape
from rodfem.fem.state import LOAD, NodalValues, State
from rodfem.fem.symmetries import Phase
from rodfem.fem.system import System
from rodfem.problem.units import Units
from rodfem.stability.in_space import InSpace
from rodfem.stability.inertia import DOUBTFUL, Index, Inertia
from rodfem.stability.near_zero import decide
from rodfem.stability.pencil import least_eigenvalue
from rodfem.stability.symmetric import SymmetricSolver
from rodfem.tolerances import TINY, round_off


@dataclass(frozen=True)
class RegularPoint:
    """A state whose factors serve: no eigenvalue is near zero."""

    index: Index  # by the count of the factors
    tangent: PETSc.Vec  # unit tangent, on the side of increasing load

    def unit_tangent(self, row: PETSc.Vec) -> PETSc.Vec:
        """Unit tangent on the side to which ``row`` points."""
        return self.tangent * (-1.0 if row.dot(self.tangent) < 0 else 1.0)


class RegularPoints:
    """Regular points among the states of one :class:`~rodfem.stability.inertia.Inertia`."""

    def __init__(self, inertia: Inertia) -> None:
        self.inertia, self.system = inertia, inertia.system
        generic = inertia.seed(0).array_r[:, None]
        self._generic = inertia.weighed(generic / inertia.sizes(generic))
        self._state: tuple[State | None, Phase | None, float] = None, None, 0.0
        self._found: RegularPoint | None = None

    def at(self, x: PETSc.Vec) -> RegularPoint | None:
        """The regular point ``x``; None where an eigenvalue is too near zero, or a load has no potential."""
        if not self.system.scene.conservative:  # S is not symmetric
            return None
        self.system.set_phase(x)
        state = self.system.at(x), self.system.phase, self.inertia.tolerance
        if not all(old is new for old, new in zip(self._state, state, strict=True)):  # else asked for once more
            self._state, self._found = state, self._found_at(x)
        return self._found

    def _found_at(self, x: PETSc.Vec) -> RegularPoint | None:
        inertia, found = self.inertia, self.inertia.at(x)
        try:
            below = found.eigenvalue_count(0.0)
        except ConvergenceError:  # exactly singular: two shifts count it, or tell what is wrong
            return None
        right = np.column_stack([found.border.array_r, self._generic])
        with self.system.clock("solve"):
            solved = found.solutions(right)
        size = inertia.sizes(grown := solved[:, 1:])
        if np.isfinite(size).all() and size.max() * DOUBTFUL * inertia.scale > 1.0:  # once more
            size = inertia.sizes(found.factors.solve_all(inertia.weighed(grown / size)))
        # |S^-1 M v| / |v| is at most one over the distance of the nearest eigenvalue from zero
        nearest = 1.0 / max(float(size.max()), TINY) if np.isfinite(size).all() else 0.0
        if not nearest > inertia.regular:
            return None
        tangent = self.system.new_vector(-solved[:, 0])
        self.system.set_load(tangent, 1.0)
        tangent.scale(1.0 / self.system.norm(tangent))
        return RegularPoint(Index(below, found.drifts, nearest), tangent)


@dataclass(frozen=True)
class Step:
    """A step along a branch: the state ``x``, a prediction where it was not corrected, and its ``load``."""

    x: PETSc.Vec
    load: float
    outcome: NewtonResult | None = None  # None where no Newton iteration was made
    tangent: PETSc.Vec | None = None  # of an equilibrium
    index: Index | None = None  # where one factorisation determines it
    aligned: float = -1.0  # cosine between the direction of the prediction and the tangent
    length: float = 0.0  # distance from the last row, in the metric


class BranchSolver:
    """Computes equilibria of one :class:`~rodfem.fem.system.System`, at given loads and along branches."""

    def __init__(self, system: System, spectrum: int = 0) -> None:
        """Tabulate the shape; with ``spectrum`` record that many left-most eigenvalues."""
        self.system, self.mesh, self.modes = system, 0, spectrum  # mesh: number of this one among several
        self.shape, self.axis = Shape(system), system.load_axis()

    def on_mesh(self, mesh: Discretization) -> BranchSolver:
        """Solver of the same rod on another ``mesh``."""
        return BranchSolver(self.system.on_mesh(mesh), self.modes)

    @property
    def conservative(self) -> bool:
        """Whether all loads have a potential: else ``S`` is not symmetric, and no count is an index."""
        return self.system.scene.conservative

    @property
    def units(self) -> Units:
        """Natural sizes of the rod's numbers."""
        return self.system.scene.units

    @cached_property
    def inertia(self) -> Inertia:
        """Second variation and its factors."""
        return Inertia(self.system)

    @cached_property
    def regular(self) -> RegularPoints:
        """Tangent and index of regular points."""
        return RegularPoints(self.inertia)

    @cached_property
    def spectrum(self) -> SymmetricSolver:
        """What finds left-most eigenvalues, and counts those below a number."""
        return SymmetricSolver(self.inertia)

    @cached_property
    def resultants(self) -> Resultants:
        """Strains, contact forces and moments of the states, compiled when they are first asked for."""
        return Resultants(self.shape)

    @cached_property
    def convexity(self) -> Convexity:
        """Convexity of the stored energy, where it varies: from state to state, along the rod, or with the load."""
        return Convexity(self.system, self.system.scene.load)

    @cached_property
    def space(self) -> InSpace | None:
        """Index in space of a planar rod, where all its loads have a potential there."""
        scene = self.system.scene
        return None if scene.planar is None or scene.without_potential(in_space=True) else InSpace(self.system)

    def reactions(self, x: PETSc.Vec) -> Reactions:
        """Reactions of supports and attachments at the equilibrium ``x``."""
        return reactions(self.resultants, x)

    def derived(self, x: PETSc.Vec, s: np.ndarray, modes: int) -> dict[str, np.ndarray]:
        """Numbers that follow from an equilibrium, by name: energies, reactions, left-most eigenvalues and profiles.

        ``reactions`` has force and moment, in space, of the left and right support and of attachments, (k, 2, 3).
        Profiles (m, 3) are those at arclengths ``s``.
        """
        profile = self.resultants.profile(x, s)
        out = {name: np.array(value) for name, value in self.system.at(x).energies()._asdict().items()}
        out["reactions"] = self.reactions(x).all
        if modes:
            out["spectrum"] = np.array(self.spectrum.at(x).leftmost(modes).values)
        return out | {name: getattr(profile, name) for name in ("r", *NAMES)}

    def lost_convexity(self, x: PETSc.Vec) -> str:
        """Why a branch ends before the state ``x``, where the stored energy is not convex any more; empty if it is."""
        where = f"{self.system.scene.load} = {self.system.scalar(x):.6g}"
        return "" if self.convexity.holds(x) else f"the stored energy is not convex any more at {where}"

    def require_convexity(self, x: PETSc.Vec) -> None:
        """Raise :class:`SceneError` for a state ``x`` to begin with along which the stored energy is not convex."""
        if self.lost_convexity(x):
            raise SceneError(
                f"The stored energy is not convex somewhere along the state at {self.system.scene.load} = "
                f"{self.system.scalar(x):g}: choose constants that make it so, or another load."
            )

    def request(self, kind: Kind, point: Point) -> SpecialPoint:
        """Special point at a load that is given: nothing changes there."""
        return SpecialPoint(kind, point, point.negative, point.negative, round_off(point.load, self.units.load))

    def start(self, load: float, bent: float = 0.0) -> PETSc.Vec:
        """First guess at ``load``: the scene's ``start`` rotation, or straight and turned as its ends are; no forces.

        ``bent`` is the size, in radian, of a smooth rotation on top that vanishes at both ends: a taut straight rod is
        a singular place to start.
        """
        system, f = self.system, self.system.fields
        x = f.coordinates(f.discretization.degree)
        start = system.scene.start or uniform_turn(system.scene, load)
        turned = f.turning.start(start, x.ravel(), system.scene.interval)
        if bent:
            along = (x.ravel() - system.scene.interval[0]) / system.scene.length
            first, second = (np.sin(number * np.pi * along) for number in (1, 2))
            vector = np.outer(first, (0.6, 0.8, 0.3)) + np.outer(second, (0.5, -0.4, 0.2))
            turned = f.turning.turned(turned, bent * vector)
        undeformed = np.array([1.0 if i == 2 else 0.0 for i in system.scene.free_strains])
        return self._shaped(turned, undeformed, load)

    def natural(self, load: float) -> PETSc.Vec | None:
        """The rod at rest at ``load`` as a first guess; None with a start of the scene, or if it does not fit."""
        system, f = self.system, self.system.fields
        found = None if system.scene.start is not None else natural_shape(system.scene, load)
        if found is None:
            return None
        s, q, strains = found
        x, v = (f.coordinates(degree) for degree in (f.discretization.degree, f.discretization.degree - 1))
        turned = f.turning.start(lambda places: sampled(s, q, places), x.ravel(), system.scene.interval)
        free = sampled(s, strains[:, list(system.scene.free_strains)], v.ravel())
        return self._shaped(turned, free.reshape(*v.shape, -1), load)

    def _shaped(self, turned: np.ndarray, v: np.ndarray, load: float) -> PETSc.Vec:
        """State of these rotations and strains at the nodes, and the centreline that they integrate to."""
        f = self.system.fields
        nodes = f.coordinates(f.discretization.degree).shape
        named = {f.turning.name: turned.reshape(*nodes, -1), "v": v, LOAD: load}
        return self.shape.with_centreline(NodalValues(self.system.equations, f.filled(named), self.system.line))

    def at_load(self, guess: PETSc.Vec, load: float, reach: float = FAR) -> tuple[PETSc.Vec, NewtonResult]:
        """Equilibrium at exactly ``load`` by Newton's method from ``guess``, at a distance of ``reach`` at most."""
        x = guess.copy()
        self.system.set_load(x, load)
        outcome = correct(self.system, x, self.axis, reach)
        self.system.set_load(x, load)  # steps at fixed load may have moved it by round-off
        return x, outcome

    def interpolated(self, point: Point) -> Point:
        """Point of another mesh with its state and tangent interpolated, not solved; itself if it is of this one."""
        if point.mesh == self.mesh:
            return point
        source, tangent = point.own_solver.shape, None
        x = self.shape.restore(source.sample(point.x))
        if point.tangent is not None:
            tangent = self.shape.restore(source.sample(point.x + point.tangent)) - x
        return replace(point, x=x, tangent=tangent, mesh=self.mesh, solver=self)

    def point(
        self,
        x: PETSc.Vec,
        arclength: float,
        tangent: PETSc.Vec | None,
        outcome: NewtonResult | None = None,
        index: Index | None = None,
    ) -> Point:
        """Evaluate all records of the equilibrium ``x``; its index unless that is given."""
        system = self.system
        if index is None:
            regular = self.regular.at(x)
            index = regular.index if regular else decide(self.inertia.at(x)).index
        return Point(
            x=x,
            tangent=tangent,
            arclength=arclength,
            load=system.scalar(x),
            ordinate=self.shape.ordinate(x),
            **system.at(x).energies()._asdict(),
            stretch=self.shape.stretch(x),
            negative=index.negative,
            zero=index.zero,
            slope=float("nan") if tangent is None else system.scalar(tangent),
            drift=system.drift(x),
            error=outcome.error if outcome else 0.0,
            spectrum=self._leftmost(x, index),
            negative_in_space=None if self.space is None else self.space.negative(x),
            mesh=self.mesh,
            nearest=index.nearest,
            solver=self,
        )

    def _leftmost(self, x: PETSc.Vec, index: Index) -> list[float]:
        """Left-most eigenvalues by SLEPc, if asked for; :class:`ConvergenceError` where they contradict the inertia."""
        if not self.modes:
            return []
        modes = self.spectrum.at(x).leftmost(self.modes)
        tolerance = self.inertia.tolerance / self.inertia.scale * least_eigenvalue(self.system)
        least, most = (int((modes.values < at).sum()) for at in (-tolerance, tolerance))
        if not least <= min(index.negative, self.modes) <= most or not modes.certified:
            raise ConvergenceError(
                f"SLEPc finds {least} negative eigenvalues at "
                f"{self.system.scene.load} = {self.system.scalar(x):.8g}, the inertia "
                f"{index.negative}: ask for more eigenvalues, or use a richer discretisation."
            )
        return [float(value) for value in modes.values]

    def step(self, known: Sequence[Point], s: float, bounds: tuple[float, float], reach: float) -> Step:
        """Predict from the ``known`` rows the equilibrium at arclength ``s``, and correct the prediction.

        Not if its load is not within the ``bounds``, or it turns back; ``reach`` bounds a correction, in the metric.
        """
        last, system = known[-1], self.system
        x, direction = predict(known, s)
        if system.symmetries:
            across_orbit(system, last.x, x, direction)
        load, row = system.scalar(x), self.row(direction)
        back = last.tangent is not None and row.dot(last.tangent) <= 0
        if back or not bounds[0] <= load <= bounds[1]:
            return Step(x, load)
        outcome = correct(system, x, row, reach, STEPS)
        if not outcome.converged:
            return Step(x, load, outcome)
        at = self.regular.at(x)
        tangent, index = (at.unit_tangent(row), at.index) if at else (self._tangent(row, x), None)
        return Step(x, system.scalar(x), outcome, tangent, index, row.dot(tangent), system.distance(last.x, x))

    def damp(self, freedoms: int) -> None:
        """Keep Newton's method from moving along families of equilibria at one load, where there are any."""
        self.system.damping = self.inertia.tolerance if freedoms > 0 else 0.0

    def row(self, direction: PETSc.Vec) -> PETSc.Vec:
        """Row of the arclength equation for a direction: the metric times it, for a direction of unit size."""
        row = self.system.metric * direction
        row.scale(1.0 / self.system.norm(direction))
        return row

    def tangent(self, row: PETSc.Vec, at: PETSc.Vec) -> PETSc.Vec:
        """Unit tangent of the branch at a state, on the side to which ``row`` points."""
        regular = self.regular.at(at)
        return regular.unit_tangent(row) if regular else self._tangent(row, at)

    def _tangent(self, row: PETSc.Vec, at: PETSc.Vec) -> PETSc.Vec:
        """The same by LU factors."""
        system, tangent = self.system, self.system.new_vector()
        system.set_phase(at)
        system.at(at).factor(row)
        solved = system.solve(self.axis, tangent)
        if not solved:  # exactly singular: of all directions that across the null space
            system.at(at).factor(row, damping=self.inertia.tolerance)
            solved = system.solve(self.axis, tangent)
        size = system.norm(tangent) if solved else 0.0
        if not 0.0 < size < inf:
            raise ConvergenceError(
                f"The equations at {system.scene.load} = {system.scalar(at):.8g} are singular, and the branch has no "
                "tangent: begin the range elsewhere, or use another number of elements."
            )
        tangent.scale(1.0 / size)
        return tangent

    def load_tangent(self, x: PETSc.Vec, increasing: bool) -> PETSc.Vec:
        """Unit tangent at the regular point ``x``, in the direction of in- or decreasing load."""
        tangent = self.tangent(self.axis, at=x)
        if not increasing:
            tangent.scale(-1.0)
        return tangent
