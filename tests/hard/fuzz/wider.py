"""A wider family: each scene is one of :mod:`.scenes` with other functions of its load.

All functions of the base scene are given other constants than its own: a stiffness that depends on the load, a load
that vanishes at both ends of the range, a load in another unit.  Besides, ends and natural shapes move with the load,
masses are attached, elements differ in size by many orders, ranges begin inside or run backwards, and events are
located.  The base scene is that of the same seed and number, but for its units.
"""

from collections.abc import Callable
from dataclasses import replace
from math import pi
from typing import Any

import numpy as np
import ufl

from rodfem import Attachment, End, Inertia, Parameter, Scene
from rodfem.problem.functions import Role, changes

from . import known
from .known import Known, Timed
from .scenes import TERMS, VARIANTS, Draw, column, ring

Of = Callable[[Any], Any]
"""A number of the constants, or of the part of the range that is run."""
PROFILES: dict[str, Callable[[Any, Any], Any]] = {
    "falls": lambda t, a: 1 - a * t,
    "grows": lambda t, a: 1 + 4 * a * t,
    "has a bump": lambda t, a: 1 + a * ufl.exp(-(((t - 0.5) / 0.2) ** 2)),
    "has a dip": lambda t, a: 1 - 4 * a * t * (1 - t),
    "oscillates": lambda t, a: 1 + a * ufl.sin(9 * t),
    "vanishes": lambda t, a: 1 - t / a,
}
"""Stiffnesses by the part of the range, relative to their own; ``a`` is below one, where the last one vanishes."""
SHAPES: dict[str, Of] = {
    "there and back": lambda t: 4 * t * (1 - t),
    "half a wave": lambda t: ufl.sin(pi * t),
    "wave": lambda t: ufl.sin(2 * pi * t),
    "five half-waves": lambda t: ufl.sin(5 * pi * t),
    "back": lambda t: 1 - t,
    "square": lambda t: t**2,
    "cubic": lambda t: 10 * t * (1 - t) * (1 - 2 * t),
    "exponential": lambda t: (ufl.exp(2 * t) - 1) / 6.4,
    "bounded": lambda t: ufl.tanh(3 * t),
    "rational": lambda t: t / (2 - t),
    "constant": lambda t: 0.3 + 0 * t,
}
"""Loads by the part of the range."""
LENGTHS = {"steel": (0.5, 2.0, 30.0), "DNA": (1e-7, 1e-6, 1e-5)}
FORCES = {"steel": (1e4, 1e6, 1e8), "DNA": (1e-15, 1e-13, 1e-11)}
OWN = (1e-9, 1e-6, 1e-3, 1e3, 1e6, 1e12, -1.0)
"""Units of the load beside that of the scene."""


class Seen:
    """Constants some of which are others: functions of the true ones."""

    def __init__(self, c: Any, others: dict[str, Of]) -> None:
        self._c, self._others = c, others

    def __getattr__(self, name: str) -> Any:
        return self._others[name](self._c) if name in self._others else getattr(self._c, name)


def seeing(scene: Scene, others: dict[str, Of], **more: Any) -> Scene:
    """The scene whose functions are given other constants."""

    def visit(_: str, function: Any, role: Role) -> Any:
        if not role.call.endswith("c)"):
            return function
        return lambda *given: function(*given[:-1], Seen(given[-1], others))

    return replace(scene, **(changes(scene, visit) | more))


def part(c: Any) -> Any:
    """Part of the range that is run."""
    return c.P * c.one / c.top


def scene(seed: int, number: int) -> tuple[Scene, Known]:
    """Scene ``number`` of a ``seed``, and what is known of it; raises :class:`rodfem.errors.SceneError`."""
    base, (group, variant) = Draw.of(seed, number), divmod(number, VARIANTS)
    draw = Draw(np.random.default_rng([seed, group, 0, 1]), np.random.default_rng([seed, group, variant + 1, 1]))
    units = draw.one_of("", "", "", *LENGTHS)
    if units:
        base = replace(base, length=draw.among(*LENGTHS[units]), force=draw.among(*FORCES[units]))
    closed = base.maybe(0.15)
    rod = ring(base, f"ring {number}") if closed else column(base, f"column {number}")
    return altered(draw, rod, [units] if units and not closed else [])


def altered(draw: Draw, rod: Scene, words: list[str]) -> tuple[Scene, Known]:
    """A scene with other functions of its load, and what is known of it."""
    low, high = rod.span
    one = draw.among(*OWN) if draw.maybe(0.3) else 1.0
    values = {"one": one, "top": high, "x": draw.number(0.1, 0.85), "y": draw.number(0.2, 1.0)}
    others: dict[str, Of] = {"P": lambda c: c.P * c.one}
    convex = None
    if draw.maybe(0.55):
        convex = stiffness(draw, rod, values["x"], others, words)
    if draw.maybe(0.55):
        shape = draw.one_of(*SHAPES)
        others["P"] = lambda c, of=SHAPES[shape]: c.top * of(part(c))
        words.append(f"load: {shape}")
    if draw.maybe(0.2):
        name, shape = draw.one_of("k0", "t0"), draw.one_of("square", "wave", "there and back")
        others[name] = lambda c, name=name, of=SHAPES[shape]: getattr(c, name) + c.y * of(part(c))
        words.append(f"{name}: {shape}")
    parameters = dict(rod.parameters) | {n: Parameter(x) for n, x in values.items()}
    parameters["P"] = Parameter(rod.parameters["P"].value / one)
    first, last = (load / one for load in ranges(draw, low, high, words))
    rod = seeing(rod, others, parameters=parameters, span=(first, last))
    rod = moved(draw, heavy(draw, fine(draw, rod, words), words), words)
    timed = events(draw)
    return replace(rod, name=", ".join([rod.name, *words])), Known(high / one, tuple(timed), convex)


def stiffness(draw: Draw, rod: Scene, a: float, others: dict[str, Of], words: list[str]) -> float | None:
    """Let one or two stiffnesses depend on the load; the part at which one vanishes, where that is all there is."""
    names = ["B1", "B2", "C", *["GA"] * (0 in rod.free_strains), *["EA"] * (2 in rod.free_strains)]
    chosen = {draw.one_of(*names): draw.one_of(*PROFILES) for _ in range(draw.one_of(1, 1, 2))}
    for name, how in chosen.items():
        others[name] = lambda c, name=name, of=PROFILES[how]: getattr(c, name) * of(part(c), c.x)
        words.append(f"{name} {how}")
    alone = not any(term in rod.name for term in TERMS)
    return a if alone and "vanishes" in chosen.values() else None


def ranges(draw: Draw, low: float, high: float, words: list[str]) -> tuple[float, float]:
    """A range of the base scene's load."""
    inside = low + draw.number(0.05, 0.7) * (high - low)
    kind = draw.one_of("", "", "", "from inside", "backwards", "backwards from inside")
    words += [kind] if kind else []
    return {"from inside": (inside, high), "backwards": (high, low), "backwards from inside": (inside, low)}.get(
        kind, (low, high)
    )


def fine(draw: Draw, rod: Scene, words: list[str]) -> Scene:
    """Elements of very different sizes, perhaps."""
    if not draw.maybe(0.2):
        return rod
    s, apart = draw.number(0.1, 0.9), 10.0 ** draw.number(-7.0, -1.5)
    words.append(f"elements of {apart:.1g}")
    return replace(rod, breaks=(*rod.breaks, rod.length * s, rod.length * (s + apart)))


def heavy(draw: Draw, rod: Scene, words: list[str]) -> Scene:
    """Masses that depend on the load, along the rod and attached to it."""
    if draw.maybe(0.25):
        words.append("masses")
        more = Attachment(
            0.7 * rod.length,
            mass=lambda c: 0.5 * (1 + part(c) ** 2),
            rotary_inertia=lambda c: [1e-3 * (1 + c.y * part(c)) * rod.length**2] * 3,
        )
        rod = replace(rod, attachments=(*rod.attachments, more))
    if draw.maybe(0.25):
        words.append("inertia of the load")
        inertia = Inertia(lambda c: 1.0 + part(c), lambda c: [1e-3 * (1 + part(c)) * rod.length**2] * 3)
        rod = replace(rod, inertia=inertia)
    return rod


def moved(draw: Draw, rod: Scene, words: list[str]) -> Scene:
    """Ends whose places and directors move with the load, perhaps."""
    if rod.closed or not draw.maybe(0.3):
        return rod
    side, shape = draw.one_of(0, 0, 1), SHAPES[draw.one_of("square", "wave", "half a wave", "there and back")]
    end, normal = rod.sides[side], rod.normal
    new: dict[str, Any] = {}
    if end.position is not None:
        along = draw.one_of(*(i for i in range(3) if i != normal))
        place = end.position

        def position(c: Any) -> list[Any]:
            by = 0.1 * c.y * rod.length * shape(part(c))
            return [x if x is None or i != along else x + by for i, x in enumerate(place(c))]

        new["position"] = position
    if end.fixed_rotation is not None:
        axis = draw.one_of(0, 1, 2) if normal is None else normal

        def rotation(c: Any) -> list[Any]:
            angle = 0.4 * c.y * shape(part(c))
            return [ufl.cos(angle), *(ufl.sin(angle) if i == axis else 0.0 for i in range(3))]

        new["rotation"] = rotation
    if not new:
        return rod
    words.append(f"{('left', 'right')[side]} end moves")
    ends: list[End] = list(rod.sides)
    ends[side] = replace(end, **new)
    return replace(rod, ends=tuple(ends))


def events(draw: Draw) -> list[Timed]:
    """Events, perhaps; none of them at an end of the range, or beside one."""
    if not draw.maybe(0.8):
        return []
    b, height = draw.number(0.07, 0.93), draw.number(-0.95, 0.95)
    kinds = ("sine", "sine", "touch", "pair", "pair", "step", "above")
    made = {
        "sine": lambda: known.sine(int(draw.among(1, 2, 3, 5, 7, 9)), height),
        "touch": lambda: known.touching(b),
        "pair": lambda: known.pair(b, 10.0 ** draw.number(-5.0, -1.2)),
        "step": lambda: known.steep(b),
        "above": lambda: known.above(b),
    }
    chosen = {draw.one_of(*kinds) for _ in range(draw.one_of(1, 1, 2))}
    return [made[kind]() for kind in sorted(chosen)]
