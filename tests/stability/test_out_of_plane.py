"""How much of a motion is out of the plane of a planar rod, on all ranks alike."""

from __future__ import annotations

import classics
import numpy as np
import pytest

from rodfem import Discretization, Solver
from rodfem.stability.out_of_plane import InSpace


@pytest.mark.few(1)
@pytest.mark.short
@pytest.mark.parametrize("out", [0.0, 0.3, 1.0])
def test_share_out_of_the_plane(out: float) -> None:
    """``x = cos a d + sin a e`` with a turn ``d`` about the plane's normal, and ``e`` about two axes in it: sin^2 a.

    A turn that grows along the rod: no rank has the same part of it.
    """
    system = Solver(classics.planar_column(), Discretization("reduced", 8, 6)).equilibria.system
    space = InSpace(system)
    fields = space.system.fields
    growing = fields.coordinates(6) ** 2
    vectors = []
    for axes in ((2,), (1, 3)):  # the plane's normal is e2
        turn = np.zeros((*growing.shape, 4))
        for axis in axes:
            turn[..., axis] = axis * growing
        x = space.system.vector(fields.filled({"q": turn}))
        vectors.append(x / np.sqrt(x.dot(space.inertia.metric * x)))
    within, beyond = vectors
    assert space._share(within * float(np.sqrt(1 - out**2)) + beyond * out) == pytest.approx(out**2, abs=1e-12)
