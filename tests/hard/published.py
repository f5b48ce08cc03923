"""Hard cases of the literature, each against its closed form or its published value."""

from dataclasses import replace
from math import hypot, inf, pi, sqrt
from typing import Any

import classics
import closed_forms
import demo_cases
import numpy as np
import ufl
from classics import SUPPORTS, column
from hard.case import Change, Measured, compare, run, said, singular

from rodfem import Discretization, Ordinate, Parameter, Ring, Scene, Solver, clamped, sliding
from rodfem.forms import loads
from rodfem.forms.energy import bending_and_twist

# --- Haringx' helical springs ---------------------------------------------------------------------------------------

SHEAR = 1 / 2.6
"""G/E of the wire."""
SLENDER = pi * sqrt((1 - SHEAR) / (0.5 + SHEAR))
"""Free length over diameter below which a spring between hinges does not buckle; between clamps twice that."""


def spring(above: float, supports: str = "pinned-pinned") -> Measured:
    """A helical spring as a column of stretch, shear and bending stiffness 1, E/G and D^2/(4 (1/2 + G/E)).

    Its compression at buckling is ``e (1 - (1 - G/E) e) = D^2 q^2/(4 (1/2 + G/E))``: two loads, where the free length
    over D exceeds the threshold by the part ``above``, and none below it.
    """
    waves = pi if supports == "pinned-pinned" else 2 * pi
    slender = SLENDER * waves / pi * (1 + above)
    B = 1 / (4 * (0.5 + SHEAR) * slender**2)

    def energy(v: Any, k: Any, c: Any) -> Any:
        return 0.5 * (c.GA * (v[0] ** 2 + v[1] ** 2) + (v[2] - 1) ** 2) + bending_and_twist(k, (c.B1, c.B2, c.C))

    scene = column("spring", SUPPORTS[supports], (0.4, 0.95), rod="flexible", energy=energy, planar="e2",
                   constants={"P": 0.4, "GA": 1 / SHEAR, "B1": B, "B2": B, "C": B})  # fmt: skip
    discriminant = 1 - 4 * (1 - SHEAR) * B * waves**2
    expected = []
    if discriminant > 0:
        low, high = ((1 + sign * sqrt(discriminant)) / (2 * (1 - SHEAR)) for sign in (-1, 1))
        expected = [Change(x, i, 1 - i) for i, x in enumerate((low, high)) if 0.4 < x < 0.95]
    diagram = run(scene)
    return compare(singular(diagram[0]), expected, said(diagram))


# --- pressed rings --------------------------------------------------------------------------------------------------


def radial(c: Any) -> tuple[Any, ...]:
    return (c.P * ufl.cos(c.s), 0.0, -c.P * ufl.sin(c.s))


def central(x: Any, c: Any) -> Any:
    return c.P * ufl.sqrt((x.r[0] - 1) ** 2 + x.r[2] ** 2)


RINGS: dict[str, tuple[dict[str, Any], Any, int]] = {
    "hydrostatic": ({"potential": lambda x, c: loads.pressure(x.r, x.dr, c.P)}, lambda n: n * n - 1, 0),
    "dead": ({"distributed": radial}, lambda n: n * n, 1),
    "central": ({"potential": central}, lambda n: (n * n - 1) ** 2 / (n * n - 2), 0),
}
"""Load, its critical values for n waves, and the index of the circle at small loads (under a dead load it turns)."""


def pressed(kind: str, span: tuple[float, float]) -> Scene:
    """A circle of radius and bending stiffness one in its plane."""
    return column("ring", Ring(), span, start=classics.circle, planar="e2", constants={"P": span[0], "B2": 1.0},
                  **classics.ROUND, **RINGS[kind][0])  # fmt: skip


def ring(kind: str) -> Measured:
    """Modes 2 to 5 of a circle in its plane, two of each."""
    _, critical, index = RINGS[kind]
    expected = [Change(critical(n), index + 2 * (n - 2), index + 2 * (n - 1)) for n in (2, 3, 4, 5)]
    diagram = run(pressed(kind, (0.3, expected[-1].load + 1.0)), Discretization("pointwise", 16, 6))
    return compare(singular(diagram[0]), expected, said(diagram))


# --- many turns -----------------------------------------------------------------------------------------------------


def rolled(turns: int) -> Measured:
    """A cantilever of bending stiffness 2 rolled up by an end moment: its end comes back to the clamp at each turn."""
    most = 4 * pi * turns
    scene = replace(classics.rolled("moment"), span=(0.0, most))
    diagram = run(scene, Discretization("pointwise", max(4 * turns, 8), 8), error_bars=False)
    last, sample = diagram[0].points[-1], diagram.solvers[0].shape.sample(diagram[0].points[-1].x)
    if last.load != most or {p.negative for p in diagram[0].points} != {0}:
        return Measured(inf, 1e-7, said(diagram), f"ended at {last.load}")
    angle, s = 2 * pi * turns, sample["s"]
    arc = np.stack([1 - np.cos(angle * s), 0 * s, np.sin(angle * s)], axis=1) / angle
    return Measured(float(abs(sample["r"] - arc).max()), 1e-7, said(diagram))


def cord(turns: float) -> Measured:
    """The first bifurcations of a straight cord, whose tensions grow with the square of the turns and lie 40 apart."""
    expected = closed_forms.tensions(turns)[:4]
    high, low = expected[0] + 20.0, (expected[2] + expected[3]) / 2
    scene = demo_cases.scene("cord", turns=turns, span=(high, low))
    diagram = run(scene, Discretization("auto", 8, 8))
    changes = [Change(x, i, i + 1) for i, x in enumerate(expected[:3])]
    return compare(singular(diagram[0]), changes, said(diagram))


# --- others ---------------------------------------------------------------------------------------------------------


def shearable_helix(slenderness: float, degree: int = 4) -> float:
    """Error of the rotation of a rod that a wrench at its end bends to a helix, of that ``slenderness``."""
    G, torsion, curvature, C = slenderness**2, 2.0, 3.0, 0.6

    def strains(c: Any) -> tuple[Any, Any, Any]:
        w = ufl.sqrt(c.k**2 + c.t**2)
        return w, c.t * (c.C - 1) * c.k / c.G, 1 + c.t * (c.C - 1) * c.t / c.G

    def position(c: Any) -> tuple[Any, ...]:
        w, v2, v3 = strains(c)
        along = (v2 * c.k + v3 * c.t) / w**2 * (1 - ufl.sin(w) / w)
        part = ufl.sin(w) / w
        return ((1 - ufl.cos(w)) / w**2 * (c.k * v3 - c.t * v2), along * c.k + part * v2, along * c.t + part * v3)

    def rotation(c: Any) -> tuple[Any, ...]:
        w = ufl.sqrt(c.k**2 + c.t**2)
        return (ufl.cos(w / 2), 0.0, ufl.sin(w / 2) * c.k / w, ufl.sin(w / 2) * c.t / w)

    def energy(v: Any, k: Any, c: Any) -> Any:
        return 0.5 * c.G * (v[0] ** 2 + v[1] ** 2 + (v[2] - 1) ** 2) + bending_and_twist(k, (c.B1, c.B2, c.C))

    scene = column(
        "shearable helix", (clamped(), clamped(position, rotation)), (0.0, torsion), rod="flexible", energy=energy,
        load="t", constants={"t": 0.0, "k": curvature, "B2": 1.0, "C": C, "G": G},
        start=lambda s: classics.circle(curvature * s),
    )  # fmt: skip
    solver = Solver(scene, Discretization("reduced", 6, degree)).equilibria
    x = solver.start(0.0)
    for load in (0.0, 0.5, 1.0, 1.5, torsion):
        x, outcome = solver.at_load(x, load)
        if not outcome.converged:
            return inf
    state = solver.shape.sample(x)
    w, s = hypot(curvature, torsion), state["s"]
    turned = np.stack([np.cos(w * s / 2), 0 * s, np.sin(w * s / 2) * curvature / w, np.sin(w * s / 2) * torsion / w], 1)
    return float(abs(state["q"] - turned).max())


def locking(slenderness: float) -> Measured:
    """The error over that of a rod of slenderness 10."""
    return Measured(shearable_helix(slenderness) / shearable_helix(10.0), 2.0)


def arch(degree: int) -> Measured:
    """A clamped and hinged arch of 215 degrees: its first fold, 897 in DaDeppo & Schmidt's hundredths."""
    scene = classics.deep_arch()
    diagram = run(scene, Discretization("auto", 8, degree))
    folds = [s for s in singular(diagram[0])][:1]
    return compare(folds, [Change(8.973089969728, 0, 1)], said(diagram))


def arch_in_space(C: float) -> Measured:
    """Its index among all perturbations, while it bends in its plane: that of the same arch as a rod in space."""
    loads_of, mesh = (1.0, 3.0, 5.0, 7.0, 8.5), Discretization("pointwise", 8, 6)
    planar = classics.deep_arch()
    planar = replace(planar, parameters={**planar.parameters, "C": Parameter(C)}, span=(0.0, 9.0))
    flat, free = (run(scene, mesh, at=loads_of, error_bars=False) for scene in (planar, replace(planar, planar=None)))
    for load in loads_of:
        state = next(s.point for s in flat.special("user") if s.point.load == load)
        same = next((s.point for s in free.special("user") if s.point.load == load), None)
        if same is None or abs(same.ordinate - state.ordinate) > 1e-6 or same.negative != state.negative_in_space:
            return Measured(inf, 1.0, said(flat) + said(free), f"{state!r} in the plane, {same!r} in space")
    return Measured(0.0, 1.0, said(flat) + said(free))


def deployed_ring(B1: float) -> Measured:
    """A ring whose opposite cross-sections are turned about their radius: by 2 pi it is a ring a third as large.

    By 4 pi it is the first one again.  Half of it is computed, that is symmetric to the other half.
    """
    scene = Scene(
        "deployed ring", (0.0, pi), "unshearable and inextensible",
        lambda v, k, c: bending_and_twist((k[0], k[1] - 1.0, k[2]), (B1, 1.0, 1.5)), {"t": Parameter(0.0)}, "t",
        (clamped(), sliding(lambda c: (None, 0.0, 0.0), lambda c: (0.0, 0.0, ufl.cos(c.t / 2), ufl.sin(c.t / 2)))),
        Ordinate("distance of the opposite points", s=pi, of=lambda r, q: r[0]), (0.0, 4 * pi), start=classics.circle,
    )  # fmt: skip
    diagram = run(scene, Discretization("auto", 12, 6), at=(2 * pi,), error_bars=False)
    if [s.point.load for s in diagram[0].special] != [2 * pi, 4 * pi] or {p.negative for p in diagram[0].points} != {0}:
        return Measured(inf, 1.0, said(diagram), f"{diagram[0].special}")
    third, whole = (s.point for s in diagram[0].special)
    errors = third.ordinate - 2 / 3, third.energy / (2 * pi) - 1, whole.ordinate - 2, whole.energy
    return Measured(max(map(abs, errors)), 1e-9, said(diagram))
