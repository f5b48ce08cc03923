"""Potential energies and what loads do work on: closed forms, the work of the load from row to row, and folds."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from classics import bow, euler
from golden_cases import cases
from rows import regular
from scipy.integrate import quad
from scipy.interpolate import CubicSpline

from rodfem import Branch, Discretization, Ordinate, Plan, Point, Solver, StepControl, trace
from rodfem.continuation.kinds import FOLD

WITH_FOLDS = [
    *("demo hemitropic", "demo ring", "docs hinge"),
    *("classic foundation", "classic tip spring", "classic pressed arch"),
]
MESHES = [Discretization("auto", 8, 6), Discretization("auto", 24, 1)]


def rows(branch: Branch) -> list[Point]:
    """Rows that the branch has been followed by, without the state that it leaves."""
    return regular(branch)[1 if branch.parent else 0 :]


@pytest.mark.ranks
@pytest.mark.few(1)
@pytest.mark.parametrize("mesh", MESHES)
def test_conjugate_of_a_distance_is_the_thrust(mesh: Discretization) -> None:
    """Clamps that come nearer by ``d``: ``V = W``, and ``dV/dd`` is the thrust, Castigliano's theorem."""
    solver = Solver(bow(), mesh)
    point = solver.equilibrium(0.2)
    thrust = solver.equilibria.system.scalar(point.x, "g1")
    assert point.potential == pytest.approx(point.energy, rel=1e-12)
    assert abs(point.conjugate) == pytest.approx(abs(thrust), rel=1e-10)


@pytest.mark.few(1)
@pytest.mark.parametrize("mesh", MESHES)
def test_dead_load_does_work_on_its_point(mesh: Discretization) -> None:
    """A column pushed down its axis by ``P``: ``V = W + P r3`` and ``c = -r3`` at its tip."""
    height = Ordinate("height of the tip", s=1.0, of=lambda r, q: float(r[2]))
    scene = replace(euler("clamped-free"), ordinate=height, span=(0.0, 10.0))
    bent = rows(trace(scene, mesh, Plan(depth=1, error_bars=False)).branches[1])
    assert bent[-1].ordinate < 0.5
    for point in bent:
        assert point.conjugate == pytest.approx(-point.ordinate, abs=1e-12)
        assert point.potential == pytest.approx(point.energy + point.load * point.ordinate, abs=1e-11)


@pytest.mark.few(1)
@pytest.mark.parametrize("name", WITH_FOLDS)
def test_stability_is_exchanged_at_folds_as_their_side_says(name: str) -> None:
    """The eigenvalue that vanishes at a fold changes by ``lam'' c'`` (Maddocks 1987).

    ``L_xx x' + lam' L_xlam = 0`` at all states.  Its derivative where ``lam' = 0``, along the null vector ``x'``, is
    ``x'.L_xxx x' x' = -lam'' x'.L_xlam``: the change of the eigenvalue, with ``c' = -L_xlam.x'``.
    """
    scene, folds = cases()[name](), 0
    mesh = Discretization("auto", 8 if scene.start is None else 16, 6)
    for branch in trace(scene, mesh, Plan(depth=1, error_bars=False)).branches:
        own = rows(branch)
        for special in (s for s in branch.special if s.kind == FOLD):
            a = max((p for p in own if p.arclength < special.point.arclength), key=lambda p: p.arclength)
            b = min((p for p in own if p.arclength > special.point.arclength), key=lambda p: p.arclength)
            turns = np.sign(b.slope - a.slope) * np.sign(b.conjugate - a.conjugate)
            assert special.negative_after - special.negative_before == -turns, special
            folds += 1
    assert folds


@pytest.mark.few(1)
@pytest.mark.parametrize("steps", [StepControl(), StepControl(largest=0.2, aim=1e-2)], ids=["short", "long"])
@pytest.mark.parametrize("mesh", MESHES, ids=["8 P6", "24 P1"])
def test_energy_changes_by_the_work_of_the_load(mesh: Discretization, steps: StepControl) -> None:
    """``V_b - V_a = -int c dlam``, with ``c`` and ``lam`` cubic splines of the arclength: on linear elements, too."""
    diagram = trace(cases()["demo hemitropic"](), mesh, Plan(depth=1, error_bars=False, steps=steps))
    for own in map(rows, diagram.branches):
        s, potential = np.array([p.arclength for p in own]), np.array([p.potential for p in own])
        load, conjugate = (CubicSpline(s, [getattr(p, name) for p in own]) for name in ("load", "conjugate"))
        work = [quad(lambda t, c=conjugate, f=load: float(c(t) * f(t, 1)), a, b)[0] for a, b in pairwise(s)]
        assert np.cumsum(work) == pytest.approx(potential[0] - potential[1:], abs=1e-2 * steps.largest**2)
