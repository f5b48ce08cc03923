"""Random ends of a rod with the load that acts on them, or between them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import ufl

from rodfem import Attachment, End, clamped, elastic, free, hinged, pinned, sliding, sliding_hinge
from rodfem.forms import loads

if TYPE_CHECKING:
    from .scenes import Draw

Vector = Callable[[Any], tuple[Any, ...]]
AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.6, 0.0, 0.8))


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
