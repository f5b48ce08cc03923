"""Laws of docs/theory/special-points.md on rods: eigenvalues on both sides of an exchange of stability."""

from math import pi

import classics
import hemitropic_cases
import pytest

import rodfem
from rodfem import Discretization, Plan, Scene

MESH = Discretization("reduced", 8, 6)


def lowest(scene: Scene, span: tuple[float, float], load: float, number: int) -> dict[str, list[float]]:
    """Left-most eigenvalues, symmetry modes not included, of the equilibria at a load, by their branch."""
    diagram = rodfem.trace(scene, MESH, Plan(span, at=(load,), depth=1, error_bars=False))
    points = {b.name: s.point for b in diagram.branches for s in b.special if s.kind == "user"}
    return {name: [float(x) for x in diagram.assess(p, number=number).values] for name, p in points.items()}


def test_eigenvalue_of_a_pitchfork_is_minus_twice_that_of_the_straight_column() -> None:
    found = lowest(classics.elastica(2.6), (0.0, 2.6), 1.0001 * pi**2 / 4, 1)
    assert found["branch 1"][0] == pytest.approx(-2 * found["straight"][0], rel=1e-3)


def test_two_eigenvalues_of_a_circle_of_states_become_a_symmetry_and_a_radial_one() -> None:
    """The straight hemitropic rod has a double eigenvalue; on the circle one is zero, the other minus twice that."""
    found = lowest(hemitropic_cases.scene(), (0.0, 0.13), 0.1143042 * 1.0002, 2)
    first, second = found["straight"]
    assert second == pytest.approx(first, rel=1e-8)
    assert found["branch 1"][0] == pytest.approx(-2 * first, rel=2e-3)
