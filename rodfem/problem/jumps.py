"""Arclengths at which the material or what acts along the rod jumps.

Inside an element a jump is seen by the points of the quadrature alone.  Where it lies between the same two points of
both meshes of an error estimate these agree with each other, and not with the rod: a column whose foundation ends at
0.43 was given the bar 3e-7 on 14 cubic elements, with an error of 0.09.

The functions of the scene are called with an arclength that has no value yet.  What they compare with it
(``ufl.conditional``) changes at the zeros of a difference.  These are bracketed on a fine grid, two between points of
it by the lowest value between them; there the function is evaluated on either side.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import islice
from typing import TYPE_CHECKING, Any

import numpy as np
import ufl
from ufl.classes import GE, GT, LE, LT, Abs, MaxValue, MinValue
from ufl.corealg.traversal import unique_pre_traversal

from rodfem.forms.rotation import rotation
from rodfem.problem.enclosure import refined
from rodfem.problem.local_state import STATES, inside, place
from rodfem.problem.roles import functions_of
from rodfem.problem.values import Symbol, Values
from rodfem.roots import lowest_between, zero_between
from rodfem.tolerances import NEGLIGIBLE, SAME_PLACE, TINY

if TYPE_CHECKING:
    from rodfem.problem.scene import Scene

GRID = 20_000
"""Pieces of the rod in each of which one zero is looked for, or two where the difference comes near to zero."""
MOST = 200
"""Places of a difference that are looked for."""
BESIDE = 1e-4
"""Part of a piece by which the grid is moved: no simple fraction of the rod is a point of it."""
ENERGY = "stored energy"
"""Words for what the strains of the rod are stored in."""
JUMP = 1e-9
"""Least jump, relative to the greater of the two values."""


def jumps(scene: Scene) -> dict[str, list[float]]:
    """Arclengths inside the rod at which a function of the scene jumps, by its words, in ascending order."""
    s = Symbol()
    found: dict[str, list[float]] = {}
    for what, expressions in along(scene, s):
        places = {x for x in changes(expressions, s, scene) if _jumps_at(expressions, s, x, scene.length)}
        if places:
            found[what] = sorted({*found.get(what, []), *places})
    return found


def unbroken(scene: Scene, inside: Callable[[float], bool]) -> str:
    """Sentence on jumps that are ``inside`` of an element, which no error bar holds; empty where there is none."""
    for what, places in jumps(scene).items():
        if lost := [x for x in places if inside(x)]:
            breaks = ", ".join(f"{x:.10g}" for x in lost)
            return (
                f"The {what} jumps inside of an element, at s = {breaks}, where no error bar holds: give the scene "
                f"breaks=({breaks},)."
            )
    return ""


def along(scene: Scene, s: Any) -> Iterator[tuple[str, list[Any]]]:
    """Functions that hold along the rod, in words, as expressions of the arclength ``s`` at some states."""
    c = scene.constants(max(inside(scene.span), key=abs), s)  # at an end of the range what jumps may be 0
    places = [_place(scene, s, state) for state in STATES]
    yield ENERGY, [ufl.as_ufl(scene.energy(x.v, x.k, c)) for x in places]
    for what, function, role in functions_of(scene):
        if role.along and role.call == "f(c)":
            values = function(c)
            yield what, [ufl.as_ufl(value) for value in (values if role.size else [values])]
        elif role.along and role.call == "f(x, c)":
            yield what, [ufl.as_ufl(function(x, c)) for x in places]


def _place(scene: Scene, s: Any, state: Any) -> Any:
    units = (1.0, scene.length, 1.0, 1.0 / scene.length)
    q, r, v, k = (ufl.as_vector([float(unit * x) for x in values]) for unit, values in zip(units, state, strict=True))
    R = rotation(q)
    return place(q, R, s, r, dr=ufl.dot(R, v), v=v, k=k, length=scene.length)


def known(f: Values, s: Symbol, scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Arclengths from one end to the other between which a function has no peak, and its values there.

    No inner one is a simple fraction of the rod.
    """
    a, b = scene.interval
    inner = np.linspace(a, b, GRID + 1)[1:-1] + BESIDE * scene.length / GRID
    places = np.concatenate([[a], inner, [b]])
    values = f({s: places})
    size = float(abs(values[np.isfinite(values)]).max(initial=0.0))
    more = refined(f.expression, s, places, max(size, TINY))
    return more, values if len(more) == len(places) else f({s: more})


def extremes(expression: Any, s: Symbol, scene: Scene) -> list[float]:
    """Least and greatest value along the rod of an expression of the arclength ``s``, also where they are narrow."""
    values = known(Values(expression), s, scene)[1]
    return [float(np.nanmin(values)), float(np.nanmax(values))]


def changes(expressions: list[Any], s: Symbol, scene: Scene, *, kinks: bool = False) -> Iterator[float]:
    """Arclengths inside the rod at which a comparison with the arclength changes, or what has ``kinks`` may have one.

    Parameters
    ----------
    expressions, s
        Expressions of the arclength ``s``.
    scene
        The rod.
    kinks
        Whether absolute values, and larger or smaller ones of two, are comparisons, too.
    """
    a, b = scene.interval
    kinds = (LT, GT, LE, GE, *((Abs, MaxValue, MinValue) if kinks else ()))
    parts = {part for e in expressions for part in unique_pre_traversal(e) if isinstance(part, kinds)}
    for part in (part for part in parts if s in unique_pre_traversal(part)):
        for at in islice(_zeros(Values(difference(part)), s, scene), MOST):
            if a + SAME_PLACE * scene.length < at < b - SAME_PLACE * scene.length:
                yield round(at, 14 - int(np.ceil(np.log10(scene.length))))


def difference(part: Any) -> Any:
    """What is zero where a comparison changes, or where an absolute value or the larger of two has a kink."""
    return part.ufl_operands[0] - (0.0 if isinstance(part, Abs) else part.ufl_operands[1])


def _zeros(f: Values, s: Symbol, scene: Scene) -> Iterator[float]:
    """Where a function changes its sign, also between two points of the grid."""
    within = NEGLIGIBLE * scene.length

    def at(x: float, sign: float = 1.0) -> float:
        return sign * float(f({s: np.array([x])})[0])

    places, y = known(f, s, scene)
    sign, size, steps = np.sign(y), abs(y), abs(np.diff(y))
    for i in np.flatnonzero(sign[1:] * sign[:-1] < 0):
        yield zero_between(at, float(places[i]), float(places[i + 1]), within)
    zero = sign == 0.0
    yield from places[1:-1][zero[1:-1] & ~(zero[:-2] & zero[2:])].tolist()
    near = (size[1:-1] <= steps[1:] + steps[:-1]) & (size[1:-1] <= size[:-2]) & (size[1:-1] <= size[2:])
    near &= (sign[:-2] == sign[1:-1]) & (sign[2:] == sign[1:-1])
    for i in np.flatnonzero(near)[:MOST]:
        low, middle, high = places[i : i + 3].tolist()
        lowest, least = lowest_between(lambda x, i=i: at(x, sign[i + 1]), low, middle, high, within)  # type: ignore[misc]
        if least < 0:
            yield from (zero_between(at, end, lowest, within) for end in (low, high))


def _jumps_at(expressions: list[Any], s: Symbol, x: float, length: float) -> bool:
    """Whether one of the expressions jumps at an arclength."""
    for expression in expressions:
        sides = []
        for s.value in (x - SAME_PLACE * length / 10, x + SAME_PLACE * length / 10):
            sides.append(float(expression(())))
        low, high = sorted(sides)
        if high - low > JUMP * max(abs(low), abs(high)):
            return True
    return False
