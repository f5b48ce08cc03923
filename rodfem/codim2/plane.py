"""A plane of two parameters of a scene, points of curves of special points in it, and what corrects to these."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.branch_solver import ROWS, BranchSolver, cubic_weights, lagrange
from rodfem.errors import ConvergenceError, SceneError
from rodfem.fem.state import Line, line
from rodfem.fem.system import System
from rodfem.linalg.orthogonal import combine
from rodfem.problem.units import size

REACH = 1e-6
"""Distance, in the metric, that a point on a line of parameters may move by, however short the step."""
Interval = tuple[float, float]
Prediction = tuple[np.ndarray, PETSc.Vec, np.ndarray, PETSc.Vec]
"""Parameters (2,) and state of a point that is expected, and their derivatives in arclength."""
Guess = tuple[np.ndarray, PETSc.Vec, np.ndarray, PETSc.Vec | None]
"""The same with a direction of any size, which may be one of the parameters alone."""


class Destroyed(ConvergenceError):
    """The special point changes its kind, or ends, along the locus; the message says why."""


@dataclass(frozen=True)
class Sought:
    """What marks a point along a curve: ``of`` a point is zero there, or ``stationary``."""

    of: Callable[[LocusPoint], float]
    stationary: bool


@dataclass
class LocusPoint:
    """A point of a locus: parameters ``p`` (2,), state ``x``, and its unit tangent ``dp``, ``dx`` at arclength ``s``.

    ``located_to`` (2,) are the uncertainties of the parameters, ``ordinate`` is the scene's.  ``rest`` counts the
    negative (without a potential: unstable) eigenvalues but for those that vanish or collide here, -1: not counted;
    those that collide are real on the side ``lower`` of the load.  ``omega2`` is a double eigenvalue.  At folds
    ``coupling`` (2,) is the derivative of the equations in the two parameters along the null vector, in units of the
    bounds, and ``curvature`` the second one along it.  ``modes`` are the null vectors, as many as the ``multiplicity``,
    and modes near by, or a basis of the double eigenvalue's invariant subspace; ``left`` are the left null vectors
    where they are others. ``orientation`` is the side of the tangent, -1 or 1, on which the defining function grows: it
    changes only where two curves cross.  ``ended`` says why the curve ends here.  A turning point or an end is
    ``sought`` along the curve, and was found in ``windows`` of these half widths.
    """

    p: np.ndarray
    x: PETSc.Vec
    dp: np.ndarray
    dx: PETSc.Vec
    located_to: np.ndarray
    s: float = 0.0
    ordinate: float = float("nan")
    rest: int = -1
    lower: int = 0
    omega2: float = float("nan")
    curvature: float = 0.0
    coupling: np.ndarray = field(default_factory=lambda: np.zeros(2))
    modes: list[PETSc.Vec] = field(default_factory=list)
    left: list[PETSc.Vec] = field(default_factory=list)
    multiplicity: int = 0
    orientation: int = 0
    ended: str = ""
    sought: Sought | None = None
    windows: tuple[float, ...] = ()

    def reversed(self) -> LocusPoint:
        """The same point with the opposite tangent."""
        return replace(self, dp=-self.dp, dx=-self.dx, orientation=-self.orientation)


class Plane:
    """Lines in the plane of two parameters of the scene of a system, the first of which is the scene's load.

    ``bounds`` (2, 2) are their ``intervals``, whose ``width`` (2,) scales them, and ``sizes`` (2,) their natural sizes.
    """

    def __init__(self, system: System, parameter: str, bounds: tuple[Interval, Interval]) -> None:
        """Check parameter and bounds; raises :class:`SceneError`."""
        scene = system.scene
        if parameter not in scene.parameters:
            raise SceneError(
                f"{parameter!r} is no parameter of the scene: choose one of {', '.join(scene.parameters)}."
            )
        if parameter == scene.load:
            raise SceneError(f"{parameter!r} is the load itself: choose a second parameter to vary.")
        self.system, self.names = system, (scene.load, parameter)
        for name, (low, high) in zip(self.names, bounds, strict=True):
            if not low < high:
                raise SceneError(f"The bounds {low:g}, {high:g} of {name} are empty: give the lower one first.")
            scene.parameters[name].check(name, low)
            scene.parameters[name].check(name, high)
        for end in bounds[1]:  # the stored energy must be convex at both ends
            replace(scene, parameters={**scene.parameters, parameter: replace(scene.parameters[parameter], value=end)})
        self.intervals, self.bounds = bounds, np.array(bounds, dtype=float)
        self.width = self.bounds[:, 1] - self.bounds[:, 0]
        self.sizes = np.array([size(x) for x in abs(self.bounds).max(axis=1)])
        self._admissible = np.array([scene.parameters[name].admissible for name in self.names])

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
        over = np.maximum(p - self.bounds[:, 1], self.bounds[:, 0] - p) / self.width
        which = int(np.argmax(over))
        if over[which] <= 0:
            return None
        return which, float(self.bounds[which, int(p[which] > self.bounds[which, 1])])

    def room(self, p: np.ndarray) -> np.ndarray:
        """Distances (2,) of the parameters ``p`` (2,) from values that are not admissible."""
        return np.asarray(abs(self._admissible - p[:, None]).min(axis=1))

    def words(self, p: np.ndarray, digits: int = 8) -> str:
        """Both parameters by name."""
        return ", ".join(f"{name} = {v:.{digits}g}" for name, v in zip(self.names, p, strict=True))

    @contextmanager
    def kept(self) -> Iterator[None]:
        """Restore on exit all that a locus changes: the line of parameters, phase conditions, symmetries."""
        system, verification = self.system, self.system.verification
        before, dropped, notices = (system.line, system.phase), {*verification.dropped}, [*verification.notices]
        try:
            yield
        finally:
            system.line, system.phase = before
            verification.dropped, verification.notices = dropped, notices


class Criterion(Protocol):
    """Defining equations of a locus: a corrector onto it.

    ``solver`` has the mesh; ``others`` says that the number of other unstable eigenvalues has changed at a row.
    """

    solver: BranchSolver
    others: str

    def length(self, dp: np.ndarray, dx: PETSc.Vec) -> float:
        """Size of a step."""

    def correct(self, guess: Guess, near: LocusPoint, reach: float = 1.0) -> LocusPoint:
        """Point of the locus on the plane through a ``guess`` across its direction; raises :class:`ConvergenceError`.

        Across a direction of the parameters alone that is a line of theirs.  ``near`` is a point of the locus whose
        null vectors, or invariant subspace, are close by; ``reach`` bounds how far the state may move, in the metric.
        Raises :class:`Destroyed` where the special point changes its kind.
        """

    def onto(self, guess: Guess, near: LocusPoint) -> LocusPoint:
        """The same point with its parameters, state and double eigenvalue alone: no tangent, modes or counts."""


def predict(nodes: list[LocusPoint], s: float) -> Prediction:
    """Extrapolate a locus to arclength ``s``."""
    last = nodes[-1]
    if len(nodes) < 3:
        step = s - last.s
        return last.p + step * last.dp, last.x + last.dx * step, last.dp, last.dx
    recent = nodes[-ROWS:]
    return _combined(lagrange(np.array([n.s for n in recent]), s), [n.p for n in recent], [n.x for n in recent])


def between(a: LocusPoint, b: LocusPoint, s: float) -> Prediction:
    """Cubic through two nodes with their tangents at arclength ``s``."""
    return _combined(cubic_weights(b.s - a.s, s - a.s), [a.p, a.dp, b.p, b.dp], [a.x, a.dx, b.x, b.dx])


def _combined(weights: tuple[np.ndarray, np.ndarray], p: list[np.ndarray], x: list[PETSc.Vec]) -> Prediction:
    value, slope = weights
    return value @ np.array(p), combine(x, value), slope @ np.array(p), combine(x, slope)
