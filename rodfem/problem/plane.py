"""The plane of a planar rod: whether all that holds and loads it leaves it there.

Functions of the constants must be zero across the plane as expressions, whatever the load and the arclength: between
the loads at which a scene is tried a component may be anything.  Of a function of the state, and of the stored energy,
the first variation out of the plane must vanish at states in it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import ufl
from ufl.classes import Abs, Conditional, Division, Product, ScalarValue, Sqrt, Sum, Zero

from rodfem.errors import SceneError
from rodfem.forms.kinematics import strain
from rodfem.forms.rotation import rotation
from rodfem.problem.end import SIDES
from rodfem.problem.local_state import STATES, Constants, Place, place, trials
from rodfem.problem.roles import functions_of
from rodfem.problem.symbols import Symbol, symbols
from rodfem.problem.values import Values
from rodfem.tolerances import NEGLIGIBLE

if TYPE_CHECKING:
    from rodfem.problem.scene import Scene

ASIDE = 1e-3
"""Displacement over length, strain or rotation out of the plane, to either side, at which energies are tried."""
Places = dict[Symbol, np.ndarray]


class LocalState:
    """Symbols of a state at a place: quaternion ``q``, ``r``, free strains ``v``, curvatures ``k``; and constants."""

    def __init__(self, scene: Scene) -> None:
        """Make symbols for a place of a ``scene``."""
        self.q, self.r, self.k = ([Symbol.named(x) for _ in range(n)] for x, n in (("q", 4), ("r", 3), ("k", 3)))
        self.v = [Symbol.named("v") for _ in scene.free_strains]
        self.constants = symbols(scene)


def check_plane(scene: Scene) -> None:
    """Raise :class:`SceneError` for what moves a planar rod out of its plane, or pushes it out."""
    if scene.normal is None:
        return
    anywhere = symbols(scene, {scene.load, "s"})
    _check_positions(scene, scene.normal, anywhere)
    _check_rotations(scene, scene.normal, anywhere)
    _check_loads(scene, scene.normal, anywhere)
    _check_functions_of_states(scene, scene.normal)


def vanishes(expression: Any, small: float = 0.0) -> bool:
    """Whether an expression is zero whatever the symbols in it are; factors up to ``small`` are zero."""
    e = ufl.as_ufl(expression)
    if isinstance(e, (Zero, ScalarValue)):
        return abs(float(e)) <= small
    parts = e.ufl_operands
    if isinstance(e, Product):
        return any(vanishes(x, small) for x in parts)
    if isinstance(e, (Sum, Abs, Sqrt)):
        return all(vanishes(x, small) for x in parts)
    if isinstance(e, Division):
        return vanishes(parts[0], small)
    return isinstance(e, Conditional) and all(vanishes(x, small) for x in parts[1:])


def _check_positions(scene: Scene, normal: int, anywhere: Constants) -> None:
    for load in scene.loads():
        left, right = (end.held(scene.constants(load))[normal] for end in scene.sides)
        if left is not None and right is not None and abs(float(left) - float(right)) > NEGLIGIBLE * scene.length:
            raise SceneError(
                f"The ends are held at {float(left):g} and {float(right):g} along {scene.planar}, across which the rod "
                "is planar: hold both at the same, or leave planar out."
            )
    left, right = (end.held(anywhere)[normal] for end in scene.sides)
    if left is None or right is None or ufl.as_ufl(left) == ufl.as_ufl(right):
        return
    if not _is_number(left) or not _is_number(right):
        raise SceneError(
            f"The ends are held along {scene.planar}, across which the rod is planar, where {scene.load} moves them "
            "apart: hold both at the same, or leave planar out."
        )


def _check_rotations(scene: Scene, normal: int, anywhere: Constants) -> None:
    for side, end in zip(SIDES, scene.sides, strict=True):
        frame = end.frame(anywhere)
        across = [] if frame is None else [x for i, x in enumerate(frame[1:]) if i != normal]
        if not all(vanishes(x, NEGLIGIBLE * _size(frame)) for x in across):
            raise SceneError(
                f"The rotation of the {side} end leaves the plane across {scene.planar}: turn about that axis only."
            )


def _check_loads(scene: Scene, normal: int, anywhere: Constants) -> None:
    for what, function, role in functions_of(scene):
        if role.load is None or role.call != "f(c)":
            continue
        out = [i for i in range(3) if (i == normal) != role.load.moment]
        for c in trials(scene, function):
            values = [float(x) for x in function(c)]
            if any(values[i] for i in out):
                raise SceneError(
                    f"The {what} pushes the rod out of its plane across {scene.planar}, with {values}: "
                    "leave that component out, or planar out of the scene."
                )
        values = function(anywhere)
        if not all(vanishes(values[i]) for i in out):
            raise SceneError(
                f"The {what} may push the rod out of its plane across {scene.planar} where it was not tried: write 0.0 "
                "for that component, or leave planar out of the scene."
            )


def _check_functions_of_states(scene: Scene, normal: int) -> None:
    at = LocalState(scene)
    x, c, sides = _along_rod(scene, at), at.constants, _sides(scene, normal, at)
    point = place(x.q, x.R, x.s, x.r, length=x.length)
    energies = [("stored energy", scene.energy(x.v, x.k, c))]
    energies += [
        (what, f(x if role.along else point, c)) for what, f, role in functions_of(scene) if role.call == "f(x, c)"
    ]
    for what, energy in energies:
        value = Values(energy)
        one, other = (_defined(value(side)) for side in sides)
        if (abs(one - other) > NEGLIGIBLE * np.maximum(abs(one), abs(other))).any():
            raise SceneError(
                f"The {what} pushes the rod out of its plane across {scene.planar}: the two sides of the plane "
                "are not alike to it; leave that out, or planar out of the scene."
            )


def _along_rod(scene: Scene, at: LocalState) -> Place:
    """Place of the whole rod, of the symbols ``at`` it."""
    q, r, k = (ufl.as_vector(x) for x in (at.q, at.r, at.k))
    v, R = strain(scene.free_strains, at.v), rotation(q)
    return place(q, R, at.constants.s, r, dr=ufl.dot(R, v), v=v, k=k, length=scene.length)


def _sides(scene: Scene, normal: int, at: LocalState) -> tuple[Places, Places]:
    """Places that differ from one in the plane by the same motion out of it, to one side and to the other.

    All motions out of all of :data:`STATES` are at the scene's own constants, at all of its loads, and at arclengths.
    """
    length, free = scene.length, np.isin(np.arange(3), scene.free_strains)
    in_plane = np.arange(3) != normal
    units = np.concatenate([[1.0] * 4, [length] * 3, [1.0] * 3, [1 / length] * 3])
    across = np.concatenate([[False], in_plane, ~in_plane, ~in_plane & free, in_plane])
    flat = []
    for q, r, v, k in STATES:
        quaternion = np.array(q) * np.concatenate([[True], ~in_plane])
        strains, curvatures = np.array(v) * in_plane, np.array(k) * ~in_plane
        flat.append([*quaternion / np.linalg.norm(quaternion), *length * np.array(r) * in_plane, *strains,
                     *curvatures / length])  # fmt: skip
    aside = np.diag(ASIDE * units)[across]
    places = [scene.constants(), *map(scene.constants, scene.loads()), *(scene.constants(s=s) for s in scene.samples())]
    constants = {symbol: np.array([vars(c)[name] for c in places]) for name, symbol in vars(at.constants).items()}
    state = dict(zip([*at.q, *at.r, *at.v, *at.k], np.flatnonzero([True] * 7 + list(free) + [True] * 3), strict=True))

    def side(sign: float) -> Places:
        every = np.concatenate([numbers + sign * aside for numbers in np.array(flat)])
        moved = {symbol: np.repeat(every[:, i], len(places)) for symbol, i in state.items()}
        return moved | {symbol: np.tile(values, len(every)) for symbol, values in constants.items()}

    return side(1.0), side(-1.0)


def _defined(values: np.ndarray) -> np.ndarray:
    """Values, zero where one is undefined: at a state that the rod need not take."""
    return np.where(np.isfinite(values), values, 0.0)


def _size(quaternion: Any) -> float:
    """Largest of its components that are numbers, one where none is."""
    sizes = [abs(float(ufl.as_ufl(x))) for x in quaternion if _is_number(x)]
    return max(sizes) or 1.0 if len(sizes) == 4 else 1.0


def _is_number(x: Any) -> bool:
    return isinstance(ufl.as_ufl(x), (Zero, ScalarValue))
