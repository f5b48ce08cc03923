"""Names of vibrations that have no rotation, against the frequencies of a bar."""

from __future__ import annotations

from dataclasses import replace
from math import pi

import classics
import numpy as np
import pytest
from hard.fuzz import scenes as fuzz

from rodfem import Discretization, Solver
from rodfem.stability.motion_names import STRAIGHT
from rodfem.stability.nonsymmetric import NonsymmetricSolver

EA = 40.0


@pytest.mark.long
def test_vibrations_along_a_rod() -> None:
    """Of a clamped bar ``omega = (n - 1/2) pi sqrt(EA)``; round-off made "mixed" or "bending" of them."""
    scene = replace(classics.shearable("flexible", 60.0, EA), inertia=classics.BEAM)
    solver = Solver(scene, Discretization("pointwise", 6, 6))
    pencil = NonsymmetricSolver(solver.equilibria.system).at(solver.equilibrium(0.0).x)
    found = pencil.near_zero(6)
    along = [i for i, kind in enumerate(found.kinds) if kind == STRAIGHT]
    assert found.values[along].real == pytest.approx(((np.arange(5) + 0.5) * pi) ** 2 * EA, rel=1e-8)
    assert {kind for kind in found.kinds if kind != STRAIGHT} == {"bending about d1", "bending about d2"}


@pytest.mark.long
def test_a_follower_thrust_leaves_vibrations_along_a_tapered_rod_alone() -> None:
    """What does not change with the thrust is torsion, or without rotation."""
    solver = Solver(fuzz.scene(30, 52), Discretization("pointwise", 2, 6))
    pencils = NonsymmetricSolver(solver.equilibria.system)
    found, other = (pencils.at(solver.equilibrium(load).x).near_zero(2) for load in (1.0, 5.0))
    still = [abs(other.values / value - 1).min() < 1e-9 for value in found.values]
    assert [kind in (STRAIGHT, "torsion") for kind in found.kinds] == still
    assert found.kinds.count(STRAIGHT) >= 3
