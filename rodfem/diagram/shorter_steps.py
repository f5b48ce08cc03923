"""About a piece of a branch in which special points are hard to tell apart steps are made shorter."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

from rodfem.continuation.branch import Point

SHORTER = 2
"""How many times steps are made shorter about one piece."""
PARTS = 8
"""Steps into which a piece is divided, each time."""


class Unresolved(Exception):
    """A piece of a branch is to be looked at again, with shorter steps."""


@dataclass(frozen=True)
class _Piece:
    """Steps from arclength ``since`` ``until`` another are of at most the ``largest`` length, after some ``tries``."""

    since: float
    until: float
    largest: float
    tries: int


class ShorterSteps:
    """The bound of the steps of one branch: short ones about the pieces that were asked for.

    A piece is known for as long as the branch is followed: it may go back beyond one on account of another one, and
    would go to and fro between the two for ever if each were asked for as often.
    """

    def __init__(self, largest: float = inf, until: float = -inf) -> None:
        """Steps of at most ``largest`` up to the arclength ``until``."""
        self._pieces = [_Piece(-inf, until, largest, 0)]

    def ask(self, a: Point, b: Point) -> None:
        """Make steps shorter from ``a`` to beyond ``b`` and raise :class:`Unresolved`; return if they are already."""
        first, last = a.arclength, b.arclength
        inside = [piece for piece in self._pieces if piece.since < last and first < piece.until]
        tries = 1 + max((piece.tries for piece in inside), default=0)
        if tries <= SHORTER:
            length = last - first
            new = _Piece(first, last + length, length / PARTS, tries)
            self._pieces = [piece for piece in self._pieces if piece not in inside] + [new]
            raise Unresolved

    def reach(self, point: Point) -> float:
        """Largest step from a ``point``: up to the next piece, and then short ones."""
        ahead = (piece for piece in self._pieces if point.arclength < piece.until)
        return min((max(piece.largest, piece.since - point.arclength) for piece in ahead), default=inf)
