"""Points of a locus in a plane of two parameters, and its defining equations as a corrector onto the curve.

Folds, branch points and divergence loads are where the second variation is singular: the equations of one of them
(:mod:`rodfem.continuation.singular`) on a plane across the curve.  A branch point is one as long as its symmetry lasts:
if the unfolding parameters do not vanish, or the equations change along the null vectors as the parameters follow the
curve, a parameter is an imperfection.  Null vectors that a symmetry relates vanish together, or the curve ends.

At flutter two eigenvalues ``mu1``, ``mu2`` collide: ``D = ((mu1 - mu2)/2)^2`` vanishes
(:mod:`rodfem.stability.cluster`; two pairs of equal ones if the rod bends alike in all planes).  The eigenvalues have a
square root there, but ``D`` is smooth in both parameters, so that ``D(a, b) = 0`` is a smooth curve unless the gradient
of ``D`` vanishes (Seyranian & Mailybaev, *Multiparameter Stability Theory with Mechanical Applications*, World
Scientific 2003, chapters 2 and 5).  A point of it is found on a line of the plane by Newton's method for ``D``, with
the derivatives of :mod:`rodfem.codim2.adjoint`.  Where pairs that are equal by a symmetry, and have one ``D``, part,
the curve ends.  At flutter of a rod with drag the mean of two conjugate rates takes the place of ``D``, as smooth.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field, replace

import numpy as np
from petsc4py import PETSc

from rodfem.codim2.adjoint import IMPERFECT, Adjoint
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.curves import ROWS, cubic_weights, lagrange
from rodfem.continuation.singular import SHARP, SPLIT, Curve, Linear, Section, SingularState, SingularSystem, Vectors
from rodfem.errors import ConvergenceError, SceneError
from rodfem.fem.state import Line, line
from rodfem.fem.system import System
from rodfem.linalg.orthogonal import combine, orthonormalize
from rodfem.problem.units import size
from rodfem.stability.cluster import Cluster, ClusterNoise, Measured, measure, noise_of
from rodfem.stability.nonsymmetric import NonsymmetricPencil, NonsymmetricSolver
from rodfem.tolerances import NEGLIGIBLE, ROUND_OFF, TINY

VANISHED = "another eigenvalue has vanished since the row before, seen from the start"
UNSTABLE = "another frequency has become unstable, or stable, since the row before, seen from the start"
"""Marks of a row where their number has changed, with a potential and without one."""
PITCHFORK, WIDE = 1e-6, 4e-3
"""Derivative of an eigenvalue along its null vector, over the lowest bending one, of which a symmetry leaves less; step
of second differences, which lose more digits to round-off, in the metric."""
FEWER = 1e-5
"""Eigenvalues that differ by more than this, over the lowest bending one, or pairs whose ``D`` do, over the square of
their mean, are not equal by a symmetry."""
SMALL, DIFFERENCE = 1e-4, 1e-3
"""Step, relative to the bounds, below which Newton's method ends where steps no longer shrink; that of a count next to
a divergence load."""
Interval = tuple[float, float]
Prediction = tuple[np.ndarray, PETSc.Vec, np.ndarray, PETSc.Vec]
"""Parameters (2,) and state of a point that is expected, and their derivatives in arclength."""
Guess = tuple[np.ndarray, PETSc.Vec, np.ndarray, PETSc.Vec | None]
"""The same with a direction of any size, which may be one of the parameters alone."""
Zero = tuple[float, float, Measured, PETSc.Vec]
"""Place of what vanishes on a line of parameters, its uncertainty, the cluster and the state there."""


class Destroyed(ConvergenceError):
    """The special point changes its kind, or ends, along the locus; the message says why."""


@dataclass(frozen=True)
class Sought:
    """What marks a point along a curve: ``of`` a point is zero there, or ``stationary``."""

    of: Callable[[LocusPoint], float]
    stationary: bool


@dataclass
class LocusPoint:
    """A point of a locus."""

    p: np.ndarray  # parameters (2,)
    x: PETSc.Vec
    dp: np.ndarray  # with the next one the unit tangent
    dx: PETSc.Vec
    located_to: np.ndarray  # uncertainties of the parameters (2,)
    s: float = 0.0  # arclength
    ordinate: float = float("nan")
    rest: int = -1  # negative (without a potential: unstable) eigenvalues but for its own, -1: not counted
    omega2: float = float("nan")  # a double eigenvalue
    curvature: float = (
        0.0  # derivative of the energy along the null vector: the third of a fold, the fourth of a pitchfork
    )
    coupling: np.ndarray = field(default_factory=lambda: np.zeros(2))  # that in the parameters, in units of the bounds
    modes: list[PETSc.Vec] = field(default_factory=list)  # null vectors and modes near by, or a cluster's basis
    left: list[PETSc.Vec] = field(default_factory=list)  # left null vectors, where they are others
    multiplicity: int = 0  # number of null vectors
    orientation: int = 0  # side of the tangent on which the defining function grows: another where two curves cross
    ended: str = ""  # why the curve ends here
    sought: Sought | None = None  # what is sought along the curve, at a turning point or an end
    windows: tuple[float, ...] = ()  # half widths of those in which that was found

    def reversed(self) -> LocusPoint:
        """The same point of the curve that is followed the other way."""
        return replace(self, dp=-self.dp, dx=-self.dx, s=-self.s, orientation=-self.orientation)


class Plane:
    """Lines in the plane of two parameters, the first of which is the scene's load, scaled by their intervals."""

    def __init__(self, system: System, parameter: str, intervals: tuple[Interval, Interval]) -> None:
        scene = system.scene
        scene.check_constant(parameter)
        self.system, self.names, self.intervals = system, (scene.load, parameter), intervals
        for name, (low, high) in zip(self.names, intervals, strict=True):
            if not low < high:
                raise SceneError(f"The bounds {low:g}, {high:g} of {name} are empty: give the lower one first.")
            scene.parameters[name].check(name, low)
            scene.parameters[name].check(name, high)
        for end in intervals[1]:  # the stored energy must be convex at both ends
            replace(scene, parameters={**scene.parameters, parameter: replace(scene.parameters[parameter], value=end)})
        self.low, self.high = np.array(intervals, dtype=float).T
        self.width = self.high - self.low
        self.sizes = np.array([size(max(map(abs, interval))) for interval in intervals])

    def line(self, origin: np.ndarray, direction: np.ndarray) -> Line:
        """Line on which the scalar unknown ``load`` stands for ``t`` in ``origin + t direction``."""
        named = (dict(zip(self.names, map(float, pair), strict=True)) for pair in (origin, direction))
        return line(self.system.scene, *named)

    def axis(self, which: int) -> np.ndarray:
        """Direction (2,) of parameter number ``which``, as long as its bounds are wide."""
        return (np.arange(2) == which) * self.width

    def at(self, p: np.ndarray, x: PETSc.Vec) -> PETSc.Vec:
        """The state ``x`` with the load in ``p`` (2,), in place, which from now on is the scene's at the other one."""
        self.system.line = self.line(np.array([0.0, p[1]]), np.array([1.0, 0.0]))
        self.system.set_load(x, float(p[0]))
        return x

    def outside(self, p: np.ndarray) -> tuple[int, float] | None:
        """Number of a parameter that is out of bounds and its bound, the one farthest out; None inside."""
        over = np.maximum(p - self.high, self.low - p) / self.width
        which = int(np.argmax(over))
        return None if over[which] <= 0 else (which, self.intervals[which][int(p[which] > self.high[which])])

    def round_off(self, p: np.ndarray, change: np.ndarray) -> np.ndarray:
        """Uncertainties (2,) of parameters ``p`` by their last ``change``: round-off at least."""
        return np.asarray(np.maximum(abs(change), ROUND_OFF * np.maximum(self.sizes, abs(p))))

    def words(self, p: np.ndarray, digits: int = 8) -> str:
        """Both parameters by name."""
        return ", ".join(f"{name} = {v:.{digits}g}" for name, v in zip(self.names, p, strict=True))


def predict(nodes: list[LocusPoint], s: float) -> Prediction:
    """Extrapolate a locus to arclength ``s``."""
    last = nodes[-1]
    if len(nodes) < 3:
        step = s - last.s
        return last.p + step * last.dp, last.x + last.dx * step, last.dp, last.dx
    recent = nodes[-ROWS:]
    return _combined(lagrange(np.array([n.s for n in recent]), s), [n.p for n in recent], [n.x for n in recent])


def interpolant(a: LocusPoint, b: LocusPoint, s: float) -> Prediction:
    """Cubic through two nodes with their tangents at arclength ``s``."""
    return _combined(cubic_weights(b.s - a.s, s - a.s), [a.p, a.dp, b.p, b.dp], [a.x, a.dx, b.x, b.dx])


def _combined(weights: tuple[np.ndarray, np.ndarray], p: list[np.ndarray], x: list[PETSc.Vec]) -> Prediction:
    value, slope = weights
    return value @ np.array(p), combine(x, value), slope @ np.array(p), combine(x, slope)


class Criterion(ABC):
    """Defining equations of a locus in a ``plane``, on the mesh of a ``solver``: a corrector onto it."""

    others = UNSTABLE

    def __init__(self, solver: BranchSolver, plane: Plane) -> None:
        self.solver, self.plane = solver, plane

    @abstractmethod
    def length(self, dp: np.ndarray, dx: PETSc.Vec) -> float:
        """Size of a step."""

    @abstractmethod
    def correct(self, guess: Guess, near: LocusPoint, reach: float = 1.0) -> LocusPoint:
        """Point of the locus on the plane through a ``guess`` across its direction; raises :class:`ConvergenceError`.

        The null vectors, or the invariant subspace, of a point ``near`` are close by; ``reach`` bounds how far the
        state may move, in the metric.  Raises :class:`Destroyed` where the special point changes its kind.
        """


class SingularCurve(SingularSystem):
    """The singular system in two parameters, whose solutions form curves."""

    def curve(self, at: Linear, found: tuple[PETSc.Vec, float, np.ndarray], null: Vectors, noise: float) -> Curve:
        """See :class:`SingularSystem`."""
        share = found[-1]
        quartic = self._quartic(at, found, null[0])
        (m, k), own = at.Z.shape, self._own(at)[1:, 1:]
        table = at.rows[m - k :, 1:] @ own
        slope = np.linalg.svd(table / np.maximum(abs(table).max(axis=1), TINY)[:, None])[2][-1]
        square = np.vstack([table, slope]) if self.fold else np.vstack([table[-1:, :2], slope[:2]])
        dx = combine(at.vectors[1:], own @ slope)
        self.system.set_load(dx, 0.0)
        return Curve(
            share[:2],
            slope[:2],
            dx,
            int(np.copysign(1.0, np.linalg.det(square))),
            table[-1, :2] / k,
            -at.b.T @ at.Z,
            0.0 if self.fold else self._part(at, slope[:2] / np.linalg.norm(slope[:2]), noise),
            float(table[-1, 2]) if self.fold else quartic,
            [combine(at.V, z) for z in np.hstack([at.Z, at.N]).T],
            at.left,
            self._negative(at.N) if self.psi is self.phi else -1,
        )

    def _quartic(self, at: Linear, found: tuple[PETSc.Vec, float, np.ndarray], null: PETSc.Vec) -> float:
        """Fourth derivative of the energy along a pitchfork's branch, at the state that is factored.

        The branch bends by ``z`` with ``S z = -y``: it is ``V . F_xxx V V V + 3 z . y``; zero of what is no pitchfork.
        """
        simple, (x, t, _) = self.count == 1 and not self.fold and self.psi is self.phi, found
        if not simple or abs(null.dot(at.y)) > PITCHFORK * self.inertia.scale:
            return 0.0
        (z, *V), border = self._bordered[0].solve([-at.y])
        z, bend = combine([z, *V], np.array([1.0, *(at.N @ self.rest(at.N, at.G, -border[:, 0]))])), 0.0
        for step, weight in SHARP:
            image, _ = self.images(x + null * (step * WIDE), [null], t)
            bend += weight / (step * WIDE**2) * image.dot(null)
        self._matrix(x, t)
        return bend + 3 * z.dot(at.y)

    def _part(self, at: Linear, direction: np.ndarray, noise: float) -> float:
        """Part of the change of the equations along a direction of the parameters that does work on null vectors."""
        work, terms = np.zeros(len(at.left)), np.zeros(len(at.left))
        for i, left in enumerate(at.left):
            each = combine(at.columns, direction)
            each.pointwiseMult(each, left)
            work[i], terms[i] = abs(each.sum()), each.norm(PETSc.NormType.NORM_1)
        return float((work[work > noise] / terms[work > noise]).max(initial=0.0))

    def _negative(self, N: np.ndarray) -> int:
        """Eigenvalues clearly below zero, but for those that vanish, at the state that the matrix holds."""
        self.inertia.move(-self.inertia.tolerance)
        _, _, G, far = self._modes(self.inertia.matrix)
        G = N.T @ G @ N
        return far + int((np.linalg.eigvalsh(G + G.T) > 0).sum())


class Singular(Criterion):
    """Corrects states to where the tangent matrix is singular: a ``fold``, else a branch point or divergence."""

    def __init__(self, solver: BranchSolver, plane: Plane, near: LocusPoint, *, fold: bool) -> None:
        super().__init__(solver, plane)
        self.fold = fold
        self.states = SingularCurve(solver, near.modes, near.multiplicity, fold=fold)
        self.scale, self.metric = solver.inertia.scale, solver.inertia.metric
        self.frequencies = NonsymmetricSolver(solver.system) if near.left else None
        self.others = UNSTABLE if near.left else VANISHED
        self.broken = f"{plane.names[1]} is an imperfection that destroys the branch point, or one on this mesh alone"

    def length(self, dp: np.ndarray, dx: PETSc.Vec) -> float:
        """Size of a step: parameters over the widths of their bounds, the state in the metric."""
        return float(np.hypot(np.linalg.norm(dp / self.plane.width), np.sqrt(max((self.metric * dx).dot(dx), 0.0))))

    def correct(self, guess: Guess, near: LocusPoint, reach: float = 1.0) -> LocusPoint:
        """See :class:`Criterion`."""
        self.states.border(near.modes, near.left)
        p, x, dp, dx = guess
        direction = dp / self.plane.width
        weight = float(np.linalg.norm(direction))
        ahead = direction / weight if weight else np.array([0.0, 1.0])
        axes = np.array([[ahead[1], -ahead[0]], ahead])  # across and along
        (across, along), line, x = axes * self.plane.width, self.plane.line, x.copy()
        self.solver.system.set_load(x, 0.0)
        row = None if dx is None else self.metric * dx
        lines = (lambda t: line(p + t * along, across)), (lambda load: line(p + load * across, along))
        found = self.states.solve(x, Section(*lines, weight, row, reach))
        if found is None or found.curve is None:
            raise ConvergenceError("Newton's method does not converge")
        if not self.fold and found.size > IMPERFECT * self.scale:
            raise Destroyed(self.broken)
        if found.spread > FEWER * self.scale:
            raise Destroyed(f"its {len(found.vectors)} zero eigenvalues do not vanish together any more")
        return self._node(found, found.curve, axes, guess)

    def _turned(self, parts: np.ndarray, axes: np.ndarray) -> np.ndarray:
        """Change (2,) of the parameters of which these are the parts along the ``axes``."""
        return np.asarray(parts @ axes * self.plane.width)

    def _node(self, found: SingularState, curve: Curve, axes: np.ndarray, guess: Guess) -> LocusPoint:
        """Point of the locus with its tangent, count and records."""
        width, (origin, _, before, dx_before) = self.plane.width, guess
        p = origin + self._turned(np.array([found.load, found.second]), axes)
        x = self.plane.at(p, found.x)
        dp, dx = self._turned(curve.slope, axes), curve.dx
        forward = before / width**2 @ dp + (0.0 if dx_before is None else (self.metric * dx).dot(dx_before))
        size = float(np.copysign(self.length(dp, dx), forward))
        rates = curve.rates @ axes
        # each of several eigenvalues vanishes no farther across the curve than their mean by what they differ
        split = SPLIT * found.spread * abs(rates) / max(rates @ rates, TINY) * width  # none of one eigenvalue
        return LocusPoint(
            p,
            x,
            dp / size,
            dx * (1.0 / size),
            self.plane.round_off(p, self._turned(curve.last, axes)) + split,
            ordinate=self.solver.shape.ordinate(x),
            ended=self.broken if curve.part > IMPERFECT else "",
            orientation=curve.side * int(np.copysign(1.0, size)),
            rest=unstable(self.frequencies.at(x), len(curve.left)) if self.frequencies else curve.negative,
            curvature=curve.curvature,
            coupling=curve.work[:, 0] @ axes if self.fold else np.zeros(2),
            modes=curve.modes,
            multiplicity=len(found.vectors),
            left=curve.left if self.frequencies else [],
        )


class Collision(Criterion):
    """Corrects points of the plane to where two eigenvalues collide; the direction of the state plays no part."""

    def __init__(self, solver: BranchSolver, plane: Plane) -> None:
        super().__init__(solver, plane)
        self.eigensolver = NonsymmetricSolver(solver.system)

    def _noise(self, noise: ClusterNoise) -> float:
        """Its round-off."""
        return noise.discriminant

    def _split(self, here: Measured) -> tuple[float, float]:
        """By how much it may differ among pairs that are taken for one, and what is large."""
        return here.split, max(here.cluster.mean**2, self.solver.units.omega2**2)

    def _squared(self, here: Measured) -> float:
        """Square of the frequency."""
        return here.cluster.mean

    def _mean(self, near: LocusPoint) -> float:
        """Mean of the eigenvalues of the cluster at a point."""
        return near.omega2

    def length(self, dp: np.ndarray, dx: PETSc.Vec) -> float:
        """Size of a step: parameters over the widths of their bounds."""
        return float(np.linalg.norm(dp / self.plane.width))

    def correct(self, guess: Guess, near: LocusPoint, reach: float = 1.0) -> LocusPoint:
        """See :class:`Criterion`; raises :class:`Destroyed` if pairs that met at once do not any more."""
        plane, system = self.plane, self.solver.system
        basis = np.stack([v.array_r.real for v in near.modes], axis=1)  # of the invariant subspace, this rank's rows
        forward = guess[2] / plane.width / np.linalg.norm(guess[2] / plane.width)
        across = np.array([-forward[1], forward[0]]) * plane.width
        system.line = plane.line(guess[0], across)
        t, last, here, x = self._collide(guess[1], Cluster(basis, self._mean(near)), reach)
        p, omega2 = guess[0] + t * across, self._squared(here)
        adjoint, basis = Adjoint(self.solver, plane.at(p, x), here.cluster), here.cluster.basis
        gradient = plane.width * [adjoint.rates.item(), adjoint.rates_in(plane.names[1]).item()]
        if not np.linalg.norm(gradient):
            raise ConvergenceError("what vanishes on the curve is constant")
        split, large = self._split(here)
        if split > FEWER * large:
            raise Destroyed(f"its {here.cluster.size // 2} pairs of eigenvalues do not meet together any more")
        dq = np.array([-gradient[1], gradient[0]]) / np.linalg.norm(gradient)
        orientation = 1 if dq @ forward >= 0 else -1
        rest = unstable(self.eigensolver.at(plane.at(p, x)), basis.shape[1], basis)
        apart = SPLIT * split * abs(gradient) / (gradient @ gradient) * plane.width
        return LocusPoint(
            p,
            x,
            orientation * dq * plane.width,
            system.new_vector(),
            plane.round_off(p, last * across) + apart,
            ordinate=self.solver.shape.ordinate(x),
            omega2=omega2,
            orientation=orientation,
            modes=system.vectors(basis),
            rest=rest + (here.cluster.size if omega2 < 0 else 0),
        )

    def _collide(self, x: PETSc.Vec, cluster: Cluster, reach: float) -> Zero:
        """Zero on the system's line of parameters, by Newton's method."""
        t, before = 0.0, np.inf
        for _ in range(12):
            now, x = self._measured(t, x, cluster)
            cluster = Cluster(cluster.basis, now.cluster.mean)
            adjoint = Adjoint(self.solver, x, cluster)
            slope = adjoint.rates.item()
            if not slope or abs(t) > reach:
                break
            step = -adjoint.left / slope
            if abs(step) < NEGLIGIBLE or (abs(step) < SMALL and abs(step) > 0.3 * before):
                with suppress(ConvergenceError):  # left vectors of a double zero are not found
                    return t, abs(step) + self._noise(noise_of(self.eigensolver.at(x), now)) / abs(slope), now, x
                return t, abs(step), now, x
            t, before = t + step, abs(step)
        raise ConvergenceError("two eigenvalues do not collide near by")

    def _measured(self, t: float, guess: PETSc.Vec, cluster: Cluster) -> tuple[Measured, PETSc.Vec]:
        """The cluster at ``t`` on the system's line of parameters, and the state there."""
        x, outcome = self.solver.at_load(guess, t)
        if not outcome.converged:
            raise ConvergenceError("no equilibrium is found there")
        return measure(self.eigensolver.at(x), cluster), x


class Oscillation(Collision):
    """Corrects points of the plane to where two conjugate rates of a rod with drag have no real part."""

    def _noise(self, noise: ClusterNoise) -> float:
        """See :class:`Collision`."""
        return noise.mean

    def _split(self, here: Measured) -> tuple[float, float]:
        apart = float(abs(here.values.real - here.cluster.mean).max())
        return apart, max(here.frequency, self.solver.units.omega2)

    def _squared(self, here: Measured) -> float:
        return -here.discriminant  # negative of two real rates of opposite sign

    def _mean(self, near: LocusPoint) -> float:
        return 0.0


def unstable(pencil: NonsymmetricPencil, size: int = 0, basis: np.ndarray | None = None) -> int:
    """Unstable eigenvalues but for ``size`` ones: those nearest zero, or of the subspace of a ``basis`` (n, size)."""
    spectrum = pencil.spectrum
    own = -abs(spectrum.values) if basis is None else pencil.shares(basis)
    chosen = np.argsort(own, kind="stable")[: len(own) - size]
    values, noise = spectrum.values[chosen], np.maximum(spectrum.zero, spectrum.noise[chosen])
    met = np.maximum(noise, 1e-4 * abs(values))  # a pair that has only just met: its imaginary part is a square root
    return int(((values.real < -noise) | ((spectrum.order == 2) & (abs(values.imag) > met))).sum())


def null_vectors(solver: BranchSolver, x: PETSc.Vec, number: int) -> tuple[list[PETSc.Vec], list[PETSc.Vec]]:
    """Right and left null vectors of the tangent matrix at ``x``, not symmetric, with the ``number`` it has there."""
    states = SingularCurve(solver, [], number, fold=False)
    metric = solver.inertia.metric
    right = left = [solver.inertia.seed(i) for i in range(number)]
    for _ in range(3):
        states.border(right, left)
        right, left, *_ = states.relaxed(x)
    for side in (right, left):
        orthonormalize(side, metric)
    overlap = np.array([[(metric * v).dot(w) for w in left] for v in right])
    u, _, vt = np.linalg.svd(overlap)
    return right, [combine(left, column) for column in (vt.T @ u.T).T]
