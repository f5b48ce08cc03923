r"""Where a computation begins without a scene's own start: the natural shape of the rod, or a straight one.

The natural strains minimise the stored energy: ``W(v0, k0) <= W(v, k)`` at each arclength, by Newton's method with the
second derivative at the undeformed state: exactly, if the energy is quadratic.  They are those of a shape,
``q' = q k0/2``, ``r' = R v0``, which a rigid motion brings to the ends of the rod.  If it fits there, it is the start:
the rod at rest.

A straight rod is turned as its ends are: from the rotation of the left one to that of the right one, uniformly.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from rodfem.errors import SceneError
from rodfem.forms.kinematics import UNDEFORMED
from rodfem.forms.rotation import IDENTITY
from rodfem.problem.arguments import plain
from rodfem.problem.functions import derived
from rodfem.problem.quaternions import CONJUGATE, directors, of_vector, product
from rodfem.problem.scene import Scene
from rodfem.tolerances import NEGLIGIBLE

FIT, STEPS = 0.05, 2000
"""Misfit of a shape that Newton's method mends; steps of the integration along the rod."""
SETTLED, STEP = 1e-8, 1e-5
"""Change of the natural strains, in natural units, at which Newton's method ends; step of its difference quotients."""


def natural_shape(scene: Scene, load: float) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
    """Arclengths (m,), quaternions (m, 4) and strains (m, 3) of the unstressed rod between the ends of a scene.

    None if it is straight, or does not fit there at this ``load``.
    """
    found = derived(scene, ("ends", load), lambda: _between_ends(scene, load))
    return found[0] if found is not None and found[1] < FIT else None


def misfit(scene: Scene, load: float) -> str:
    """Sentence on a start that is not the rod at rest, as the ends of a scene do not admit that at a ``load``."""
    found = None if scene.start is not None else derived(scene, ("ends", load), lambda: _between_ends(scene, load))
    if found is None or found[1] < FIT:
        return ""
    return (
        f"At {scene.load} = {load:g} the rod at rest, in its natural shape, does not fit its ends: it starts straight "
        "and under stress; for another state give Scene(start=...)."
    )


def _between_ends(scene: Scene, load: float) -> tuple[tuple[np.ndarray, np.ndarray, np.ndarray], float] | None:
    """The natural shape, and by how much it does not fit; None if it is straight."""
    if scene.closed or (strains := _natural_strains(scene, load)) is None:
        return None
    s = np.linspace(*scene.interval, STEPS + 1)
    middle = strains((s[1:] + s[:-1]) / 2)
    q, apart = np.vstack([IDENTITY, of_vector(middle[:, 3:] * np.diff(s)[:, None])]), 1
    while apart < len(q):  # products of all turns up to each, by those of twice as many
        q[apart:], apart = product(q[:-apart], q[apart:]), 2 * apart
    halfway = directors(product(q[:-1], of_vector(middle[:, 3:] * np.diff(s)[:, None] / 2)))
    slopes = np.einsum("sij,sj->si", halfway, middle[:, :3])
    r = np.vstack([np.zeros(3), np.cumsum(slopes * np.diff(s)[:, None], axis=0)])
    turned, off = _placed(scene, load, q, r)
    return (s, turned, strains(s)[:, :3]), off


def _natural_strains(scene: Scene, load: float) -> Callable[[np.ndarray], np.ndarray] | None:
    """Natural strains (m, 6) as a function of arclengths (m,); None if they are the undeformed ones."""
    places = np.linspace(*scene.interval, 33) if scene.energy_depends_on("s") else np.array([scene.interval[0]])
    found = [x for x in (_least(scene, load, float(s)) for s in places) if x is not None]
    if len(found) < len(places) or not np.array(found).any():
        return None
    values = np.array([*UNDEFORMED, 0.0, 0.0, 0.0]) + found
    if len(places) == 1:
        return lambda s: np.tile(values, (len(s), 1))
    from scipy.interpolate import PchipInterpolator  # slow to load

    return PchipInterpolator(places, values, axis=0)


def _least(scene: Scene, load: float, s: float) -> np.ndarray | None:
    """Change (6,) of the undeformed strains that minimises the energy at ``s``; None if Newton's method finds none."""
    c, unit, free = scene.constants(load, s), np.where(np.arange(6) < 3, 1.0, 1.0 / scene.length), _free(scene)
    chosen = [[*scene.free_strains, 3, 4, 5].index(i) for i in free]
    stiffness = scene.stiffness(s if scene.energy_depends_on("s") else None)[np.ix_(chosen, chosen)]
    x = np.zeros(6)
    for _ in range(20):
        try:
            step = np.linalg.solve(stiffness, [_slope(scene, x, i, unit[i], c) for i in free])
        except SceneError:  # the energy is not defined there
            return None
        x[free] -= step
        if (abs(step) <= SETTLED * unit[free]).all():
            return np.where(abs(x) <= SETTLED * unit, 0.0, x)
    return None


def _free(scene: Scene) -> list[int]:
    """Numbers of the strains that the energy depends on: of a planar rod those in its plane."""
    every, normal = [*scene.free_strains, 3, 4, 5], scene.normal
    return [i for i in every if normal is None or (i - 3 == normal if i > 2 else i != normal)]


def _slope(scene: Scene, x: np.ndarray, i: int, h: float, c: Any) -> float:
    """Derivative of the energy in strain ``i`` by a central difference, which is exact for a quadratic energy."""
    ahead, back = x.copy(), x.copy()
    ahead[i], back[i] = x[i] + STEP * h, x[i] - STEP * h
    return (scene.energy_at(ahead[:3], ahead[3:], c) - scene.energy_at(back[:3], back[3:], c)) / (2 * STEP * h)


def _placed(scene: Scene, load: float, q: np.ndarray, r: np.ndarray) -> tuple[np.ndarray, float]:
    """Quaternions of a shape turned to where the ends are, and by how much it is off, in lengths or radian."""
    (first, last), c = [rotation_of(scene, load, side) for side in range(2)], scene.constants(load)
    places = [[np.nan if x is None else plain(x) for x in side.support(c)] for side in scene.sides]
    chord = np.subtract(places[1], places[0])
    if first is not None:
        turn = first
    else:
        turn = _aligned(r[-1], chord) if last is None else product(last, q[-1] * CONJUGATE)
    turned = product(turn, q)
    off = np.nanmax(abs(directors(turn) @ r[-1] - chord), initial=0.0) / scene.length
    if first is not None and last is not None:
        off = max(off, 2 * np.sqrt(max(1.0 - float(turned[-1] @ last) ** 2, 0.0)))
    return turned, float(off)


def _aligned(chord: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Shortest rotation of a ``chord`` into the direction that is ``wanted``, which is not a number where it is free.

    There it is as long as the chord makes it; no rotation, if that is not known.
    """
    free, squared = np.isnan(wanted), float(chord @ chord)
    part = np.where(free, chord if np.any(chord[free]) else 1.0, 0.0)
    if free.any():
        part *= np.sqrt(max(squared - np.nansum(wanted**2), 0.0) / (part @ part))
    wanted = np.where(free, part, wanted)
    sizes = np.sqrt(squared * (wanted @ wanted))
    cosine = float(chord @ wanted / sizes) if sizes > 0 else -1.0
    if cosine <= -1 + NEGLIGIBLE:
        return np.array(IDENTITY)
    out = np.array([1 + cosine, *np.cross(chord, wanted) / sizes])
    return np.asarray(out / np.linalg.norm(out))


def rotation_of(scene: Scene, load: float, side: int) -> np.ndarray | None:
    """Unit quaternion at which an end is held in all directions; None if it is not."""
    end = scene.sides[side]
    frame = None if scene.closed or end.hinge is not None else end.frame(scene.constants(load))
    if frame is None:
        return None
    q = np.array([plain(x) for x in frame])
    return np.asarray(q / np.linalg.norm(q))


def uniform_turn(scene: Scene, load: float) -> Callable[[np.ndarray], np.ndarray] | None:
    """Rotations of a straight rod, from that of the left end to that of the right one; None if neither is turned."""
    frames = [q for q in (rotation_of(scene, load, side) for side in range(2)) if q is not None]
    if all(abs(q[0]) == 1.0 for q in frames):
        return None
    first, last = frames[0], frames[-1]
    apart = product(first * CONJUGATE, last)
    apart = -apart if apart[0] < 0 else apart
    size = np.linalg.norm(apart[1:])
    vector = apart[1:] * (2 * np.arctan2(size, apart[0]) / size if size > 0 else 0.0)
    a, b = scene.interval
    return lambda s: product(first, of_vector((s - a)[:, None] / (b - a) * vector))


def sampled(s: np.ndarray, values: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Values (m, k) at arclengths ``s`` (m,), interpolated at ``places`` (p,): (p, k)."""
    return np.array([np.interp(places, s, column) for column in values.T]).reshape(-1, len(places)).T
