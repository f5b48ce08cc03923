"""The plane of a planar rod: whether all that holds and loads it leaves it there.

Functions of the constants are zero across the plane at the loads and the arclengths at which they are tried.  Functions
of the state, and the stored energy, have one value at two states that are each other's image by the plane.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from rodfem.errors import SceneError
from rodfem.forms.kinematics import UNDEFORMED
from rodfem.problem.arguments import number_of
from rodfem.problem.end import SIDES
from rodfem.problem.local_state import STATES, Constants, OfConstants, Place, places_at, watched
from rodfem.problem.roles import Role, functions_of
from rodfem.tolerances import NEGLIGIBLE

if TYPE_CHECKING:
    from rodfem.problem.scene import Scene

ASIDE = 1e-3
"""Displacement over length, strain or rotation out of the plane, to either side, at which energies are tried."""


def check_plane(scene: Scene) -> None:
    """Raise :class:`SceneError` for what moves a planar rod out of its plane, or pushes it out."""
    if scene.normal is not None:
        for load in scene.loads():
            _check_ends(scene, scene.normal, scene.constants(load))
        _check_loads(scene, scene.normal)
        _check_functions_of_states(scene, scene.normal)


def _check_ends(scene: Scene, normal: int, c: Constants) -> None:
    left, right = (end.held(c)[normal] for end in scene.sides)
    if left is not None and right is not None and abs(float(left) - float(right)) > NEGLIGIBLE * scene.length:
        raise SceneError(
            f"The ends are held at {float(left):g} and {float(right):g} along {scene.planar}, across which the rod is "
            "planar: hold both at the same, or leave planar out."
        )
    for side, end in zip(SIDES, scene.sides, strict=True):
        frame = np.array([float(x) for x in end.frame(c) or ()])
        if frame.size and abs(np.delete(frame[1:], normal)).max() > NEGLIGIBLE * np.linalg.norm(frame):
            raise SceneError(
                f"The rotation of the {side} end leaves the plane across {scene.planar}: turn about that axis only."
            )


def _check_loads(scene: Scene, normal: int) -> None:
    for what, function, role in functions_of(scene):
        if role.load is None or role.call != "f(c)":
            continue
        out = [i for i in range(3) if (i == normal) != role.load.moment]
        for c in _trials(scene, function):
            values = [float(x) for x in function(c)]
            if any(values[i] for i in out):
                raise SceneError(
                    f"The {what} pushes the rod out of its plane across {scene.planar}, with {values}: "
                    "leave that component out, or planar out of the scene."
                )


def _trials(scene: Scene, function: OfConstants) -> Iterator[Constants]:
    """Constants at which a function of them is tried: at the loads, and at the arclengths, if it asks for them."""
    c, asked = watched(scene.constants())
    function(c)
    places = scene.samples() if "s" in asked else [None]
    for load in scene.loads() if scene.load in asked else [None]:
        yield from (scene.constants(load, s) for s in places)


def _check_functions_of_states(scene: Scene, normal: int) -> None:
    own = scene.constants()
    others = [*map(scene.constants, scene.loads()), *(scene.constants(s=s) for s in scene.samples())]
    functions = [(what, f, role) for what, f, role in functions_of(scene) if role.call in ("f(x, c)", "W(v, k, c)")]
    for state in range(len(STATES)):
        for c in [own, *others] if state == 0 else [own]:
            sides = [_side(scene, normal, state, c.s, sign) for sign in (1.0, -1.0)]
            for what, function, role in functions:
                one, other = (_defined(function, role, places, c) for places in sides)
                if abs(one - other) > NEGLIGIBLE * max(abs(one), abs(other)):
                    raise SceneError(
                        f"The {what} pushes the rod out of its plane across {scene.planar}: the two sides of the plane "
                        "are not alike to it; leave that out, or planar out of the scene."
                    )


def _side(scene: Scene, normal: int, state: int, s: float, sign: float) -> tuple[Place, Place]:
    """A point and a place along the rod, in one of :data:`STATES` moved into the plane and then aside."""
    q, r, v, k = (np.array(x) for x in STATES[state])
    out = np.arange(3) == normal
    free = np.isin(np.arange(3), scene.free_strains)
    aside = (
        sign * ASIDE * np.random.default_rng(0).uniform(0.5, 1.0, (4, 3))
    )  # generic: no motion is another's opposite
    turned = np.append(q[0], np.where(out, q[1:], 0.0))
    turned /= np.linalg.norm(turned)
    turned[1:] += np.where(out, 0.0, aside[0])
    strains = np.where(out, free * aside[2], np.where(free, v, UNDEFORMED))
    return places_at(scene.length, s, (turned, np.where(out, aside[1], r), strains, np.where(out, k, aside[3])))


def _defined(function: Callable[..., Any], role: Role, places: tuple[Place, Place], c: Constants) -> float:
    """Value of a function, zero if it is undefined: at a state that the rod need not take."""
    x = places[role.along or role.call == "W(v, k, c)"]
    try:
        value = number_of(function(x.v, x.k, c) if role.call == "W(v, k, c)" else function(x, c))
    except SceneError:
        return 0.0
    return value if np.isfinite(value) else 0.0
