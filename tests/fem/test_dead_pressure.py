"""A ring under a dead radial load: what depends on the arclength is no symmetry, and what is claimed is verified."""

from collections.abc import Callable
from functools import cache
from math import pi
from typing import Any

import classics
import numpy as np
import pytest
import ufl
from hard.published import radial

from rodfem import Discretization, Ring, Scene, Solver
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.fem.newton import relax
from rodfem.fem.system import System
from rodfem.forms.energy import bending_and_twist
from rodfem.stability.assessment import Assessor


def ring(planar: str | None = None, B2: float = 1.0, C: float = 1.0, load: Any = radial, **more: Any) -> Scene:
    given = {"distributed": load} | more
    return classics.column(
        "dead pressure", Ring(), (0.3, 10.0), start=classics.circle, planar=planar, constants={"B2": B2, "C": C},
        energy=lambda v, k, c: bending_and_twist(k, (c.B1, c.B2, c.C)), **classics.ROUND, **given,
    )  # fmt: skip


@cache
def solver(planar: str | None, B2: float, C: float) -> BranchSolver:
    return Solver(ring(planar, B2, C), Discretization("pointwise", 8, 6)).equilibria


def ritz(p: float, B: tuple[float, float, float], planar: bool, modes: int = 12) -> np.ndarray:
    """Eigenvalues of the circle's second variation, for unit rotary inertia, by Fourier series of the rotation.

    With R = R0 exp(theta x), k0 = e2, and the load integrated by parts (its integral is p d3 of the circle), ::

        k = k0 + (theta' - theta x k0) + 1/2 theta x (theta x k0) - 1/2 theta x theta',
        2 E2 = int (theta' - theta x k0) . B (theta' - theta x k0)
               + B k0 . (theta x (theta x k0) - theta x theta') - p (theta1^2 + theta2^2) ds,

    for all periodic theta that keep the ring closed, int R0 (theta x e3) ds = 0.
    """
    s = 2 * pi * np.arange(6 * modes) / (6 * modes)
    m = np.arange(1, modes + 1)[:, None]
    shapes = np.vstack([np.ones_like(s), np.cos(m * s), np.sin(m * s)])
    slopes = np.vstack([0 * s, -m * np.sin(m * s), m * np.cos(m * s)])
    axes = [1] if planar else [0, 1, 2]
    theta, slope = (np.vstack([f[:, :, None] * np.eye(3)[i] for i in axes]) for f in (shapes, slopes))
    k0, e3 = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])
    first = slope - np.cross(theta, k0)
    E = np.einsum("asi,bsi->ab", first * B, first)
    E += B[1] * np.cross(theta[:, None], np.cross(theta, k0)[None])[..., 1].sum(axis=2)
    twist = -B[1] * np.cross(theta[:, None], slope[None])[..., 1].sum(axis=2)
    E += (twist + twist.T) / 2 - p * np.einsum("asi,bsi->ab", theta[..., :2], theta[..., :2])
    R0 = np.array([[np.cos(s), 0 * s, np.sin(s)], [0 * s, 1 + 0 * s, 0 * s], [-np.sin(s), 0 * s, np.cos(s)]])
    moved = np.einsum("ijs,asj->ai", R0, np.cross(theta, e3))
    Z = np.linalg.svd(moved[:, [0, 2] if planar else [0, 1, 2]].T)[2][len(moved[0]) - planar :].T
    M = np.einsum("asi,bsi->ab", theta, theta)
    root = np.linalg.cholesky(Z.T @ M @ Z)
    half = np.linalg.solve(root, Z.T @ (E + E.T) / 2 @ Z)
    return np.linalg.eigvalsh(np.linalg.solve(root, half.T))


def circle_at(found: BranchSolver, p: float) -> Any:
    """The circle under the load p, to which Newton's method leads from the start."""
    x = found.start(p)
    found.system.set_phase(x)
    assert relax(found.system, x, found.axis).converged
    return x


@pytest.mark.ranks
@pytest.mark.few(1)
@pytest.mark.parametrize(
    "p", [pytest.param(0.5, marks=pytest.mark.alone), 4.5, pytest.param(9.5, marks=pytest.mark.alone)]
)
@pytest.mark.parametrize(("planar", "B2", "C"), [("e2", 1.0, 1.0), (None, 1.0, 1.0), (None, 1.3, 0.7)])
def test_index_of_the_circle(planar: str | None, B2: float, C: float, p: float) -> None:
    found = solver(planar, B2, C)
    verdict = Assessor(found)(circle_at(found, p), number=6)
    mu = ritz(p, (1.0, B2, C), planar is not None)
    translations = 2 if planar else 3
    assert verdict.negative == (mu < -1e-9).sum()
    assert verdict.zero == translations + (abs(mu) < 1e-9).sum()
    np.testing.assert_allclose(verdict.values, mu[abs(mu) > 1e-9][:6], rtol=1e-6)
    assert mu[0] <= -p + 1e-9  # a rigid rotation lowers the energy


LOADS: list[tuple[Callable[[Any], Any] | None, Any, list[str]]] = [
    (lambda c: (0.0, 0.0, c.P * ufl.cos(7 * c.s)), None, ["rotation about e3"]),
    (lambda c: (0.0, c.P * ufl.sin(c.s), 0.0), None, ["rotation about e2"]),
    (None, lambda x, c: c.P * ufl.sin(x.s) * x.r[1], ["rotation about e2"]),
    (
        lambda c: (c.P * ufl.conditional(ufl.lt(c.s, 1.0), 1.0, -1 / (2 * pi - 1)), 0.0, 0.0),
        None,
        ["rotation about e1"],
    ),
    (radial, None, ["motion along itself with rotation about e2"]),
]


@pytest.mark.ranks
@pytest.mark.long
@pytest.mark.parametrize(("load", "potential", "motions"), LOADS)
def test_symmetries_of_a_loaded_ring(load: Any, potential: Any, motions: list[str]) -> None:
    """Loads without resultant: rotations about their axis remain, none along the rod unless the load turns with it."""
    breaks = (1.0,) if "rotation about e1" in motions else ()
    scene = ring(load=load, potential=potential, breaks=breaks)
    names = [str(s) for s in System(scene, Discretization("pointwise", 8, 6)).symmetries]
    always = [f"translation along e{i}" for i in (1, 2, 3)] + ["turning of the cross-sections about d3"]
    assert sorted(names) == sorted(always + motions)
