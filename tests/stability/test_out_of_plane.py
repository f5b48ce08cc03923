"""How much of a motion is out of the plane of a planar rod, on all ranks alike."""

from dataclasses import replace

import numpy as np
import pytest
from classics import column

from rodfem import Discretization, Ordinate, Solver, clamped

pytestmark = pytest.mark.ranks


@pytest.mark.few(1)
def test_a_planar_start_keeps_its_whole_turn() -> None:
    """A strip from clamp to clamp that is bent into a loop, in its plane and in space: quaternions are another mesh."""

    def start(s: np.ndarray) -> np.ndarray:
        half = np.pi / (1 + np.exp(-12 * (s - 0.5)))
        return np.stack([np.cos(half), 0 * s, np.sin(half), 0 * s], axis=1)

    ends = clamped(), clamped(lambda c: (0.0, 0.0, c.d))
    planar = column(
        "loop", ends, (0.2, 0.8), load="d", constants={"d": 0.2, "B2": 1.0}, planar="e2", start=start,
        ordinate=Ordinate("width", s=0.5, of=lambda r, q: r[0]),
    )  # fmt: skip
    one, other = (Solver(scene, Discretization("reduced", 8, 6)) for scene in (planar, replace(planar, planar=None)))
    for d, index in ((0.2, 0), (0.5, 1)):
        plane, space = one.equilibrium(d), other.equilibrium(d)
        assert plane.energy == pytest.approx(space.energy, rel=1e-7)
        assert plane.negative_in_space == space.negative == index
