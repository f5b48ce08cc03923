"""The numbers of the paper, computed anew: ``python paper/printed.py`` prints each as the paper has it.

A table of loads, and the errors of coarse meshes.  Each is a text with the digits of the paper.
"""

from __future__ import annotations

import runpy
from dataclasses import replace
from math import hypot, log2, pi
from pathlib import Path

import rodfem
from rodfem import Discretization, Inertia, Ordinate, Parameter, Plan, Scene, free
from rodfem.forms.energy import bending_and_twist

DEMOS = Path(__file__).parents[1] / "demos"
MESHES = (4, 8, 16)
"""Numbers of quadratic elements."""


def demo(file: str, function: str, span: tuple[float, float]) -> Scene:
    """The scene of a demo with its default constants, over another ``span`` of its load."""
    scene: Scene = runpy.run_path(str(DEMOS / f"{file}.py"))[function]()
    return replace(scene, span=span)


def beam() -> Scene:
    """A beam that nothing holds, pushed along its own end; what it does not give way to accelerates it, uniformly."""
    return Scene(
        name="beam",
        interval=(0.0, 1.0),
        rod="unshearable and inextensible",
        energy=lambda v, k, c: bending_and_twist(k, (1.0, 1.0, 1.0)),
        parameters={"P": Parameter(0.0)},
        load="P",
        ends=(free(), free(follower=lambda c: (0.0, 0.0, -c.P))),
        distributed=lambda c: (0.0, 0.0, c.P),
        inertia=Inertia(rho_A=lambda c: 1.0, rho_I=lambda c: (0.0, 0.0, 0.0)),
        ordinate=Ordinate("tip", s=1.0, of=lambda r, q: hypot(r[0], r[1])),
        span=(90.0, 130.0),
    )


def first(scene: Scene, mesh: Discretization, *, error_bars: bool = True) -> tuple[float, float]:
    """Load of the first special point of the first branch that is no end of it, and its error bar."""
    diagram = rodfem.trace(scene, mesh, Plan(depth=0, error_bars=error_bars))
    special = next(s for s in diagram[0].special if s.kind in ("branch point", "flutter"))
    return special.point.load, max(special.error_estimate, special.located_to)


def loads() -> dict[str, tuple[float, float]]:
    """The loads of the table with their error bars, by the names of its rows."""
    fine = Discretization("auto", 8, 6)
    return {
        "telephone cord": first(demo("cord", "cord", (60.0, 45.0)), fine),
        "hemitropic rod": first(demo("hemitropic", "hemitropic_rod", (0.0, 0.2)), fine),
        "twisted ring": first(demo("ring", "ring", (0.9, 1.3)), Discretization("auto", 16, 6)),
        "column": first(demo("follower", "pushed_rod", (18.0, 22.0)), fine),
        "free beam": first(beam(), Discretization("pointwise", 6, 6)),
    }


def errors() -> list[float]:
    """Relative errors of the cord's first load on coarse meshes of quadratic elements, ``len(MESHES)``."""
    scene, exact = demo("cord", "cord", (60.0, 40.0)), 5 * pi**2
    found = [first(scene, Discretization("reduced", n, 2), error_bars=False)[0] for n in MESHES]
    return [abs(load / exact - 1) for load in found]


if __name__ == "__main__":
    for name, (load, bar) in loads().items():
        print(f"{name:<20}{load:.12g} +- {bar:.0e}")
    wrong = errors()
    print(", ".join(f"{error:.1e}" for error in wrong), f"an order of {log2(wrong[-2] / wrong[-1]):.2f}")
