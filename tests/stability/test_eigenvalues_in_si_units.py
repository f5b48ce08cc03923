"""Frequencies of rods in metres, newtons and kilograms: those of the closed form, by every method."""

import classics
import numpy as np
import pytest

from rodfem import Discretization, Inertia, Ordinate, Scene, Solver, free, hinged
from rodfem.forms.energy import bending_and_twist

pytestmark = pytest.mark.ranks

UNITS = [(1e4, 1e9, 1e3), (100.0, 1e7, 100.0), (300.0, 1e14, 3e5), (100.0, 1.0, 1.0), (1e-8, 2e-28, 1e-18)]
"""Length, bending stiffness and mass per length."""
ANY_UNITS = pytest.mark.parametrize(
    "units", [UNITS[-1], *(pytest.param(units, marks=pytest.mark.alone) for units in UNITS[:-1])]
)
LOADS = [
    (0.0, 0, (12.362363368326204, 485.5188185133718)),
    (2.3, 0, (0.905033145902847, 410.65889829895076)),
    (4.0, 1, (-8.885289715935146, 355.18086574705575)),
]
"""Thrusts in units of stiffness over squared length, the index, and zeros of the frequency equation of a dead load."""
METHODS = ["auto", "shift-invert", "slicing", "reduction", "cayley", "dense"]


def cantilever(length: float, stiffness: float, mass: float) -> Scene:
    """Twenty times stiffer in the other plane, whose frequencies are among neither of the first two here."""
    return classics.column(
        "cantilever", classics.SUPPORTS["clamped-free"], (0.0, 5.0 * stiffness / length**2), interval=(0.0, length),
        energy=lambda v, k, c: bending_and_twist(k, (stiffness, 1e3 * stiffness, stiffness)),
        ordinate=Ordinate("tip", s=length, of=lambda r, q: r[0]), inertia=Inertia(rho_A=lambda c: mass),
    )  # fmt: skip


@pytest.mark.long
@ANY_UNITS
def test_each_method_finds_those_of_a_cantilever_under_thrust(units: tuple[float, float, float]) -> None:
    length, stiffness, mass = units
    of_force, of_value = stiffness / length**2, stiffness / (mass * length**4)
    solver = Solver(cantilever(*units), Discretization("pointwise", 5, 7))
    for thrust, index, exact in LOADS:
        point = solver.equilibrium(thrust * of_force)
        for method in METHODS:
            found = solver.assess(point, method, 2)
            assert found.negative == index
            np.testing.assert_allclose(found.values / of_value, exact, rtol=1e-8, err_msg=method)
            assert found.certified, method
        modes = solver.modes(point, 2)
        assert (abs(modes.value / of_value - exact) <= modes.error / of_value).all()
        assert (modes.error < 1e-5 * abs(modes.value)).all()


@pytest.mark.few(1)
@ANY_UNITS
def test_a_rod_that_turns_about_a_hinge(units: tuple[float, float, float]) -> None:
    """Its free rotation left out, ``tan b = tanh b``: a rotation with a mass of its own, whatever the units."""
    length, stiffness, mass = units
    rod = classics.column(
        "hinged", (hinged((0.0, 1.0, 0.0)), free(follower=classics.push)), (0.0, stiffness / length**2), planar="e2",
        interval=(0.0, length), energy=lambda v, k, c: bending_and_twist(k, (1e3 * stiffness, stiffness, stiffness)),
        ordinate=Ordinate("tip", s=length, of=lambda r, q: r[0]), inertia=Inertia(rho_A=lambda c: mass),
    )  # fmt: skip
    solver = Solver(rod, Discretization("pointwise", 5, 7))
    point = solver.equilibrium(0.0)
    exact = np.array([3.926602312047919, 7.068582745628732]) ** 4 * stiffness / (mass * length**4)
    for method in ("auto", "shift-invert", "reduction", "dense"):
        np.testing.assert_allclose(solver.assess(point, method, 2).values, exact, rtol=1e-7, err_msg=method)
