"""More eigenvalues than a small mesh has, but fewer than the bound that is known before anything is computed."""

from __future__ import annotations

import numpy as np
import pytest
from classics import SUPPORTS, column

from rodfem import Discretization, Solver
from rodfem.errors import InputError


@pytest.mark.few(1)
@pytest.mark.parametrize("method", ["auto", "dense", "shift-invert", "slicing", "cayley"])
def test_there_are_no_more_than_the_nodes_that_turn(method: str) -> None:
    """Between clamps 2 elements of degree 2 have 3 nodes that turn, by 3 angles each: 9.

    That the end stays on the axis is two conditions, which leaves 7; the bound of a mesh is 15.
    """
    solver = Solver(column("few", SUPPORTS["clamped-clamped"], (0.0, 4.0)), Discretization("pointwise", 2, 2))
    point = solver.equilibrium(1.0)
    assert np.isfinite(solver.modes(point, 7).value).all()
    for number in (8, 12, 15):
        with pytest.raises(InputError, match=f"The rod has 7 eigenvalues on this mesh, not {number}: give number=7"):
            solver.modes(point, number, method)
