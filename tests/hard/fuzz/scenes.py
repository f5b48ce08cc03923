"""Random scenes: number i of a seed is the same whatever is asked for besides.

Four successive numbers have one structure, so that they share their compiled forms, and differ in their constants.
Lengths are multiples of ``c.l``, forces of ``c.f``: a scene may be stated in any units.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from math import hypot, pi
from typing import Any

import numpy as np
import ufl

from rodfem import (
    Attachment,
    Constraint,
    End,
    Inertia,
    Ordinate,
    Parameter,
    Ring,
    Scene,
    at,
    clamped,
    elastic,
    everywhere,
    free,
    hinged,
    integral,
    pinned,
    sliding,
    sliding_hinge,
)
from rodfem.forms import loads

VARIANTS = 4
"""Scenes of one structure."""
RODS = ("flexible", "unshearable", "inextensible", "unshearable and inextensible")
NEARLY = (0.0, 1e-2, 1e-4, 1e-6, 1e-8)
"""Relative differences of two stiffnesses, and imperfections."""
TERMS = ("bend and twist", "bend and bend", "stretch and twist", "shear and bend", "logarithm", "quartic", "cosh")
ALONG = ("tapered", "tapered", "jump", "wavy")
Energy = Callable[[Any, Any, Any], Any]
Vector = Callable[[Any], tuple[Any, ...]]
AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.6, 0.0, 0.8))


@dataclass(frozen=True)
class Draw:
    """Two generators, of what a scene is made of and of its numbers, and its units of length and force."""

    shape: np.random.Generator
    numbers: np.random.Generator
    length: float = 1.0
    force: float = 1.0

    @classmethod
    def of(cls, seed: int, number: int) -> "Draw":
        """Generators of scene ``number`` of a seed."""
        group, variant = divmod(number, VARIANTS)
        numbers = np.random.default_rng([seed, group, variant + 1])
        units = (1.0, 1.0)
        if numbers.random() < 0.12:
            units = float(numbers.choice([1e-3, 7.0, 1e3])), float(numbers.choice([1e-6, 30.0, 1e6]))
        return cls(np.random.default_rng([seed, group]), numbers, *units)

    def one_of(self, *choices: Any) -> Any:
        """A part of the structure."""
        return choices[self.shape.integers(len(choices))]

    def maybe(self, chance: float) -> bool:
        """Whether the structure has a part."""
        return bool(self.shape.random() < chance)

    def number(self, low: float, high: float) -> float:
        """A constant."""
        return float(self.numbers.uniform(low, high))

    def among(self, *values: float) -> float:
        """A constant that is one of some values."""
        return float(values[self.numbers.integers(len(values))])


def scene(seed: int, number: int) -> Scene:
    """Scene ``number`` of a ``seed``; raises :class:`rodfem.errors.SceneError` for one that cannot be."""
    draw = Draw.of(seed, number)
    return ring(draw, f"ring {number}") if draw.maybe(0.15) else column(draw, f"column {number}")


def constants(draw: Draw) -> dict[str, float]:
    """Constants of all scenes: stiffnesses, natural shape, couplings, units.  The load ``P`` is zero."""
    B1, B2, C = (draw.number(0.5, 3.0) for _ in range(3))
    if draw.numbers.random() < 0.5:
        B2 = B1 * (1 + draw.among(*NEARLY))
    stiff = draw.among(1.0, 1.0, 1.0, 1e3, 1e6)
    return {
        **{
            "P": 0.0,
            "l": draw.length,
            "f": draw.force,
            "B1": B1,
            "B2": B2,
            "C": C,
            "GA": 60.0 * stiff,
            "EA": 40.0 * stiff,
        },
        **{"k0": draw.among(0.0, 0.0, draw.number(0.1, 1.0)), "t0": draw.among(0.0, 0.0, draw.number(0.1, 1.0))},
        **{"a": draw.number(0.1, 1.0), "m": draw.number(-0.4, 0.4), "j": draw.number(0.1, 0.4)},
        **{"k": draw.number(20.0, 300.0), "e": draw.number(1.0, 30.0), "w": draw.number(0.5, 5.0)},
        **{"H": draw.among(0.0, 0.0, 0.0, 0.05, 1e-3, 1e-5, 1e-8), "g": draw.among(0.0, *NEARLY, 0.5)},
    }


def energy_of(draw: Draw, rod: str, planar: str | None) -> tuple[Energy, tuple[float, ...], str]:
    """Convex energy of a rod, with what it is made of by chance, arclengths (of a unit rod) where it jumps, a name."""
    term = draw.one_of("", "", *TERMS)
    along = draw.one_of(*ALONG) if draw.maybe(0.25) else ""
    curved, twisted = draw.maybe(0.4) and planar != "e1", draw.maybe(0.4) and planar is None
    shear, stretch = rod in ("flexible", "inextensible"), rod in ("flexible", "unshearable")

    def profile(c: Any) -> Any:
        s = c.s / c.l
        if along == "jump":
            return ufl.conditional(ufl.lt(s, 0.4), 1.0, 1.0 + c.j)
        return {"": 1.0, "tapered": 1 - c.j * s, "wavy": 1 + c.j * ufl.cos(2 * pi * s)}[along]

    def energy(v: Any, k: Any, c: Any) -> Any:
        x, y = c.l * k[0], c.l * k[1] - c.k0 * curved
        t, e = c.l * k[2] - c.t0 * twisted, v[2] - 1
        out = 0.5 * (c.B1 * x**2 + c.B2 * y**2 + c.C * t**2)
        if shear:
            out += 0.5 * c.GA * (v[0] ** 2 + v[1] ** 2)
        if stretch:
            out += c.EA * (v[2] * ufl.ln(v[2]) - e if term == "logarithm" else 0.5 * e**2)
        if term == "bend and twist" and planar is None:
            out += c.m * x * t
        if term == "bend and bend" and planar is None:
            out += c.m * x * y
        if term == "stretch and twist" and stretch and planar is None:
            out += 8 * c.m * e * t
        if term == "shear and bend" and shear:
            out += 8 * c.m * v[0] * y
        if term == "quartic":
            out += 0.1 * c.a * sum(z**4 for z in (x, y, t))
        if term == "cosh":
            out += c.a * sum(ufl.cosh(0.7 * z) - 1 for z in (x, y, t))
        return c.f * profile(c) * out

    return energy, (0.4,) if along == "jump" else (), ", ".join(("", *filter(None, (term, along))))


def column(draw: Draw, name: str) -> Scene:
    """Random rod between two ends."""
    rod = draw.one_of(*RODS)
    planar = draw.one_of("e1", "e2") if draw.maybe(0.25) else None
    energy, breaks, made_of = energy_of(draw, rod, planar)
    case = supported(draw, rod, planar)
    values = constants(draw)
    if planar == "e1":
        values["H"] = 0.0
    length = draw.length
    unit = {"force": draw.force, "moment": draw.force * length, "number": 1.0}[case.unit]
    most = case.most * draw.number(0.3, 1.0) * (-1 if case.both and draw.numbers.random() < 0.25 else 1)
    more = along(draw, planar) if case.extra else {}
    ordinate = Ordinate("middle", s=0.5 * length, of=lambda r, q: hypot(r[0], r[1]))
    if draw.maybe(0.2):
        ordinate = Ordinate("bending", None, of=lambda x, c: c.l * (x.k[0] ** 2 + x.k[1] ** 2))
    return Scene(
        f"{name}, {case.name}{made_of}", (0.0, length), rod, energy, as_parameters(values), "P",
        case.ends, ordinate, (0.0, unit * most), planar=planar, breaks=tuple(s * length for s in breaks),
        inertia=Inertia(lambda c: 1.0, lambda c: [1e-3 * c.l**2] * 3), **(more | case.more),
    )  # fmt: skip


def as_parameters(values: dict[str, float]) -> dict[str, Parameter]:
    """Constants of a scene."""
    return {name: Parameter(float(value)) for name, value in values.items()}


def along(draw: Draw, planar: str | None) -> dict[str, Any]:
    """What acts along a rod beside its load, if anything does."""
    extra = draw.one_of(
        *[""] * 4, "foundation", "uneven foundation", "gravity", "spring", "integral", "point", "strain"
    )
    if extra in ("foundation", "uneven foundation"):
        uneven = extra != "foundation"

        def rest(x: Any, c: Any) -> Any:
            k = c.k * c.f / c.l**2
            return loads.spring(x.r, (k, k * (1 - 0.7 * c.g * uneven), 0.0))

        return {"potential": rest}
    if extra == "gravity":
        return {"distributed": lambda c: (0.0, 0.0, -c.w * c.f / c.l)}
    if extra == "spring":
        return {
            "attachments": (
                Attachment(0.4 * draw.length, energy=lambda x, c: loads.spring(x.r, [c.k * c.f / c.l] * 2 + [0.0])),
            )
        }
    free = 0 if planar != "e1" else 1
    if extra == "integral":
        kept: Constraint = integral(lambda x, c: x.r[free])
    elif extra == "point":
        kept = at(0.5 * draw.length, lambda x, c: x.r[free])
    elif extra == "strain" and planar is None:
        kept = everywhere(lambda x, c: x.k[0], strain=True)
    else:
        return {}
    return {"constraints": (kept,)}


def circle(s: np.ndarray) -> np.ndarray:
    """Quaternions of a circle of length 2 pi in the plane across e2."""
    return np.stack([np.cos(s / 2), 0 * s, np.sin(s / 2), 0 * s], axis=1)


def ring(draw: Draw, name: str) -> Scene:
    """Random closed rod: under pressure, a load of fixed direction that depends on the arclength, or springs."""
    rod = draw.one_of("unshearable", "unshearable and inextensible", "unshearable and inextensible")
    planar = "e2" if draw.maybe(0.5) else None
    energy, breaks, made_of = energy_of(draw, rod, planar)
    values = constants(draw) | {"P": 0.2, "l": 1.0, "f": 1.0, "H": 0.0}
    kind = draw.one_of("pressure", "radial", "wave", "foundation", "point loads")
    more: dict[str, Any] = {}
    if kind == "pressure":
        more["potential"] = lambda x, c: loads.pressure(x.r, x.dr, c.P)
    elif kind == "radial":
        more["distributed"] = lambda c: (c.P * ufl.cos(c.s), 0.0, -c.P * ufl.sin(c.s))
    elif kind == "wave":
        waves = draw.one_of(2, 3, 4)
        more["distributed"] = lambda c: (c.P * ufl.cos(waves * c.s), 0.0, 0.0)
    elif kind == "point loads":
        push = [lambda c: (0.0, 0.0, c.P), lambda c: (0.0, 0.0, -c.P)]
        more["attachments"] = tuple(Attachment(s, force=p) for s, p in zip((0.5 * pi, 1.5 * pi), push, strict=True))
    else:
        more["potential"] = lambda x, c: c.P * (x.r[0] ** 2 + (1 - c.g) * x.r[2] ** 2)
    ordinate = Ordinate("bending", None, of=lambda x, c: x.k[0] ** 2 + x.k[1] ** 2)  # wherever the ring may have gone
    return Scene(
        f"{name}, {kind}{made_of}", (0.0, 2 * pi), rod, energy, as_parameters(values), "P",
        Ring(), ordinate, (0.2, 5.0), planar=planar, start=circle, breaks=breaks, **more,
    )  # fmt: skip


# --- ends, with the load that acts on them, or between them --------------------------------------------------------


@dataclass(frozen=True)
class Case:
    """Two ends and a load: its largest value, in a ``unit``, and whether it may have ``both`` signs.

    ``more`` are fields of a scene, and ``extra`` says whether there may be others.
    """

    name: str
    ends: tuple[End, End]
    most: float
    unit: str = "force"
    both: bool = True
    extra: bool = True
    more: dict[str, Any] = field(default_factory=dict)


def push(c: Any) -> tuple[Any, ...]:
    """Thrust along e3, and a small force across."""
    return (c.H * c.f, 0.0, -c.P)


def on_axis(c: Any) -> tuple[Any, ...]:
    """Held across e3."""
    return (0.0, 0.0, None)


def at_far_end(c: Any) -> tuple[Any, ...]:
    """Place of the right end of the straight rod."""
    return (0.0, 0.0, c.l)


def axis_of(draw: Draw, planar: str | None) -> tuple[float, float, float]:
    """Axis of a hinge; a planar rod has mostly the normal of its plane."""
    if planar is not None and draw.maybe(0.9):
        return AXES[int(planar[1]) - 1]
    return draw.one_of(*AXES)


def held(draw: Draw, planar: str | None) -> End:
    """A left end."""
    axis = axis_of(draw, planar)
    return draw.one_of(clamped(), clamped(), clamped(), pinned(), hinged(axis))


def pushed(draw: Draw, planar: str | None, force: Vector | None) -> tuple[End, End]:
    """Two ends of which the right one moves along e3 at least, under a dead ``force``."""
    left, axis = held(draw, planar), axis_of(draw, planar)
    slide = draw.one_of((0.0, 0.0, 1.0), (0.6, 0.0, 0.8))
    thrust = None if force is None else lambda c: force(c)[2]

    def springs(c: Any) -> tuple[Any, ...]:
        return (c.e * c.f / c.l, (1 + c.g) * c.e * c.f / c.l, 0.0)

    right = [
        elastic(springs, force=force),
        elastic(springs, lambda c: c.e * c.f * c.l, force=force),
        pinned(on_axis, force),
        sliding(on_axis, force=force),
        sliding(lambda c: (0.0, None, None) if planar != "e1" else (None, 0.0, None), force=force),
        hinged(axis, on_axis, force=force),
        sliding_hinge(axis, slide if planar != "e1" else (0.0, 0.0, 1.0), at_far_end, force=thrust),
        free(force),
        free(force),
    ]
    return left, draw.one_of(*(right if left.fixed_rotation is not None or draw.maybe(0.1) else right[:-2]))


def supported(draw: Draw, rod: str, planar: str | None) -> Case:
    """Ends and load by chance."""
    kinds = [pressed, pressed, pressed, turned, weight, natural, between, followed]
    if "inextensible" not in rod or draw.maybe(0.1):
        kinds.append(shortened)
    kinds += [torqued, blown] if planar is not None else [leaned, torqued]
    return draw.one_of(*kinds)(draw, planar)


def pressed(draw: Draw, planar: str | None) -> Case:
    """A dead thrust."""
    return Case("thrust", pushed(draw, planar, push), 40.0)


def turned(draw: Draw, planar: str | None) -> Case:
    """One end turned by the angle P about e3, or about an axis across, the other one held; a thrust beside it."""
    half = 0.5
    axis = 3 if planar is None else int(planar[1])

    def rotation(c: Any) -> tuple[Any, ...]:
        out = [ufl.cos(half * c.P), 0.0, 0.0, 0.0]
        out[axis] = ufl.sin(half * c.P)
        return tuple(out)

    thrust: Vector = lambda c: (0.0, 0.0, -c.w * c.f)  # noqa: E731
    place = draw.one_of(on_axis, on_axis, None)
    return Case("turned", (clamped(), sliding(place, rotation, thrust)), 9.0, "number", both=False)


def weight(draw: Draw, planar: str | None) -> Case:
    """A force along the rod."""
    along = draw.one_of(lambda c: -c.P / c.l, lambda c: -2 * c.P * c.s / c.l**2)
    case = Case("weight", pushed(draw, planar, None), 60.0, extra=False)
    case.more["distributed"] = lambda c: (c.H * c.f / c.l, 0.0, along(c))
    return case


def natural(draw: Draw, planar: str | None) -> Case:
    """A moment of springs at the far end that grows: a rod wound up."""
    twist = loads.semi_tangential if planar is None else lambda d1, d2, m: -m * (d1[2] if planar == "e2" else d2[2])
    end = End(position=on_axis, energy=lambda x, c: twist(x.d1, x.d2, c.P), force=lambda c: (0.0, 0.0, -c.w * c.f))
    return Case("energy of an end", (clamped(), end), 15.0, "moment")


def shortened(draw: Draw, planar: str | None) -> Case:
    """The far end moved towards the other one; the rod is under dead lateral weight, or none."""
    far = draw.one_of(clamped, pinned, lambda position: hinged(axis_of(draw, planar), position))
    return Case("shortened", (clamped(), far(lambda c: (c.H * c.l, 0.0, c.l * (1 - c.P)))), 0.5, "number", both=False)


def between(draw: Draw, planar: str | None) -> Case:
    """A thrust at a point of the rod."""
    ends = pushed(draw, planar, None)
    case = Case("thrust between the ends", ends, 60.0, extra=False)
    case.more["attachments"] = (Attachment(0.6 * draw.length, force=push),)
    return case


def followed(draw: Draw, planar: str | None) -> Case:
    """A follower force at the end, or along the rod: no potential."""
    if draw.maybe(0.4):
        case = Case("follower along the rod", (held(draw, planar), free()), 60.0, both=False, extra=False)
        case.more["follower"] = lambda c: (0.0, 0.0, -c.P / c.l)
        return case
    return Case("follower", (held(draw, planar), free(follower=lambda c: (0.0, 0.0, -c.P))), 40.0, both=False)


def torqued(draw: Draw, planar: str | None) -> Case:
    """A moment about a fixed axis, or about a director: conservative in a plane alone."""
    which = draw.one_of("moment", "follower_moment")
    axis = 2 if planar is None else int(planar[1]) - 1

    def moment(c: Any) -> tuple[Any, ...]:
        return tuple(c.P if i == axis else 0.0 for i in range(3))

    thrust: Vector = lambda c: (0.0, 0.0, -c.w * c.f)  # noqa: E731
    place = draw.one_of(on_axis, None)
    return Case(which, (clamped(), End(position=place, force=thrust, **{which: moment})), 9.0, "moment")


def leaned(draw: Draw, planar: str | None) -> Case:
    """A dead force across and along."""
    return Case("oblique", pushed(draw, planar, lambda c: ((0.05 + c.H) * c.P, 0.01 * c.P, -c.P)), 40.0)


def blown(draw: Draw, planar: str | None) -> Case:
    """A pressure on a planar rod whose ends stay on a line through the origin."""
    ends = draw.one_of((clamped(), sliding(on_axis)), (pinned(), pinned(on_axis)), (clamped(), pinned(on_axis)))
    case = Case("pressure", ends, 30.0, extra=False)
    normal = AXES[int(str(planar)[1]) - 1]
    case.more["potential"] = lambda x, c: loads.pressure(x.r, x.dr, c.P / c.l, normal)
    return case
