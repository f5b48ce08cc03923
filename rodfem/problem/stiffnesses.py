"""Second derivatives of the energies of a scene with respect to the state at a place, where they are no polynomials.

Eigenvalues are known at rows.  A spring that softens within a small part of a step, in what the state is there, takes
them through zero and back, and leaves no trace at the rows if the branch does not bend.  Its second derivatives show
it: on the chord between two states they have values far from those at both ends.  They are bounded there by interval
arithmetic (:mod:`rodfem.problem.enclosure`), on all places along the rod at once.
"""

from __future__ import annotations

from itertools import combinations_with_replacement
from typing import TYPE_CHECKING, Any

import numpy as np
from ufl.corealg.traversal import unique_pre_traversal

from rodfem.problem.enclosure import Chords
from rodfem.problem.gradients import derivative, is_polynomial
from rodfem.problem.pointwise import LocalState, Places, pointwise
from rodfem.problem.values import Values, scalar

if TYPE_CHECKING:
    from rodfem.problem.scene import Scene

BEYOND = 0.05
"""How far beyond its values at both ends a second derivative may be between, over the largest one there."""


class Stiffness:
    """Second derivatives of a ``function`` of a place, in words ``what``; all along the rod, or at the arclength ``s``.

    ``units`` has those of the symbols of the state, ``natural`` is the natural size of the derivatives times these.
    """

    def __init__(self, what: str, s: float | None, function: Any, at: LocalState, natural: float) -> None:
        """Differentiate twice."""
        self.what, self.s, self.natural = what, s, natural
        symbols = [symbol for symbol in at.units if symbol in unique_pre_traversal(function)]
        self.parts: list[tuple[float, Chords]] = []
        for x, y in combinations_with_replacement(symbols, 2):
            second = scalar(derivative(derivative(function, x), y))
            if not is_polynomial(second, at.units):
                self.parts.append((at.units[x] * at.units[y], Chords(Values(second))))

    def hidden(self, a: Places, b: Places) -> np.ndarray:
        """Whether derivatives have values between two states at one place that are far from those at both: (places,).

        The states of each place are in ``a`` and in ``b``.
        """
        ends = [(unit * chords.values(a), unit * chords.values(b)) for unit, chords in self.parts]
        size = np.max([np.maximum(abs(p), abs(q)) for p, q in ends], axis=0)
        size[~(size > 0)] = max(float(size.max(initial=0.0)), self.natural)
        found = np.zeros(len(size), dtype=bool)
        for (unit, chords), (p, q) in zip(self.parts, ends, strict=True):
            found |= chords.leave(a, b, BEYOND * size / unit, (p / unit, q / unit))
        return found


def stiffnesses(scene: Scene) -> tuple[LocalState, list[Stiffness]]:
    """Second derivatives of the energies, potentials and constraints of a ``scene`` that are no polynomials."""
    at, found = LocalState(scene), []
    for place in pointwise(scene, at):
        whole = scalar(place.function)
        if not is_polynomial(whole, at.units):
            natural = scene.units.energy / (scene.length if place.s is None else 1.0)
            found.append(Stiffness(place.what, place.s, whole, at, natural))
    return at, [each for each in found if each.parts]
