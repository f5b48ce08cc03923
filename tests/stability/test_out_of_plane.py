"""How much of a motion is out of the plane of a planar rod, on all ranks alike."""

from __future__ import annotations

from dataclasses import replace

import classics
import numpy as np
import pytest

from rodfem import Discretization, Ordinate, Parameter, Scene, Solver, clamped
from rodfem.forms.energy import bending_and_twist
from rodfem.stability.in_space import InSpace


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
