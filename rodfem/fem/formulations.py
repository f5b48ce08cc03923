"""How a rod's rotations and centreline are described: classes of rotation fields, and of formulations by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import ufl

from rodfem.errors import InputError
from rodfem.forms import lagrangian
from rodfem.forms.rotation import IDENTITY, turn, turn_change
from rodfem.problem.functions import LETTERS, PLACES
from rodfem.problem.quaternions import of_vector, product
from rodfem.problem.unknowns import UNIT, Block, Group, Motion, Unknown

if TYPE_CHECKING:
    from rodfem.fem.equations import Equations
    from rodfem.fem.fields import Fields
    from rodfem.fem.shape import Shape
    from rodfem.fem.state import NodalValues
    from rodfem.modes.finder import Motions
    from rodfem.problem.functions import Constants, Place
    from rodfem.problem.scene import Scene

CONTACT_FORCE = "n"
"""Name of the contact force: a field, or the beginning of the names of scalars."""
Start = Callable[[np.ndarray], np.ndarray] | None


# --- rotation ------------------------------------------------------------------------------------------------------


class QuaternionField:
    """Rotation as a quaternion ``q``, whose unit norm is a constraint: values (..., ``size``) of a field."""

    name = "q"
    size = 4

    def expression(self, value: Any) -> Any:
        """Quaternion of a value in UFL."""
        return value

    def variation(self, value: Any, change: Any) -> Any:
        """Change of the quaternion in UFL."""
        return change

    def quaternion(self, values: np.ndarray) -> np.ndarray:
        """Quaternions of values."""
        return values

    def change(self, values: np.ndarray, change: np.ndarray) -> np.ndarray:
        """Changes of quaternions."""
        return change

    def functional(self, values: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """Weights (..., 4) of changes of quaternions, of ``weights`` of changes of values."""
        return weights

    def turned(self, values: np.ndarray, vector: np.ndarray) -> np.ndarray:
        """Values turned by rotation vectors (..., 3) along the directors."""
        return product(values, of_vector(vector))

    def normalised(self, values: np.ndarray) -> np.ndarray:
        """Values of unit quaternions."""
        return np.asarray(values / np.linalg.norm(values, axis=-1, keepdims=True))

    def start(self, start: Start, s: np.ndarray, interval: tuple[float, float]) -> np.ndarray:
        """Values (m, size) at arclengths (m,) of a scene's ``start``, a straight rod without one."""
        every, place = np.unique(np.append(np.linspace(*interval, PLACES), s), return_inverse=True)
        q = np.tile(IDENTITY, (len(every), 1)) if start is None else np.asarray(start(every), dtype=float)
        return self._continuous(q)[place.ravel()[PLACES:]]

    def _continuous(self, q: np.ndarray) -> np.ndarray:
        signs = np.cumprod(np.where((q[1:] * q[:-1]).sum(axis=1) < 0, -1.0, 1.0))
        return np.asarray(q * np.append(1.0, signs)[:, None])

    def clamp(self, rotation: Sequence[float], start: Start, s: float, interval: tuple[float, float]) -> np.ndarray:
        """Value of the quaternion ``rotation``, or its negative, of a clamped end at ``s``: that next to the start."""
        value = np.array(rotation)
        return np.asarray(-value if value @ self.start(start, np.array([s]), interval)[0] < 0 else value)


class AngleField(QuaternionField):
    """The angle about the normal of the plane, e1 or e2 (``normal`` 0 or 1), from the undeformed state.

    It is not confined to one turn: the number of whole turns is that of the scene's start.
    """

    name = "angle"
    size = 1

    def __init__(self, normal: int) -> None:
        self.normal = normal

    def expression(self, value: Any) -> Any:
        """Quaternion of a value in UFL."""
        return turn(value, self.normal)

    def variation(self, value: Any, change: Any) -> Any:
        """Change of the quaternion in UFL."""
        return turn_change(value, change, self.normal)

    def quaternion(self, values: np.ndarray) -> np.ndarray:
        """Quaternions of values."""
        q = np.zeros((*values.shape[:-1], 4))
        q[..., 0], q[..., self.normal + 1] = np.cos(values[..., 0] / 2), np.sin(values[..., 0] / 2)
        return q

    def change(self, values: np.ndarray, change: np.ndarray) -> np.ndarray:
        """Changes of quaternions."""
        return self.quaternion(values + np.pi) * change / 2

    def functional(self, values: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """Weights of changes of quaternions."""
        return 4 * self.change(values, weights)

    def turned(self, values: np.ndarray, vector: np.ndarray) -> np.ndarray:
        """Values turned by the components of rotation vectors along the normal."""
        return np.asarray(values + vector[..., [self.normal]])

    def normalised(self, values: np.ndarray) -> np.ndarray:
        """Values as they are."""
        return values

    def clamp(self, rotation: Sequence[float], start: Start, s: float, interval: tuple[float, float]) -> np.ndarray:
        """Angle of the quaternion ``rotation`` of a clamped end at ``s``: the one next to the start."""
        angle = self._angle(np.array(rotation))
        near = self.start(start, np.array([s]), interval)[0]
        return np.asarray(angle + 2 * np.pi * np.round((near - angle) / (2 * np.pi)))

    def _continuous(self, q: np.ndarray) -> np.ndarray:
        return np.asarray(np.unwrap(self._angle(q), period=2 * np.pi)[:, None])

    def _angle(self, q: np.ndarray) -> np.ndarray:
        return np.asarray(2 * np.arctan2(q[..., self.normal + 1], q[..., 0]))


def turning_of(scene: Scene) -> QuaternionField:
    """How the rotation of a scene's rod is described."""
    return QuaternionField() if scene.normal is None else AngleField(scene.normal)


# --- centreline ----------------------------------------------------------------------------------------------------


class Formulation:
    """Which unknowns a rod has in addition to rotations and strains, its Lagrangian in them, and where they say it is.

    Here centreline and contact force are fields, ``r`` measured from the lift of the ends' positions: that applies to
    all scenes. ``name`` is that in files and options.
    """

    name, words, centreline = "pointwise", "all fields", True

    def refusal(self, scene: Scene) -> str:
        """Why it does not apply to a scene, in words that follow its name; empty if it does."""
        return ""

    def blocks(self, degree: int) -> list[Block]:
        """Fields in addition to rotations and strains, for a rotation of this degree."""
        return [Block("r", 3, degree, True, False), Block(CONTACT_FORCE, 3, degree - 1, False, True)]

    def unknowns(self, scene: Scene) -> list[Unknown]:
        """Scalar unknowns in addition to those of the parts of the scene."""
        return []

    def integrand(self, equations: Equations, W: Any, along: Place) -> Any:
        """Integrand of the Lagrangian of the rod with the stored energy ``W``: see :mod:`rodfem.forms.lagrangian`."""
        return lagrangian.pointwise(W, along.R, along.v, along.dr, equations.unknowns.n)

    def dead_forces(self, equations: Equations, along: Place, dx: Any) -> dict[str, Any]:
        """The potential of dead forces at the ends by its name, if no term of an end has it."""
        return {}

    def contact_force(self, equations: Equations) -> list[Any]:
        """Components of the contact force in space (3,)."""
        return [equations.unknowns.n[i] for i in range(3)]

    def position(self, equations: Equations, c: Constants, at: Callable[[Any], Any], side: int | None) -> Any:
        """Position (3,) where ``at`` restricts a field to, at an end that of its ``side`` 0 or 1; None without one."""
        return at(equations.unknowns.r) + equations.lift(c)

    def sums(self, shape: Shape, state: NodalValues, integral: np.ndarray, value: np.ndarray) -> np.ndarray:
        """Share of this rank in the position at a place without its offset (3,), or in that and the chord (2, 3).

        ``integral`` are weights (2, points) of slopes in their integrals, ``value`` (nodes,) of nodal values.
        """
        return value @ state.values("r")[shape.cells].reshape(-1, 3)

    def nodal(self, shape: Shape, state: NodalValues) -> tuple[np.ndarray, np.ndarray]:
        """Positions of the nodes (m, 3) without their offset, and the chord (3,)."""
        r = shape.nodal(state.values("r")[shape.cells])
        return r, r[-1] - r[0]

    def offset(self, fields: Fields, state: NodalValues, s: np.ndarray, chord: np.ndarray) -> np.ndarray:
        """Offset (..., 3) or (3,) of the positions at arclengths ``s`` (...,); ``chord`` (3,) is that of the ends."""
        return fields.lift(s, state.constants())

    def store(self, shape: Shape, out: np.ndarray, r: np.ndarray, ends: tuple[Any, Any]) -> None:
        """Write positions ``r`` (cells, nodes, 3) above the lift, and those of the ends, into local values ``out``."""
        out[shape.system.fields.dofs["r"][shape.cells][:, shape.order]] = r

    def displacement(self, motions: Motions, state: NodalValues, change: NodalValues) -> np.ndarray:
        """Displacement of the nodes (m, 3) in a change of the state."""
        return motions.nodal(change.values("r")[motions.cells])


class Reduced(Formulation):
    """No centreline, and a contact force that is constant along the rod.

    It applies where nothing acts along the rod, and nothing there asks where the rod is.  The centreline is recovered
    by integrating ``r' = R v`` with the quadrature of the weak form, so that it closes exactly where the integral
    constraints say it does, and is as accurate as the pointwise one.  Positions ``a1``.., ``b1``.. of an end are
    unknown where other than dead forces act on it.
    """

    name, words, centreline = "reduced", "no centreline, the contact force as scalars", False

    def refusal(self, scene: Scene) -> str:
        """What needs the centreline."""
        reason = scene.needs_centreline
        return reason and f"has no centreline, and {reason} needs one"

    def blocks(self, degree: int) -> list[Block]:
        """None."""
        return []

    def unknowns(self, scene: Scene) -> list[Unknown]:
        """Components ``n1``.. of a constant contact force, and positions of ends."""
        c, inside = scene.constants(), [i for i in range(3) if i != scene.normal]
        known = lambda c: [scene.known_force(i, c) for i in range(3)]  # noqa: E731
        force = Group(CONTACT_FORCE, "position of the ends along e{}", Motion.VECTOR, known)
        out = [Unknown(force, i, UNIT[i]) for i in inside if scene.known_force(i, c) is None]
        for side, end in enumerate(scene.sides):
            if not scene.plain[side]:
                place = Group(LETTERS[side], "", Motion.POSITION, end.support)
                out += [Unknown(place, i, UNIT[i]) for i in inside if end.support(c)[i] is None]
        return out

    def integrand(self, equations: Equations, W: Any, along: Place) -> Any:
        """With the integral of ``r' = R v``."""
        force = self.contact_force(equations)
        left, right = (self._end(equations, equations.constants, side) for side in range(2))
        chord = [0.0 if x is None or y is None else y - x for x, y in zip(left, right, strict=True)]
        return lagrangian.reduced(W, along.R, along.v, ufl.as_vector(force), ufl.as_vector(chord) / equations.length)

    def dead_forces(self, equations: Equations, along: Place, dx: Any) -> dict[str, Any]:
        """That of the components of the contact force which they prescribe: ``-n.r'``."""
        known, slope = [equations.fields.scene.known_force(i, equations.constants) for i in range(3)], along.R * along.v
        terms = [-n * slope[i] * dx for i, n in enumerate(known) if n is not None and n != 0]
        return {"dead forces": sum(terms)} if terms else {}

    def contact_force(self, equations: Equations) -> list[Any]:
        """Unknown scalars, and what dead forces prescribe."""
        scene, scalars, c = equations.fields.scene, equations.unknowns.scalars, equations.constants
        return [scalars.get(f"n{i + 1}", scene.known_force(i, c) or 0.0) for i in range(3)]

    def position(self, equations: Equations, c: Constants, at: Callable[[Any], Any], side: int | None) -> Any:
        """Known at an end that is held or whose position is a scalar unknown."""
        r = [None] if side is None else self._end(equations, c, side)
        return None if None in r else ufl.as_vector(r)

    def _end(self, equations: Equations, c: Constants, side: int) -> list[Any]:
        return _end_position(side, equations.fields.scene, c, equations.unknowns.scalars)

    def sums(self, shape: Shape, state: NodalValues, integral: np.ndarray, value: np.ndarray) -> np.ndarray:
        """Integrals of the slope."""
        return integral @ shape.slopes(state).reshape(-1, 3)

    def nodal(self, shape: Shape, state: NodalValues) -> tuple[np.ndarray, np.ndarray]:
        """Integrals of the slope."""
        before, inside, chord = shape.integrals(shape.slopes(state))
        return shape.joined(before + inside), chord

    def offset(self, fields: Fields, state: NodalValues, s: np.ndarray, chord: np.ndarray) -> np.ndarray:
        """Position of the left end."""
        return _left_end(fields.scene, state.constants(), state.scalars, chord, float)

    def store(self, shape: Shape, out: np.ndarray, r: np.ndarray, ends: tuple[Any, Any]) -> None:
        """In the scalar positions of the ends."""
        fields = shape.system.fields
        for i, unknown in enumerate(fields.unknown_scalars):
            if unknown.group.motion is Motion.POSITION:
                out[fields.copies[:, i]] = ends[LETTERS.index(unknown.group.name)][unknown.component]

    def displacement(self, motions: Motions, state: NodalValues, change: NodalValues) -> np.ndarray:
        """Integral of the change of slope; of a ring without its mean."""
        scene = motions.system.scene
        before, inside, chord = motions.integrals(motions.slope_changes(state, change))
        r = motions.joined(before + inside)
        r = r + _left_end(scene, scene.constants(), change.scalars, chord, lambda held: 0.0)
        return r - motions.mean(r) if scene.closed else r


def _end_position(
    side: int, scene: Scene, c: Constants, scalars: Mapping[str, Any], given: Callable[[Any], Any] = lambda x: x
) -> list[Any]:
    """Position of the end on one ``side``: ``given(held)``, a scalar unknown by its name, or None (known force)."""
    return [
        given(x) if x is not None else scalars.get(f"{LETTERS[side]}{i + 1}", 0.0 if i == scene.normal else None)
        for i, x in enumerate(scene.sides[side].support(c))
    ]


def _left_end(
    scene: Scene, c: Constants, scalars: Mapping[str, Any], chord: np.ndarray, given: Callable[[Any], Any]
) -> np.ndarray:
    """Position (3,) of the left end: where it is held, or else a ``chord`` back from where the right end is."""
    left, right = (_end_position(side, scene, c, scalars, given) for side in range(2))
    return np.array([a if a is not None else (b or 0.0) - d for a, b, d in zip(left, right, chord, strict=True)])


AUTO = "auto"
"""Not a formulation: the first that applies is chosen."""
FORMULATIONS: dict[str, Formulation] = {made.name: made for made in (Reduced(), Formulation())}
NAMES = (AUTO, *FORMULATIONS)
"""What a discretisation may ask for."""


def chosen(name: str, scene: Scene) -> Formulation:
    """Formulation of that name, or the first that applies; raises :class:`InputError` where it does not apply."""
    refusals = {other: made.refusal(scene) for other, made in FORMULATIONS.items()}
    first = next(other for other, refusal in refusals.items() if not refusal)
    if refusals.get(name):
        raise InputError(f"The {name} formulation {refusals[name]}: use Discretization(formulation={first!r}).")
    return FORMULATIONS[first if name == AUTO else name]
