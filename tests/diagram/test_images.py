"""Images of branches by symmetries: the other side of a symmetric pitchfork, and none where the scene has none."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from problem.test_docs import scenes

import rodfem
from rodfem.deflation.symmetries import Mirror
from rodfem.diagram.diagram import trace
from rodfem.diagram.plan import Plan
from rodfem.fem.fields import Discretization
from rodfem.output.plot_diagram import figure_of
from rodfem.problem.scene import Ordinate, Scene

pytestmark = pytest.mark.alone
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
    image, rest = Mirror((-1, 1, 1), reversal=False)(solver.system, point.x), solver.system.new_vector()
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
