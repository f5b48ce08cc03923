"""A plane of two parameters of a scene, and points of curves in it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.prediction import lagrange
from rodfem.errors import SceneError
from rodfem.fem.parameters import Line, line
from rodfem.fem.system import System
from rodfem.linalg.orthogonal import combine
from rodfem.problem.units import size

Interval = tuple[float, float]
Tangent = tuple[np.ndarray, PETSc.Vec | None]
"""Direction of parameters (2,) and state; None: of the parameters alone."""


@dataclass(frozen=True)
class Sought:
    """What marks a point along a curve: ``of`` a point is stationary there where ``stationary``, else it is zero."""

    of: Callable[[LocusPoint], float]
    stationary: bool


@dataclass
class LocusPoint:
    """A point of a locus: parameters ``p`` (2,), state ``x``, and its unit tangent ``dp``, ``dx`` at arclength ``s``.

    ``rest`` counts the negative eigenvalues, or the unstable ones under loads without a potential, other than those
    that vanish or collide here (-1: not counted); those that collide are real on the side ``lower`` of the load.  At
    folds ``coupling`` (2,) is the derivative of the equations in the two parameters along the null vector, in units of
    the bounds, and ``curvature`` the second one along it.  ``omega2`` is a double eigenvalue.  ``modes`` are the null
    vectors, or a basis of the double eigenvalue's invariant subspace; ``left`` the left null vectors where they are
    others.  ``orientation`` is the side of the tangent, -1 or 1, on which the defining function grows: it changes only
    where two curves cross.  ``ended`` says why the curve ends here, empty where it does not.  ``located_to`` (2,) are
    the uncertainties of the parameters, and ``ordinate`` is the scene's.  A turning point or an end is ``sought`` along
    the curve, and was found in ``windows`` of these half widths (see :mod:`rodfem.codim2.along`); others are not.
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
    orientation: int = 0
    ended: str = ""
    sought: Sought | None = None
    windows: tuple[float, ...] = ()

    def reversed(self) -> LocusPoint:
        """The same point with the opposite tangent."""
        return replace(self, dp=-self.dp, dx=-self.dx, orientation=-self.orientation)


class Plane:
    """Lines in the plane of two parameters of the scene of a system.

    The first parameter is the scene's load.  ``bounds`` are their intervals, whose ``width`` (2,) scales them,
    and ``sizes`` (2,) their natural sizes.
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
        self.bounds = np.array(bounds, dtype=float)
        self.width = self.bounds[:, 1] - self.bounds[:, 0]
        self.sizes = np.array([size(x) for x in abs(self.bounds).max(axis=1)])
        self._admissible = np.array([scene.parameters[name].admissible for name in self.names])

    def line(self, origin: np.ndarray, direction: np.ndarray) -> Line:
        """Line on which the scalar unknown ``load`` stands for ``t`` in ``origin + t direction``."""
        named = (dict(zip(self.names, map(float, pair), strict=True)) for pair in (origin, direction))
        return line(self.system.scene, *named)

    def along(self, p: np.ndarray, which: int) -> Line:
        """Line on which it stands for parameter number ``which``; the other one has its value in ``p``."""
        axis = np.arange(2) == which
        return self.line(np.where(axis, 0.0, p), axis)

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

    @contextmanager
    def kept(self) -> Iterator[None]:
        """Restore on exit all that a locus changes: the line of parameters, phase conditions, symmetries.

        A symmetry that the second parameter breaks is one of the scene all the same.
        """
        system, verification = self.system, self.system.verification
        before, dropped, notices = (system.line, system.phase), {*verification.dropped}, [*verification.notices]
        try:
            yield
        finally:
            system.line, system.phase = before
            verification.dropped, verification.notices = dropped, notices


def predict(nodes: list[LocusPoint], s: float) -> tuple[np.ndarray, PETSc.Vec, np.ndarray, PETSc.Vec]:
    """Extrapolate a locus to arclength ``s``: parameters, state, and their derivatives in ``s``."""
    last = nodes[-1]
    if len(nodes) < 3:
        step = s - last.s
        return last.p + step * last.dp, last.x + last.dx * step, last.dp, last.dx
    recent = nodes[-4:]
    value, slope = lagrange(np.array([n.s for n in recent]), s)
    p, x = np.array([n.p for n in recent]), [n.x for n in recent]
    return value @ p, combine(x, value), slope @ p, combine(x, slope)


def between(a: LocusPoint, b: LocusPoint, s: float) -> tuple[np.ndarray, PETSc.Vec, np.ndarray, PETSc.Vec]:
    """Cubic through two nodes with their tangents at arclength ``s``: parameters, state, and their derivatives."""
    h = b.s - a.s
    t = (s - a.s) / h
    value = np.array([(1 + 2 * t) * (1 - t) ** 2, h * t * (1 - t) ** 2, t * t * (3 - 2 * t), h * t * t * (t - 1)])
    slope = np.array([-6 * t * (1 - t) / h, (1 - t) * (1 - 3 * t), 6 * t * (1 - t) / h, t * (3 * t - 2)])
    p, x = np.array([a.p, a.dp, b.p, b.dp]), [a.x, a.dx, b.x, b.dx]
    return value @ p, combine(x, value), slope @ p, combine(x, slope)
