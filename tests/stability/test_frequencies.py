"""Frequencies under loads without a potential: none missing, none infinite, motions without rotation by name."""

from dataclasses import replace
from math import pi

import classics
import numpy as np
import pytest

from rodfem import Attachment, Discretization, Plan, Scene, Solver, clamped, free, trace
from rodfem.stability.motion_names import STRAIGHT
from rodfem.stability.nonsymmetric import NonsymmetricSolver

EA = 40.0


def pushed(body: float) -> Scene:
    """Beck's column of unit length, stiffness and mass, four times as stiff across, with a ``body`` at its tip."""
    return classics.column(
        "pushed", (clamped(), free(follower=classics.push)), (0.0, 20.19), constants={"B2": 4.0, "C": 2.0, "m": body},
        attachments=(Attachment(1.0, mass=lambda c: c.m),), inertia=classics.BEAM,
    )  # fmt: skip


def body_of(P: float, omega2: float) -> float:
    """Mass at the tip with which ``omega2`` is an eigenvalue at a thrust ``P``.

    Of the waves ``a cosh + b sinh`` and ``cos, sin`` that fulfil the conditions at the clamp, ``w'' = 0`` and ``w''' +
    m omega2 w = 0`` at the tip.
    """
    root = np.sqrt(P**2 / 4 + omega2)
    a, b = np.sqrt(root - P / 2), np.sqrt(root + P / 2)
    even, odd = np.array([np.cosh(a), np.cos(b)]), np.array([np.sinh(a), np.sin(b)])
    first = even[0] - even[1], a**2 * even[0] + b**2 * even[1], a**3 * odd[0] - b**3 * odd[1]
    second = b * odd[0] - a * odd[1], b * a**2 * odd[0] + a * b**2 * odd[1], b * a**3 * even[0] + a * b**3 * even[1]
    shear, deflection = (first[1] * second[i] - second[1] * first[i] for i in (2, 0))
    return float(-shear / (omega2 * deflection))


@pytest.mark.few(1)
@pytest.mark.parametrize("body", [1e4, 1e6, 1e8])
def test_what_is_infinite_is_not_found(body: float) -> None:
    """All eigenvalues of the stable column are those of its waves; with a body of 1e5 one was -28734, beside 28714."""
    solver = Solver(pushed(body), Discretization(elements=6, degree=5))
    found = NonsymmetricSolver(solver.equilibria.system).at(solver.equilibrium(3.306966).x).near_zero(6)
    assert (found.values.imag == 0).all()
    assert (found.values.real > 0).all()
    assert body_of(3.306966, float(found.values[0].real)) == pytest.approx(body, rel=1e-4)


@pytest.mark.long
@pytest.mark.usefixtures("few_loads")
def test_flutter() -> None:
    """Where the body that goes with an eigenvalue is stationary two of them coincide, as in waves along the column."""
    diagram = trace(pushed(1e6), Discretization(elements=6, degree=5), Plan(error_bars=False))
    (flutter,) = diagram.special("flutter")
    P, omega2 = flutter.point.load, flutter.omega2
    assert body_of(P, omega2) == pytest.approx(1e6, rel=1e-5)
    assert body_of(P, 1.001 * omega2) == pytest.approx(body_of(P, 0.999 * omega2), rel=1e-4)
    assert not diagram.special("divergence")
    assert not diagram.warnings


def check(found: np.ndarray, dense: np.ndarray) -> None:
    """Compare the first real frequencies (k,) that were found with all (n,) by dense matrices."""
    every = np.sort(dense.real)[: len(found)]
    assert abs(found - every).max() < 1e-6 * every[-1]


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
