"""What can be wrong with a scene, found before any computation: each check raises one sentence."""

from __future__ import annotations

import inspect
from collections.abc import Sequence
from numbers import Real
from typing import TYPE_CHECKING

import numpy as np
import ufl

from forms.kinematics import UNDEFORMED
from rodfem.ends import End, Ring, check_vector
from rodfem.errors import SceneError

if TYPE_CHECKING:
    from rodfem.scene import Scene


def check_kinds(scene: Scene) -> None:
    """Check that what a scene is made of is of the right kind."""
    if not isinstance(scene.ends, Ring) and not (
        isinstance(scene.ends, (tuple, list)) and len(scene.ends) == 2 and all(isinstance(e, End) for e in scene.ends)
    ):
        raise SceneError("The ends are not two of the kind End: give them as in (clamped(), free()), or a Ring().")
    for what, pair in (("interval", scene.interval), ("span", scene.span)):
        if not (isinstance(pair, Sequence) and len(pair) == 2 and all(isinstance(x, Real) for x in pair)):
            raise SceneError(f"The {what} is {pair!r}: give two numbers.")
    for name, parameter in scene.parameters.items():
        if not isinstance(getattr(parameter, "value", parameter), Real):
            raise SceneError(f"The parameter {name} is {parameter!r}: give a number or a Parameter.")
    if not (hasattr(scene.ordinate, "of") and hasattr(scene.ordinate, "s")):
        raise SceneError(f"The ordinate is {scene.ordinate!r}: give an Ordinate(name, s, of).")
    for what, function, count in (("stored energy", scene.energy, 3), ("start", scene.start, 1)):
        if function is None:
            continue
        if not callable(function):
            raise SceneError(f"The {what} is {function!r}: give a function.")
        try:
            inspect.signature(function).bind(*range(count))
        except TypeError:
            wanted = "W(v, k, c)" if count == 3 else "start(s)"
            raise SceneError(f"The {what} is no function of {count} argument(s): give {wanted}.") from None


def check_energy(scene: Scene) -> None:
    """Check that the stored energy is a scalar."""
    v, k = ufl.as_vector(UNDEFORMED), ufl.as_vector([0.0, 0.0, 0.0])
    shape = ufl.as_ufl(scene.energy(v, k, scene.constants())).ufl_shape
    if shape != ():
        raise SceneError(f"The stored energy has the shape {shape}: return a scalar, the energy per unit length.")


def check_scene(scene: Scene) -> None:
    """Check supports, places and the stored energy; raises :class:`~rodfem.errors.SceneError`."""
    if scene.planar not in (None, "e1", "e2"):
        raise SceneError(f"A rod cannot be planar across {scene.planar!r}: choose 'e1' or 'e2', or None for space.")
    check_energy(scene)
    check_supports(scene)
    check_places(scene)
    check_convexity(scene)


def check_convexity(scene: Scene) -> None:
    """Raise where the stored energy is not strictly convex at the undeformed state."""
    for s in scene.samples() if scene.depends_on_s() else [None]:
        stiffness = scene.stiffness(s)
        lowest = np.linalg.eigvalsh(stiffness)[0] if stiffness.size else 1.0
        if lowest <= 1e-12 * abs(stiffness).max(initial=0.0):
            where = "" if s is None else f" at s = {s:g}"
            raise SceneError(
                f"The stored energy is not convex{where}: its second derivative at the undeformed state has the "
                f"eigenvalue {lowest:.3g}; choose constants for which all are positive."
            )


def check_supports(scene: Scene) -> None:
    """Check shapes, whether anything holds the rod, and whether the ends can be where they are asked to be."""
    for side, end in zip(("left", "right"), scene.sides, strict=True):
        for load in scene.span:
            c = scene.constants(load)
            for what, function in (("position of", end.position), ("force on", end.force)):
                if function is not None:
                    check_vector(f"{what} the {side} end", function(c), 3)
            rotation = end.rotation(c) if callable(end.rotation) else end.rotation
            if rotation is not None:
                check_vector(f"rotation of the {side} end", rotation, 4)
                if scene.normal is not None and any(rotation[i + 1] != 0 for i in range(3) if i != scene.normal):
                    raise SceneError(
                        f"The rotation of the {side} end leaves the plane across {scene.planar}: "
                        "turn about that axis only."
                    )
                if not sum(float(x) ** 2 for x in rotation) > 0:
                    raise SceneError(f"The rotation of the {side} end is the zero quaternion: give one of size one.")
        if end.hinge is not None and end.rotation is None:
            raise SceneError(f"The {side} end has a hinge but no rotation: say which directors the hinge holds.")
        if end.hinge is not None and not np.linalg.norm(end.hinge) > 0:
            raise SceneError(f"The hinge of the {side} end has no axis: give three components, not all zero.")
        if end.follower is not None and all(x is not None for x in end.held(scene.constants())):
            raise SceneError(
                f"A follower force acts on the {side} end, whose position is held: leave it free in one direction."
            )
        if end.fixed_rotation is not None and (end.moment or end.follower_moment):
            raise SceneError(
                f"A moment acts on the {side} end, whose directors are held: leave its rotation free, or use a hinge."
            )
    check_drift(scene)
    check_reach(scene)


def check_drift(scene: Scene) -> None:
    """Raise unless something holds the rod, or what acts on it is in balance whatever its shape."""
    c = scene.constants()
    if isinstance(scene.ends, Ring) or scene.potential is not None or scene.constraints:
        return
    if any(end.energy is not None for end in scene.sides) or any(a.energy is not None for a in scene.attachments):
        return
    held = [[x is not None for x in end.held(c)] for end in scene.sides]
    for i, (left, right) in enumerate(zip(*held, strict=True)):
        if not (left or right):
            raise SceneError(
                f"The rod can drift away along e{i + 1}: hold that component of the position at one end at least, "
                "or attach a spring."
            )


def check_reach(scene: Scene) -> None:
    """Raise where a rod that cannot stretch is held at ends that are farther apart than it is long."""
    if 2 in scene.free_strains or 0 in scene.free_strains:
        return
    for load in scene.span:
        left, right = (end.held(scene.constants(load)) for end in scene.sides)
        if None not in left and None not in right:
            distance = sum((float(b) - float(a)) ** 2 for a, b in zip(left, right, strict=True)) ** 0.5
            if distance > scene.length * (1 + 1e-12):
                raise SceneError(
                    f"At {scene.load} = {load:g} the ends are {distance:.6g} apart, but the rod is inextensible "
                    f"and only {scene.length:.6g} long: let it stretch, or move the ends together."
                )


def check_places(scene: Scene) -> None:
    """Raise for attachments, constraints and breaks that are not on the rod."""
    a, b = scene.interval
    places = [("attachment", x.s) for x in scene.attachments] + [("break", s) for s in scene.breaks]
    places += [("constraint", x.s) for x in scene.constraints if x.s is not None]
    for what, s in places:
        if not a <= s <= b:
            raise SceneError(f"The {what} at s = {s:g} is not on the rod: choose {a:g} <= s <= {b:g}.")
    c = scene.constants()
    for what, values in (
        ("distributed force", scene.distributed and scene.distributed(c)),
        ("distributed follower force", scene.follower and scene.follower(c)),
        *(("force of an attachment", x.force(c)) for x in scene.attachments if x.force),
        *(("moment on an end", end.moment(c)) for end in scene.sides if end.moment),
        *(("follower force on an end", end.follower(c)) for end in scene.sides if end.follower),
    ):
        if values is not None:
            check_vector(what, values, 3)
