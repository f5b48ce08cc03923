"""What the points of a locus fulfil: its defining equations, as a corrector onto the curve.

Folds, branch points and divergence loads are where the second variation is singular: the equations of one of them
(:mod:`rodfem.continuation.singular`) on a plane across the curve.  A branch point is one as long as its symmetry lasts:
if the unfolding parameters do not vanish, or the equations change along the null vectors as the parameters follow the
curve, a parameter is an imperfection.  Null vectors that a symmetry relates vanish together, or the curve ends.

At flutter two eigenvalues ``mu1``, ``mu2`` collide: ``D = ((mu1 - mu2)/2)^2`` vanishes
(:mod:`rodfem.stability.cluster`; two pairs of equal ones if the rod bends alike in all planes).  The eigenvalues have a
square root there, but ``D`` is smooth in both parameters, so that ``D(a, b) = 0`` is a smooth curve unless the gradient
of ``D`` vanishes (Seyranian & Mailybaev, *Multiparameter Stability Theory with Mechanical Applications*, World
Scientific 2003, chapters 2 and 5).  A point of it is found on a line of the plane by the secant method for ``D``, its
tangent from central differences.  Pairs that are equal by a symmetry have one ``D``; where they part, the curve ends.

Other unstable eigenvalues are counted by the factors of a symmetric tangent matrix, and without a potential among all
that the mesh has: those that are negative or complex.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from petsc4py import PETSc

from rodfem.codim2.plane import Destroyed, Guess, LocusPoint, Plane
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.singular import Curve, Section, SingularState, SingularSystem
from rodfem.errors import ConvergenceError
from rodfem.linalg.orthogonal import combine, orthonormalize
from rodfem.stability.cluster import Cluster, Measured, as_vectors, measure, noise_of
from rodfem.stability.nonsymmetric import NonsymmetricPencil, NonsymmetricSolver
from rodfem.tolerances import ROUND_OFF, TINY

MET = 1e-4
"""Imaginary part, relative to the eigenvalue, below which a pair has only just met: it has a square root there."""
VANISHED = "another eigenvalue has vanished since the row before, seen from the start"
UNSTABLE = "another frequency has become unstable, or stable, since the row before, seen from the start"
"""What is said of a row where their number has changed, with a potential and without one."""
NEAREST = "the index is that of the frequencies nearest zero: the mesh has too many unknowns to find all of them"
"""What is said of a locus on a fine mesh."""
SPLIT = 1.1
"""Times what eigenvalues, or the ``D`` of pairs, that are equal by a symmetry differ by that each may be off: to first
order."""
IMPERFECT = 1e-7
"""Over the lowest bending eigenvalue, or over the terms that cancel: a larger imperfection is not one of the mesh."""
FEWER = 1e-5
"""Eigenvalues that differ by more than this, over the lowest bending one, or pairs whose ``D`` do, over the square of
their mean, are not equal by a symmetry."""
FIRST = 1e-4
"""First step of the secants, relative to the bounds."""
SHARP, NOISE = 1e-12, 1e-4
"""Steps of the secants that end them: by their own size, or where they no longer shrink."""
FAR = 1e-6
"""Step of the secants from which on they tell the slope of ``D``."""
DIFFERENCE = 1e-3
"""Step of the central differences of ``D``, relative to the bounds."""
Zero = tuple[float, float, Measured, PETSc.Vec]
"""Place of a zero of ``D`` on a line of parameters, its uncertainty, the cluster and the state there."""


def unstable(pencil: NonsymmetricPencil, size: int = 0, basis: np.ndarray | None = None) -> int:
    """Unstable eigenvalues but for ``size`` ones: those nearest to zero, or of an invariant subspace.

    Its ``basis`` (n, size) is orthonormal in the mass.
    """
    spectrum = pencil.spectrum
    own = -abs(spectrum.values) if basis is None else pencil.shares(basis)
    chosen = np.argsort(own, kind="stable")[: len(own) - size]
    values, noise = spectrum.values[chosen], np.maximum(spectrum.zero, spectrum.noise[chosen])
    return int(((values.real < -noise) | (abs(values.imag) > np.maximum(noise, MET * abs(values)))).sum())


@dataclass(frozen=True)
class _Frame:
    """Parameters ``origin`` (2,), and directions ``axes`` (2, 2) across a tangent and along it, in ``width`` (2,)."""

    origin: np.ndarray
    axes: np.ndarray
    width: np.ndarray

    def turned(self, parts: np.ndarray) -> np.ndarray:
        """Change (2,) of the parameters of which these are the parts across and along."""
        return np.asarray(parts @ self.axes * self.width)


class Singular:
    """Corrects states to where the tangent matrix is singular: a ``fold``, else a branch point or divergence.

    It is bordered with the null vectors of a point ``near`` the curve in a ``plane``; ``solver`` has the mesh.
    """

    def __init__(self, solver: BranchSolver, plane: Plane, near: LocusPoint, *, fold: bool) -> None:
        self.solver, self.plane, self.fold = solver, plane, fold
        self.states = SingularSystem(solver, near.modes, near.multiplicity, fold=fold)
        self.inertia, self.metric = self.states.inertia, self.states.inertia.metric
        self.frequencies = NonsymmetricSolver(solver.system) if near.left else None
        self.others = UNSTABLE if near.left else VANISHED

    def length(self, dp: np.ndarray, dx: PETSc.Vec) -> float:
        """Size of a step: parameters over the widths of their bounds, the state in the metric."""
        return float(np.hypot(np.linalg.norm(dp / self.plane.width), np.sqrt(max((self.metric * dx).dot(dx), 0.0))))

    def correct(self, guess: Guess, near: LocusPoint, reach: float = 1.0) -> LocusPoint:
        """As :class:`~rodfem.codim2.plane.Criterion` says; raises :class:`ConvergenceError`."""
        frame, section = self._section(guess, near, reach)
        found = self.states.solve(self._unloaded(guess[1]), section)
        if found is None or found.curve is None:
            raise ConvergenceError("Newton's method does not converge")
        self._require(found)
        return self._node(found, found.curve, frame, guess)

    def onto(self, guess: Guess, near: LocusPoint) -> LocusPoint:
        """As :class:`~rodfem.codim2.plane.Criterion` says; raises :class:`ConvergenceError`."""
        frame, section = self._section(guess, near, 1.0)
        found = self.states.place(self._unloaded(guess[1]), section)
        if found is None:
            raise ConvergenceError("Newton's method does not converge")
        x, parts, last = found
        p = frame.origin + frame.turned(parts)
        return LocusPoint(p, self.plane.at(p, x), near.dp, near.dx, self._located(p, frame.turned(last)))

    def _unloaded(self, x: PETSc.Vec) -> PETSc.Vec:
        x = x.copy()
        self.solver.system.set_load(x, 0.0)
        return x

    def _section(self, guess: Guess, near: LocusPoint, reach: float) -> tuple[_Frame, Section]:
        """Plane through a guess across its direction; the border is the null vectors of a point ``near`` by."""
        self.states.border(near.modes, near.left)
        p, _, dp, dx = guess
        direction = dp / self.plane.width
        size = float(np.linalg.norm(direction))
        along = direction / size if size else np.array([0.0, 1.0])
        frame = _Frame(p, np.array([[along[1], -along[0]], along]), self.plane.width)
        across, along = frame.axes * self.plane.width
        row = None if dx is None else self.metric * dx
        line = self.plane.line
        return frame, Section(
            lambda t: line(p + t * along, across), lambda load: line(p + load * across, along), size, row, reach
        )

    def _located(self, p: np.ndarray, last: np.ndarray) -> np.ndarray:
        """Uncertainties of both parameters, across the curve, by their ``last`` changes."""
        return np.asarray(np.maximum(abs(last), ROUND_OFF * np.maximum(self.plane.sizes, abs(p))))

    def _require(self, found: SingularState) -> None:
        if not self.fold and found.size > IMPERFECT * self.inertia.scale:
            raise Destroyed(self._broken)
        if found.spread > FEWER * self.inertia.scale:
            raise Destroyed(f"its {len(found.vectors)} zero eigenvalues do not vanish together any more")

    @property
    def _broken(self) -> str:
        """Why a curve ends where the second parameter breaks the symmetry of its branch points."""
        return f"{self.plane.names[1]} is an imperfection that destroys the branch point, or is one on this mesh alone"

    def _node(self, found: SingularState, curve: Curve, frame: _Frame, guess: Guess) -> LocusPoint:
        """Point of the locus with its tangent, count and records."""
        width, (*_, before, dx_before) = frame.width, guess
        p = frame.origin + frame.turned(np.array([found.load, found.second]))
        x = self.plane.at(p, found.x)
        dp, dx = frame.turned(curve.slope), curve.dx
        forward = before / width**2 @ dp + (0.0 if dx_before is None else (self.metric * dx).dot(dx_before))
        size = float(np.copysign(self.length(dp, dx), forward))
        rates = curve.rates @ frame.axes
        # each of several eigenvalues vanishes no farther across the curve than their mean by what they differ
        split = SPLIT * found.spread * abs(rates) / max(rates @ rates, TINY) * width  # none of one eigenvalue
        return LocusPoint(
            p,
            x,
            dp / size,
            dx * (1.0 / size),
            self._located(p, frame.turned(curve.last)) + split,
            ordinate=self.solver.shape.ordinate(x),
            ended=self._broken if curve.part > IMPERFECT else "",
            orientation=curve.side * int(np.copysign(1.0, size)),
            rest=unstable(self.frequencies.at(x), len(curve.left)) if self.frequencies else curve.negative,
            curvature=curve.curvature if self.fold else 0.0,
            coupling=curve.work[:, 0] @ frame.axes if self.fold else np.zeros(2),
            modes=curve.modes,
            multiplicity=len(found.vectors),
            left=curve.left if self.frequencies else [],
        )


def null_vectors(solver: BranchSolver, x: PETSc.Vec, number: int) -> tuple[list[PETSc.Vec], list[PETSc.Vec]]:
    """Right and left null vectors of the tangent matrix at ``x``, not symmetric, with the ``number`` it has there.

    By inverse iteration, of borders that are arbitrary at first.  Of several the left ones are turned to be along the
    right ones of the same number: if a symmetry relates them ``G`` is a multiple of one.
    """
    states = SingularSystem(solver, [], number, fold=False)
    metric = states.inertia.metric
    right = left = [states.inertia.seed(i) for i in range(number)]
    for _ in range(3):
        states.border(right, left)
        right, left = states.relaxed(x)
    for side in (right, left):
        orthonormalize(side, metric)
    overlap = np.array([[(metric * v).dot(w) for w in left] for v in right])
    u, _, vt = np.linalg.svd(overlap)
    return right, [combine(left, column) for column in (vt.T @ u.T).T]


class Collision:
    """Corrects points of the plane to where two eigenvalues near ``omega2`` collide."""

    others = UNSTABLE

    def __init__(self, solver: BranchSolver, plane: Plane) -> None:
        self.solver, self.plane = solver, plane
        self.eigensolver = NonsymmetricSolver(solver.system)

    def length(self, dp: np.ndarray, dx: PETSc.Vec) -> float:
        """Size of a step: parameters over the widths of their bounds."""
        return float(np.linalg.norm(dp / self.plane.width))

    def correct(self, guess: Guess, near: LocusPoint, reach: float = 1.0) -> LocusPoint:
        """As :class:`~rodfem.codim2.plane.Criterion` says; the direction of the state plays no part.

        Raises :class:`ConvergenceError`, and :class:`Destroyed` if pairs that met at once do not any more.
        """
        node, here = self._onto(guess, near, reach)
        width, system, p, x, omega2 = self.plane.width, self.solver.system, node.p, node.x, node.omega2
        basis, forward = _basis(near), guess[2] / width
        gradient, clearest = np.zeros(2), here
        # D has a pole at what is not admissible, as a mass of zero
        steps = np.minimum(DIFFERENCE, self.plane.room(p) / 100 / width)
        for which in (0, 1):
            system.line = self.plane.line(p, self.plane.axis(which))
            step = float(steps[which])
            low, high = (self._measured(h, x, Cluster(basis, omega2))[0] for h in (-step, step))
            gradient[which] = (high.discriminant - low.discriminant) / (2 * step)
            clearest = max((clearest, low, high), key=lambda m: m.spread)
        if not np.linalg.norm(gradient):
            raise ConvergenceError("the discriminant is constant")
        if here.split > FEWER * max(omega2**2, system.scene.units.omega2**2):
            raise Destroyed(f"its {here.cluster.size // 2} pairs of eigenvalues do not meet together any more")
        dq = np.array([-gradient[1], gradient[0]]) / np.linalg.norm(gradient)
        orientation = 1 if dq @ forward >= 0 else -1
        basis = clearest.cluster.basis
        rest = unstable(self.eigensolver.at(self.plane.at(p, x)), basis.shape[1], basis)
        return replace(
            node,
            dp=orientation * dq * width,
            orientation=orientation,
            located_to=node.located_to + SPLIT * here.split * abs(gradient) / (gradient @ gradient) * width,
            modes=as_vectors(system, basis),
            rest=rest + (here.cluster.size if omega2 < 0 else 0),
            lower=int(np.sign(gradient[0])),
        )

    def onto(self, guess: Guess, near: LocusPoint) -> LocusPoint:
        """See :class:`~rodfem.codim2.plane.Criterion`."""
        return self._onto(guess, near, 1.0)[0]

    def _onto(self, guess: Guess, near: LocusPoint, reach: float) -> tuple[LocusPoint, Measured]:
        """Point of the curve on the line, and the cluster there; the tangent is the one that was given."""
        p, x, dp, _ = guess
        width, system = self.plane.width, self.solver.system
        forward = dp / width / np.linalg.norm(dp / width)
        across = np.array([-forward[1], forward[0]])
        system.line = self.plane.line(p, across * width)
        t, last, here, x = self._collide(x, Cluster(_basis(near), near.omega2), reach)
        p = p + t * across * width
        x = self.plane.at(p, x)
        located = np.maximum(last * abs(across) * width, ROUND_OFF * np.maximum(self.plane.sizes, abs(p)))
        ordinate, still = self.solver.shape.ordinate(x), system.new_vector()
        return LocusPoint(p, x, forward * width, still, located, ordinate=ordinate, omega2=here.cluster.mean), here

    def _collide(self, x: PETSc.Vec, cluster: Cluster, reach: float) -> Zero:
        """Zero of ``D`` on the system's line of parameters, by secants.

        These take ``D`` from the eigenvalues, and end near the zero, or where they no longer shrink.  The last digits
        are by ``D`` of both subspaces, right and left.
        """
        t, other = 0.0, FIRST
        now, x = self._measured(t, x, cluster)
        at_other = self._measured(other, x, cluster)[0].discriminant
        before = np.inf
        slope = (at_other - now.discriminant) / (other - t)
        for _ in range(12):
            if now.discriminant == at_other:
                break
            step = -now.discriminant * (other - t) / (at_other - now.discriminant)
            if abs(step) < SHARP or (abs(step) < NOISE and abs(step) > 0.3 * before):
                return self._by_both_sides((t, abs(step), now, x), slope)
            if abs(other - t) > FAR:
                slope = (at_other - now.discriminant) / (other - t)
            other, at_other, before = t, now.discriminant, abs(step)
            t += step
            if abs(t) > reach:
                break
            now, x = self._measured(t, x, Cluster(cluster.basis, now.cluster.mean))
        raise ConvergenceError("two eigenvalues do not collide near by")

    def _by_both_sides(self, found: Zero, slope: float) -> Zero:
        """Correct a zero of ``D`` that was ``found`` twice, by its ``slope``.

        The uncertainty is the last change and the round-off of ``D``.  If left vectors are not found, as next to a
        double zero, the zero stays that of the eigenvalues.
        """
        t, _, now, x = found
        with suppress(ConvergenceError):
            for _ in range(2):
                noise = noise_of(self.eigensolver.at(x), now)
                step = -noise.two_sided / slope
                t += step
                now, x = self._measured(t, x, now.cluster)
                found = t, abs(step) + abs(noise.discriminant / slope), now, x
        return found

    def _measured(self, t: float, guess: PETSc.Vec, cluster: Cluster) -> tuple[Measured, PETSc.Vec]:
        """The cluster at ``t`` on the system's line of parameters, and the state there."""
        x, outcome = self.solver.at_load(guess, t)
        if not outcome.converged:
            raise ConvergenceError("no equilibrium is found there")
        return measure(self.eigensolver.at(x), cluster), x


def _basis(near: LocusPoint) -> np.ndarray:
    """Basis (n, size) of the invariant subspace at a point, this rank's n unknowns."""
    return np.stack([v.array_r.real for v in near.modes], axis=1)
