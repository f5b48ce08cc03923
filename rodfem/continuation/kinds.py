"""The kinds of special points: each is a name with what is to be known of it; pictures read this without PETSc.

A kind is added here.  What finds its points makes :class:`~rodfem.continuation.branch.SpecialPoint` of that kind.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

EIGENVALUE, UNFOLDING, FREQUENCY, NUMBER, LOAD = "eigenvalue", "unfolding", "frequency", "number", "load"
"""Test functions, which vanish at a special point: an eigenvalue of the second variation, or the slope of the load; the
unfolding parameter of a branch point, nearly; the square of a frequency, or the difference of two; any number of the
state (:mod:`rodfem.problem.events`); the distance from a load asked for."""
Line = tuple[int, Any]


class Kind(str):
    """Name of a kind of special point, with what is to be known of it."""

    code: str = ""  # two letters for the terminal, AUTO's where it has some
    test: str = ""  # test function
    branches: bool = False  # whether other branches leave there
    marker: Mapping[str, Any] = MappingProxyType({})  # style of its mark in a picture, in matplotlib's words
    line: Line | None = None  # place in the palette and dashes of its locus in the plane of two parameters

    def __new__(cls, name: str, **known: Any) -> Kind:
        """Make a string that knows more than its letters."""
        kind = super().__new__(cls, name)
        vars(kind).update(known)
        return kind

    @property
    def words(self) -> str:
        """Name for a reader: that of its mark, where it has another one."""
        return str(self.marker.get("label", self))

    @property
    def singular(self) -> bool:
        """Whether the second variation is singular there, so that there are null vectors."""
        return self.test == EIGENVALUE

    @property
    def counted(self) -> bool:
        """Whether the index before and after belongs to the segments of a branch next to it."""
        return self.test in (EIGENVALUE, UNFOLDING)

    @property
    def request(self) -> bool:
        """Whether its load is given, and nothing happens there."""
        return self.test in (LOAD, "")

    @property
    def solved(self) -> bool:
        """Whether its load is solved for on any mesh, by the test function at the equilibria there."""
        return self.test in (EIGENVALUE, NUMBER)


YELLOW = "#F0E442"
BRANCH_POINT = Kind(
    "branch point", code="BP", test=EIGENVALUE, branches=True, line=(1, "-"),
    marker={"marker": "o", "ms": 7.5, "mfc": "white", "mec": "black", "mew": 1.5},
)  # fmt: skip
FOLD = Kind(
    "fold", code="LP", test=EIGENVALUE, line=(2, (0, (5.0, 1.5))),
    marker={"marker": "D", "ms": 6.0, "mfc": "black", "mec": "black"},
)  # fmt: skip
IMPERFECT = Kind(
    "imperfect bifurcation", code="IB", test=UNFOLDING,
    marker={"marker": "P", "ms": 9.5, "mfc": "white", "mec": "black", "mew": 1.3},
)  # fmt: skip
"""A branch point that an imperfection has taken apart, where steps of continuation do not resolve its pieces."""
FLUTTER = Kind(
    "flutter", code="HB", test=FREQUENCY, line=(3, (0, (5.0, 1.2, 1.0, 1.2))),
    marker={"marker": "*", "ms": 13.0, "mfc": YELLOW, "mec": "black", "mew": 1.1},
)  # fmt: skip
"""Under loads without a potential: a pair of frequencies becomes complex."""
DIVERGENCE = Kind(
    "divergence", code="BP", test=FREQUENCY, line=(4, (0, (2.0, 1.0))),
    marker={"marker": "v", "ms": 10.0, "mfc": YELLOW, "mec": "black", "mew": 1.1},
)  # fmt: skip
"""Under loads without a potential: a frequency becomes imaginary."""
EVENT = Kind("event", code="UZ", test=NUMBER, marker={"marker": "+", "ms": 8.5, "mec": "black", "mew": 1.6})
LEVEL = Kind("level", code="UZ", test=NUMBER, marker={"marker": "1", "ms": 9.5, "mec": "black", "mew": 1.6})
"""An eigenvalue equals a given number."""
USER = Kind(
    "user", code="UZ", test=LOAD,
    marker={"marker": "x", "ms": 6.5, "mec": "black", "mew": 1.6, "label": "requested load"},
)  # fmt: skip
END = Kind("end", code="EP")
KINDS = {str(kind): kind for kind in (BRANCH_POINT, FOLD, IMPERFECT, FLUTTER, DIVERGENCE, EVENT, LEVEL, USER, END)}
"""By name, in the order of legends."""

GAP = 1e-5
"""Gap between two loci, over the bounds of their parameters, that may be taken for a crossing: no step is shorter."""
CROSSES = f"another curve of its kind crosses it, or comes within {GAP:g} of the bounds"
"""Mark of a row of a locus beyond a crossing, from which on the other side of the load has the lower index."""
