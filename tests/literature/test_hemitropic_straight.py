"""Where the straight rod buckles: loads, indices and rates of convergence against the closed form."""

from itertools import pairwise

import closed_form_hemitropic
import numpy as np
import pytest
from hemitropic_cases import DEFAULT, Constants, explored, specials

from rodfem.continuation.branch import SpecialPoint

REFERENCE: dict[Constants, list[float]] = {
    DEFAULT: [0.114304214520030, 0.332039079723330],
    (-2.0, 1.0, 1.0, 3.0): [0.119809689488270151, 0.353956736666130556, 0.7802741251197446],
    (0.0, 1.0, 1.0, 3.0): [0.125383223978443667, 0.339817068339789501, 0.660182931660210499, 0.874616776021556333],
    (-3.0, 1.0, 1.0, 4.0): [0.0630449842683115703, 0.151779941281791052, 0.306992986989438319],
    (-3.0, 1.0, 2.0, 3.0): [0.268561103653612743],
    (-3.0, 1.5, 1.0, 2.0): [0.276922081872403693],
}
"""Roots of the closed form in (0, 0.95), computed apart with 30 digits."""


def buckling_points(formulation: str, elements: int, degree: int, constants: Constants = DEFAULT) -> list[SpecialPoint]:
    straight = explored(formulation, elements, degree, constants, depth=0)[0]
    return specials(straight, "branch point")


@pytest.mark.ranks
@pytest.mark.few(1)
@pytest.mark.versions
@pytest.mark.parametrize("formulation", ["reduced", "pointwise"])
def test_loads_of_both_formulations(formulation: str) -> None:
    found = buckling_points(formulation, 12, 6)
    np.testing.assert_allclose([s.point.load for s in found], REFERENCE[DEFAULT], rtol=0, atol=2e-11)
    assert all(s.located_to < 1e-10 for s in found)


@pytest.mark.few(1)
@pytest.mark.parametrize("constants", REFERENCE)
def test_loads_and_indices(constants: Constants) -> None:
    """Eigenvalues cross zero in pairs, and return where the thrust's destabilising part 10 lam (1 - lam) declines."""
    straight = explored("reduced", 12, 6, constants, depth=0)[0]
    found = specials(straight, "branch point")
    exact = REFERENCE[constants]
    np.testing.assert_allclose([s.point.load for s in found], exact, rtol=0, atol=1e-9)
    index = [closed_form_hemitropic.index((a + b) / 2, *constants) for a, b in pairwise([0.0, *exact, 0.95])]
    assert [found[0].negative_before, *(s.negative_after for s in found)] == index
    assert [s.negative_before for s in found] == index[:-1]
    assert all(s.multiplicity == 2 and s.point.zero == 2 for s in found)
    for p in straight.points:
        if min(abs(p.load - x) for x in exact) > 1e-6:
            assert (p.negative, p.zero) == (closed_form_hemitropic.index(p.load, *constants), 0)


def test_straight_states() -> None:
    """Stretch 1 - lam, no displacement, and the energy 5 lam^2 per unit length."""
    for p in explored("reduced", 12, 6, depth=0)[0].points:
        assert p.stretch == pytest.approx(1 - p.load, abs=1e-12)
        assert p.energy == pytest.approx(5 * p.load**2 * 6, abs=1e-11)
        assert abs(p.ordinate) < 1e-12


@pytest.mark.long
@pytest.mark.parametrize(
    ("formulation", "degree", "meshes"),
    [
        ("reduced", 1, (24, 48, 96)),
        ("reduced", 2, (12, 24, 48)),
        ("reduced", 3, (8, 12, 16)),
        ("reduced", 4, (5, 7, 10)),
        ("pointwise", 1, (24, 48)),
        ("pointwise", 2, (12, 24)),
    ],
)
def test_loads_converge_as_h_to_twice_the_degree(formulation: str, degree: int, meshes: tuple[int, ...]) -> None:
    exact = np.array(REFERENCE[DEFAULT])
    found = [[s.point.load for s in buckling_points(formulation, n, degree)] for n in meshes]
    for error in abs(np.array(found) - exact).T:
        slope = -np.polyfit(np.log(meshes), np.log(error), 1)[0]
        assert slope == pytest.approx(2 * degree, abs=0.4), error
