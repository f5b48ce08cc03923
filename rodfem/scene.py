"""What a person states: a rod, its ends, its loads, its symmetry, and what to record.

A :class:`Scene` is plain immutable data without meshes or matrices.  Functions in it receive a namespace ``c`` of
named constants (``c.lam``, ``c.C``, ...; ``c.s`` is the arclength) and work on UFL expressions and on numbers alike.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from math import inf, isfinite
from types import SimpleNamespace
from typing import Any

import numpy as np
import ufl
from ufl.algorithms.apply_algebra_lowering import apply_algebra_lowering
from ufl.algorithms.apply_derivatives import apply_derivatives

from forms.kinematics import RODS, UNDEFORMED
from forms.rotation import IDENTITY
from forms.symmetry import Matrix
from rodfem.errors import SceneError

Constants = SimpleNamespace
Vector = Sequence[Any]


@dataclass(frozen=True)
class Parameter:
    """A named constant of a scene.

    ``value`` is where it starts, ``label`` its TeX name without dollars, ``admissible`` the open interval that makes
    sense for it.  Any parameter can be the one that a continuation varies.
    """

    value: float
    label: str = ""
    admissible: tuple[float, float] = (-inf, inf)

    def check(self, name: str, value: float) -> None:
        """Raise :class:`SceneError` unless ``value`` is a finite number inside the admissible interval."""
        low, high = self.admissible
        if not isfinite(value):
            raise SceneError(f"{name} = {value:g} is not a finite number: give one.")
        if not low < value < high:
            raise SceneError(f"{name} = {value:g} is outside its admissible range: choose {low:g} < {name} < {high:g}.")


@dataclass(frozen=True)
class End:
    """What holds one end of the rod.

    ``position(c)`` gives three components, each an expression (held there) or None (free to move in that direction);
    ``position = None`` leaves all three free.  ``force(c)`` is the dead force on the end, used in the free directions.
    ``follower(c)`` is a force on a free end given by its components along the directors, with which it turns: it has no
    potential.  ``rotation`` is the quaternion at which the directors are clamped, None leaves them free.
    """

    position: Callable[[Constants], Vector] | None = None
    rotation: tuple[float, float, float, float] | None = None
    force: Callable[[Constants], Vector] | None = None
    follower: Callable[[Constants], Vector] | None = None

    def held(self, c: Constants) -> list[Any]:
        """Position of the end: three expressions, None where the end is free."""
        return [None] * 3 if self.position is None else list(self.position(c))

    def applied(self, c: Constants) -> list[Any]:
        """Dead force on the end, three expressions."""
        return [0.0] * 3 if self.force is None else list(self.force(c))


def clamped(
    position: Callable[[Constants], Vector] = lambda c: (0.0, 0.0, 0.0),
    rotation: tuple[float, float, float, float] = IDENTITY,
) -> End:
    """Return an end whose position and directors are given."""
    return End(position=position, rotation=rotation)


def free(
    force: Callable[[Constants], Vector] | None = None, follower: Callable[[Constants], Vector] | None = None
) -> End:
    """Return an end without support, loaded by a dead force, a follower force, or none."""
    return End(force=force, follower=follower)


@dataclass(frozen=True)
class Inertia:
    """Mass ``rho_A(c)`` and rotary inertia ``rho_I(c)`` about the directors, both per unit length.

    Only frequencies need them, and the stability of states under loads without a potential.
    """

    rho_A: Callable[[Constants], Any] = lambda c: 0.0
    rho_I: Callable[[Constants], Vector] = lambda c: (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class Ordinate:
    """The number that a bifurcation diagram shows against the load: ``of(r, q)`` at arclength ``s``.

    ``r`` (3,) is the centreline and ``q`` (4,) the unit quaternion there, as numpy arrays.  ``key`` names the record
    ``name`` in words, ``label`` in TeX for the axis of a figure.
    """

    name: str
    s: float
    of: Callable[[np.ndarray, np.ndarray], float]
    label: str = ""


@dataclass(frozen=True)
class Scene:
    """A boundary value problem for one rod, as a person states it.

    Parameters
    ----------
    name, title
        Used for folders and headings.
    interval
        Arclength of the two ends in the reference state.
    rod
        One of the keys of :data:`forms.kinematics.RODS`: which strains are free.
    energy
        Stored energy ``W(v, k, c)`` per unit length.
    parameters
        Named constants; ``load`` names the one that is varied unless another is asked for.
    ends
        Left and right :class:`End`.
    ordinate
        What to record beside the load.
    inertia
        Kinetic metric of the spectrum; unit rotary inertia by default, which serves to count.
    symmetries
        Generators from :mod:`forms.symmetry` of the continuous symmetries that all states of the scene share.
    start
        Quaternion(s) of a first guess, ``start(s)`` of shape (m,) -> (m, 4); by default the identity (a straight rod).
    span
        Default range of the load, from where the continuation starts to where it ends.
    """

    name: str
    interval: tuple[float, float]
    rod: str
    energy: Callable[[Any, Any, Constants], Any]
    parameters: Mapping[str, Parameter]
    load: str
    ends: tuple[End, End]
    ordinate: Ordinate
    span: tuple[float, float]
    title: str = ""
    inertia: Inertia = Inertia()
    symmetries: tuple[Mapping[str, Matrix], ...] = ()
    start: Callable[[np.ndarray], np.ndarray] | None = None
    states: str = field(default="straight")

    def __post_init__(self) -> None:
        """Check all that can be checked before any computation; raises :class:`SceneError`."""
        a, b = self.interval
        if not (isfinite(a) and isfinite(b) and a < b):
            raise SceneError(
                f"The rod's interval ({a:g}, {b:g}) is empty: give two finite ends with the left one first."
            )
        if self.rod not in RODS:
            raise SceneError(f"Unknown kind of rod {self.rod!r}: choose one of {', '.join(map(repr, RODS))}.")
        if self.load not in self.parameters:
            raise SceneError(f"The load {self.load!r} is not a parameter: choose one of {', '.join(self.parameters)}.")
        for name, parameter in self.parameters.items():
            parameter.check(name, parameter.value)
        if not a <= self.ordinate.s <= b:
            raise SceneError(
                f"The ordinate's arclength {self.ordinate.s:g} is not on the rod: choose {a:g} <= s <= {b:g}."
            )
        self.check_span(self.span)
        held = [[x is not None for x in end.held(self.constants())] for end in self.ends]
        if not all(left or right for left, right in zip(*held, strict=True)):
            raise SceneError("The rod can drift away: hold each component of the position at one end at least.")
        if all(end.rotation is None for end in self.ends):
            raise SceneError("The rod can rotate freely: clamp the rotation at one end at least.")
        for end in self.ends:
            if end.follower is not None and any(x is not None for x in end.held(self.constants())):
                raise SceneError("A follower force acts on an end that is held: leave its position free.")
        stiffness = self.stiffness()
        if stiffness.size and np.linalg.eigvalsh(stiffness)[0] <= 1e-12 * abs(stiffness).max():
            raise SceneError(
                f"The stored energy is not convex: its second derivative at the undeformed state has the eigenvalue "
                f"{np.linalg.eigvalsh(stiffness)[0]:.3g}; choose constants for which all are positive."
            )

    @property
    def length(self) -> float:
        """Reference length of the rod."""
        return self.interval[1] - self.interval[0]

    @property
    def conservative(self) -> bool:
        """Whether all loads have a potential, so that stability is a matter of the second variation alone."""
        return all(end.follower is None for end in self.ends)

    @property
    def free_strains(self) -> tuple[int, ...]:
        """Components of ``v`` that are unknowns."""
        return RODS[self.rod]

    def constants(self, load: float | None = None, s: float | None = None) -> Constants:
        """Namespace of all parameters as numbers, at ``load`` and at the arclength ``s`` (default: the mid-point)."""
        values = {name: p.value for name, p in self.parameters.items()}
        if load is not None:
            values[self.load] = load
        return SimpleNamespace(s=sum(self.interval) / 2 if s is None else s, **values)

    def check_span(self, span: tuple[float, float]) -> None:
        """Raise :class:`SceneError` unless both ends of a range of loads are admissible and differ."""
        for value in span:
            self.parameters[self.load].check(self.load, value)
        if span[0] == span[1]:
            raise SceneError(
                f"The range of {self.load} from {span[0]:g} to {span[1]:g} is empty: give two different loads."
            )

    def known_force(self, component: int, c: Constants) -> Any | None:
        """Component of the contact force that a dead end force prescribes, or None where both ends are held there.

        Free at the right end the contact force is the applied one, free at the left end it is minus the applied one.
        """
        left, right = self.ends
        if right.held(c)[component] is None:
            return right.applied(c)[component]
        if left.held(c)[component] is None:
            return -left.applied(c)[component]
        return None

    def stiffness(self) -> np.ndarray:
        """Second derivative of ``W`` in the m free strains and ``k`` at the undeformed state, (m + 3, m + 3)."""
        free_v = self.free_strains
        x = ufl.variable(ufl.as_vector([UNDEFORMED[i] for i in free_v] + [0.0] * 3))
        v = [ufl.as_ufl(value) for value in UNDEFORMED]
        for position, component in enumerate(free_v):
            v[component] = x[position]
        k = ufl.as_vector([x[len(free_v) + i] for i in range(3)])
        W = ufl.as_ufl(self.energy(ufl.as_vector(v), k, self.constants()))
        hessian = apply_derivatives(apply_algebra_lowering(ufl.diff(ufl.diff(W, x), x)))
        m = len(free_v) + 3
        return np.array([[float(hessian((), component=(i, j))) for j in range(m)] for i in range(m)])
