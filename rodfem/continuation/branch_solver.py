"""Equilibria at given loads and along branches: steps, tangents, and the index and records of each state."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import inf

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.branch import Point, SpecialPoint
from rodfem.continuation.kinds import Kind
from rodfem.continuation.natural_shape import natural_shape, sampled, uniform_turn
from rodfem.continuation.prediction import across_orbit, predict
from rodfem.continuation.regular_point import RegularPoints
from rodfem.errors import ConvergenceError, SceneError
from rodfem.fem.convexity import Convexity
from rodfem.fem.newton import FAR, STEPS, NewtonResult, correct
from rodfem.fem.resultants import Reactions, Resultants, reactions
from rodfem.fem.shape import Shape
from rodfem.fem.state import LOAD, Energies, NodalValues
from rodfem.fem.system import System
from rodfem.linalg.chain import Chain
from rodfem.linalg.factorization import Factors
from rodfem.problem.units import Units
from rodfem.stability.in_space import InSpace
from rodfem.stability.inertia import Index, Inertia
from rodfem.stability.near_zero import decide
from rodfem.stability.pencil import least_eigenvalue
from rodfem.stability.symmetric import SymmetricSolver

VERTICAL = 1e-8
"""Slope of the load (in spans per unit of arclength) below which it counts as constant along a branch."""


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
    """

    x: PETSc.Vec
    load: float
    outcome: NewtonResult | None = None
    tangent: PETSc.Vec | None = None
    index: Index | None = None
    aligned: float = -1.0
    length: float = 0.0


class BranchSolver:
    """Computes equilibria of one :class:`~rodfem.fem.system.System`, at given loads and along branches.

    It owns what such a computation needs once: Newton's factors (in the system), the stability matrix, the shape.
    """

    def __init__(self, system: System, spectrum: int = 0) -> None:
        """Tabulate the shape; with ``spectrum`` record that many left-most eigenvalues.

        ``mesh`` is the number of this discretisation where there are several.
        """
        self.system, self.mesh, self.modes = system, 0, spectrum
        self.shape, self.axis = Shape(system), system.load_axis()

    @property
    def conservative(self) -> bool:
        """Whether all loads have a potential: else ``S`` is not symmetric, and no count is an index."""
        return self.system.scene.conservative

    @cached_property
    def inertia(self) -> Inertia:
        """Second variation and its factors."""
        return Inertia(self.system)

    @cached_property
    def regular(self) -> RegularPoints:
        """Tangent and index of regular points."""
        return RegularPoints(self.inertia)

    @cached_property
    def spectrum(self) -> SymmetricSolver | None:
        """What finds left-most eigenvalues, if they are recorded."""
        return SymmetricSolver(self.inertia) if self.modes else None

    def factors(self) -> list[Factors]:
        """Those of Newton's method, and the symmetric ones that count."""
        return [self.system.lu, self.inertia.factors] if self.conservative else [self.system.lu]

    @cached_property
    def resultants(self) -> Resultants:
        """Strains, contact forces and moments of the states, compiled when they are first asked for."""
        return Resultants(self.shape)

    def reactions(self, x: PETSc.Vec) -> Reactions:
        """Reactions of supports and attachments at the equilibrium ``x``."""
        return reactions(self.resultants, x)

    @cached_property
    def convexity(self) -> Convexity:
        """Convexity of the stored energy, where it varies: from state to state, along the rod, or with the load."""
        return Convexity(self.system, self.system.scene.load)

    def lost_convexity(self, x: PETSc.Vec) -> str:
        """Why a branch ends at the state ``x``, where the stored energy is not convex any more; empty where it is."""
        return "" if self.convexity.holds(x) else self.not_convex(x)

    def not_convex(self, x: PETSc.Vec) -> str:
        """Why a branch ends at a state ``x`` along which the stored energy is not convex."""
        return f"the stored energy is not convex any more at {self.system.scene.load} = {self.system.scalar(x):.6g}"

    def require_convexity(self, x: PETSc.Vec) -> None:
        """Raise :class:`SceneError` for a state ``x`` to begin with along which the stored energy is not convex."""
        if self.lost_convexity(x):
            raise SceneError(
                f"The stored energy is not convex somewhere along the state at {self.system.scene.load} = "
                f"{self.system.scalar(x):g}: choose constants that make it so, or another load."
            )

    @property
    def units(self) -> Units:
        """Natural sizes of the rod's numbers."""
        return self.system.scene.units

    def given(self, kind: Kind, point: Point) -> SpecialPoint:
        """Special point at a load that is given."""
        return SpecialPoint.given(kind, point, self.units.load)

    def start(self, load: float, bent: float = 0.0) -> PETSc.Vec:
        """First guess at ``load``: the scene's ``start`` rotation, undeformed strains, zero forces.

        Without one it is straight, and turned as its ends are.  ``bent`` is the size, in radian, of a smooth rotation
        on top: a taut straight rod is a singular place to start.
        """
        system, f = self.system, self.system.fields
        x = f.coordinates(f.discretization.degree)
        start = system.scene.start or uniform_turn(system.scene, load)
        turned = f.turning.start(start, x.ravel(), system.scene.interval)
        if bent:
            along = (x.ravel() - system.scene.interval[0]) / system.scene.length
            turned = f.turning.turned(turned, bent * _bend(along))
        undeformed = np.array([1.0 if i == 2 else 0.0 for i in system.scene.free_strains])
        return self._shaped(turned, undeformed, load)

    def natural(self, load: float) -> PETSc.Vec | None:
        """The rod at rest at ``load`` as a first guess; None with a start of the scene, or if it does not fit."""
        system, f = self.system, self.system.fields
        found = None if system.scene.start is not None else natural_shape(system.scene, load)
        if found is None:
            return None
        x, v = (f.coordinates(degree) for degree in (f.discretization.degree, f.discretization.degree - 1))
        turned = f.turning.start(lambda s: sampled(found.s, found.q, s), x.ravel(), system.scene.interval)
        strains = sampled(found.s, found.v[:, list(system.scene.free_strains)], v.ravel())
        return self._shaped(turned, strains.reshape(*v.shape, -1), load)

    def _shaped(self, turned: np.ndarray, v: np.ndarray, load: float) -> PETSc.Vec:
        """State of these rotations and strains at the nodes, and the centreline that they integrate to."""
        f = self.system.fields
        nodes = f.coordinates(f.discretization.degree).shape
        named = {f.turning.name: turned.reshape(*nodes, -1), "v": v, LOAD: load}
        return self.shape.with_centreline(NodalValues(f, f.filled(named), self.system.line))

    def at_load(self, guess: PETSc.Vec, load: float, reach: float = FAR) -> tuple[PETSc.Vec, NewtonResult]:
        """Equilibrium at exactly ``load`` by Newton's method from ``guess``, at a distance of ``reach`` at most."""
        x = guess.copy()
        self.system.set_load(x, load)
        outcome = correct(self.system, x, self.axis, reach)
        self.system.set_load(x, load)  # steps at fixed load may have moved it by round-off
        return x, outcome

    def notices(self) -> list[str]:
        """Sentences for the record that nobody has read: symmetries that were none, factors by the last resort."""
        out = self.system.verification.read()
        for factors in self.factors():
            if isinstance(factors, Chain) and factors.times:
                out.append(
                    f"{factors.times} matrices could not be factored along the rod, too many pivots were delayed: "
                    "MUMPS factored them."
                )
                factors.times = 0
        return out

    def energies(self, x: PETSc.Vec) -> Energies:
        """Stored and potential energy of the equilibrium ``x``, and what the load does work on."""
        return self.system.at(x).energies()

    def energy(self, x: PETSc.Vec) -> float:
        """Stored energy of the state ``x``."""
        return self.system.at(x).energy()

    @cached_property
    def space(self) -> InSpace | None:
        """Index in space of a planar rod, where all its loads have a potential there."""
        scene = self.system.scene
        return None if scene.planar is None or scene.without_potential(in_space=True) else InSpace(self.system)

    def point(
        self,
        x: PETSc.Vec,
        arclength: float,
        tangent: PETSc.Vec | None,
        outcome: NewtonResult | None = None,
        index: Index | None = None,
        energies: Energies | None = None,
    ) -> Point:
        """Evaluate all records of the equilibrium ``x``; its index is counted, its energies are summed, unless given.

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
            **(energies or self.energies(x))._asdict(),
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
        if self.spectrum is None:
            return []
        modes = self.spectrum.at(x).leftmost(self.modes)
        tolerance = self.inertia.tolerance / self.inertia.scale * least_eigenvalue(self.system)
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

        A prediction whose load is not within the ``bounds`` is not
        corrected, nor one that turns back; ``reach`` bounds a correction, in the metric.
        """
        last, system = known[-1], self.system
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
        return Step(x, system.scalar(x), outcome, tangent, index, row.dot(tangent), system.distance(last.x, x))

    def correct(
        self, x: PETSc.Vec, row: PETSc.Vec, reach: float
    ) -> tuple[NewtonResult, PETSc.Vec | None, Index | None]:
        """Correct a prediction in place; also its unit tangent on the side of ``row``, and its index, both at ``x``.

        The tangent is None without convergence, the index where one factorisation does not determine it.  ``row`` is
        the normal of the plane on which the equilibrium lies, and ``reach`` bounds how far ``x`` may move, in the
        metric.
        """
        outcome = correct(self.system, x, row, reach, STEPS)
        if not outcome.converged:
            return outcome, None, None
        at = self.regular.at(x)
        return outcome, at.along(row) if at else self._tangent(row, x), at.index if at else None

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
        regular = None if at is None else self.regular.at(at)
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
