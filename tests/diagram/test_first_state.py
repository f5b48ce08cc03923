"""First states from a start that is no equilibrium: one on all meshes, and none at which nothing can be counted."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import ufl
from classics import circle

from rodfem import Attachment, Discretization, Ordinate, Plan, Ring, Scene, Solver, hinged, sliding_hinge, trace


def energy(v: Any, k: Any, c: Any) -> Any:
    """Grows so fast with the curvature that a state of huge curvature has a stiffness of 1e13."""
    strains = (k[0], k[1], k[2] - 0.433)
    quadratic = sum(B * x**2 for B, x in zip((1.037, 1.01, 2.74), strains, strict=True))
    return 0.5 * quadratic + 20 * (v[2] - 1) ** 2 + 0.707 * sum(ufl.cosh(0.7 * x) - 1 for x in strains)


@pytest.mark.long
@pytest.mark.alone
def test_all_meshes_find_one_first_state() -> None:
    """The stiffness of a state far away was that of all others, and none was found: constraints were blamed.

    On the way back to no load the rod passes two folds.
    """
    guide = sliding_hinge((0.6, 0.0, 0.8), (0.6, 0.0, 0.8), lambda c: (0.0, 0.0, 1.0))
    rod = Scene(
        "cosh", (0.0, 1.0), "unshearable", energy, {"P": 0.0}, "P", (hinged((0.0, 1.0, 0.0)), guide),
        Ordinate("middle", 0.5, of=lambda r, q: float(np.hypot(r[0], r[1]))), (29.756, 0.0),
        attachments=(Attachment(0.6, force=lambda c: (0.0, 0.0, -c.P)),),
    )  # fmt: skip
    meshes = Discretization("auto", 5, 6), Discretization("pointwise", 7, 5), Discretization("pointwise", 10, 6)
    found = [trace(rod, mesh, Plan(depth=0))[0] for mesh in meshes]
    assert [branch.points[0].stable for branch in found] == [True] * 3
    assert [branch.points[0].ordinate for branch in found] == pytest.approx(
        [found[-1].points[0].ordinate] * 3, rel=1e-6
    )
    folds = [[s for s in branch.special if s.kind == "fold"] for branch in found]
    for first, other in ((folds[-1], folds[0]), (folds[-1], folds[1])):
        assert len(first) == len(other) == 2
        for a, b in zip(first, other, strict=True):
            assert abs(a.point.load - b.point.load) <= a.error_estimate + b.error_estimate


@pytest.mark.long
def test_of_two_equilibria_the_one_beside_the_start() -> None:
    """A tapered ring under dead loads inwards is 0.17 from the circle, and unstable: turned by pi it is stretched.

    Newton's method without forces led there, on the meshes of 7 and 10 elements.
    """

    def stiff(v: Any, k: Any, c: Any) -> Any:
        return (1 - 0.15 * c.s) * (1.335 * (k[0] ** 2 + k[1] ** 2) + 1.1 * k[2] ** 2 + 20 * (v[2] - 1) ** 2)

    ring = Scene(
        "tapered ring", (0.0, 2 * np.pi), "unshearable", stiff, {"P": 0.2}, "P", Ring(),
        Ordinate("bending", None, of=lambda x, c: x.k[0] ** 2 + x.k[1] ** 2), (0.2, 5.0), planar="e2", start=circle,
        distributed=lambda c: (c.P * ufl.cos(c.s), 0.0, -c.P * ufl.sin(c.s)),
    )  # fmt: skip
    found = [Solver(ring, Discretization("auto", elements, 5)).equilibrium(0.2) for elements in (7, 8, 10, 14)]
    assert [point.negative for point in found] == [1] * 4
    assert [point.ordinate for point in found] == pytest.approx([found[-1].ordinate] * 4, rel=1e-3)
