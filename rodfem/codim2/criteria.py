r"""What the points of a locus fulfil: its defining equations, as a corrector onto the curve.

Folds, branch points and divergence loads are where the second variation is singular: the equations of one of them
(:mod:`rodfem.continuation.singular`) on a plane across the curve.  A branch point is one as long as its symmetry lasts:
where the unfolding parameters do not vanish, or the equations change along the null vectors as the parameters follow
the curve, a parameter is an imperfection.  Null vectors that a symmetry relates vanish together, or the curve ends.
Flutter has equations of its own (:mod:`rodfem.codim2.collision`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from petsc4py import PETSc

from rodfem.codim2.plane import Destroyed, Guess, LocusPoint, Plane
from rodfem.codim2.unstable import UNSTABLE, VANISHED, unstable
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.singular import Curve, Section, SingularState, SingularSystem
from rodfem.errors import ConvergenceError
from rodfem.linalg.orthogonal import combine, orthonormalize
from rodfem.stability.nonsymmetric import NonsymmetricSolver
from rodfem.tolerances import ROUND_OFF, TINY

SPLIT = 1.1
"""Times what eigenvalues, or the ``D`` of pairs, that are equal by a symmetry differ by that each may be off: to first
order."""
IMPERFECT = 1e-7
"""Over the lowest bending eigenvalue, or over the terms that cancel: a larger imperfection is not one of the mesh."""
FEWER = 1e-5
"""Eigenvalues that differ by more than this, over the lowest bending one, or pairs whose ``D`` do, over the square of
their mean, are not equal by a symmetry."""


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
    """Corrects states to where the tangent matrix is singular: a ``fold``, else a branch point or divergence."""

    def __init__(self, solver: BranchSolver, plane: Plane, near: LocusPoint, *, fold: bool) -> None:
        """Border with the null vectors of a point ``near`` the curve, and the left ones where there are such.

        ``solver`` has the mesh, ``plane`` the two parameters.  At a ``fold`` the single null vector is coupled to the
        load; otherwise the points are branch points.
        """
        self.solver, self.plane, self.fold = solver, plane, fold
        self.states = SingularSystem(solver, near.modes, np.eye(len(near.modes))[:, : near.multiplicity], fold=fold)
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
        """Raise :class:`Destroyed` where an imperfection has taken the branch point apart, or null vectors part."""
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

    By borders that are arbitrary at first: each solution is a step of inverse iteration, and the better border.  Of
    several the left ones are turned such that each is along the right one of the same number as far as it can be:
    where a symmetry relates them ``G`` is a multiple of one.
    """
    states = SingularSystem(solver, [], np.eye(number), fold=False)
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
