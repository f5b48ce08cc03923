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
nearest point of its orbit (:mod:`rodfem.deflation.group_orbit`), and discrete symmetries add isolated images
(:mod:`rodfem.deflation.discrete_symmetries`).  What converges is polished by the plain Newton method, and kept if it is
new and admissible.

A search can show that there are more equilibria, and never that there are no more.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from math import inf, isfinite, nan
from typing import NamedTuple

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.arc import Arc
from rodfem.continuation.branch import Branch, Point
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.deflation.discrete_symmetries import Mirror, mirrors
from rodfem.deflation.group_orbit import Orbits
from rodfem.errors import ConvergenceError, InputError
from rodfem.fem.newton import LARGEST, Correction, Limits, NewtonResult, correct, linear_step, newton, relative_size
from rodfem.fem.system import System
from rodfem.problem.ends import TURNS
from rodfem.tolerances import APART, DRIFT, NEGLIGIBLE, SAME_LOAD, TINY

NEAR = 1e-4
"""Plain Newton steps below this, in the metric and relative in natural sizes, end the deflated iteration: the plain one
takes over."""
FLOW = (10.0, 3.0, 1.0, 0.3, 0.1, 0.03)
"""Reciprocal time steps of the gradient flow, over the rod's lowest bending eigenvalue."""
LEAST, GREATEST = 0.3, 3.0
"""Root mean square rotation, in radian, of the first and of the last guess from the state that it starts from."""
SAME_ENERGY, LEAST_ENERGY = 1e-6, 1e-12
"""Equilibria that slide are one if their energies agree to the first, or to the second of their natural size."""

NEW, KNOWN, FAILED, INADMISSIBLE = "new", "known", "without convergence", "not admissible"


@dataclass
class SearchLog:
    """What a search did: its ``load`` in words, how its ``tries`` ended, and the ``mirrors`` (symmetries) of the scene.

    ``tries`` are the outcomes above, in order.  ``nearly`` counts equilibria that are nearly mirror images of others,
    which an imperfection makes different ones.
    """

    load: str
    tries: list[str] = field(default_factory=list)
    mirrors: list[str] = field(default_factory=list)
    nearly: int = 0

    def __str__(self) -> str:
        """Return the counts, and what they do not prove, in a few lines."""
        words = ", ".join(f"{self.tries.count(outcome)} {outcome}" for outcome in (NEW, KNOWN, INADMISSIBLE, FAILED))
        images = "; ".join(self.mirrors) or "none"
        nearly = f"  {self.nearly} new: nearly, but not exactly, mirror images of others\n" if self.nearly else ""
        return (
            f"Further equilibria at {self.load} by deflation, {len(self.tries)} tries: {words}\n{nearly}"
            f"  states that a symmetry carries into each other count as one (mirror images: {images})\n"
            "  no proof that there are no others: more tries or another seed may find some"
        )


class Deflation:
    """Search for equilibria at one ``load``, on the mesh of a ``solver``, other than the ``known`` ones at that load.

    New ones are ``found``, one of each set that the symmetries carry into each other; the ``tally`` says how tries
    ended, ``mirrors`` are the discrete symmetries.  ``seed`` is that of the random guesses.  Raises :class:`InputError`
    for a known equilibrium at another load.
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
        self.mirrors = mirrors(self.system, self.start)
        self.bases: list[PETSc.Vec] = []
        self.found: list[Point] = []
        self.energies: list[float] = []
        # states shifted along the rod are one, and known by their energy
        self.slides = any(s.along for s in self.system.symmetries)
        self.tally = SearchLog(f"{scene.load} = {load:.10g}", mirrors=[str(m) for m in self.mirrors])
        for point in known:
            self._deflate(point.x)

    def run(self, tries: int) -> list[Point]:
        """Make ``tries`` tries, the first from the scene's start if nothing is known; all that was found so far.

        Guesses start in turn from the known and the found states, and grow from ``LEAST`` to ``GREATEST``; half of them
        flow twice as long.  The tries of a second call are others.  The first ones of a rod whose ends turn freely are
        the first state turned over.
        """
        before = len(self.tally.tries)
        over = turned_over(self.system, self.bases[0]) if self.bases else []
        for number in range(before, before + tries):
            x = self.start.copy()
            if number < len(over):
                x = over[number]
            elif number or self.known.states:
                amplitude = LEAST * (GREATEST / LEAST) ** ((number - before) / max(tries - 1, 1))
                base = self.bases[number % len(self.bases)] if self.bases else self.start
                x = turned_state(self.system, base, amplitude, [self.seed, number])
                self.flow(x, FLOW * (1 + number // 2 % 2))
            point, outcome = self._judge(x) if self.approach(x).converged else (None, FAILED)
            self.tally.tries.append(outcome)
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
        """Deflated Newton steps from ``x``, in place, until a plain step is small.

        A step is never longer than ``LARGEST``, and is halved while it leads to where the stored energy has no value.
        """
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
        # grad log M . p, a sum over the known equilibria: see the module
        image = self.system.metric * step
        slope = 0.0
        for d, apart in self.known.nearest(x):
            d = max(d, NEGLIGIBLE)
            slope -= 2 * apart.dot(image) / (d * d * (1 + d * d))
        return 1.0 / (1.0 - slope) if abs(1.0 - slope) > NEGLIGIBLE else 1.0 / NEGLIGIBLE

    def _advance(self, x: PETSc.Vec, step: PETSc.Vec, factor: float) -> bool:
        """Add ``factor`` times a step, halved while the stored energy has no value there; False if it never has."""
        system, equations = self.system, self.system.new_vector()
        for _ in range(10):
            trial = x + step * factor
            self._normalise(trial)
            system.at(trial).residual(equations)
            if isfinite(equations.norm()):
                trial.copy(x)
                return True
            factor /= 2
        return False

    def _normalise(self, x: PETSc.Vec) -> None:
        """Make the nodal quaternions of ``x`` of unit length."""
        state, f = self.system.at(x), self.system.fields
        normalised = {f.turning.name: f.turning.normalised(state.turned)}
        self.system.vector(f.filled(state.named | normalised), state.drifts).copy(x)

    def nearest_known(self, x: PETSc.Vec) -> float:
        """Distance of a state from all that is known, images by symmetries included; infinite if that is nothing."""
        return min((d for d, _ in self.known.nearest(x)), default=float("inf"))

    def _deflate(self, x: PETSc.Vec) -> None:
        """Add a state and its images to what is known."""
        self.bases.append(x)
        self.energies.append(self.solver.energy(x))
        if self.nearest_known(x) > APART:
            self.known.add(x)
        for mirror in list(self.mirrors):
            image = mirror(self.system, x)
            if mirror in self.mirrors and self.nearest_known(image) > APART:
                self._deflate_image(image, self.energies[-1], mirror)

    def _deflate_image(self, image: PETSc.Vec, energy: float, mirror: Mirror) -> None:
        """Add the mirror image of an equilibrium to what is known; without it, if it is none, the mirror goes.

        An imperfection below what the test of the mirrors sees makes the image another equilibrium, with another
        energy: a pole next to its root would hide it from Newton's method.
        """
        point, _ = self._judge(image)
        scale = max(abs(energy), self.solver.inertia.scale)
        if point is not None and abs(point.energy - energy) > NEGLIGIBLE * scale:
            self.found.append(point)
            self.tally.nearly += 1
            self.mirrors.remove(mirror)
            self.tally.mirrors.remove(str(mirror))
            self._deflate(point.x)
        else:
            self.known.add(image)

    def _judge(self, x: PETSc.Vec) -> tuple[Point | None, str]:
        """Polish a candidate by the plain Newton method; the point, if it is a new equilibrium, and the outcome."""
        system, solver = self.system, self.solver
        outcome = correct(system, x, solver.axis, reach=0.1)
        system.set_load(x, self.load)  # steps at fixed load may have moved it by round-off
        if not outcome.converged:
            return None, FAILED
        if self.nearest_known(x) < APART:
            return None, KNOWN
        try:
            point = solver.point(x, 0.0, solver.load_tangent(x, True), outcome)
        except ConvergenceError:  # an index that cannot be counted
            return None, FAILED
        if self.slides and any(
            abs(point.energy - e) <= SAME_ENERGY * max(abs(e), LEAST_ENERGY * solver.units.energy)
            for e in self.energies
        ):
            return None, KNOWN
        if point.drift > DRIFT * solver.inertia.scale or not point.stretch > 0:
            return None, INADMISSIBLE
        return point, NEW


def turned_state(system: System, base: PETSc.Vec, amplitude: float, seed: list[int]) -> PETSc.Vec:
    """Known state turned by a smooth rotation that respects clamps, its vector of that root mean square size.

    The vector, of this ``amplitude``, is a random combination of the lowest four waves along the rod that vanish where
    directors are clamped; it depends on the nodes and the ``seed`` only.  ``base`` is a state of the ``system``.
    """
    f = system.fields
    rng = np.random.default_rng(seed)
    weights = rng.normal(size=(4, 3)) / np.arange(1, 5)[:, None]
    a, b = system.scene.interval
    x = (f.coordinates(f.discretization.degree) - a) / (b - a)
    left, right = (end.fixed_rotation is not None for end in system.scene.sides)
    waves = _waves(x, left, right)
    dense = _waves(np.linspace(0.0, 1.0, 401), left, right)
    size = float(np.sqrt(np.mean(np.sum((dense @ weights) ** 2, axis=-1))))
    state = system.at(base)
    turned = f.turning.turned(state.turned, waves @ weights * (amplitude / size))
    return system.vector(f.filled(state.named | {f.turning.name: turned}))


def turned_over(system: System, base: PETSc.Vec) -> list[PETSc.Vec]:
    """Known state ``base`` turned over, half a turn about d1, and about d2, where both ends turn freely; else none.

    Waves along the rod never get there: a rod between two pins may hang below the one that it stands on.
    """
    if system.scene.closed or any(end.turning != TURNS for end in system.scene.sides):
        return []
    f, state = system.fields, system.at(base)
    out = []
    for axis in np.eye(3)[:2]:
        vector = np.broadcast_to(np.pi * axis, (*state.turned.shape[:-1], 3))
        out.append(system.vector(f.filled(state.named | {f.turning.name: f.turning.turned(state.turned, vector)})))
    return out


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
    """An equilibrium with its symmetric copies: so many mirror images, itself among them.

    Continuous symmetries that it breaks, ``freedoms`` of them, make a circle (a torus, a line) of each.
    """

    point: Point
    images: int
    freedoms: int


def with_copies(solver: BranchSolver, point: Point) -> Coexisting:
    """An equilibrium with the number of its copies."""
    system, known, phase = solver.system, Orbits(solver.system), solver.system.phase
    known.add(point.x)
    images = [mirror(system, point.x) for mirror in mirrors(system, point.x)]
    system.phase, count = phase, 1
    for x in images:
        if all(apart >= APART for apart, _ in known.nearest(x)):
            known.add(x)
            count += 1
    return Coexisting(point, count, system.active_drifts(point.x))


def equilibria_at(
    solver: BranchSolver, branches: Sequence[Branch], load: float, here: Callable[[Point], Point] = lambda p: p
) -> list[Point]:
    """Equilibria of traced branches at exactly ``load``, which a search for further ones deflates.

    A row at that load is one; none counts twice, as where branches begin and end at one state, or what the symmetries
    carry into each other.  Raises :class:`ConvergenceError` where there is none between two points on either side of
    the load.  ``here`` brings points of ``branches`` to the mesh of ``solver``, where they are on others.
    """
    found, known = list[Point](), Orbits(solver.system)
    for branch in branches:
        for point in _along(solver, [here(p) for p in branch.points], load, singular_states(branch)):
            if all(apart >= APART for apart, _ in known.nearest(point.x)):
                point.branch = branch.name
                found.append(point)
                known.add(point.x)
    return found


def singular_states(branch: Branch) -> set[int]:
    """Ids of the states of a branch that are those of folds and branch points."""
    first = {id(branch.points[0].x)} if branch.parent else set()
    return first | {id(s.point.x) for s in branch.special if s.kind.singular}


def _along(solver: BranchSolver, points: Sequence[Point], load: float, singular: set[int]) -> Iterator[Point]:
    """Yield the equilibria at ``load`` at and between neighbouring ``points`` of a branch, which are on its mesh.

    At those whose states are ``singular``, by their ids, Newton's method at the load itself has nothing to go by: they
    are what was located.
    """
    for a, b in zip(points, [*points[1:], None], strict=True):
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
        if b is not None and (a.load - load) * (b.load - load) < 0:
            yield Arc(solver, a, b).at_load(load)
