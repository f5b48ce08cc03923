r"""Places along the rod at which a material or a load changes too steeply for the elements there.

What is integrated over an element is seen at the points of the quadrature alone.  A stiffness that grows within 1e-4 of
the rod's length, between two points of both meshes of an error estimate, is neither in the result nor in its bar.
Jumps are looked for by :mod:`rodfem.problem.jumps`; here a function of the arclength has a value at every place.

Where it is steep is found without a mesh: a piece of the rod on which Gauss quadrature differs from that of its two
halves is halved, down to where it does not, and so is one where the function is not the polynomial through the points:
at its ends, and at places between which interval arithmetic bounds it (:mod:`rodfem.problem.enclosure`), so that no
peak and no notch is too narrow to be seen.  On an element ``[a, b]`` that holds such a place the moments

    I_j = int f(s) P_j(t) ds,    s = (a + b)/2 + t (b - a)/2,    P_j the Legendre polynomials, j = 0, 1, 2,

by the rule of the element, of its halves with one degree more, as for an error bar, and by the pieces are compared: a
bar of the moments has to hold, the difference of the first two enlarged by what is left in the second.  A kink may be
as bad as a step: at 0.751, beside the end of an element, one had the bar 2e-11 and an error of 2e-7.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import groupby, pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from ufl.corealg.traversal import unique_pre_traversal

from rodfem.problem.jumps import along, changes, jumps, known
from rodfem.problem.values import Symbol, Values
from rodfem.tolerances import NEGLIGIBLE, TINY

if TYPE_CHECKING:
    from rodfem.problem.scene import Scene

PIECES = 16
"""Pieces of the rod to begin with."""
POINTS = 8
"""Points of the Gauss quadrature of a piece."""
AGREE = 1e-10
"""Difference of two rules, relative to the largest value times the length of the piece, below which both are right."""
MOMENTS = 3
"""Number of moments that are compared."""
BESIDE = 1e-9
"""Part of a piece by which its ends are inside of it: at a break the function may jump."""
ENDS = 1e-6
"""Difference, on a piece and at its ends, of a function and the polynomial through its points, over the largest one."""
SEEN = 1e-8
"""Error of a moment, relative to the integral of the absolute value on the element, that no bar needs to hold."""
EPS, NOISE = float(np.finfo(float).eps), 10.0
"""Relative round-off of an arclength, and how often it counts over the length of a piece."""
MANY = 1000
"""Most pieces: of what varies everywhere on so small a scale the elements say more than this."""

Pieces = list[tuple[float, float]]


@dataclass(frozen=True)
class Rules:
    """Numbers of points of the Gauss rules of an element, its ``own``, and of its halves, the ``richer`` one.

    An error bar assumes that the part ``left`` of the first rule's error is left in the second.
    """

    own: int
    richer: int
    left: float


def unresolved(scene: Scene, elements: Callable[[float], Pieces], rules: Rules) -> str:
    """Sentence on what changes too steeply for the elements; empty where nothing does.

    Parameters
    ----------
    scene
        The rod.
    elements
        Returns the elements, as their ends, that hold an arclength: on every rank the same.
    rules
        Quadrature of the elements.
    """
    s, jumping = Symbol(), [place for places in jumps(scene).values() for place in places]
    for what, expressions in along(scene, s):
        for f in (_Function(e, s, scene) for e in expressions if s in unique_pre_traversal(e)):
            examined: set[tuple[float, float]] = set()
            for a, b in f.steep(scene, jumping):
                at = (a + b) / 2
                for element in elements(at):
                    if element not in examined and not f.resolved(element, rules):
                        return (
                            f"The {what} changes too sharply about s = {at:.6g}, within {b - a:.1g}, for the element "
                            f"from {element[0]:.6g} to {element[1]:.6g}, and error bars need not hold: give the "
                            f"Discretization vertices near {at:.6g}, or, for a jump or a kink, the scene "
                            f"breaks=({at:.6g},)."
                        )
                    examined.add(element)
    return ""


class _Function:
    """A function of the arclength, and the pieces of the rod on which it is smooth."""

    def __init__(self, expression: Any, s: Symbol, scene: Scene) -> None:
        """Evaluate the function on a grid, and where a kink may be."""
        self.values, self.s = Values(expression), s
        self.pieces: Pieces = []
        kinks = np.unique([*scene.interval, *changes([expression], s, scene, kinks=True)])
        between = (kinks[1:] + kinks[:-1]) / 2
        places = np.unique([*known(self.values, s, scene)[0], *kinks, *between])
        values = self(places)
        finite = np.isfinite(values)
        self.places, self.known = places[finite], values[finite]
        self.size = max(float(abs(self.known).max(initial=0.0)), TINY)

    def __call__(self, places: np.ndarray) -> np.ndarray:
        """Values at arclengths."""
        return self.values({self.s: places})

    def steep(self, scene: Scene, jumping: list[float]) -> Iterator[tuple[float, float]]:
        """Yield where it is smooth on smaller pieces than at first only: the smallest ones, by runs, and the others.

        At joints of the scene, and where it is ``jumping``, it may jump.
        """
        a, b = scene.interval
        ends = np.unique([*np.linspace(a, b, PIECES + 1), *scene.joints, *jumping]).tolist()
        first = list(pairwise(ends))
        open_, least = first, NEGLIGIBLE * scene.length
        while open_ and len(self.pieces) + len(open_) < MANY:
            rough = [(low, high) for low, high in open_ if high - low > least and not self._smooth(low, high)]
            self.pieces += sorted({*open_} - {*rough})
            open_ = [half for low, high in rough for half in pairwise((low, (low + high) / 2, high))]
        self.pieces = sorted(self.pieces + open_)
        others: Pieces = []
        for whole, run in groupby(self.pieces, {*first}.__contains__):
            if not whole:
                pieces = list(run)
                smallest = min(high - low for low, high in pieces)
                sharp = [piece for piece in pieces if piece[1] - piece[0] < 1.5 * smallest]
                together = sharp[0][0], sharp[-1][1]
                yield together if together[1] - together[0] < scene.length / PIECES else sharp[0]
                others += pieces
        yield from sorted(others, key=lambda piece: piece[1] - piece[0])

    def _smooth(self, low: float, high: float) -> bool:
        middle = (low + high) / 2
        whole = self._moments((low, high), (low, high), POINTS)
        halves = sum(self._moments((low, high), half, POINTS) for half in ((low, middle), (middle, high)))
        noise = EPS * max(abs(low), abs(high)) / (high - low)  # places are rounded
        if abs(whole - halves).max() > (AGREE + NOISE * noise) * self.size * (high - low):
            return False
        inside = BESIDE * (high - low)
        t, _ = np.polynomial.legendre.leggauss(POINTS)
        through = np.polynomial.legendre.legfit(t, self(middle + (high - low) / 2 * t), POINTS - 1)
        ends = np.array([low + inside, high - inside])
        among = slice(*np.searchsorted(self.places, ends))
        places = np.concatenate([ends, self.places[among]])
        values = np.concatenate([self(ends), self.known[among]])
        told = np.polynomial.legendre.legval((2 * places - low - high) / (high - low), through)
        return bool(abs(told - values).max() <= ENDS * self.size)

    def resolved(self, element: tuple[float, float], rules: Rules) -> bool:
        """Whether the error bar of the moments on an element holds."""
        a, b = element
        middle = (a + b) / 2
        own = self._moments(element, element, rules.own)
        richer = sum(self._moments(element, half, rules.richer) for half in ((a, middle), (middle, b)))
        inside = [(max(a, low), min(b, high)) for low, high in self.pieces if low < b and high > a]
        true = sum(self._moments(element, piece, POINTS) for piece in inside if piece[1] > piece[0])
        size = sum(self._moments(element, piece, POINTS, size=True)[0] for piece in inside if piece[1] > piece[0])
        most = rules.left / (1 - rules.left) * abs(richer - own)
        return bool((abs(richer - true) <= np.maximum(most, SEEN * size)).all())

    def _moments(
        self, element: tuple[float, float], piece: tuple[float, float], points: int, *, size: bool = False
    ) -> np.ndarray:
        """Parts on a ``piece`` of the moments on an element, by that many points; or of those of the absolute value."""
        t, w = np.polynomial.legendre.leggauss(points)
        half = (piece[1] - piece[0]) / 2
        places = (piece[0] + piece[1]) / 2 + half * t
        values = self(places)
        self.size = max(self.size, float(abs(values).max()), TINY)
        local = (2 * places - element[0] - element[1]) / (element[1] - element[0])
        return half * (w * (abs(values) if size else values)) @ np.polynomial.legendre.legvander(local, MOMENTS - 1)
