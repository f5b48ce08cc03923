"""A state at which eigenvalues cannot be counted is no first state: the way down ends anywhere under a full thrust."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import ufl

from rodfem import Attachment, Discretization, Ordinate, Plan, Scene, hinged, sliding_hinge, trace
from rodfem.errors import ConvergenceError


def energy(v: Any, k: Any, c: Any) -> Any:
    """Grows so fast with the curvature that a state of huge curvature has a stiffness of 1e13."""
    strains = (k[0], k[1], k[2] - 0.433)
    quadratic = sum(B * x**2 for B, x in zip((1.037, 1.01, 2.74), strains, strict=True))
    return 0.5 * quadratic + 20 * (v[2] - 1) ** 2 + 0.707 * sum(ufl.cosh(0.7 * x) - 1 for x in strains)


@pytest.mark.alone  # with the factors of several ranks Newton's method ends elsewhere, at an equilibrium
@pytest.mark.parametrize(
    "mesh", [Discretization("auto", 5, 6), Discretization("pointwise", 7, 5), Discretization("pointwise", 10, 6)]
)
def test_the_first_state_is_to_blame_and_no_constraint(mesh: Discretization) -> None:
    """It was said that constraints depend on each other, of which the scene has none, or that a mesh is too fine."""
    guide = sliding_hinge((0.6, 0.0, 0.8), (0.6, 0.0, 0.8), lambda c: (0.0, 0.0, 1.0))
    rod = Scene(
        "cosh", (0.0, 1.0), "unshearable", energy, {"P": 0.0}, "P", (hinged((0.0, 1.0, 0.0)), guide),
        Ordinate("middle", 0.5, of=lambda r, q: float(np.hypot(r[0], r[1]))), (29.756, 0.0),
        attachments=(Attachment(0.6, force=lambda c: (0.0, 0.0, -c.P)),),
    )  # fmt: skip
    with pytest.raises(ConvergenceError, match=r"No equilibrium was found at P = 29\.756 from the scene"):
        trace(rod, mesh, Plan(depth=0))
