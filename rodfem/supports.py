r"""What holds a rod and what loads it: derived from a scene, and written to a file.

An end is described by its properties, and named after them by one rule (:func:`~rodfem.setting.kind_of`): how many
components of its position are held, what its directors are free to do, and whether springs hold it.  A potential of an
end is a *spring* where its second derivative at the reference is positive semidefinite and not zero; any other (of a
semi-tangential moment, say) is a load that no arrow shows.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import ufl
from numpy.typing import NDArray

from forms.kinematics import UNDEFORMED
from forms.rotation import IDENTITY, rotation
from rodfem.ends import Constants, End, OfPlace, Ring
from rodfem.functions import asks_where
from rodfem.places import place
from rodfem.scene import Scene
from rodfem.setting import AXIS, DISTRIBUTED, HELD, SECTION, SUPPORTS, TURNS, Support, kind_of

Floats = NDArray[np.float64]

STATIONS = 9
"""Places along the rod at which distributed forces are recorded."""
STEP, SMALL = 1e-3, 1e-6
"""Of differences of potentials (relative to the rod's length; in radian), and what is zero beside the greatest."""
BENT = 1e-2
"""Angle by which the rod is bent in differences of its energy."""


def supports_of(scene: Scene, sample: dict[str, Any]) -> dict[str, Support]:
    """Supports of a rod by the names of their places, in a state given by :meth:`~rodfem.shape.Shape.sample`.

    A ring has none at its ends.
    """
    load, out = float(sample["load"]), {}
    for name, (s, end, mass) in _places(scene).items():
        c, start = scene.constants(load, s), _start(scene, s)
        held = np.array([p is not None for p in end.held(c)])
        turning = TURNS if end.rotation is None else HELD if end.hinge is None else AXIS
        springs = np.zeros((2, 3, 3))
        if end.energy is not None:
            r = np.asarray(sample["r"][int(np.argmin(abs(sample["s"] - s)))])
            springs = stiffness_of(end.energy, c, s, scene.length, r, start)
        out[name] = Support(
            s=s,
            kind=kind_of(int(held.sum()), turning, bool(springs.any())),
            held=held,
            turning=turning,
            axis=np.zeros(3) if end.hinge is None else np.asarray(end.hinge, dtype=float),
            translation_stiffness=springs[0],
            rotation_stiffness=springs[1],
            mass=0.0 if mass is None else _number(mass(c)),
            **_changing(scene, s, end, load),
        )
    return out


def _places(scene: Scene) -> dict[str, tuple[float, End, Callable[[Constants], Any] | None]]:
    """Where something may hold or load the rod: arclength, the end or what is like one, and the mass attached."""
    out: dict[str, tuple[float, End, Callable[[Constants], Any] | None]] = {}
    if not isinstance(scene.ends, Ring):
        for name, s, end in zip(("left end", "right end"), scene.interval, scene.sides, strict=True):
            out[name] = s, end, None
    for i, x in enumerate(scene.attachments):
        out[f"attachment {i + 1}"] = x.s, End(force=x.force, follower=x.follower, energy=x.energy), x.mass
    return out


def _start(scene: Scene, s: float) -> Floats:
    q = np.array(IDENTITY) if scene.start is None else np.asarray(scene.start(np.array([s])), dtype=float)[0]
    return np.asarray(q / np.linalg.norm(q))


def _changing(scene: Scene, s: float, end: End, load: float) -> dict[str, Floats]:
    """Attributes of a support that depend on the load: its frame, forces and moments by their names."""
    c = scene.constants(load, s)
    frame = _start(scene, s)
    if end.rotation is not None:
        frame = _vector(end.rotation, c) if callable(end.rotation) else np.asarray(end.rotation, dtype=float)
    return {
        "frame": frame / np.linalg.norm(frame),
        "force": np.where([p is not None for p in end.held(c)], 0.0, _vector(end.force, c)),
        "moment": _vector(end.moment, c),
        "follower": _vector(end.follower, c),
        "follower_moment": _vector(end.follower_moment, c),
    }


def stiffness_of(energy: OfPlace, c: Constants, s: float, length: float, r: Floats, q: Floats) -> Floats:
    """Stiffness of springs with the potential ``energy(x, c)`` at ``s``, in translation and rotation, (2, 3, 3).

    By differences about the position ``r`` (3,) and the unit quaternion ``q`` (4,); zero where the second derivative is
    not positive semidefinite, so that the potential is no spring's.
    """
    values: list[float] = []

    def value(which: int, change: Floats) -> float:
        """Potential where the position (0) or the rotation (1) is changed by a vector (3,)."""
        moved, turned = (r + change, q) if which == 0 else (r, turn(q, change))
        rotated = ufl.as_vector(turned.tolist())
        x = place(rotated, rotation(rotated), s, ufl.as_vector(moved.tolist()), length=length)
        values.append(_number(energy(x, c)))
        return values[-1]

    out, here = np.zeros((2, 3, 3)), value(0, np.zeros(3))
    for which, h in enumerate((STEP * length, STEP)):
        if which == 0 and not asks_where(energy, c):
            continue
        basis = h * np.eye(3)
        ahead, behind = ([value(which, sign * e) for e in basis] for sign in (1, -1))
        for i in range(3):
            out[which, i, i] = (ahead[i] - 2 * here + behind[i]) / h**2
            for j in range(i):
                mixed = value(which, basis[i] + basis[j]) - ahead[i] - ahead[j] + here
                out[which, i, j] = out[which, j, i] = mixed / h**2
    greatest = float(abs(out).max())
    positive = np.linalg.eigvalsh(out).min() > -1e2 * STEP * greatest
    return out * (positive and greatest > SMALL * max(map(abs, values)))


def turn(q: Floats, change: Floats) -> Floats:
    """Unit quaternion (4,) turned by a rotation vector (3,) in the frame of space."""
    angle = float(np.linalg.norm(change))
    a, v = np.cos(angle / 2), change * np.sinc(angle / (2 * np.pi)) / 2
    return np.append(a * q[0] - v @ q[1:], a * q[1:] + q[0] * v + np.cross(v, q[1:]))


def section_of(scene: Scene) -> tuple[Floats, Floats]:
    """Bending stiffness (n, 2, 2) in ``k1, k2`` of the undeformed rod at n arclengths (n,), one where it is uniform."""
    places = scene.samples() if scene.depends_on_s() else [scene.interval[0]]
    return np.array(places), np.array([_bending(scene, s) for s in places])


def _bending(scene: Scene, s: float) -> Floats:
    """Second derivative (2, 2) of the stored energy in ``k1, k2`` at zero, by differences: pictures need no more."""
    c, h = scene.constants(s=s), BENT / scene.length

    def W(k1: float, k2: float) -> float:
        return _number(scene.energy(ufl.as_vector(UNDEFORMED), ufl.as_vector([h * k1, h * k2, 0.0]), c))

    here, ahead, aside = W(0, 0), W(1, 0), W(0, 1)
    mixed = W(1, 1) - ahead - aside + here
    return np.array([[ahead - 2 * here + W(-1, 0), mixed], [mixed, aside - 2 * here + W(0, -1)]]) / h**2


def distributed_on(scene: Scene, load: float) -> tuple[Floats, Floats, Floats]:
    """Arclengths (n,), dead force per length in the frame of space and follower force along the directors, (n, 3)."""
    a, b = scene.interval
    s = a + (b - a) * (np.arange(STATIONS) + 0.5) / STATIONS
    values = [[_vector(f, scene.constants(load, x)) for x in s.tolist()] for f in (scene.distributed, scene.follower)]
    return s, np.array(values[0]), np.array(values[1])


def write(group: Any, scene: Scene, samples: Sequence[dict[str, Any]]) -> None:
    """Write what holds and loads P states into groups below an HDF5 group.

    ``supports`` has a group for each place, ``left end``, ``right end``, ``attachment 1`` ...: attributes ``s``,
    ``kind``, ``held``, ``turning``, ``axis``, ``translation_stiffness``, ``rotation_stiffness``, ``mass`` and, with P
    rows, ``frame``, ``force``, ``moment``, ``follower``, ``follower_moment``, as in
    :class:`~rodfem.setting.Support`; of a ring it is empty.  ``distributed``, where there is such a load, has ``s``
    (n,), ``force`` and ``follower`` (P, n, 3).
    """
    rows = [float(sample["load"]) for sample in samples]
    out, places = group.create_group(SUPPORTS), _places(scene)
    for name, support in supports_of(scene, samples[0]).items():
        here = out.create_group(name)
        changing = [_changing(scene, *places[name][:2], load) for load in rows]
        for key, value in vars(support).items():
            if key in changing[0]:
                here[key] = np.array([row[key] for row in changing])
            else:
                here.attrs[key] = value
    if scene.distributed is not None or scene.follower is not None:
        along = group.create_group(DISTRIBUTED)
        found = [distributed_on(scene, load) for load in rows]
        along["s"] = found[0][0]
        along["force"], along["follower"] = (np.array([f[i] for f in found]) for i in (1, 2))


def write_section(file: Any, scene: Scene) -> None:
    """Write the bending stiffness of a rod into a group ``section`` of an HDF5 file: ``s`` (n,), ``stiffness``."""
    file[f"{SECTION}/s"], file[f"{SECTION}/stiffness"] = section_of(scene)


def _number(value: Any) -> float:
    return float(value if isinstance(value, (int, float)) else ufl.as_ufl(value)(()))  # most are plain numbers


def _vector(function: Callable[[Constants], Any] | None, c: Constants) -> Floats:
    return np.zeros(3) if function is None else np.array([_number(x) for x in function(c)])
