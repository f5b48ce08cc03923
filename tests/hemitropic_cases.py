"""Rods that several tests share: the hemitropic demo with any constants, each discretisation of it set up once."""

import runpy
import sys
from dataclasses import replace
from functools import cache
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType

from rows import verify

from rodfem import Branch, Discretization, Observer, Plan, Point, Scene, Solver, SpecialPoint, StepControl
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.diagram.explorer import Explorer

DEMO = Path(__file__).parents[1] / "demos" / "hemitropic.py"
SPAN = (0.0, 0.95)

Constants = tuple[float, float, float, float]
"""Coupling A, twisting B, bending C, half length l."""
DEFAULT: Constants = (-3.0, 1.0, 1.0, 3.0)


@cache
def demo() -> ModuleType:
    """The demo as a module (it is a script, in no package)."""
    spec = spec_from_file_location("hemitropic_demo", DEMO)
    assert spec is not None and spec.loader is not None
    module = module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def run_demo(*arguments: str) -> None:
    """Run the demo as its command line does, in this process and on all ranks."""
    given, sys.argv = sys.argv, [str(DEMO), *arguments]
    try:
        runpy.run_path(str(DEMO), run_name="__main__")
    finally:
        sys.argv = given


@cache
def scene(constants: Constants = DEFAULT, span: tuple[float, float] = SPAN) -> Scene:
    """The demo's scene with these constants."""
    coupling, twisting, bending, half = constants
    return replace(demo().hemitropic_rod(coupling, twisting, bending, half), span=span)


@cache
def follower(
    formulation: str = "reduced", elements: int = 8, degree: int = 6, constants: Constants = DEFAULT
) -> BranchSolver:
    """The demo on one discretisation."""
    return Solver(scene(constants), Discretization(formulation, elements, degree)).equilibria


@cache
def explored(
    formulation: str = "reduced",
    elements: int = 8,
    degree: int = 6,
    constants: Constants = DEFAULT,
    *,
    span: tuple[float, float] = SPAN,
    at: tuple[float, ...] = (),
    depth: int = 2,
    error_bars: bool = False,
    steps: StepControl = StepControl(),  # noqa: B008, it is frozen
) -> list[Branch]:
    """Branches of the demo; all that are explored on one discretisation share what is set up for it."""
    plan = Plan(span, at=at, depth=depth, steps=steps, error_bars=error_bars)
    solver = follower(formulation, elements, degree, constants)
    branches = Explorer(solver, plan, Observer(), lambda: None).run()
    verify(solver, branches)
    return branches


def specials(branch: Branch, kind: str) -> list[SpecialPoint]:
    """Special points of one kind, in order along the branch."""
    return [s for s in branch.special if s.kind == kind]


def user_points(branch: Branch, load: float) -> list[Point]:
    """Points of a branch at exactly ``load``, in order along it."""
    return [s.point for s in branch.special if s.kind == "user" and s.point.load == load]
