"""Equilibria along branches: steps, tangents, and the index and records of each state."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import inf

from petsc4py import PETSc

from rodfem.continuation.branch import Point
from rodfem.continuation.prediction import across_orbit, predict
from rodfem.continuation.regular_point import RegularPoints
from rodfem.continuation.static_solver import StaticSolver
from rodfem.errors import ConvergenceError
from rodfem.fem.newton import STEPS, NewtonResult, correct
from rodfem.fem.state import Energies
from rodfem.fem.system import System
from rodfem.linalg.factorization import Factors
from rodfem.stability.inertia import Index, Inertia
from rodfem.stability.near_zero import decide
from rodfem.stability.out_of_plane import InSpace
from rodfem.stability.pencil import least_eigenvalue
from rodfem.stability.symmetric import SymmetricSolver

ASIDE = 0.1
"""How far beside a saddle the way down goes on, in the metric."""
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


class BranchSolver(StaticSolver):
    """Computes equilibria along branches, with their index and records.

    It owns what such a computation needs once: Newton's factors (in the system), the stability matrix, the shape.
    """

    def __init__(self, system: System, spectrum: int = 0) -> None:
        """Allocate matrices and tabulate the shape; with ``spectrum`` record that many left-most eigenvalues."""
        super().__init__(system)
        self.inertia = Inertia(system)
        self.regular = RegularPoints(self.inertia)
        self.modes = spectrum
        self.spectrum = SymmetricSolver(self.inertia) if spectrum else None

    @cached_property
    def space(self) -> InSpace | None:
        """Index in space of a planar rod, where all its loads have a potential there."""
        scene = self.system.scene
        return None if scene.planar is None or scene.without_potential(in_space=True) else InSpace(self.system)

    def factors(self) -> list[Factors]:
        """Those of Newton's method, and the symmetric ones that count."""
        return [*super().factors(), self.inertia.factors]

    def is_stable(self, x: PETSc.Vec) -> bool:
        """Whether the index of an equilibrium, the last one that a phase condition was taken at, is zero.

        A search asks that of states that may be far from all others: their round-off is that of no other.
        """
        try:
            return decide(self.inertia.at(x)).index.negative == 0
        finally:
            self.inertia.forget_band()

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
