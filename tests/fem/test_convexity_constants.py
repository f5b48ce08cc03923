"""Second derivatives of the stored energy where a number of it vanishes in them: the others keep their places."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from rodfem import Discretization, Ordinate, Scene, Solver, clamped, free
from rodfem.errors import SceneError
from rodfem.problem.scene import Parameter


def by_number(v: Any, k: Any, c: Any) -> Any:
    return (k[0] ** 2 + 1.3 * (k[1] - 0.3) ** 2 + 1.5 * k[2] ** 2) / 2 + 0.1 * k[0] ** 4


def by_parameter(v: Any, k: Any, c: Any) -> Any:
    return (k[0] ** 2 + 1.3 * (k[1] - c.n) ** 2 + 1.5 * k[2] ** 2) / 2 + 0.1 * k[0] ** 4


def linear(v: Any, k: Any, c: Any) -> Any:
    return 5.1 * k[2] + (k[0] ** 2 + 1.3 * k[1] ** 2 + 1.5 * k[2] ** 2) / 2 + 0.1 * k[0] ** 4


def rod(energy: Any) -> Scene:
    return Scene(
        "rod", (0.0, 1.0), "unshearable and inextensible", energy, {"p": Parameter(0.0), "n": Parameter(0.3)}, "p",
        (clamped(), free(lambda c: (c.p, 0.0, 0.0))), Ordinate("tip", s=1.0, of=lambda r, q: r[0]), (0.0, 12.0),
    )  # fmt: skip


@pytest.mark.long
@pytest.mark.parametrize("energy", [by_number, by_parameter, linear])
def test_a_number_that_vanishes_shifts_no_other(energy: Any) -> None:
    """diag(1, -0.3, 1.5) was computed for diag(1, 1.3, 1.5)."""
    solver = Solver(rod(energy), Discretization(elements=2, degree=3)).equilibria
    convexity = solver.convexity
    assert convexity is not None
    matrices = convexity._matrices(solver.start(0.0))  # the straight rod
    np.testing.assert_allclose(matrices, np.broadcast_to(np.diag([1.0, 1.3, 1.5]), matrices.shape), atol=1e-12)


@pytest.mark.long
@pytest.mark.parametrize(
    "order", [(0, 1, 2), *(pytest.param(x, marks=pytest.mark.alone) for x in [(2, 0, 1), (1, 2, 0)])]
)
def test_the_order_of_terms_does_not_matter(order: tuple[int, ...]) -> None:
    """Not convex where ``k1^2 > 1.875``, ahead of a clamp that is pushed aside by 12."""

    def energy(v: Any, k: Any, c: Any) -> Any:
        terms = (
            (1.3 * (k[1] - c.n) ** 2 + k[0] ** 2) / 2,
            (1.5 - 0.8 * k[1] ** 2) * k[2] ** 2 / 2,
            0.35 * k[1] ** 4,
        )
        return sum(terms[i] for i in order)

    solver = Solver(rod(energy), Discretization(elements=4, degree=4))
    solver.equilibrium(0.5)
    with pytest.raises(SceneError, match="not convex somewhere along the state at p = 12"):
        solver.equilibrium(12.0)
