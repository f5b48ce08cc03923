"""A diagram does not depend on the units in which its scene is stated."""

from __future__ import annotations

import numpy as np
import pytest

import rodfem
from forms.energy import bending_and_twist
from rodfem import Discretization, Ordinate, Plan, Scene, clamped, free
from rodfem.problem.local_state import Constants

MESH = Discretization(elements=4, degree=5)


def column(length: float, stiffness: float, rod: str) -> Scene:
    """Column of lengths and stiffnesses in some units, up to ten times its natural load."""

    def energy(v, k, c: Constants):
        out = bending_and_twist(k, (c.EI, 1.3 * c.EI, 0.8 * c.EI))
        if rod == "flexible":
            out += 0.5e4 * c.EI / length**2 * (v[0] ** 2 + v[1] ** 2 + 2 * (v[2] - 1) ** 2)
        return out

    return Scene(
        name="column",
        interval=(0.0, length),
        rod=rod,
        energy=energy,
        parameters={"P": 0.0, "EI": stiffness},
        load="P",
        ends=(clamped(), free(force=lambda c: (0.0, 0.0, -c.P))),
        ordinate=Ordinate("tip", s=length, of=lambda r, q: r[0] ** 2 + r[1] ** 2),
        span=(0.0, 10 * stiffness / length**2),
    )


@pytest.mark.parametrize("rod", ["unshearable and inextensible", "flexible"])
@pytest.mark.parametrize(
    ("length", "stiffness"),
    [(1.0, 1e6), (1e-3, 1.0), (1e4, 1e9), (1e-4, 1e-8), (1.0, 1e-9)],
    ids=["steel bar", "wire, m", "pipeline, SI", "fibre, SI", "thread"],
)
def test_dimensionless_diagram(length: float, stiffness: float, rod: str) -> None:
    """Loads, ordinates and indices of all rows in units of the rod are those of the rod of unit length and stiffness.

    Of a column whose loads are of order 1e6 no buckling was found: the weight of the load in the metric, one over the
    square of the span, was taken for the smallest mass of a perturbation.
    """
    one, other = (rodfem.trace(column(*units, rod), MESH, Plan(depth=1)) for units in ((1.0, 1.0), (length, stiffness)))
    assert [[(str(s.kind), s.negative_before, s.negative_after) for s in b.special] for b in one] == [
        [(str(s.kind), s.negative_before, s.negative_after) for s in b.special] for b in other
    ]
    assert not other.warnings
    load, area = stiffness / length**2, length**2
    for a, b in zip(one, other, strict=True):
        assert [p.negative for p in a.points] == [p.negative for p in b.points]
        found = np.array([(s.point.load / load, s.point.ordinate / area) for s in b.special])
        np.testing.assert_allclose(found, [(s.point.load, s.point.ordinate) for s in a.special], rtol=1e-9, atol=1e-10)
