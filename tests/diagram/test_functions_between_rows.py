"""What functions of a scene do between rows, at other parameters, or at some states alone: found, or said."""

from math import pi, sqrt
from typing import Any

import numpy as np
import pytest
import ufl
from classics import column

from rodfem import Diagram, Discretization, Plan, Scene, clamped, free, trace
from rodfem.forms.energy import bending_and_twist

MESH = Discretization("auto", 4, 6)
EULER = pi**2 / 4


def cantilever(
    energy: Any, thrust: Any = lambda c: EULER / 2, span: tuple[float, float] = (0.0, 4.0), **given: Any
) -> Scene:
    ends = clamped(), free(lambda c: (0.0, 0.0, -thrust(c)))
    return column("cantilever", ends, span, energy=energy, **given)


def branch_points(diagram: Diagram) -> list[float]:
    return [s.point.load for s in diagram.special("branch point")]


@pytest.mark.few(1)
@pytest.mark.parametrize(
    ("above", "other", "power"), [(1e-4, 2.0, 1), (1e-6, 1.0, 3), pytest.param(1e-2, 9.0, 1, marks=pytest.mark.long)]
)
def test_a_pair_where_stiffness_and_thrust_both_grow(above: float, other: float, power: int) -> None:
    """Stiffness ``((1 + P^2)/2)^n``, thrust ``P^n (1 + a)`` of Euler's: unstable where ``2 P (1 + a)^(1/n) > 1 + P^2``.

    Determinants of all modes grew a hundredfold from row to row, which hid the one that comes and goes: "stable".
    """
    growth = (1 + above) ** (1 / power)
    rod = cantilever(
        lambda v, k, c: ((1 + c.P**2) / 2) ** power * bending_and_twist(k, (1.0, other, 1.0)),
        lambda c: EULER * (1 + above) * c.P**power,
        (0.25, 2.3),
    )
    diagram = trace(rod, MESH, Plan(depth=0, error_bars=False))
    half = sqrt(growth**2 - 1)
    np.testing.assert_allclose(branch_points(diagram), [growth - half, growth + half], rtol=0, atol=1e-9)
    assert not diagram.warnings


@pytest.mark.long
def test_a_dent_of_the_energy_beyond_small_strains() -> None:
    """``W'' = 1 + (4 t^2 - 2) exp(-t^2)``, ``t = (v3 - 1.3712)/0.05``: quadratic near zero."""
    rod = column(
        "dented", (clamped(), free(lambda c: (0.0, 0.0, c.P))), (0.0, 1.0), rod="unshearable",
        energy=lambda v, k, c: bending_and_twist(k, (50.0, 50.0, 1.0)) + 0.5 * (v[2] - 1) ** 2
        + 0.05**2 * ufl.exp(-(((v[2] - 1.3712) / 0.05) ** 2)),
    )  # fmt: skip
    (branch,) = trace(rod, MESH, Plan(depth=0, error_bars=False))
    assert branch.ended.startswith("the stored energy is not convex any more at P = 0.38")
    assert {point.negative for point in branch.points} == {0}
