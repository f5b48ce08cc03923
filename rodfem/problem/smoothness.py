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

Strains vary along the rod as the stored energy does.  What polynomials of their degree miss of it,

    E = int (f - Pi f)^2 ds,    Pi the projection in L2,

is to loads what the error of the strains is, by its square.  On the halves with one degree more as much of it has to be
left as the bar assumes: a layer that cubic elements resolve in part had a bar of a third of its error.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import groupby, pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from ufl.corealg.traversal import unique_pre_traversal

from rodfem.problem.jumps import ENERGY, along, changes, jumps, known
from rodfem.problem.values import Symbol, Values
from rodfem.tolerances import NEGLIGIBLE, TINY

if TYPE_CHECKING:
    from rodfem.problem.scene import Scene

PIECES = 16
"""Pieces of the rod to begin with."""
POINTS = 8
"""Points of the Gauss quadrature of a piece."""
AGREE = 1e-13
"""Difference of two rules, relative to the largest value times the length of the piece, below which both are right."""
MOMENTS = 3
"""Number of moments that are compared."""
BESIDE = 1e-9
"""Part of a piece by which its ends are inside of it: at a break the function may jump."""
ENDS = 1e-9
"""Difference, on a piece and at its ends, of a function and the polynomial through its points, over the largest one."""
SEEN = 1e-12
"""Error, relative to the integral of the absolute value or of the square on the element, that no bar needs to hold."""
EPS, NOISE = float(np.finfo(float).eps), 10.0
"""Relative round-off of an arclength, and how often it counts over the length of a piece."""
MANY = 1000
"""Most pieces: of what varies everywhere on so small a scale the elements say more than this."""

Pieces = list[tuple[float, float]]


@dataclass(frozen=True)
class Rules:
    """Numbers of points of the Gauss rules of an element, its ``own``, and of its halves, the ``richer`` one.

    An error bar assumes that the part ``left`` of the first rule's error is left in the second.  The ``strains`` are
    polynomials of one degree on the element, and of another on its halves.
    """

    own: int
    richer: int
    left: float
    strains: tuple[int, int]


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
                    if element not in examined and not f.resolved(element, rules, strained=what == ENERGY):
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
        whole = self._moments((low, high), [(low, high)], POINTS)
        halves = self._moments((low, high), [(low, middle), (middle, high)], POINTS)
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

    def resolved(self, element: tuple[float, float], rules: Rules, *, strained: bool) -> bool:
        """Whether the error bar of the moments on an element holds, and, of what is ``strained``, that of a load."""
        a, b = element
        halves = [(a, (a + b) / 2), ((a + b) / 2, b)]
        true = self._moments(element, self._inside(element), POINTS)
        own, richer = self._moments(element, [element], rules.own), self._moments(element, halves, rules.richer)
        _, weights, values = self._sampled(self._inside(element), POINTS)
        least = SEEN * np.array([weights @ abs(values), weights @ values**2])
        left = rules.left / (1 - rules.left)
        if (abs(richer - true) > np.maximum(left * abs(richer - own), least[0])).any():
            return False
        missed = self._missed(element, rules.strains[0])
        still = sum(self._missed(half, rules.strains[1]) for half in halves) if missed > least[1] and strained else 0.0
        return bool(still <= max(left * (missed - still), least[1]))

    def _inside(self, element: tuple[float, float]) -> Pieces:
        """Parts of the pieces that are inside of an element."""
        a, b = element
        return [(max(a, low), min(b, high)) for low, high in self.pieces if low < b and high > a]

    def _sampled(self, pieces: Pieces, points: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Places and weights of the Gauss rule of that many points on each of some pieces, and the values there."""
        t, w = np.polynomial.legendre.leggauss(points)
        low, high = np.array(pieces).T[:, :, None]
        places, weights = ((low + high) / 2 + (high - low) / 2 * t).ravel(), ((high - low) / 2 * w).ravel()
        values = self(places)
        self.size = max(self.size, float(abs(values).max()), TINY)
        return places, weights, values

    def _moments(self, element: tuple[float, float], pieces: Pieces, points: int) -> np.ndarray:
        """The moments on an element, by that many points on each of the ``pieces`` that it is made of."""
        places, weights, values = self._sampled(pieces, points)
        return np.asarray((weights * values) @ _legendre(places, element, MOMENTS - 1))

    def _missed(self, element: tuple[float, float], degree: int) -> float:
        """Squared norm on an element of what polynomials of a degree miss of the function."""
        places, weights, values = self._sampled(self._inside(element), max(POINTS, degree + 3))
        polynomials = _legendre(places, element, degree) * np.sqrt(2 * np.arange(degree + 1) + 1)
        polynomials /= np.sqrt(element[1] - element[0])
        rest = values - polynomials @ ((weights * values) @ polynomials)
        return float(weights @ rest**2)


def _legendre(places: np.ndarray, element: tuple[float, float], degree: int) -> np.ndarray:
    """Legendre polynomials of an element up to a degree, at places on it: (places, degree + 1)."""
    a, b = element
    return np.asarray(np.polynomial.legendre.legvander((2 * places - a - b) / (b - a), degree))
