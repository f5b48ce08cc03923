"""A state owns its numbers: no other state, load or parameter that is evaluated meanwhile changes them."""

import numpy as np
import pytest
from small_states import plain

from rodfem.fem.state import State, line
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
