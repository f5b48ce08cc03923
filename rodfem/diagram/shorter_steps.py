"""Steps of a branch that are made shorter about a piece of it in which its special points are hard to tell apart."""

from __future__ import annotations

from math import inf

from rodfem.continuation.branch import Point

SHORTER = 2
"""How many times steps are made shorter about one piece."""
PARTS = 8
"""Steps into which a piece is divided, each time."""


class Unresolved(Exception):
    """A piece of a branch is to be looked at again, with shorter steps."""


class ShorterSteps:
    """The bound of the steps of one branch: short ones about the piece that was asked for last."""

    def __init__(self, largest: float = inf, until: float = -inf) -> None:
        """Steps of at most ``largest`` up to the arclength ``until``."""
        self._since, self._until, self._largest, self._tries = -inf, until, largest, 0

    def ask(self, a: Point, b: Point, parts: int = PARTS, *, once: bool = False) -> None:
        """Make steps shorter from ``a`` to beyond ``b`` and raise :class:`Unresolved`; return if they are already.

        The piece is divided into so many ``parts``; ``once``: steps that are short already do.
        """
        if once and self._since <= a.arclength < self._until:
            return
        self._tries = self._tries + 1 if a.arclength < self._until else 1
        if self._tries <= SHORTER:
            length = b.arclength - a.arclength
            self._since, self._until, self._largest = a.arclength, b.arclength + length, length / parts
            raise Unresolved

    def reach(self, point: Point) -> float:
        """Largest step from a ``point``: up to the piece, and then short ones."""
        if point.arclength >= self._until:
            return inf
        return max(self._largest, self._since - point.arclength)
