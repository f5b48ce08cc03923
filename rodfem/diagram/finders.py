"""A step of a branch, and what looks for special points in it: here, for the loads that a plan asks for.

A kind of special point that is a zero of some function of the state has a class in a file of its own, as
:class:`~rodfem.diagram.events.Events`, an entry in :class:`~rodfem.diagram.tracer.Tracer`, and its name, code and
marker in :mod:`rodfem.continuation.kinds`.  Folds and branch points are zeros of eigenvalues, whose number the index
tells: :class:`~rodfem.diagram.special_search.SpecialSearch` has them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple, Protocol

from rodfem.continuation.arc import Arc
from rodfem.continuation.branch import Point, SpecialPoint
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.kinds import USER
from rodfem.continuation.observer import Observer
from rodfem.diagram.plan import Plan


class Step(NamedTuple):
    """From a point ``a`` of a branch to the next, ``b``, both on the mesh of a ``solver``.

    ``singular`` has the folds and branch points between them; the branch ``begins`` at ``a``, or has come there; it is
    ``closed`` at ``b``, a state that has been examined as its beginning.
    """

    solver: BranchSolver
    a: Point
    b: Point
    singular: Sequence[SpecialPoint] = ()
    begins: bool = False
    closed: bool = False

    def pieces(self) -> Iterator[Arc]:
        """Yield the arcs between ``a``, the folds and branch points, and ``b``: the load is monotone along each."""
        between = (s.point for s in self.singular if s.point.arclength > self.a.arclength)
        return (Arc(self.solver, p, q) for p, q in pairwise([self.a, *between, self.b]))

    def up_to(self, bounds: tuple[float, float]) -> Step:
        """The step up to where its load leaves the ``bounds`` for the first time, at one of the singular points."""
        low, high = bounds
        arc = next(arc for arc in self.pieces() if not low <= arc.b.load <= high)
        last = arc.at_load(low if arc.b.load < low else high)
        before = [s for s in self.singular if self.a.arclength < s.point.arclength < last.arclength]
        return self._replace(b=last, singular=before, closed=False)


class Finder(Protocol):
    """Finds the special points of its kind step by step, in order along a branch."""

    def between(self, step: Step) -> list[SpecialPoint]:
        """Special points in a step."""

    def finish(self, observer: Observer) -> None:
        """Say what is left open of a branch that is complete."""


class RequestedLoads:
    """Finds the states at the loads asked for, which are the same for all branches."""

    def __init__(self, plan: Plan) -> None:
        """Take the loads from the ``plan``."""
        self.loads = tuple(plan.at)

    def between(self, step: Step) -> list[SpecialPoint]:
        """Points at these loads in a step; at its first point, too, where a branch begins there.

        A row at such a load is the point itself, and the branch has it once, unless it is a special point of another
        kind: one at which an eigenvalue vanishes, in a step, or where a branch leaves another one.
        """
        found = [
            step.a if step.a.zero <= step.b.zero else replace(step.a)
            for load in self.loads
            if step.begins and load == step.a.load
        ]
        found += [point for arc in step.pieces() for load in self.loads for point in self._on(step, arc, load)]
        return [step.solver.given(USER, point) for point in found]

    @staticmethod
    def _on(step: Step, arc: Arc, load: float) -> Iterator[Point]:
        """Yield the point at a load on an arc of the step, if there is one, without its beginning."""
        if (arc.a.load - load) * (arc.b.load - load) < 0:
            yield arc.at_load(load)
        elif load == arc.b.load and arc.b is not step.b:
            yield replace(arc.b)
        elif load == arc.b.load and not step.closed:
            yield arc.b

    def finish(self, observer: Observer) -> None:
        """Nothing is left open: an equilibrium that is not found ends its branch."""
