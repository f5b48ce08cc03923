"""Pairs of special points that only a finer mesh has are announced; against closed forms and another mesh."""

from __future__ import annotations

from collections.abc import Sequence
from math import pi, sqrt
from typing import Any

import numpy as np
import pytest
import ufl
from classics import BRANCH_POINT, column
from hard.fuzz import wider

from rodfem import Diagram, Discretization, Plan, Scene, StepControl, clamped, free, trace
from rodfem.adaptivity.missed_points import dips
from rodfem.continuation.kinds import FOLD

pytestmark = pytest.mark.alone

COARSE, FINE = Discretization("reduced", 2, 3), Discretization("reduced", 8, 6)
EULER = pi**2 / 4
"""Critical thrust of a clamped-free column."""


def pushed_to(most: float, **given: Any) -> Scene:
    """A column whose thrust rises to a largest value at P = 1, and falls again."""
    ends = clamped(), free(lambda c: (0.0, 0.0, (c.P - 1.0) ** 2 - most))
    return column("there and back", ends, (0.0, 2.0), **given)


def said(diagram: Diagram, points: str) -> list[str]:
    """Announcements of missing points of a kind."""
    return [w for w in diagram.warnings if f"a pair of {points} may be missing there" in w]


def lost(diagram: Diagram) -> list[float]:
    """Loads of the branch points of the first branch."""
    return [s.point.load for s in diagram[0].special if s.kind == BRANCH_POINT]


@pytest.mark.long
@pytest.mark.parametrize("given", [{}, {"potential": lambda x, c: 1e6 * ufl.exp(6 * c.P) * x.q[3] ** 2}])
def test_branch_points_that_only_a_finer_mesh_has(given: dict[str, Any]) -> None:
    """Between the critical thrust and that of a coarse mesh, which is larger: two branch points, or none.

    A foundation against turning, which the column does not feel, changes determinants by orders of magnitude.
    """
    plan = Plan(depth=0, steps=StepControl(first=0.05, largest=0.1))
    coarse = lost(trace(pushed_to(EULER + 0.5, **given), COARSE, plan))
    of_mesh = EULER + 0.5 - (coarse[0] - 1.0) ** 2
    assert 1e-6 < of_mesh - EULER < 1e-1
    most = (EULER + of_mesh) / 2
    missing = trace(pushed_to(most, **given), COARSE, plan)
    assert lost(missing) == [] and len(said(missing, "branch points")) == 1
    whole = trace(pushed_to(most, **given), FINE, plan)
    assert lost(whole) == pytest.approx([1.0 - sqrt(most - EULER), 1.0 + sqrt(most - EULER)], abs=1e-6)
    assert said(whole, "branch points") == []
    # far from zero on both meshes
    assert said(trace(pushed_to(EULER - 0.1, **given), COARSE, plan), "branch points") == []


@pytest.mark.long
def test_folds_that_only_a_finer_mesh_has() -> None:
    """A soft ring with an element of 1e-4: the third of its branches has one fold on one mesh, three on another."""
    scene = wider.scene(13, 134)[0]
    few, many = (
        trace(scene, Discretization(how, *mesh), Plan(depth=1, most_branches=3))
        for how, mesh in (("auto", (10, 6)), ("pointwise", (14, 5)))
    )
    assert [sum(s.kind == FOLD for s in d.branches[2].special) for d in (few, many)] == [1, 3]
    assert len(said(few, "folds")) == 1 and said(many, "folds") == []


@pytest.mark.few(9)
@pytest.mark.parametrize(
    ("values", "places"),
    [
        ((3, 2, 1, 2, 3), [2]),
        ((-3, -2, -1, -2, -3), [2]),
        ((3, 1, -1, -3), []),
        ((1, 0.95, 1), []),
        ((3, 1, 0.95, 1, 3, 2, 1), [2]),
        ((3, 1, 1, 3), [1]),
        ((0, 1, 0.5, 2, 0), [2]),
        ((3, 2, np.inf, 2, 3), []),
        ((3, 1, 2, np.inf), [1]),
        ((1, 2), []),
    ],
)
def test_dips(values: Sequence[float], places: list[int]) -> None:
    assert dips(np.array(values, dtype=float)) == places
