r"""Deflation: further equilibria at one load, whether or not a branch connects them to those that are known.

Each try starts from a smooth seeded guess, a known state that is turned.  A few steps of gradient flow (backward Euler:
Newton's method with ``K + alpha M`` for ``K``) fit its multipliers, which far from equilibrium matter more than all
else: of guesses turned by 0.8 from a straight hemitropic rod 4 of 20 led to a buckled state without them, 20 with them.
Then it iterates by Newton's method on equations from which the known equilibria are divided out (Farrell, Birkisson &
Funke, SIAM J. Sci. Comput. 37 (2015) A2026-A2045) ::

    G(x) = M(x) F(x),    M(x) = prod_i (1 / d_i(x)^2 + 1),    d_i(x) = distance of x from the known equilibrium i.

They keep all their solutions but those.  ``G'`` differs from ``M F'`` by a matrix of rank one, so that its Newton step
is the plain one ``p = -F'^-1 F``, rescaled (Sherman & Morrison) ::

    step = p / (1 - grad log M . p),    grad log M . p = -sum_i 2 <x - x_i, p> / (d_i^2 (1 + d_i^2)).

The distance is that of the system's metric: at a given load the rotation determines the strains and multipliers of a
rod with a convex energy.  What a symmetry makes of a known equilibrium is known too: ``d_i`` is the distance from the
nearest point of its orbit, and discrete symmetries add isolated images (:mod:`rodfem.deflation.symmetries`).  What
converges is polished by the plain Newton method, and kept if it is new and admissible.

A search can show that there are more equilibria, and never that there are no more.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from math import inf, isfinite, nan
from typing import NamedTuple

import numpy as np
from petsc4py import PETSc

from rodfem import compat
from rodfem.continuation.arc import Arc
from rodfem.continuation.branch import Branch, Point
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.deflation.symmetries import Orbits, mirrors
from rodfem.errors import ConvergenceError, InputError
from rodfem.fem.newton import LARGEST, Correction, Limits, NewtonResult, correct, linear_step, newton, relative_size
from rodfem.fem.system import System
from rodfem.problem.ends import TURNS
from rodfem.tolerances import APART, DRIFT, NEGLIGIBLE, SAME_LOAD, SAME_SPECIAL, TINY

NEAR = 1e-4
"""Plain Newton steps below this, in the metric and relative in natural sizes, end the deflated iteration: the plain one
takes over."""
FLOW = (10.0, 3.0, 1.0, 0.3, 0.1, 0.03)
"""Reciprocal time steps of the gradient flow, over the rod's lowest bending eigenvalue."""
NEW, KNOWN, FAILED, INADMISSIBLE = "new", "known", "without convergence", "not admissible"


class Deflation:
    """Search for equilibria at one ``load``, on the mesh of a ``solver``, other than the ``known`` ones at that load.

    New ones are ``found``, one of each set that the symmetries carry into each other; ``tries`` are the outcomes.
    """

    def __init__(self, solver: BranchSolver, load: float, known: Sequence[Point] = (), seed: int = 0) -> None:
        self.solver, self.system, self.known = solver, solver.system, Orbits(solver.system)
        self.load, self.seed = load, seed
        scene = self.system.scene
        scene.parameters[scene.load].check(scene.load, load)
        for point in known:
            if abs(point.load - load) > SAME_LOAD * abs(scene.span[1] - scene.span[0]):
                raise InputError(
                    f"A known equilibrium is at {scene.load} = {point.load:.8g}, not {load:.8g}: "
                    "give equilibria at the load of the search (diagram.at(load) computes them)."
                )
        self.start = solver.start(load)
        self.mirrors = mirrors(self.solver.shape, self.start)
        self.bases, self.energies = list[PETSc.Vec](), list[float]()
        self.found, self.tries = list[Point](), list[str]()
        for point in known:
            self._deflate(point.x)

    def __str__(self) -> str:
        """Return the counts, and what they do not prove, in a few lines."""
        words = ", ".join(f"{self.tries.count(outcome)} {outcome}" for outcome in (NEW, KNOWN, INADMISSIBLE, FAILED))
        images = "; ".join(m.in_words() for m in self.mirrors) or "none"
        where = f"{self.system.scene.load} = {self.load:.10g}"
        return (
            f"Further equilibria at {where} by deflation, {len(self.tries)} tries: {words}\n"
            f"  states that a symmetry carries into each other count as one (mirror images: {images})\n"
            "  no proof that there are no others: more tries or another seed may find some"
        )

    def run(self, tries: int) -> list[Point]:
        """Make ``tries`` tries, the first from the scene's start if nothing is known; all that was found so far.

        Guesses start in turn from the known and the found states, and turn by 0.3 to 3 radian (root mean square); half
        of them flow twice as long.  The tries of a second call are others.  The first ones of a rod whose ends turn
        freely are the first state turned over.
        """
        before = len(self.tries)
        over = turned_over(self.system, self.bases[0]) if self.bases else []
        for number in range(before, before + tries):
            compat.destroy_garbage(self.system.comm)
            x = self.start.copy()
            if number < len(over):
                x = over[number]
            elif number or self.known.states:
                amplitude = 0.3 * 10.0 ** ((number - before) / max(tries - 1, 1))
                base = self.bases[number % len(self.bases)] if self.bases else self.start
                x = turned_state(self.system, base, amplitude, [self.seed, number])
                self.flow(x, FLOW * (1 + number // 2 % 2))
            point, outcome = self._judge(x) if self.approach(x).converged else (None, FAILED)
            self.tries.append(outcome)
            if point is not None:
                self.found.append(point)
                self._deflate(point.x)
        return self.found

    def flow(self, x: PETSc.Vec, alphas: Sequence[float] = FLOW) -> None:
        """Steps of gradient flow from ``x``, in place: towards constraints, lower energy, and multipliers that fit."""
        system = self.system
        for alpha in alphas:
            system.set_phase(None)
            # backward Euler for M x' = -F(x), linearised: (S + alpha M) dx = -F
            step = linear_step(system, x, self.solver.axis, alpha * self.solver.inertia.scale)
            size = nan if step is None else system.norm(step)
            if step is None or not isfinite(size) or not self._advance(x, step, -min(1.0, LARGEST / max(size, TINY))):
                return

    def approach(self, x: PETSc.Vec) -> NewtonResult:
        """Deflated Newton steps from ``x``, in place, none longer than ``LARGEST``, until a plain step is small."""
        system = self.system

        def iteration(fresh: bool) -> Correction | None:
            system.set_phase(x)
            step = linear_step(system, x, self.solver.axis)
            if step is None:
                return None
            step.scale(-1.0)
            distance = system.norm(step)
            # the plain step measures the distance from a solution of F = 0: plain Newton converges from here
            size = max(distance, relative_size(system, x, step))
            if isfinite(size) and size >= NEAR:
                factor = self.rescaling(x, step)
                factor *= min(1.0, LARGEST / max(abs(factor) * distance, TINY))
                if not self._advance(x, step, factor):
                    return None
            return Correction(distance, size)

        return newton(iteration, Limits(60, inf, NEAR))

    def rescaling(self, x: PETSc.Vec, step: PETSc.Vec) -> float:
        """Factor that makes a plain Newton step at ``x`` the step of the deflated equations."""
        image, slope = self.system.metric * step, 0.0  # grad log M . p: see the module
        for d, apart in self.known.nearest(x):
            d = max(d, NEGLIGIBLE)
            slope -= 2 * apart.dot(image) / (d * d * (1 + d * d))
        return 1.0 / (1.0 - slope) if abs(1.0 - slope) > NEGLIGIBLE else 1.0 / NEGLIGIBLE

    def _advance(self, x: PETSc.Vec, step: PETSc.Vec, factor: float) -> bool:
        """Add ``factor`` times a step, halved while the stored energy has no value there; False if it never has."""
        system, equations, f = self.system, self.system.new_vector(), self.system.fields
        for _ in range(10):
            state = system.at(x + step * factor)
            unit = {f.turning.name: f.turning.normalised(state.turned)}  # quaternions of unit length
            trial = system.vector(f.filled(state.parts | unit), state.drifts)
            system.at(trial).residual(equations)
            if isfinite(equations.norm()):
                trial.copy(x)
                return True
            factor /= 2
        return False

    def _deflate(self, x: PETSc.Vec) -> None:
        """Add a state and its mirror images to what is known."""
        self.bases.append(x)
        self.energies.append(self.system.at(x).energy())
        for image in (x, *(mirror(self.solver.shape, x) for mirror in self.mirrors)):
            if self.known.distance(image) > APART:
                self.known.add(image)

    def _judge(self, x: PETSc.Vec) -> tuple[Point | None, str]:
        """Polish a candidate by the plain Newton method; the point, if it is a new equilibrium, and the outcome."""
        system, solver = self.system, self.solver
        outcome = correct(system, x, solver.axis, reach=0.1)
        system.set_load(x, self.load)  # steps at fixed load may have moved it by round-off
        if not outcome.converged:
            return None, FAILED
        if self.known.distance(x) < APART:
            return None, KNOWN
        try:
            point = solver.point(x, 0.0, solver.load_tangent(x, True), outcome)
        except ConvergenceError:  # an index that cannot be counted
            return None, FAILED
        least = NEGLIGIBLE * solver.units.energy  # states shifted along the rod are one, and known by their energy
        same = (abs(point.energy - e) <= SAME_SPECIAL * max(abs(e), least) for e in self.energies)
        if any(s.along for s in system.symmetries) and any(same):
            return None, KNOWN
        if point.drift > DRIFT * solver.inertia.scale or not point.stretch > 0:
            return None, INADMISSIBLE
        return point, NEW


def turned_state(system: System, base: PETSc.Vec, amplitude: float, seed: list[int]) -> PETSc.Vec:
    """State ``base`` turned by a smooth rotation that respects clamps, of a root mean square ``amplitude``."""
    f = system.fields
    weights = np.random.default_rng(seed).normal(size=(4, 3)) / np.arange(1, 5)[:, None]
    a, b = system.scene.interval
    x = (f.coordinates(f.discretization.degree) - a) / (b - a)
    left, right = (end.fixed_rotation is not None for end in system.scene.sides)
    dense = _waves(np.linspace(0.0, 1.0, 401), left, right)
    size = float(np.sqrt(np.mean(np.sum((dense @ weights) ** 2, axis=-1))))
    return _turned(system, base, _waves(x, left, right) @ weights * (amplitude / size))


def turned_over(system: System, base: PETSc.Vec) -> list[PETSc.Vec]:
    """Known state ``base`` turned over, half a turn about d1, and about d2, where both ends turn freely; else none.

    Waves along the rod never get there: a rod between two pins may hang below the one that it stands on.
    """
    if system.scene.closed or any(end.turning != TURNS for end in system.scene.sides):
        return []
    nodes = (*system.at(base).turned.shape[:-1], 3)
    return [_turned(system, base, np.broadcast_to(np.pi * axis, nodes)) for axis in np.eye(3)[:2]]


def _turned(system: System, base: PETSc.Vec, vector: np.ndarray) -> PETSc.Vec:
    """State ``base`` whose rotations are turned by a rotation ``vector`` at each node."""
    f, state = system.fields, system.at(base)
    return system.vector(f.filled(state.parts | {f.turning.name: f.turning.turned(state.turned, vector)}))


def _waves(x: np.ndarray, left: bool, right: bool) -> np.ndarray:
    """Four waves at ``x`` in [0, 1], (..., 4), that vanish at clamped ends; periodic where none is clamped."""
    k = np.arange(1, 5)
    x = x[..., None]
    if left and right:
        return np.sin(np.pi * k * x)
    if left or right:
        return np.sin(np.pi * (k - 0.5) * (x if left else 1 - x))
    return np.where(k % 2, np.sin(2 * np.pi * ((k + 1) // 2) * x), np.cos(2 * np.pi * ((k + 1) // 2) * x))


class Coexisting(NamedTuple):
    """A point, the number of its mirror images, itself among them, and the ``freedoms`` that make a line of each."""

    point: Point
    images: int
    freedoms: int


def with_copies(solver: BranchSolver, point: Point) -> Coexisting:
    """An equilibrium with the number of its copies."""
    known, count = Orbits(solver.system), 1
    known.add(point.x)
    for mirror in mirrors(solver.shape, point.x):
        image = mirror(solver.shape, point.x)
        if known.distance(image) >= APART:
            known.add(image)
            count += 1
    return Coexisting(point, count, solver.system.active_drifts(point.x))


def equilibria_at(solver: BranchSolver, branches: Sequence[Branch], load: float) -> list[Point]:
    """Equilibria of traced branches at exactly ``load``, each once, which a search for further ones deflates."""
    found, known = list[Point](), Orbits(solver.system)
    for branch in branches:
        for point in _equilibria(solver, branch, [*map(solver.interpolated, branch.points)], load):
            if known.distance(point.x) >= APART:
                point.branch = branch.name
                found.append(point)
                known.add(point.x)
    return found


def _equilibria(solver: BranchSolver, branch: Branch, points: Sequence[Point], load: float) -> Iterator[Point]:
    """Yield the equilibria at ``load`` at and between neighbouring ``points`` of a ``branch``, which are on its mesh.

    At a fold or a branch point Newton's method at the load itself has nothing to go by: they are what was located.
    """
    located = [s.point for s in branch.special if s.kind.singular] + branch.points[: int(bool(branch.parent))]
    singular = {id(point.x) for point in located}
    for a, b in pairwise([*points, points[-1]]):
        if a.load == load and id(a.x) in singular:
            yield solver.point(a.x, a.arclength, a.tangent)
        elif a.load == load:
            x, outcome = solver.at_load(a.x, load, reach=1.0)
            if not outcome.converged:
                raise ConvergenceError(
                    f"No equilibrium was found at {solver.system.scene.load} = {load:g} next to a row there: use more "
                    "elements, or another load."
                )
            yield solver.point(x, a.arclength, solver.load_tangent(x, True), outcome)
        if (a.load - load) * (b.load - load) < 0:
            yield Arc(solver, a, b).at_load(load)
