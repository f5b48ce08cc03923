"""Location of events: zeros of a number of the state on a piece of a branch."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import NamedTuple

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.event_samples import Samples, sampled
from rodfem.continuation.event_zeros import EXACT, SURE, Zero, Zeros
from rodfem.continuation.states_between import ASIDE, STEADY, Curve, EventCurve, solved_on
from rodfem.errors import ConvergenceError, SceneError
from rodfem.linalg.orthogonal import generic
from rodfem.problem.events import Event
from rodfem.tolerances import INSIDE, ROUND_OFF

TRIED = 4
"""Number of states, each with another round-off, whose values are compared."""
NOISY = 0.5
"""Part of a curve that is not resolved above which its ends alone tell of one zero: those between may be of noise."""
ABOVE = 1e-6
"""Distance, relative to the curve, to which the place of a lowest value that is not zero is that of equilibria."""
WIDE = 1e-2
"""Length, relative to the curve, of a piece on which an event is zero that is no place any more."""
QUARTERS = 4
"""Pieces of such a piece between which it is seen whether the event is zero there."""
ROUNDS = 12
"""Times that the curve is improved."""
NEAREST, WIDER = 1e-2, 10.0
"""Half length of the first piece on which an event is sought, relative to the last one; and the ratio of two that
follow."""
TOUCHES = 1e-7
"""Least distance, relative to the last piece, at which it is tried whether a function rises by its lowest value."""


class Found(NamedTuple):
    """Where an event happens: parameter ``s`` of the curve, state ``x``, uncertainty ``along`` of the parameter."""

    s: float
    x: PETSc.Vec
    along: float


class OnCurve:
    """An event as a function of the place on a ``curve``, which is led through equilibria where its zeros are."""

    def __init__(self, event: Event, curve: EventCurve) -> None:
        """Nothing of the ``event`` is known yet."""
        self.event, self.curve, self.solver = event, curve, curve.solver
        self.known: dict[float, float] = {}
        self.places = [end.arclength for end in curve.ends]

    def __call__(self, s: float) -> float:
        """Value at the state of the curve at ``s``."""
        if s not in self.known:
            self.known[s] = event_at(self.solver, self.event, self.curve(s)[0])
        return self.known[s]

    def noise(self, s: float) -> float:
        """How much it varies there with the round-off of a state."""
        left = self.curve.nearest(s).left if self.curve.solved else None
        return noise_of(self.solver, self.event, self.curve(s)[0], left)

    @cached_property
    def rough(self) -> float:
        """What of values is surely above the round-off that they have at the ends."""
        return SURE * max(noise_of(self.solver, self.event, end.x) for end in self.curve.ends)

    def zeros(self, first: Callable[[float], float], ends: tuple[float, float], *, known: bool) -> Zeros | None:
        """Zeros at equilibria, and lowest values; None where the event is zero all along.

        ``first(s)`` is the value on the curve as it is now, ``ends`` are those at its ends, of which the first one may
        be ``known`` to be zero.  Raises :class:`ConvergenceError` where equilibria are not found.
        """
        at_ends = dict(zip(self.places, ends, strict=True))
        for _ in range(ROUNDS):
            self.known = at_ends.copy()
            f = self if self.curve.solved else first
            samples = sampled(f, self.places[0], self.places[-1], ends, lambda _: self.rough)
            sizes = [abs(y) for y in samples.values.values()]
            if min(sizes) == 0.0 and max(sizes) <= self.rough:
                return None
            noisy = sum(q - p for p, q in samples.unresolved) > NOISY * self.curve.length
            if noisy:
                samples = Samples(at_ends.copy(), samples.unresolved)
            self.known |= samples.values
            zeros = Zeros(self, samples, self.noise)
            if known:
                zeros.add(self.places[0])
            zeros.locate()
            if not (more := self._open(zeros)) and not noisy:
                zeros.look_around()
                more = self._open(zeros)
            if not more:
                return zeros
            for s in more:
                self.curve.solve(s)
        raise ConvergenceError(
            f"The zeros of the event {self.event.name!r} change with the states that are solved for."
        )

    def found(self, zero: Zero) -> Found:
        """A zero that is inside."""
        node = self.curve.nearest(zero.s)
        along = zero.along + abs(node.s - zero.s) + 2 * abs(node.arclength - node.s)
        return Found(node.arclength, node.x, along)

    def inside(self, zero: Zero) -> bool:
        """Whether a zero is none of an end."""
        margin = max(INSIDE * self.curve.length, zero.along)
        return not self.still(zero) and all(abs(zero.s - s) > margin for s in self.places)

    def still(self, zero: Zero) -> bool:
        """Whether a zero is a whole piece of the curve."""
        return zero.high - zero.low >= WIDE * self.curve.length

    def zero_on(self, piece: tuple[float, float]) -> bool:
        """Whether the event is zero somewhere inside of a ``piece``; where it jumps across zero it is not."""
        return any(abs(self(s)) <= SURE * self.noise(s) for s in np.linspace(*piece, QUARTERS + 1)[1:-1])

    def _open(self, zeros: Zeros) -> list[float]:
        """Places at which equilibria are to decide."""
        places = [(zero.s, max(zero.along, EXACT)) for zero in zeros.found if self.inside(zero)]
        places += [(s, ABOVE * self.curve.length) for s in zeros.above if s not in self.places]
        return [s for s, near in places if not any(abs(s - node.s) <= near for node in self.curve.solved)]


def event_at(solver: BranchSolver, event: Event, x: PETSc.Vec) -> float:
    """Value of an event at a state; collective."""
    return event(solver.shape.sample(x))


def noise_of(solver: BranchSolver, event: Event, x: PETSc.Vec, left: PETSc.Vec | None = None) -> float:
    """How much the value of an ``event`` varies with the round-off of a state ``x``; collective.

    Newton's method has ``left`` that much there, if it is known: the more the worse the equations are conditioned.
    ``solver`` has the mesh.
    """
    first, last = x.getOwnershipRange()
    here, most, others = event_at(solver, event, x), 0.0, list[PETSc.Vec]()
    for which in range(TRIED):
        others.append(x.copy())
        others[-1].array[:] += ROUND_OFF * generic(np.arange(first, last), which)
    if left is not None:
        others += [x + left * sign for sign in (-STEADY, STEADY)]
    for other in others:
        try:
            most = max(most, abs(event_at(solver, event, other) - here))
        except SceneError:  # the state is at the edge of those at which there is a value
            continue
    return most


def nearest_event(solver: BranchSolver, event: Event, curve: Curve, reach: float) -> Found:
    """Where an ``event`` happens nearest to the beginning of a ``curve``, within ``reach`` on either side.

    Raises :class:`ConvergenceError` where it does not happen.  Its function may only come near zero, as beside where it
    touches zero on another mesh: then it is known to the distance at which it has twice its lowest value.  ``solver``
    has the mesh.
    """
    width = NEAREST * reach
    while True:
        first, last = (solved_on(solver, curve, s, 2 * ASIDE * width) for s in (-width, width))
        value = OnCurve(event, EventCurve(solver, first, last))
        value.curve.solve(0.0)
        ends = event_at(solver, event, first.x), event_at(solver, event, last.x)
        zeros = value.zeros(value, ends, known=False)
        found = [zero for zero in zeros.found if value.inside(zero)] if zeros else []
        if found:
            return value.found(min(found, key=lambda zero: abs(zero.s)))
        if width >= reach:
            break
        width = min(WIDER * width, reach)
    places = [] if zeros is None else [s for s in zeros.above if s not in value.places]
    if places:
        lowest = min(places, key=lambda s: abs(value(s)))
        along, x = TOUCHES * reach, value.curve.nearest(lowest).x
        while along <= reach:
            if max(abs(value(lowest - along)), abs(value(lowest + along))) >= 2 * abs(value(lowest)):
                return Found(lowest, x, along)
            along *= WIDER
    raise ConvergenceError(f"The event {event.name!r} does not happen near there.")
