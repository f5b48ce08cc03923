"""What a rod's inertia is where a scene states a part of it."""

from __future__ import annotations

from math import pi, sqrt

import pytest

from rodfem import Discretization, Inertia, Ordinate, Scene, Solver, clamped, free
from rodfem.forms.energy import bending_and_twist

pytestmark = pytest.mark.alone

SLENDER, STOUT = 3.516015268, 0.1
"""Lowest frequency of a cantilever of unit length, mass and stiffness; a rotary inertia."""


def cantilever(inertia: Inertia, **more: object) -> Scene:
    return Scene(
        **{
            "name": "cantilever",
            "interval": (0.0, 1.0),
            "rod": "unshearable and inextensible",
            "energy": lambda v, k, c: bending_and_twist(k, (1.0, 4.0, 1.0)),
            "parameters": {"P": 0.0},
            "load": "P",
            "ends": (clamped(), free(force=lambda c: (0.0, 0.0, -c.P))),
            "ordinate": Ordinate("tip", s=1.0, of=lambda r, q: r[0]),
            "span": (0.0, 1.0),
            "inertia": inertia,
        }
        | more
    )  # type: ignore[arg-type]


def lowest(scene: Scene) -> float:
    solver = Solver(scene, Discretization(elements=4))
    return sqrt(solver.modes(solver.equilibrium(0.0), 1).value[0].real)


@pytest.mark.long
@pytest.mark.short
def test_a_mass_alone_is_that_of_a_slender_rod() -> None:
    """Its frequency is that of the textbook; of torsion, with a rotary inertia about d3 alone, pi/2 over its root."""
    assert lowest(cantilever(Inertia(rho_A=lambda c: 1.0))) == pytest.approx(SLENDER, rel=1e-6)
    both = Inertia(rho_A=lambda c: 1.0, rho_I=lambda c: (0.0, 0.0, 1.0))
    assert lowest(cantilever(both)) == pytest.approx(pi / 2, rel=1e-6)
