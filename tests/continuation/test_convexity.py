"""Branches, sweeps and loci end where the stored energy is not convex any more: beyond, an index means nothing."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from classics import SUPPORTS, column

from forms.energy import bending_and_twist
from rodfem import Discretization, Inertia, Plan, Scene, Solver, clamped, free, trace
from rodfem.codim2.locus import locus
from rodfem.errors import SceneError

MESH = Discretization("auto", 4, 4)
Energy = Callable[[Any, Any, Any], Any]


def softening(v: Any, k: Any, c: Any) -> Any:
    """Bending stiffness 1 - P about d1: quadratic in the strains, and the same all along the rod."""
    return bending_and_twist(k, (1.0 - c.P, 2.0, 1.0))


def coupled(v: Any, k: Any, c: Any) -> Any:
    """Convex while P < 1."""
    return bending_and_twist(k, (1.0, 2.0, 1.0)) + c.P * k[0] * k[2]


def bowl(v: Any, k: Any, c: Any) -> Any:
    """Convex while P < 0.8, and where P > 1.2."""
    return bending_and_twist(k, ((1.0 - c.P) ** 2 - 0.04, 2.0, 1.0))


def rod(energy: Energy, span: tuple[float, float] = (0.0, 2.0), **given: Any) -> Scene:
    """Cantilever without a load, but for the stiffness that depends on it."""
    return column("rod", given.pop("ends", (clamped(), free())), span, energy=energy, **given)


@pytest.mark.parametrize(("energy", "until"), [(softening, 1.0), (coupled, 1.0), (bowl, 0.8)])
def test_a_stiffness_that_the_load_takes_away(energy: Energy, until: float) -> None:
    """Past it 48 eigenvalues of a mesh of 48 nodes were negative, and that was called a branch point."""
    (branch,) = trace(rod(energy), MESH, Plan(depth=0, error_bars=False))
    assert branch.ended.startswith("the stored energy is not convex any more at P = ")
    assert not [s for s in branch.special if not s.kind.given]
    assert until - 0.15 < branch.points[-1].load < until
    assert {p.negative for p in branch.points} == {0}
    with pytest.raises(SceneError, match=r"not convex somewhere along the state at P = 1\b"):
        Solver(rod(energy), MESH).equilibrium(1.0)


def test_an_energy_that_is_quadratic_at_the_first_load_alone() -> None:
    """``k^2/2 - P k^4/4`` under the moment m: convex while ``P < 4/(27 m^2)``."""
    scene = rod(
        lambda v, k, c: bending_and_twist(k, (1.0, 1.0, 1.0)) - 0.25 * c.P * k[0] ** 4,
        ends=(clamped(), free(moment=lambda c: (0.5, 0.0, 0.0))),
        planar="e1",
    )
    (branch,) = trace(scene, MESH, Plan(depth=0, error_bars=False))
    assert branch.ended.startswith("the stored energy is not convex any more")
    assert 0.5 < branch.points[-1].load < 4 / (27 * 0.25)


def test_a_sweep() -> None:
    scene = rod(
        lambda v, k, c: bending_and_twist(k, (1.0 - c.P / 30, 2.0, 1.0)),
        (0.0, 60.0),
        ends=(clamped(), free(follower=lambda c: (0.0, 0.0, -0.01 * c.P))),
        inertia=Inertia(rho_A=lambda c: 1.0, rho_I=lambda c: (0.0, 0.0, 0.0)),
    )
    (branch,) = trace(scene, MESH, Plan(error_bars=False))
    assert branch.ended.startswith("the stored energy is not convex any more at P = ")
    assert branch.points[-1].load < 30


def test_a_locus() -> None:
    """Euler's load ``(b^2 - 1/4) pi^2/4``: the curve ends before b = 1/2, though both bounds of b have convex rods."""
    scene = column(
        "locus", SUPPORTS["clamped-free"], (0.0, 4.0), constants={"b": 0.9},
        energy=lambda v, k, c: bending_and_twist(k, (c.b**2 - 0.25, 2.0, 1.0)),
    )  # fmt: skip
    diagram = trace(scene, MESH, Plan(depth=0, error_bars=False))
    curve = locus(diagram.solvers[0], diagram[0].special[0], "b", ((-4.0, 4.0), (-1.0, 1.0)), error_bars=0)
    assert any(end.startswith("the stored energy is not convex any more near P = ") for end in curve.ended)
    assert curve.values[:, 1].min() > 0.5
    assert {tuple(row) for row in curve.index.tolist()} == {(0, 1)}
