"""What a run was asked for, in numbers and texts: recorded in its files, and compared by a run that goes on."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, fields
from typing import Any

from rodfem.continuation.step_control import StepControl
from rodfem.diagram.plan import Plan
from rodfem.errors import InputError
from rodfem.fem import formulations
from rodfem.fem.fields import Discretization
from rodfem.fem.fingerprint import fingerprint, of_events, same, same_event
from rodfem.fem.system import System
from rodfem.problem.scene import Scene

EQUATIONS = "equations"
"""Entry that has the fingerprint of the equations (:mod:`rodfem.fem.fingerprint`), where it is known."""
EVENTS = "events"
"""Entry that has values of the events of the plan at the same states, where there are events."""
PRINTS = (EQUATIONS, EVENTS)
"""Entries that tell functions, up to round-off."""
REMEDY = "give what was run, or choose another folder"


def as_asked(scene: Scene, discretization: Discretization, plan: Plan) -> dict[str, Any]:
    """What JSON can hold of a run before anything is computed; steps are a text, events their names."""
    chosen = {f.name: getattr(plan, f.name) for f in fields(plan)}
    chosen |= {"span": plan.over(scene), "steps": repr(plan.steps), "events": [event.name for event in plan.events]}
    mesh = asdict(discretization) | {"formulation": formulations.chosen(discretization.formulation, scene).name}
    return {
        "scene": {"name": scene.name, "load": scene.load, "rod": scene.rod},
        "constants": {name: p.value for name, p in scene.parameters.items() if name != scene.load},
        "discretization": _plain(mesh),
        "plan": _plain(chosen),
    }


def prints(system: System, plan: Plan) -> dict[str, Any]:
    """Entries that tell functions: of the equations of a ``system``, and of the events of a ``plan``; collective."""
    span = plan.over(system.scene)
    values = of_events(system, plan.events, span)
    return {EQUATIONS: fingerprint(system, span)} | ({EVENTS: values} if values else {})


def check_asked(there: dict[str, Any], here: dict[str, Any], folder: Any) -> None:
    """Raise :class:`InputError` where a run in a ``folder`` was asked for something else than this one.

    ``there`` and ``here`` are what the two were asked for; equations and events are compared where both have them.
    """
    for name, before, now in _differences(there, here):
        raise InputError(f"{folder} was run with {name} = {before!r}, not {now!r}: {REMEDY}.")
    if EQUATIONS in there and EQUATIONS in here and not same(there[EQUATIONS], here[EQUATIONS]):
        raise InputError(
            f"{folder} was run with other equations than those of the scene {here['scene']['name']!r} (at one and the "
            f"same state their residual, ordinate, or stored, potential or kinetic energy differ): {REMEDY}."
        )
    named = zip(here["plan"]["events"], there.get(EVENTS, ()), here.get(EVENTS, ()), strict=False)
    for name, before, now in named:
        if not same_event(before, now):
            raise InputError(
                f"{folder} was run with another event {name!r} (at one and the same state its values differ): {REMEDY}."
            )


def plan_of(asked: dict[str, Any], folder: Any) -> Plan:
    """Plan that a run in a ``folder`` was asked for; :class:`InputError` where files cannot hold it."""
    if what := not_held(asked):
        raise InputError(f"The plan of the run in {folder} has {what} of its own, which no file holds: give the plan.")
    return plan_without(asked)


def not_held(asked: dict[str, Any]) -> str:
    """What of a plan that was ``asked`` for no file holds: ``events`` or ``steps``; empty if all of it is there."""
    entries = asked["plan"]
    return "events" if entries["events"] else "steps" if entries["steps"] != repr(StepControl()) else ""


def plan_without(asked: dict[str, Any]) -> Plan:
    """Plan that was ``asked`` for, without what no file holds."""
    known = {f.name for f in fields(Plan)} - {"steps", "events"}
    given = {n: x for n, x in asked["plan"].items() if n in known}
    entries: dict[str, Any] = {n: tuple(x) if isinstance(x, list) else x for n, x in given.items()}
    return Plan(**entries)


def _plain(entries: dict[str, Any]) -> dict[str, Any]:
    return {name: list(entry) if isinstance(entry, tuple) else entry for name, entry in entries.items()}


def _differences(there: dict[str, Any], here: dict[str, Any]) -> Iterator[tuple[str, Any, Any]]:
    """Entries that differ: a name, and both values."""
    for group in (name for name in here if name not in PRINTS):
        before, now = there.get(group, {}), here[group]
        for name in dict.fromkeys([*before, *now]):
            if before.get(name) != now.get(name):
                yield name, before.get(name), now.get(name)
