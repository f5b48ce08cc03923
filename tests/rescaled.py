"""Scenes stated in other units of length and force, compared with recorded ones.

Parameters keep their values: what they stand for is converted where a scene uses it.  The load has a unit of its own.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import golden_cases

import rodfem
from rodfem.problem.functions import Role, changes
from rodfem.problem.scene import Scene

DNA = 1e-8, 1e-12, 1.0
STEEL = 0.1, 1e5, 1e7
"""Metres and newtons of one unit of length and force, and what of the load is one of the scene's own unit."""


class InUnits:
    """Constants or a place, some attributes of which are converted."""

    def __init__(self, given: Any, factors: dict[str, float]) -> None:
        self.given, self.factors = given, factors

    def __getattr__(self, name: str) -> Any:
        value = getattr(self.given, name)
        return value * self.factors[name] if name in self.factors else value


def rescaled(scene: Scene, length: float, force: float, load: float = 1.0) -> Scene:
    """The same rod where one ``length``, ``force`` and ``load`` of the scene are so many units; masses keep theirs."""

    def constants(c: Any) -> InUnits:
        return InUnits(c, {"s": 1 / length, scene.load: 1 / load})

    def place(x: Any) -> InUnits:
        return InUnits(x, {"s": 1 / length, "length": 1 / length, "r": 1 / length, "k": length})

    def times(values: Any, factor: float) -> tuple[Any, ...]:
        return tuple(None if x is None else x * factor for x in values)

    factors = {
        "position": length,
        "moment": force * length,
        "follower moment": force * length,
        "distributed": force / length,
        "force": force,
        "follower force": force,
        "mass per length": 1.0,
        "rotary inertia per length": length**2,
        "mass of": length,
        "rotary inertia of": length**3,
        "value of": length,
    }

    def visit(words: str, f: Callable[..., Any], role: Role) -> Any:
        if role.call == "f(c)":
            factor = next((x for start, x in factors.items() if words.startswith(start)), 1.0)
            return lambda c: times(f(constants(c)), factor) if role.size != 0 else factor * f(constants(c))
        if role.call == "f(x, c)":
            factor = 1.0 if words == "constraint" else force if role.along else force * length
            return lambda x, c: factor * f(place(x), constants(c))
        others: dict[str, Callable[..., Any]] = {
            "W(v, k, c)": lambda v, k, c: force * f(v, k * length, constants(c)),
            "start(s)": lambda s: f(s / length),
            "of(r, q)": lambda r, q: f(r / length, q),
            "of(x, c)": lambda x, c: f(place(x), constants(c)) / length,
        }
        return others[role.call]

    new = changes(scene, visit)
    ordinate = new.get("ordinate", scene.ordinate)
    new["ordinate"] = ordinate if ordinate.s is None else replace(ordinate, s=ordinate.s * length)
    for name in ("attachments", "constraints"):
        parts = new.get(name, getattr(scene, name))
        new[name] = tuple(x if x.s is None else replace(x, s=x.s * length) for x in parts)
    if not scene.has_inertia:
        new["inertia"] = rodfem.Inertia(rho_I=lambda c: (length**2,) * 3)
    a, b = (s * length for s in scene.interval)
    first = scene.parameters[scene.load]
    low, high = (x * load for x in first.admissible)
    new["parameters"] = scene.parameters | {
        scene.load: replace(first, value=first.value * load, admissible=(low, high))
    }
    span = scene.span[0] * load, scene.span[1] * load
    return replace(scene, interval=(a, b), span=span, breaks=tuple(s * length for s in scene.breaks), **new)


def differences(name: str, length: float, force: float, load: float = 1.0) -> list[str]:
    """What differs between the diagrams of a recorded scene in its own and in other units, in words.

    That in its own units is traced only where the other is not what is recorded, or says something.
    """
    scene = golden_cases.cases()[name]()
    other = golden_cases.trace(rescaled(scene, length, force, load), error_bars=False)
    if not other.warnings and not _apart(golden_cases.numbers()[name], other, load):
        return []
    own = golden_cases.trace(scene, error_bars=False)
    said = [f"warning: {sentence}" for sentence in other.warnings if sentence not in own.warnings]
    return said + _apart(golden_cases.recorded(own), other, load)


def _apart(recorded: list[dict[str, Any]], other: rodfem.Diagram, load: float) -> list[str]:
    """What differs between what is recorded of a scene and its diagram where its ``load`` has another unit."""
    found, out = golden_cases.recorded(other), []
    if [b["name"] for b in recorded] != [b["name"] for b in found]:
        out.append(f"branches {[b['name'] for b in recorded]} and {[b['name'] for b in found]}")
    for a, b in zip(recorded, found, strict=False):
        if a["indices"] != b["indices"]:
            out.append(f"{b['name']}: indices {a['indices']} and {b['indices']}")
        kinds = [[(str(s["kind"]), *s["index"]) for s in x["special"]] for x in (a, b)]
        if kinds[0] != kinds[1]:
            out.append(f"{b['name']}: special points {kinds[0]} and {kinds[1]}")
            continue
        for s, t in zip(a["special"], b["special"], strict=True):
            if abs(s["load"] - t["load"] / load) > 1e-9 * max(1.0, abs(s["load"])):
                out.append(f"{b['name']}: {s['kind']} at {s['load']:.12g} and {t['load'] / load:.12g}")
    return out
