"""The other demos' scenes with any constants, explored once for each discretisation."""

from dataclasses import replace
from functools import cache
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Any

from rows import verify

from rodfem import Diagram, Discretization, Plan, Scene, trace

FUNCTIONS = {"cord": "cord", "ruler": "ruler", "ring": "ring", "follower": "pushed_rod"}
"""Functions that state the demos' scenes."""


@cache
def module(name: str) -> ModuleType:
    """A demo as a module (it is a script, in no package)."""
    spec = spec_from_file_location(f"{name}_demo", Path(__file__).parents[1] / "demos" / f"{name}.py")
    assert spec is not None and spec.loader is not None
    found = module_from_spec(spec)
    spec.loader.exec_module(found)
    return found


def scene(name: str, **constants: Any) -> Scene:
    """The scene of a demo with its default constants, or others, over its own span or ``span``."""
    span = constants.pop("span", None)
    made: Scene = getattr(module(name), FUNCTIONS[name])(**constants)
    return made if span is None else replace(made, span=span)


@cache
def explored(
    name: str,
    formulation: str = "reduced",
    elements: int = 8,
    degree: int = 6,
    depth: int = 2,
    at: tuple[float, ...] = (),
    **constants: Any,
) -> Diagram:
    """Explore a demo over its own span, once for each set of arguments."""
    diagram = trace(scene(name, **constants), Discretization(formulation, elements, degree), Plan(at=at, depth=depth))
    verify(diagram.solvers[0], diagram.branches)
    return diagram
