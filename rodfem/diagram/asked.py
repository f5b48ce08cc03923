"""What a run was asked for, in its files: its plan, which a diagram that is read has again, and its equations."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

from rodfem.continuation.step_control import StepControl
from rodfem.diagram.plan import Plan
from rodfem.fem.fingerprint import fingerprint
from rodfem.fem.system import System

EQUATIONS = "equations"
"""Entry that has the fingerprint of the equations (:mod:`rodfem.fem.fingerprint`)."""


def as_asked(system: System, plan: Plan) -> dict[str, Any]:
    """What JSON can hold of a ``plan`` and of the equations of a ``system``; steps are a text, events their names."""
    span = plan.over(system.scene)
    chosen = {f.name: getattr(plan, f.name) for f in fields(plan)}
    chosen |= {"span": span, "steps": repr(plan.steps), "events": [event.name for event in plan.events]}
    return {"plan": chosen, EQUATIONS: fingerprint(system, span)}


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
