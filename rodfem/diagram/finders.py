"""What finds special points in a step of a branch, beside those at which an eigenvalue vanishes: the registry.

A kind of special point that is a zero of some function of the state has a class in a file of its own, as
:class:`~rodfem.diagram.events.Events`, an entry here, and its name, code and marker in
:mod:`rodfem.continuation.kinds`; that of the loads that a plan asks for is here.  Folds and branch points are zeros of
eigenvalues, whose number the index tells: :class:`~rodfem.diagram.special_search.SpecialSearch` has them.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Protocol

from rodfem.continuation.branch import SpecialPoint
from rodfem.continuation.kinds import USER
from rodfem.continuation.observer import Observer
from rodfem.diagram.events import Events
from rodfem.diagram.plan import Plan
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


class RequestedLoads:
    """Finds the states at the loads asked for, which are the same for all branches."""

    at_start = True

    def __init__(self, plan: Plan) -> None:
        """Take the loads from the ``plan``."""
        self.loads = tuple(plan.at)

    def between(self, step: Step) -> list[SpecialPoint]:
        """Points at these loads in a step; at its first point, too, where a branch begins there.

        A row at such a load is the point itself, and the branch has it once, unless it is a special point of another
        kind: one at which an eigenvalue vanishes, in a step, or where a branch leaves another one.
        """
        found = []
        for p, q in step.pieces():
            for load in self.loads:
                if load == p.load and p is step.a and step.begins:
                    found.append(p if p.zero <= step.b.zero else replace(p))
                if (p.load - load) * (q.load - load) < 0:
                    found.append(step.at_load(load, p, q))
                if load == q.load and not (q is step.b and step.closed):
                    found.append(q if q is step.b else replace(q))
        return [step.solver.given(USER, point) for point in found]

    def finish(self, observer: Observer) -> None:
        """Nothing is left open: an equilibrium that is not found ends its branch."""


FINDERS: tuple[type[Finder], ...] = (RequestedLoads, Events)
