"""Arclengths at which the material or what acts along the rod jumps.

Inside an element a jump is seen by the points of the quadrature alone.  Where it lies between the same two points of
both meshes of an error estimate these agree with each other, and not with the rod: a column whose foundation ends at
0.43 was given the bar 3e-7 on 14 cubic elements, with an error of 0.09.

The functions of the scene are called with an arclength that has no value yet.  What they compare with it
(``ufl.conditional``) changes at the zeros of a difference, which are bracketed on a grid; there the
function is evaluated on either side.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import ufl
from ufl.classes import GE, GT, LE, LT
from ufl.corealg.traversal import unique_pre_traversal

from forms.rotation import rotation
from rodfem.problem.local_state import STATES, inside, place
from rodfem.problem.roles import functions_of
from rodfem.roots import zero_between
from rodfem.tolerances import NEGLIGIBLE, SAME_PLACE

if TYPE_CHECKING:
    from rodfem.problem.scene import Scene

GRID = 200
"""Pieces of the rod in each of which one zero is looked for."""
BESIDE = 1e-4
"""Part of a piece by which the grid is moved: no simple fraction of the rod is a point of it."""
JUMP = 1e-9
"""Least jump, relative to the greater of the two values."""


class Arclength(ufl.classes.Variable):  # type: ignore[misc]
    """The arclength, with the value that it is given last."""

    __slots__ = ("value",)

    def evaluate(self, *_: Any, **__: Any) -> float:
        """Return the value."""
        return float(self.value)


def jumps(scene: Scene) -> dict[str, list[float]]:
    """Arclengths inside the rod at which a function of the scene jumps, by its words, in ascending order."""
    s = Arclength(ufl.as_ufl(0.0))
    found: dict[str, list[float]] = {}
    for what, expressions in along(scene, s):
        places = {x for x in _changes(expressions, s, scene) if _jumps_at(expressions, s, x, scene.length)}
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
    yield "stored energy", [ufl.as_ufl(scene.energy(x.v, x.k, c)) for x in places]
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


def _changes(expressions: list[Any], s: Arclength, scene: Scene) -> Iterator[float]:
    """Arclengths inside the rod at which a comparison with the arclength changes."""
    a, b = scene.interval
    inner = np.linspace(a, b, GRID + 1)[1:-1] + BESIDE * scene.length / GRID
    grid = np.concatenate([[a], inner, [b]])
    parts = {part for e in expressions for part in unique_pre_traversal(e) if isinstance(part, LT | GT | LE | GE)}
    for part in (part for part in parts if s in unique_pre_traversal(part)):
        left, right = part.ufl_operands

        def difference(x: float, left: Any = left, right: Any = right) -> float:
            s.value = x
            return float(left(())) - float(right(()))

        values = [difference(x) for x in grid]
        for (x, y), (f, g) in zip(pairwise(grid), pairwise(values), strict=True):
            if f * g < 0:
                at = zero_between(difference, x, y, NEGLIGIBLE * scene.length)
                if a + SAME_PLACE * scene.length < at < b - SAME_PLACE * scene.length:
                    yield round(at, 14 - int(np.ceil(np.log10(scene.length))))


def _jumps_at(expressions: list[Any], s: Arclength, x: float, length: float) -> bool:
    """Whether one of the expressions jumps at an arclength."""
    for expression in expressions:
        sides = []
        for s.value in (x - SAME_PLACE * length / 10, x + SAME_PLACE * length / 10):
            sides.append(float(expression(())))
        low, high = sorted(sides)
        if high - low > JUMP * max(abs(low), abs(high)):
            return True
    return False
