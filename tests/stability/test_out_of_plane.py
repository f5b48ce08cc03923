"""How much of a motion is out of the plane of a planar rod, on all ranks alike."""

from dataclasses import replace

import numpy as np
import pytest

from rodfem import Discretization, Ordinate, Parameter, Scene, Solver, clamped
from rodfem.forms.energy import bending_and_twist

pytestmark = pytest.mark.ranks


@pytest.mark.few(1)
def test_a_planar_start_keeps_its_whole_turn() -> None:
    """A strip from clamp to clamp that is bent into a loop, in its plane and in space: quaternions are another mesh."""

    def start(s: np.ndarray) -> np.ndarray:
        half = np.pi / (1 + np.exp(-12 * (s - 0.5)))
        return np.stack([np.cos(half), 0 * s, np.sin(half), 0 * s], axis=1)

    ends = clamped(), clamped(lambda c: (0.0, 0.0, c.d))
    planar = Scene(
        "loop", (0.0, 1.0), "unshearable and inextensible", lambda v, k, c: bending_and_twist(k, (1.0, 1.0, 1.0)),
        {"d": Parameter(0.2)}, "d", ends, Ordinate("width", s=0.5, of=lambda r, q: r[0]), (0.2, 0.8),
        planar="e2", start=start,
    )  # fmt: skip
    one, other = (Solver(scene, Discretization("reduced", 8, 6)) for scene in (planar, replace(planar, planar=None)))
    for d, index in ((0.2, 0), (0.5, 1)):
        plane, space = one.equilibrium(d), other.equilibrium(d)
        assert plane.energy == pytest.approx(space.energy, rel=1e-7)
        assert plane.negative_in_space == space.negative == index
