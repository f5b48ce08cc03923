"""Hard cases of the literature, each against its closed form or its published value.

Rings on springs that repeat n times around have multiple branch points by the symmetry of a regular n-gon.

The circle of radius and bending stiffness one is held by springs ``k0 + k1 cos(n s)`` to where its points were.  It
does not stretch: displacements inward ``w`` and along the ring ``u`` have ``u' = w``, and the second variation under
the pressure P is

    int (w'' + w)^2 - P (w'^2 - w^2) + (k0 + k1 cos(n s)) (w^2 + u^2) ds.

The recorded loads are those of a symmetric matrix of 81 Fourier coefficients, which converge exponentially.  By the
group of the n-gon a mode of m waves is double, unless 2 m is a multiple of n.
"""

from dataclasses import replace
from math import inf, pi, sqrt
from typing import Any

import classics
import closed_forms
import demo_cases
import numpy as np
import ufl
from classics import SUPPORTS, column
from hard.case import Change, Measured, check, compare, reference, run, said, singular
from literature.test_classics import CRITICAL

from rodfem import Discretization, Ordinate, Parameter, Ring, Scene, Solver, clamped, sliding
from rodfem.forms import loads
from rodfem.forms.energy import bending_and_twist

# --- critical loads with closed forms ---------------------------------------------------------------------------------

TWELVE_DIGITS = {"lateral", "tip on a plane"}
"""Problems of which the record has a value to twelve digits only."""
PROBLEMS = tuple(name for name in CRITICAL if name not in TWELVE_DIGITS)
MESHES = ((3, 6), (5, 6), (8, 6))
"""Elements and degree, the same of all, so that forms are compiled once.

There are twice as many elements of rods that are bent, or twist, from the start.
"""


def changes(name: str) -> list[Change]:
    """Critical loads of a problem, with the index on either side."""
    _, _, modes, loads = CRITICAL[name]
    return [Change(load, i * modes, (i + 1) * modes) for i, load in enumerate(loads)]


def critical(name: str) -> Measured:
    """All critical loads of a problem with the index on either side, on all meshes and formulations."""
    scene, formulations, *_ = CRITICAL[name]
    more = 2 if "ring" in name or name == "michell" else 1
    found = []
    for formulation in formulations:
        for elements, degree in MESHES:
            diagram = run(scene(), Discretization(formulation, more * elements, degree))
            found.append(compare(singular(diagram[0]), changes(name), said(diagram)))
    worst = max(found, key=lambda one: one.error)
    return Measured(worst.error, 1.0, worst.said, worst.wrong, tuple(r for one in found for r in one.ratios))


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
    rod = classics.shearable("flexible", 1 / SHEAR, 1.0)
    constants = {"P": Parameter(0.4)} | {name: Parameter(B) for name in ("B1", "B2", "C")}
    scene = replace(rod, ends=SUPPORTS[supports], span=(0.4, 0.95), planar="e2", parameters=rod.parameters | constants)
    discriminant = 1 - 4 * (1 - SHEAR) * B * waves**2
    expected = []
    if discriminant > 0:
        low, high = ((1 + sign * sqrt(discriminant)) / (2 * (1 - SHEAR)) for sign in (-1, 1))
        expected = [Change(x, i, 1 - i) for i, x in enumerate((low, high)) if 0.4 < x < 0.95]
    return check(expected, scene)


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
    return check(expected, pressed(kind, (0.3, expected[-1].load + 1.0)), Discretization("pointwise", 16, 6))


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


def shearable_helix(slenderness: float) -> float:
    """Error of the rotation of a rod that a wrench at its end bends to a helix, of that ``slenderness``."""
    G, torsion, curvature = slenderness**2, 2.0, 3.0

    def strains(c: Any) -> tuple[Any, ...]:
        return c.t * (c.C - 1) * c.k / c.G, 1 + c.t * (c.C - 1) * c.t / c.G

    def energy(v: Any, k: Any, c: Any) -> Any:
        return 0.5 * c.G * (v[0] ** 2 + v[1] ** 2 + (v[2] - 1) ** 2) + bending_and_twist(k, (c.B1, c.B2, c.C))

    scene = classics.helix(curvature, torsion, strains, rod="flexible", energy=energy, constants={"G": G})
    solver = Solver(scene, Discretization("reduced", 6, 4)).equilibria
    x = solver.start(0.0)
    for load in (0.0, 0.5, 1.0, 1.5, torsion):
        x, outcome = solver.at_load(x, load)
        if not outcome.converged:
            return inf
    state = solver.shape.sample(x)
    return float(abs(state["q"] - classics.helix_directors(state["s"], curvature, torsion)).max())


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


# --- rings on springs -------------------------------------------------------------------------------------------------

MOST = 14.0
"""Greatest pressure."""
MEAN, COINCIDENT, MODULATION = 18.0, 17.987962206622775, 6.0
"""Stiffness at which two waves and three buckle at one pressure if it does not vary, and for n = 7; its amplitude."""


def springy_ring(n: int) -> Measured:
    """All critical pressures below 14 with their multiplicities; n = 0: springs that do not vary."""

    def potential(x: Any, c: Any) -> Any:
        away = x.r - ufl.as_vector((1 - ufl.cos(c.s), 0.0, ufl.sin(c.s)))
        springs = (c.k + c.k1 * ufl.cos(c.n * c.s)) / 2 * ufl.dot(away, away)
        return loads.pressure(x.r, x.dr, c.P) + springs

    springs = {"k": COINCIDENT if n == 7 else MEAN, "k1": MODULATION if n else 0.0, "n": float(n)}
    scene = column(
        "springy ring", Ring(), (8.0, MOST), start=classics.circle, planar="e2", potential=potential,
        constants={"P": 8.0, "B2": 1.0} | springs, **classics.ROUND,
    )  # fmt: skip
    return check(reference("springs", n), scene, Discretization("pointwise", 10, 6))
