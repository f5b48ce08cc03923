r"""Supports and loads of a rod: derived from a scene, and written to a file.

A potential of an end is a *spring* in translation (in rotation) where its second derivative at the reference is
positive semidefinite and not zero.  Minus its derivative at the state is a load where it is none.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import ufl
from numpy.typing import NDArray

from rodfem.errors import SceneError
from rodfem.expressions import differentiated, evaluated
from rodfem.forms.rotation import IDENTITY, product, rotation
from rodfem.problem.arguments import number_of
from rodfem.problem.ends import End
from rodfem.problem.functions import SIDES, Constants, OfPlace, Place, place
from rodfem.problem.scene import Scene
from rodfem.problem.setting import CONSTRAINTS, DISTRIBUTED, FOUNDATION, HELD, SECTION, SUPPORTS, Support, kind_of

Floats = NDArray[np.float64]
Sample = dict[str, Any]
CHANGING = ("frame", "force", "moment", "follower", "follower_moment")  # what changes with the state of a support


def supports_of(scene: Scene, sample: Sample, first: dict[str, Support] | None = None) -> dict[str, Support]:
    """Supports of a rod by the names of their places, in a state given by :meth:`~rodfem.fem.shape.Shape.sample`.

    Those of the ``first`` state say what is a spring.
    """
    sides = zip(SIDES, scene.interval, scene.sides, strict=True)
    places: dict[str, tuple[float, End, Any]] = {f"{side} end": (s, e, None) for side, s, e in sides if not e.closed}
    for i, x in enumerate(scene.attachments, start=1):
        places[f"attachment {i}"] = x.s, End(force=x.force, follower=x.follower, energy=x.energy), x.mass
    return {name: _support(scene, sample, place, (first or {}).get(name)) for name, place in places.items()}


def _support(scene: Scene, sample: Sample, where: tuple[float, End, Any], first: Support | None) -> Support:
    s, end, mass = where
    start = np.array(IDENTITY) if scene.start is None else np.asarray(scene.start(np.array([s])), dtype=float)[0]
    frame, loads, c = start / np.linalg.norm(start), np.zeros((2, 3)), scene.constants(float(sample["load"]), s)
    springs = np.array([first.translation_stiffness, first.rotation_stiffness]) if first else np.zeros((2, 3, 3))
    if end.energy is not None:
        r, q = _state(sample, s)
        springs = springs if first else _springs(derivative_of(end.energy, c, _point(scene, s, r, frame), 2))
        loads = -derivative_of(end.energy, c, _point(scene, s, r, q)) * ~springs.any(axis=(1, 2))[:, None]
        loads[1] *= end.turning != HELD
    if end.rotation is not None:
        frame = np.array([number_of(x) for x in end.frame(c)])
    held = np.array([p is not None for p in end.support(c)])
    return Support(
        s=s,
        kind=kind_of(len(end.fixed(c)), end.turning, bool(springs.any())),
        held=held,
        guide=np.array(end.guide),
        turning=end.turning,
        axis=np.zeros(3) if end.hinge is None else np.asarray(end.hinge, dtype=float),
        translation_stiffness=springs[0],
        rotation_stiffness=springs[1],
        mass=number_of(mass(c)) if mass else 0.0,
        frame=frame / np.linalg.norm(frame),
        force=np.where(held, 0.0, _vector(end.force, c) + loads[0]),
        moment=_vector(end.moment, c) + loads[1],
        follower=_vector(end.follower, c),
        follower_moment=_vector(end.follower_moment, c),
    )


def _state(sample: Sample, s: float) -> tuple[Floats, Floats]:
    """Position (3,) and unit quaternion (4,) of the node at an arclength."""
    node = int(np.argmin(abs(np.asarray(sample["s"]) - s)))
    r, q = (np.asarray(sample[name][node], dtype=float) for name in ("r", "q"))
    return r, q / np.linalg.norm(q)


def _point(scene: Scene, s: float, r: Floats, q: Floats) -> Place:
    """Place of a position (3,) and a quaternion (4,), numbers."""
    turned = ufl.as_vector(q.tolist())
    return place(turned, rotation(turned), s, ufl.as_vector(r.tolist()), length=scene.length)


def derivative_of(function: OfPlace, c: Constants, x: Place, order: int = 1) -> Floats:
    """Derivatives of ``function(x, c)`` in position, and in rotation vector, both in space: (2, 3), or (2, 3, 3)."""
    change = ufl.variable(ufl.as_vector([0.0] * 6))  # of position and rotation vector, along e1 to e3
    spin = ufl.as_vector([change[3], change[4], change[5]])
    q = product(ufl.as_vector([1.0 - ufl.dot(spin, spin) / 8, spin[0] / 2, spin[1] / 2, spin[2] / 2]), x.q)
    r = ufl.as_vector([x.r[0] + change[0], x.r[1] + change[1], x.r[2] + change[2]])
    value = ufl.diff(ufl.as_ufl(function(place(q, rotation(q), x.s, r, length=x.length), c)), change)
    entries: list[tuple[int, ...]] = [(i,) for i in range(6)]
    if order == 2:
        value = ufl.diff(value, change)
        entries = [(first + i, first + j) for first in (0, 3) for i in range(3) for j in range(3)]
    value = differentiated(value)
    return np.array([float(evaluated(value, entry)) for entry in entries]).reshape(2, *(3,) * order)


def _springs(second: Floats) -> Floats:
    """Second derivatives (n, 3, 3) that are those of springs, zero for what is not positive semidefinite."""
    least, greatest = np.linalg.eigvalsh(second)[:, 0], abs(second).max(axis=(1, 2))
    return second * (least > -0.1 * greatest)[:, None, None]


def distributed_on(scene: Scene, load: float) -> tuple[Floats, Floats, Floats]:
    """Arclengths (n,), dead force per length in the frame of space and follower force along the directors, (n, 3)."""
    s = _stations(scene)
    values = [[_vector(f, scene.constants(load, x)) for x in s.tolist()] for f in (scene.distributed, scene.follower)]
    return s, np.array(values[0]), np.array(values[1])


def foundation_of(scene: Scene, sample: Sample) -> tuple[Floats, Floats] | None:
    """Stiffness per length (n, 3, 3) of an elastic foundation at arclengths (n,); None for other potentials."""
    if scene.potential is None:
        return None
    s, load = _stations(scene), float(sample["load"])
    places = [_point(scene, at, *_state(sample, at)) for at in s.tolist()]
    try:
        second = [derivative_of(scene.potential, scene.constants(load, x.s), x, 2)[0] for x in places]
    except SceneError:  # it asks for strains, which a point does not have
        return None
    found = _springs(np.array(second))
    return (s, found) if found.any() else None


def _stations(scene: Scene) -> Floats:
    a, b = scene.interval
    return np.asarray(a + (b - a) * (np.arange(9) + 0.5) / 9)


def write(group: Any, scene: Scene, samples: Sequence[Sample]) -> None:
    """Write what holds and loads P states into groups below an HDF5 group, as ``docs/files.md`` describes them."""
    _write_supports(group.create_group(SUPPORTS), scene, samples)
    if scene.distributed is not None or scene.follower is not None:
        along = group.create_group(DISTRIBUTED)
        s, dead, follower = zip(*(distributed_on(scene, float(sample["load"])) for sample in samples), strict=True)
        along["s"], along["force"], along["follower"] = s[0], np.array(dead), np.array(follower)
    if scene.potential is not None:
        along, foundation = group.create_group(FOUNDATION), foundation_of(scene, samples[0])
        along.attrs["note"] = "" if foundation else "load by a potential along the rod"
        if foundation:
            along["s"], along["stiffness"] = foundation
    for number, x in enumerate(scene.constraints, start=1):
        place = group.create_group(f"{CONSTRAINTS}/constraint {number}")
        place.attrs.update(s=np.nan if x.s is None else x.s, note=x.words)


def _write_supports(group: Any, scene: Scene, samples: Sequence[Sample]) -> None:
    first = supports_of(scene, samples[0])
    states = [first, *(supports_of(scene, sample, first) for sample in samples[1:])]
    for name, support in first.items():
        here = group.create_group(name)
        for key, value in vars(support).items():
            if key in CHANGING:
                here[key] = np.array([getattr(supports[name], key) for supports in states])
            else:
                here.attrs[key] = value


def write_section(file: Any, scene: Scene) -> None:
    """Write the bending stiffness (n, 2, 2) in ``k1, k2`` at arclengths ``s`` (n,), one where the rod is uniform."""
    varies = scene.energy_depends_on("s")
    places = scene.samples() if varies else [scene.interval[0]]
    stiffness = np.array([scene.stiffness(s if varies else None)[-3:-1, -3:-1] for s in places])
    file[f"{SECTION}/s"], file[f"{SECTION}/stiffness"] = np.array(places), stiffness


def _vector(function: Callable[[Constants], Any] | None, c: Constants) -> Floats:
    return np.zeros(3) if function is None else np.array([number_of(x) for x in function(c)])
