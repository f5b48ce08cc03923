"""What to explore of a scene: range, loads to stop at, depth, steps, and what else is wanted."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any

from rodfem.continuation.follow import StepControl
from rodfem.errors import InputError
from rodfem.fem.fields import Discretization, check_mesh, most_eigenvalues
from rodfem.problem.arguments import a, convert, each, interval, optional, real, reals, whole, yes_or_no
from rodfem.problem.events import Event, Level
from rodfem.problem.scene import Scene
from rodfem.problem.trials import asked_for
from rodfem.problem.validation import FLEXIBLE, check_load, round_off_of_strains
from rodfem.stability import AUTO, METHODS, find

COUNTS = {
    "depth": "depth",
    "most_branches": "number of branches",
    "tries": "number of tries",
    "spectrum": "number of eigenvalues",
    "modes": "number of modes",
}
"""Fields that are not negative, in words."""
FINEST, ACCURACY, COARSEST = 1e-11, 1e-8, 1e-1
"""Least accuracy that can be asked for, which is near round-off, one that an error suggests, and the greatest one."""


EVENTS = each(a((Event, Level), "Events or Levels, as in events=(Event('ends meet', of=f),)"))


def _locus(name: str, value: Any) -> tuple[str, float, float]:
    """Name of a parameter and an interval."""
    parts = tuple(value) if isinstance(value, (tuple, list)) else ()
    if len(parts) != 3 or not isinstance(parts[0], str):
        raise InputError(f"{name} is {value!r}: give a name and an interval, as in {name}=('A', -3.0, 0.0).")
    low, high = reals(f"{name}[1:]", parts[1:], (-3.0, 0.0))
    return parts[0], low, high


@dataclass(frozen=True)
class Plan:
    """Range of the load, loads to stop at, depth of switches, steps, and further results that are wanted.

    ``span`` is the range of the load, start first, by default that of the scene; ``at`` are loads to stop at, each
    once.  Branches are followed from branch points of branches of a ``depth`` less than this, that of the first one
    being 0, and no more once there are ``most_branches``, 0 for no limit; ``steps`` control the lengths of steps.
    ``error_bars`` are those of a second computation; ``spectrum`` is the number of left-most eigenvalues of every state
    that are wanted in addition to its index.

    At each load of ``at`` that many ``tries``, deflated iterations, look for equilibria that no branch has reached, and
    states are assessed by a ``method``, empty for none, with a number of left-most ``modes``.  With a ``locus``,
    ``(parameter, low, high)``, every special point is followed in the plane of the load and that parameter; with
    ``sensitivity`` the derivatives of their loads in all constants are computed.  Zeros of ``events``, numbers of the
    state, and levels of eigenvalues are special points, too (conservative scenes).

    With an ``accuracy`` meshes are chosen and raised on the way such that load and ordinate of every row and special
    point are in error by less than this (relative to values greater than one), those of a row across the branch.  Of a
    discretisation that is given the formulation, the factors and the vertices are taken, which are the first mesh;
    elements and degree alone are not.
    """

    span: tuple[float, float] | None = None
    at: tuple[float, ...] = ()
    depth: int = 2
    steps: StepControl = field(default_factory=StepControl)
    error_bars: bool = True
    spectrum: int = 0
    tries: int = 0
    locus: tuple[str, float, float] | None = None
    sensitivity: bool = False
    method: str = ""
    modes: int = 0
    accuracy: float | None = None
    events: tuple[Event | Level, ...] = ()
    most_branches: int = 0

    def __post_init__(self) -> None:
        convert(
            self,
            span=optional(interval(0.0, 1.0, real)),
            at=lambda name, values: tuple(dict.fromkeys(reals(name, values, (0.5, 1.0)))),
            depth=whole(2),
            steps=a(StepControl, "StepControl, as in steps=StepControl(largest=0.02)"),
            error_bars=yes_or_no,
            spectrum=whole(4),
            tries=whole(24),
            locus=optional(_locus),
            sensitivity=yes_or_no,
            method=a(str, "the name of one, as in method='auto'"),
            modes=whole(3),
            accuracy=optional(real(ACCURACY)),
            events=lambda name, values: tuple(EVENTS(name, values)),
            most_branches=whole(20),
        )
        if self.method not in ("", AUTO):
            find(self.method)

    def load_range(self, scene: Scene) -> tuple[float, float]:
        """Range of the load: that of the plan, or that of the scene."""
        return scene.span if self.span is None else self.span

    def check(self, scene: Scene, discretization: Discretization | None = None) -> None:
        """Raise :class:`InputError` for a range that the scene does not admit, or a load outside the range.

        Of a ``discretization``, too, if it is given: for one that does not fit, or has too few eigenvalues.
        """
        if discretization is not None:
            self._check_mesh(scene, discretization)
        span = self.load_range(scene)
        scene.check_span(span)
        check_load(scene)
        if self.events and not scene.conservative:
            raise InputError(
                f"The event {self.events[0].name!r} is sought along branches, and a load without a potential is swept: "
                "leave events out."
            )
        for event in self.events:
            if isinstance(event, Event):
                event.check(scene.length)
        if self.accuracy is not None:
            self._check_accuracy(self.accuracy, scene)
        low, high = sorted(span)
        for load in self.at:
            if not low <= load <= high:
                raise InputError(
                    f"The load {load:g} asked for is outside the range {low:g} to {high:g}: "
                    "widen the range or leave it out."
                )
        if self.locus is not None:
            self._check_locus(scene, *self.locus)
        self._check_counts()

    @staticmethod
    def _check_locus(scene: Scene, name: str, low: float, high: float) -> None:
        scene.check_constant(name)
        if name not in asked_for(scene):
            raise InputError(f"Nothing in the scene depends on {name!r}: choose another parameter for the locus.")
        value = scene.parameters[name].value
        if not low <= value <= high or low == high:
            raise InputError(
                f"The interval of {name} from {low:g} to {high:g} does not hold its value {value:g}: choose one that "
                "does, the lower end first."
            )
        for end in (low, high):
            try:
                scene.varying(**{name: end})
            except InputError as trouble:
                raise InputError(f"The locus cannot reach {name} = {end:g}. {trouble}") from None

    def _check_counts(self) -> None:
        """Raise :class:`InputError` for numbers below zero, and for what needs loads where none is asked for."""
        for name, what in COUNTS.items():
            if (value := getattr(self, name)) < 0:
                raise InputError(f"{value} is not a {what}: give 0 or more in Plan({name}=...).")
        for asked, words in (
            (self.tries, "A search needs loads to search at"),
            (self.modes, "Modes need loads to judge at"),
            (self.method, "A method needs loads to judge at"),
        ):
            if asked and not self.at:
                raise InputError(f"{words}: give them in Plan(at=...).")
        if self.modes and self.method in METHODS and not find(self.method).finds_modes:
            raise InputError("Counting alone finds no modes: leave out Plan(modes=...) or give Plan(method=...).")

    @staticmethod
    def _check_accuracy(accuracy: float, scene: Scene) -> None:
        if not FINEST <= accuracy <= COARSEST:
            raise InputError(
                f"An accuracy of {accuracy:g} is not attainable: ask for one between {FINEST:g} (round-off) and "
                f"{COARSEST:g}."
            )
        if not scene.conservative:
            raise InputError(
                f"The accuracy {accuracy:g} is one of branches, and a load without a potential is swept on one mesh: "
                "leave it out, and give more elements (Discretization(elements=...)) where an error bar is too wide."
            )
        if doubt := round_off_of_strains(scene):
            raise InputError(f"{doubt}: no accuracy can be promised; {FLEXIBLE}, or give a mesh.")

    def _check_mesh(self, scene: Scene, discretization: Discretization) -> None:
        if self.accuracy is not None and discretization.vertices is None:
            return  # meshes are chosen on the way
        check_mesh(scene, discretization)
        most = most_eigenvalues(scene, discretization)
        for name in ("spectrum", "modes"):
            if (asked := getattr(self, name)) > most:
                raise InputError(
                    f"The mesh has no more than {most} eigenvalues, not {asked}: give less in Plan({name}=...), or use "
                    "more elements."
                )


def plan_of(plan: Plan | None, asked: dict[str, Any]) -> Plan:
    """The ``plan`` given, or that of the fields ``asked`` for; raises :class:`InputError` for both, or another name."""
    names = [f.name for f in fields(Plan)]
    for name in asked:
        if name not in names:
            raise InputError(f"A plan has no {name!r}: choose one of {', '.join(names)}, or give a Discretization.")
        if plan is not None:
            raise InputError(f"{name} and plan are both given: give plan=Plan({name}=...), or {name} without a plan.")
    return Plan(**asked) if plan is None else plan


EQUATIONS = "equations"
"""Entry of what a run was asked for that has the fingerprint of the equations (:mod:`rodfem.fem.fingerprint`)."""


def entries(plan: Plan, scene: Scene) -> dict[str, Any]:
    """What JSON can hold of a ``plan`` for a ``scene``; steps are a text, events their names."""
    chosen = {f.name: getattr(plan, f.name) for f in fields(plan)}
    return chosen | {
        "span": plan.load_range(scene),
        "steps": repr(plan.steps),
        "events": [event.name for event in plan.events],
    }


def not_held(asked: dict[str, Any]) -> str:
    """What of a plan that was ``asked`` for no file holds: ``events`` or ``steps``; empty if all of it is there."""
    plan = asked["plan"]
    return "events" if plan["events"] else "steps" if plan["steps"] != repr(StepControl()) else ""


def plan_without(asked: dict[str, Any]) -> Plan:
    """Plan that was ``asked`` for, without what no file holds."""
    names = ({f.name for f in fields(Plan)} - {"steps", "events"}) & asked["plan"].keys()
    return Plan(**{name: asked["plan"][name] for name in names})
