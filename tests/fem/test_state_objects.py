"""A state owns its numbers: no other state, load or parameter that is evaluated meanwhile changes them."""

from math import pi

import numpy as np
import pytest
from classics import column
from small_states import plain

from rodfem import Discretization, Ordinate, clamped
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.fem.state import State, line
from rodfem.fem.system import System
from rodfem.stability.inertia import Inertia
from rodfem.stability.nonsymmetric import NonsymmetricSolver


def numbers(state: State) -> np.ndarray:
    """Equations, a row of their Jacobian, energy, load and rotations of a state."""
    out = state.system.new_vector()
    state.residual(out)
    matrix = state.jacobian(state.system.load_axis())
    image = matrix * state.system.load_axis()
    return np.concatenate([out.array_r, image.array_r, [state.energy(), state.load], state.turned.ravel()])


@pytest.mark.ranks
@pytest.mark.versions
@pytest.mark.short
@pytest.mark.parametrize("name", ["cord", "ruler", "hemitropic"])
def test_numbers_stay_when_another_state_is_evaluated(name: str) -> None:
    system, x = plain(name, "pointwise", 6, 3, 0.2)
    x = x.copy()
    state = system.at(x)
    before = numbers(state)
    x.scale(0.5)  # the vector it came from goes on to another state
    other = system.at(x, line(system.scene, {system.scene.load: 0.3}, {system.scene.load: 2.0}))
    assert np.linalg.norm(numbers(other) - before) > 1e-3 * np.linalg.norm(before)
    np.testing.assert_array_equal(numbers(state), before)
    with pytest.raises(ValueError, match="read-only"):
        state.local[0] = 1.0


@pytest.mark.ranks
@pytest.mark.long
@pytest.mark.versions
@pytest.mark.short
@pytest.mark.parametrize("formulation", ["reduced", "pointwise"])
def test_a_line_of_parameters_is_a_scene_with_those_values(formulation: str) -> None:
    """Also where the ends are: the ordinate is measured from them."""
    rod = column(
        "moved", (clamped(lambda c: (c.e, 0.0, 0.0)), clamped(lambda c: (c.e, 0.0, 1.0 - c.d))), (0.05, 0.5), load="d",
        constants={"d": 0.1, "e": 0.0}, ordinate=Ordinate("place of the middle", s=0.5, of=lambda r, q: r[0]),
        start=lambda s: np.stack([np.cos(np.sin(pi * s)), 0 * s, np.sin(np.sin(pi * s)), 0 * s], axis=1),
    )  # fmt: skip
    moved = rod.varying("d", rod.span, e=0.7, B2=3.0)
    discretization = Discretization(formulation, 4, 3)
    given, expected = (BranchSolver(System(scene, discretization)) for scene in (rod, moved))
    x = expected.start(0.2)
    assert abs(given.shape.ordinate(x) - expected.shape.ordinate(x)) > 0.5
    given.system.line = line(rod, {"d": 0.15, "e": 0.7, "B2": 3.0}, {"d": 0.25})
    y = x.copy()
    given.system.set_load(y, 0.2)  # d = 0.15 + 0.25 * 0.2 = 0.2
    assert given.shape.ordinate(y) == pytest.approx(expected.shape.ordinate(x), abs=1e-14)
    assert given.system.at(y).energy() == pytest.approx(expected.system.at(x).energy(), rel=1e-14)
    ours, theirs = given.system.new_vector(), expected.system.new_vector()
    given.system.at(y).residual(ours)
    expected.system.at(x).residual(theirs)
    assert (ours - theirs).norm() < 1e-13 * theirs.norm()


@pytest.mark.ranks
@pytest.mark.versions
@pytest.mark.short
def test_stale_factors_refuse() -> None:
    """Rather than tell a number of the state that took their place; so do those that were never made."""
    system, x = plain("cord", "reduced", 6, 3, 20.0)
    y, inertia = x.copy(), Inertia(system)
    system.set_load(y, 60.0)
    first = inertia.at(x)
    with pytest.raises(RuntimeError, match="not factored"):
        first.nearest(1)
    index, values = first.count(), first.nearest(1)[0]
    second = inertia.at(y)
    with pytest.raises(RuntimeError, match="not factored"):
        second.nearest(1)
    assert second.count() != index
    for ask in (lambda: first.eigenvalue_count(0.0), first.count, lambda: first.nearest(1), lambda: first.factors):
        with pytest.raises(RuntimeError, match="another state"):
            ask()
    again = inertia.at(x)
    assert again.count() == index
    assert again.nearest(1)[0] == pytest.approx(values, rel=1e-3)


@pytest.mark.ranks
@pytest.mark.short
def test_a_stale_pencil_refuses() -> None:
    """Its eigenvalues are those of another state."""
    system, x = plain("follower", "pointwise", 6, 3, 10.0)
    y, vibration = x.copy(), NonsymmetricSolver(system)
    system.set_load(y, 15.0)
    first, second = vibration.at(x), vibration.at(y)
    with pytest.raises(RuntimeError, match="another state"):
        first.nearest(2, 0.0)
    assert second.nearest(2, 0.0).values != pytest.approx(vibration.at(x).nearest(2, 0.0).values, rel=1e-3)
