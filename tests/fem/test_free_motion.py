"""Rods that nothing keeps from turning about their axis, under moments without a potential."""

from functools import cache
from math import pi
from typing import Any

import classics
import numpy as np
import pytest

from rodfem import Discretization, End, Scene, Solver
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.first_equilibrium import first_equilibrium
from rodfem.stability.assessment import Assessor


def scene(kind: str, balanced: bool = True) -> Scene:
    """Greenhill's rod between pins, one of which slides along the axis."""
    ends = (
        End(position=lambda c: (0.0, 0.0, 0.0), **({kind: lambda c: (0.0, 0.0, -c.M)} if balanced else {})),
        End(position=lambda c: (0.0, 0.0, None), **{kind: lambda c: (0.0, 0.0, c.M)}),
    )
    return classics.column(
        "pinned", ends, (0.0, 7.0), load="M", constants={"M": 0.0, "B2": 1.0}, inertia=classics.BEAM
    )  # fmt: skip


@cache
def solver(kind: str) -> BranchSolver:
    return Solver(scene(kind), Discretization("auto", 4, 6)).equilibria


def straight(found: BranchSolver, load: float) -> Any:
    x, outcome = first_equilibrium(found, load)
    assert outcome.converged
    return x


KINDS = pytest.mark.parametrize("kind", ["moment", "follower_moment"])


@pytest.mark.ranks
@pytest.mark.few(1)
@KINDS
def test_symmetries_without_a_potential(kind: str) -> None:
    names = {str(s) for s in solver(kind).system.symmetries}
    assert names == {"rotation about e3", "turning of the cross-sections about d3"}


@pytest.mark.ranks
@pytest.mark.versions
@KINDS
@pytest.mark.parametrize("method", ["shift-invert", "reduction", "dense"])
def test_frequencies_beside_the_free_motion(kind: str, method: str) -> None:
    """Without a moment those of a pinned beam, each twice: (n pi)^4; the turning about the axis is left out."""
    found = solver(kind)
    verdict = Assessor(found)(straight(found, 0.0), method, 4)
    assert (verdict.negative, verdict.zero) == (0, 1)
    values = np.sort(verdict.values.real)[:4]
    np.testing.assert_allclose(values, [pi**4, pi**4, (2 * pi) ** 4, (2 * pi) ** 4], rtol=1e-5)


@pytest.mark.long
@KINDS
def test_greenhill_between_pins(kind: str) -> None:
    """The straight rod diverges at M = 2 pi (Greenhill 1883)."""
    found = classics.sweep(scene(kind))
    points = found.special("divergence")
    assert points[0].point.load == pytest.approx(2 * pi, rel=1e-7)  # a double eigenvalue
    assert (points[0].negative_before, points[-1].negative_after) == (0, 2)
    assert {p.zero for p in found.branches[0].points if abs(p.load - 2 * pi) > 0.01} == {1}
