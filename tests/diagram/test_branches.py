"""Branches that close, and that have an image by a symmetry."""

from dataclasses import replace
from math import pi, sqrt
from typing import Any

import classics
import numpy as np
import pytest
from classics import column
from problem.test_docs import scenes

import rodfem
from rodfem import Discretization, End, Ordinate, Plan, Ring, Scene, StepControl, clamped, trace
from rodfem.deflation.symmetries import Mirror
from rodfem.output.plot_diagram import figure_of


@pytest.mark.long
def test_two_states_of_a_twisted_ring_are_joined_at_any_step() -> None:
    """Michell: rings twisted by none and by two turns lose stability where ``C |twist - t0| = sqrt 3``, both found.

    At the second one the branch meets states with one more free motion, along which Newton's method slides away.
    """
    twist = Ordinate("twist", s=None, of=lambda x, c: x.k[2] / (2 * pi))
    ring = replace(classics.ring(), span=(0.0, 1.5), ends=Ring(), ordinate=twist)
    plan = Plan(depth=1, error_bars=False, steps=StepControl(largest=0.025))
    diagram = trace(ring, Discretization(elements=8, degree=6), plan)
    first, last = diagram["ring"].special[0], diagram["branch 1"].special[-1]
    assert first.point.load == pytest.approx(2 / sqrt(3), abs=1e-8)
    assert last.point.load == pytest.approx(2 - 2 / sqrt(3), abs=1e-8)
    assert last.point.ordinate == pytest.approx(2.0, abs=1e-9)
    assert diagram["branch 1"].ended.startswith("meets another branch")
    assert not diagram.warnings


PLANAR = replace(
    scenes()["in_plane"],
    ends=(rodfem.clamped(), rodfem.free(lambda c: (0.0, 0.0, -c.P))),
    ordinate=Ordinate("tip deflection", s=1.0, of=lambda r, q: r[0]),
)
"""Euler's cantilever in its plane: it buckles to either side at pi^2/4 times its stiffness."""


def branches(scene: Scene) -> Any:
    return trace(scene, Discretization("auto", 4, 4), Plan((0.0, 40.0), depth=1, error_bars=False))


@pytest.mark.long
def test_the_other_side_of_a_pitchfork(folder: Any) -> None:
    found = branches(PLANAR)
    straight, buckled = found[0], found[1]
    assert straight.image == "" and "reflection along e1" in buckled.image
    found.save(folder)
    assert rodfem.load(folder, PLANAR)[1].image == buckled.image
    data = rodfem.load_json(folder / "diagram.json")
    axes = figure_of(data).axes[0]
    thin = [line for line in axes.lines if line.get_linewidth() < 1.0]
    assert thin and axes.get_ylim()[0] < -0.5 and axes.get_ylim()[1] > 0.5
    (words,) = (t.get_text() for t in axes.get_legend().get_texts() if t.get_text().startswith("image, not traced"))
    assert words.endswith(buckled.image)
    solver, point = found.solvers[0], buckled.points[-1]  # the image is an equilibrium, and not the same one
    image, rest = Mirror((-1, 1, 1), reversal=False)(solver.shape, point.x), solver.system.new_vector()
    solver.system.at(image).residual(rest)
    assert rest.norm() < 1e-9 and solver.shape.ordinate(image) == pytest.approx(-point.ordinate, rel=1e-9)


@pytest.mark.long
def test_no_image_without_a_symmetry() -> None:
    """A lateral force, however small, prefers a side; of an ordinate of one sign the image is the branch itself."""
    push = rodfem.free(lambda c: (1e-3, 0.0, -c.P))
    bent = branches(replace(PLANAR, ends=(rodfem.clamped(), push)))
    assert all(branch.image == "" for branch in bent) and max(abs(p.ordinate) for p in bent[0].points) > 0.3
    held = replace(scenes()["untwistable"], ordinate=Ordinate("deflection", s=0.5, of=lambda r, q: r[0]))
    found = trace(held, Discretization("auto", 4, 4), Plan((0.0, 12.0), depth=1, error_bars=False))
    assert all(branch.image == "" for branch in found)  # multipliers along the rod have signs that nobody knows
    absolute = replace(PLANAR, ordinate=Ordinate("size", s=1.0, of=lambda r, q: np.hypot(r[0], r[1])))
    assert all(branch.image == "" for branch in branches(absolute))


@pytest.mark.parametrize("n", [3, 4])
def test_branches_by_the_symmetry_of_a_polygon_are_counted(n: int) -> None:
    """A round column on a spring of the group D_n at its tip: 2 n half branches, of two kinds."""
    tip = {3: lambda x: x[0] ** 3 - 3 * x[0] * x[1] ** 2, 4: lambda x: x[0] ** 4 + x[1] ** 4}[n]
    ends = clamped(), End(force=lambda c: (0.0, 0.0, -c.P), energy=lambda u, c: tip(u.r))
    rod = column("polygon", ends, (2.0, 3.0), constants={"B2": 1.0})
    diagram = trace(rod, Discretization("auto", 4, 4), Plan(depth=1))
    (said,) = diagram.notes
    assert f"{2 * n} branches leave straight at 2.4674" in said and f"{2 * n - 2} are images of the others" in said
    assert len(diagram.branches) == 3
