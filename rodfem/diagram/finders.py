"""What finds special points in a step of a branch, beside those at which an eigenvalue vanishes: the registry.

A kind of special point that is a zero of some function of the state has a class in a file of its own, as
:class:`~rodfem.diagram.events.Events`, an entry here, and its name, code and marker in
:mod:`rodfem.continuation.kinds`.  Folds and branch points are zeros of eigenvalues, whose number the index tells:
:class:`~rodfem.diagram.special_search.SpecialSearch` has them.
"""

from __future__ import annotations

from typing import Protocol

from rodfem.continuation.branch import SpecialPoint
from rodfem.continuation.observer import Observer
from rodfem.diagram.events import Events
from rodfem.diagram.plan import Plan
from rodfem.diagram.requested_loads import RequestedLoads
from rodfem.diagram.step import Step


class Finder(Protocol):
    """Finds the special points of its kind step by step, in order along a branch."""

    at_start: bool
    """Whether it looks between a branch point and the first point of what leaves it, too."""

    def __init__(self, plan: Plan) -> None:
        """A run's finder, for all its branches: what the plan asks for."""

    def between(self, step: Step) -> list[SpecialPoint]:
        """Special points in a step."""

    def finish(self, observer: Observer) -> None:
        """Say what is left open of a branch that is complete."""


FINDERS: tuple[type[Finder], ...] = (RequestedLoads, Events)
