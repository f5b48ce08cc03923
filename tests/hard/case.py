"""A hard case: what makes it hard, what is promised, and what is measured of it against a closed form or a source."""

import json
from collections.abc import Callable, Sequence
from contextvars import ContextVar
from dataclasses import dataclass
from functools import cache
from math import inf, isfinite
from pathlib import Path
from typing import Any

from rodfem import Branch, ConvergenceError, Diagram, Discretization, InputError, Plan, Scene, SpecialPoint, trace
from rodfem.continuation.kinds import BRANCH_POINT, FOLD, IMPERFECT

SINGULAR = (FOLD, BRANCH_POINT, IMPERFECT)
"""Kinds of special points at which an eigenvalue vanishes."""


@dataclass(frozen=True)
class Change:
    """A special point as it should be: load, and the index before and after it."""

    load: float
    before: int
    after: int


@cache
def references() -> dict[str, Any]:
    """Numbers of series without a closed form, to about 1e-12, that other programs than rodfem have computed.

    How is said in the modules of the series.
    """
    read: dict[str, Any] = json.loads((Path(__file__).parent / "references.json").read_text())
    return read


def reference(series: str, *values: float) -> list[Change]:
    """Special points of a series for values of its parameters."""
    return [Change(*change) for change in references()[series][", ".join(f"{value:g}" for value in values)]]


@dataclass(frozen=True)
class Measured:
    """Outcome of one case: ``error`` in the case's own measure, the bar that bounds it, and what was said.

    ``error`` is infinite where what was found is not what there is: a special point more or less, another index.
    ``ratios`` are the errors of all loads over their error bars.
    """

    error: float
    bar: float
    said: tuple[str, ...] = ()
    wrong: str = ""
    ratios: tuple[float, ...] = ()

    @property
    def right(self) -> bool:
        return not self.wrong and self.error <= self.bar

    @property
    def verdict(self) -> str:
        """In words: right, said to be undecided, or wrong."""
        return "right" if self.right else "said" if self.said else "wrong"


@cache
def words() -> dict[str, dict[str, str]]:
    """Rows of ``cases.md`` by the name of the case, each by the heads of its columns.

    One of them is the row of the contract, of "Promised" in docs/resolution.md, that the case tests.
    """
    lines = (Path(__file__).parent / "cases.md").read_text().splitlines()
    head, _, *rows = ([cell.strip() for cell in line.strip("|").split("|")] for line in lines)
    return {row[0]: dict(zip(head, row, strict=True)) for row in rows}


@dataclass(frozen=True)
class Case:
    """A series of problems of one kind, by a parameter: the tests run ``few`` of its values, the page ``all``."""

    name: str
    measure: Callable[[Any], Measured]
    few: tuple[Any, ...]
    all: tuple[Any, ...]

    @property
    def may_say(self) -> bool:
        """Whether a sentence that says what is not decided is as good as an answer."""
        return words()[self.name]["promised"] == "exact or said"


ASKED: ContextVar[float | None] = ContextVar("asked", default=None)
"""An accuracy that is asked for in place of a mesh, and that errors are then compared with in place of their bars."""


def run(scene: Scene, mesh: Discretization | None = None, **plan: Any) -> Diagram:
    """Diagram of a scene; what is an error with branches is their diagram, with the error among its warnings."""
    given = {"depth": 0} | plan
    if (accuracy := ASKED.get()) is not None:
        mesh, given = None, given | {"accuracy": accuracy}
    try:
        return trace(scene, mesh, Plan(**given))
    except (ConvergenceError, InputError) as trouble:
        diagram: Diagram | None = getattr(trouble, "diagram", None)
        if diagram is None:
            raise
        diagram.warnings.append(str(trouble))
        return diagram


def said(diagram: Diagram) -> tuple[str, ...]:
    """All that a diagram says it could not decide."""
    unexplained = [str(u) for b in diagram for u in b.unexplained]
    ended = [b.ended for b in diagram if b.ended.startswith("no convergence")]
    notes = [note for note in diagram.notes if "eigenvalue" in note]
    missed = [s.note for b in diagram for s in b.special if "not reached" in s.note]
    return (*diagram.warnings, *unexplained, *ended, *notes, *missed)


def singular(branch: Branch) -> list[SpecialPoint]:
    return [s for s in branch.special if s.kind in SINGULAR]


def compare(found: Sequence[SpecialPoint], expected: Sequence[Change], said: tuple[str, ...] = ()) -> Measured:
    """Largest error of the loads, relative to its own bar: infinite where other points were found, or other indices.

    Neighbours nearer to each other than the bars may be one point that has the change of all.  Of a point that the mesh
    does not resolve it is said: its bar may not hold.
    """
    left, ratios = list(expected), []
    for s in found:
        bar = max(s.error_estimate if isfinite(s.error_estimate) else s.located_to, 1e-15 * abs(s.point.load))
        if (accuracy := ASKED.get()) is not None:
            bar = accuracy * max(1.0, abs(s.point.load))
        group: list[Change] = []
        while left and (not group or (group[-1].after != s.negative_after and abs(left[0].load - s.point.load) <= bar)):
            group.append(left.pop(0))
        if not group or (group[0].before, group[-1].after) != (s.negative_before, s.negative_after):
            return Measured(inf, 1.0, said, f"{s!r} where {group} was expected")
        errors = [abs(s.point.load - g.load) / bar if s.point.load != g.load else 0.0 for g in group]
        if max(errors) > 1 and s.resolved is False:
            said = (*said, f"{s!r} is not resolved")
        ratios += errors
    if left:
        return Measured(inf, 1.0, said, f"{left} missed")
    return Measured(max(ratios, default=0.0), 1.0, said, ratios=tuple(ratios))


def check(expected: Sequence[Change], scene: Scene, mesh: Discretization | None = None, **plan: Any) -> Measured:
    """The special points of the first branch of a scene, with the index on either side, against those expected."""
    diagram = run(scene, mesh, **plan)
    return compare(singular(diagram[0]), expected, said(diagram))
