"""Rods that nothing holds: rigid motions are their symmetries, and a thrust makes them flutter."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest
from classics import BEAM, ROUND, circle, column, push
from closed_forms import polynomials
from scipy.interpolate import CubicSpline
from scipy.linalg import eigvals
from scipy.optimize import brentq

import rodfem
from rodfem import Attachment, Discretization, End, Inertia, Plan, Ring, Scene, SceneError, Solver, free
from rodfem.forms import loads
from rodfem.forms.energy import bending_and_twist
from rodfem.modes.finder import ModeFinder
from rodfem.modes.modes import RIGID

ROOTS = [brentq(lambda x: np.cos(x) - 1 / np.cosh(x), (n + 0.4) * pi, (n + 0.6) * pi, xtol=1e-14) for n in (1, 2, 3)]
FREQUENCIES = np.square(ROOTS)
"""Of a free beam, in units of sqrt(B/(m L^4)), cos x cosh x = 1: 22.3733, 61.6728, 120.9034."""
MESH = Discretization("pointwise", 6, 6)


def floating(ends: tuple, span: tuple[float, float], **loads) -> Scene:
    return column("floating", ends, span, constants={"B2": 1.0}, inertia=BEAM, **loads)


def thrust(span: tuple[float, float]) -> Scene:
    """A thrust along the end, which the inertia of the rod balances."""
    return floating((free(), free(follower=push)), span, distributed=lambda c: (0.0, 0.0, c.P))


PRESSED = (free(lambda c: (0.0, 0.0, c.P)), free(push))


@pytest.mark.long
@pytest.mark.short
def test_frequencies_and_rigid_motions() -> None:
    """Six zero eigenvalues, of three translations and three rotations, and pairs of frequencies in two planes."""
    solver = Solver(floating(PRESSED, (0.0, 45.0)), MESH)
    point = solver.equilibrium(0.0)
    assert (point.negative, point.zero) == (0, 6)
    modes = solver.modes(point, 8)
    moving = np.sqrt(modes.value.real[modes.value.real > 1.0])
    assert pytest.approx((22.3733, 61.6728, 120.9034), abs=1e-4) == FREQUENCIES
    assert moving == pytest.approx(np.repeat(FREQUENCIES, 2), rel=1e-7)
    verdict = solver.assess(point)
    assert (verdict.negative, verdict.zero) == (0, 6) and verdict.certified


@pytest.mark.long
def test_dead_forces_at_both_ends() -> None:
    """Pressed, it turns round at once, in two directions; besides, it buckles as between pins.  Pulled it is stable."""
    diagram = rodfem.trace(floating(PRESSED, (1.0, 45.0)), MESH, Plan(depth=0))
    found = diagram.special("branch point")
    assert [(s.negative_before, s.negative_after) for s in found] == [(2, 4), (4, 6)]
    for n, special in enumerate(found, 1):
        assert abs(special.point.load - (n * pi) ** 2) < special.error_estimate < 1e-7
    pulled = rodfem.trace(floating(PRESSED, (-1.0, -45.0)), MESH, Plan(depth=0))
    assert {p.negative for p in pulled[0].points} == {0} and not pulled.special()


def beal(P: float) -> np.ndarray:
    """Eigenvalues of a free beam under a thrust at its tail that follows, by Galerkin's method.

    ``int w'' v'' - P s w' v' ds + P w'(1) v(1) = mu int w v ds``.
    """
    s, weight, w = polynomials(18, clamped=False)
    (tip,), (slope,) = w(0, [1.0]).T, w(1, [1.0]).T
    K = (w(2) * weight) @ w(2).T - (w(1) * weight * P * s) @ w(1).T + P * np.outer(tip, slope)
    return eigvals(K, (w(0) * weight) @ w(0).T)


@pytest.mark.long
@pytest.mark.parametrize("rotary", [0.0, 0.01])
def test_thrust_of_a_rod_that_bends_unlike_in_its_planes(rotary: float) -> None:
    """Each plane by itself, the stiffer one as at half the load; a tilt of the rod is no state of its own.

    A tilted rod is at rest but for a force across it, which is no drift of a rod that its inertia balances: without
    forces of drifts that are generic the equations are singular.  With rotary inertia the frequencies are lower, and
    each row goes on from the one before it, in the parts along free motions, too, or a pair is not found again.
    """
    scene = replace(
        thrust((0.0, 130.0)),
        energy=lambda v, k, c: bending_and_twist(k, (1.0, 2.0, 0.8)),
        inertia=Inertia(rho_A=lambda c: 1.0, rho_I=lambda c: (rotary, rotary, rotary)),
    )
    planar = replace(scene, energy=lambda v, k, c: bending_and_twist(k, (1.0, 1.0, 0.8)), planar="e1")
    plan = Plan(depth=0, error_bars=False)
    diagram, alone = rodfem.trace(scene, MESH, plan), rodfem.trace(planar, MESH, plan)
    (found,), (known,) = diagram.special(), alone.special()
    assert not diagram.warnings and len(diagram[0].points) >= 101
    assert (found.kind, found.negative_before, found.negative_after) == ("flutter", 0, 2)
    assert abs(found.point.load - known.point.load) < 1e-8 * known.point.load
    for point in diagram[0].points[::10] if rotary == 0.0 else []:
        values = np.array([complex(*mu) for mu in point.omega2])
        expected = np.concatenate([beal(point.load), 2.0 * beal(point.load / 2.0)])
        for value in values[abs(values) > 1.0][:4]:
            assert abs(expected - value).min() < 1e-5 * abs(value)


def with_mass_at_nose(m: float, stiffness: tuple[float, float, float], span: tuple[float, float]) -> Scene:
    """A rod of mass 1 that a thrust at its tail accelerates, with a mass ``m`` at its nose."""
    return replace(
        floating((free(lambda c: (0.0, 0.0, c.P * m / (1 + m))), free(follower=push)), span,
                 distributed=lambda c: (0.0, 0.0, c.P / (1 + m))),
        attachments=(Attachment(0.0, mass=lambda c: m),),
        energy=lambda v, k, c: bending_and_twist(k, stiffness),
    )  # fmt: skip


@pytest.mark.long
@pytest.mark.parametrize("mesh", [MESH, pytest.param(Discretization("pointwise", 8, 5), marks=pytest.mark.long)])
@pytest.mark.usefixtures("few_loads")
def test_thrust_along_the_end_of_a_rod_with_a_mass_at_its_nose(mesh: Discretization) -> None:
    """The compression is ``P (m + s)/(1 + m)``.  In each plane two eigenvalues are zero at all loads: by Galerkin.

    The determinant is ``mu^2 (a + b mu + ...)``, and the rod diverges where ``a``, a contour integral, vanishes.  Then
    a second eigenvalue does, and meets the first one: no less than these two negative ones are complex after that.
    """
    expected = 34.271614690784276, 78.70131205220214, 80.02261225350209
    found = rodfem.trace(with_mass_at_nose(1.0, (1.0, 1000.0, 1000.0), (30.0, 90.0)), mesh)
    assert [(s.kind.words, s.negative_before, s.negative_after) for s in found.special()] == [
        ("divergence", 0, 1), ("divergence", 1, 2), ("flutter", 2, 2),
    ]  # fmt: skip
    for s, load in zip(found.special(), expected, strict=True):
        assert abs(s.point.load - load) < s.error_estimate + 1e-11 * load < 5e-8
        assert s.point.negative == min(s.negative_before, s.negative_after)
    assert not found.warnings


@pytest.mark.long
@pytest.mark.usefixtures("few_loads")
def test_divergence_of_two_planes_that_bend_nearly_alike() -> None:
    """Each plane at its stiffness times one load, both in one step, beside eigenvalues that are zero at all loads."""
    ratio = 1.0005
    found = rodfem.trace(with_mass_at_nose(1.0, (1.0, ratio, 1000.0), (30.0, 45.0)), MESH, Plan(depth=0))
    first, second = found.special()
    for number, special in enumerate((first, second)):
        assert (special.kind.words, special.negative_before) == ("divergence", number)
        assert special.negative_after == number + 1 and special.error_estimate < 1e-7
    error = ratio * first.error_estimate + second.error_estimate
    assert abs(second.point.load - ratio * first.point.load) < error and not found.warnings


@pytest.mark.long
def test_ring_under_a_pressure_that_follows(monkeypatch: pytest.MonkeyPatch) -> None:
    """Out of its plane, by ``v`` and a twist ``a`` of n waves, a ring of radius one under forces P along its normal.

    ``B n^2 (n^2 v + a) + C n^2 (v + a) = P (n^2 v + a)`` and ``B (n^2 v + a) + C n^2 (v + a) = 0``, so that
    ``P = B (n^2 - 1)`` whatever C is, as in its plane: two modes at a time.  Both are loads of the sweep, at which the
    eigenvalues vanish but for round-off.
    """
    monkeypatch.setattr("rodfem.diagram.sweep.LOADS", 11)
    scene = column(
        "pressed", Ring(), (0.0, 10.0), **ROUND, start=circle, follower=lambda c: (c.P, 0.0, 0.0),
        energy=lambda v, k, c: bending_and_twist((k[0], k[1] - 1.0, k[2]), (1.0, 9.0, 0.7)),
        inertia=Inertia(rho_A=lambda c: 1.0, rho_I=lambda c: (0.0, 0.0, 0.1)),
    )  # fmt: skip
    found = rodfem.trace(scene, Discretization("pointwise", 12, 6))
    assert {3.0, 8.0} < {p.load for p in found[0].points}
    for s, n in zip(found.special(), (2, 3), strict=True):
        assert abs(s.point.load - (n * n - 1)) < s.error_estimate < 1e-8
        assert (s.kind.words, s.negative_before, s.negative_after) == ("divergence", 2 * (n - 2), 2 * (n - 1))
    assert not found.warnings


@pytest.mark.long
def test_forces_that_nothing_balances() -> None:
    one_sided = (free(), free(follower=push))
    with pytest.raises(SceneError, match="nothing holds the rod against"):
        rodfem.trace(floating(one_sided, (0.0, 5.0)), MESH, Plan(depth=0))
    with pytest.raises(SceneError, match="nothing holds the rod against"):
        floating((free(), free(push)), (0.0, 5.0))
    with pytest.raises(SceneError, match="not the state that a small P leads on from"):
        rodfem.trace(floating((free(), free()), (0.0, 5.0), distributed=lambda c: (0.0, 0.0, -c.P)), MESH)


@pytest.mark.long
def test_a_spring_that_resists_turning_alone() -> None:
    """A rod that turns against a spring at one end and is held nowhere: stable, and free to move along e1, e2, e3."""
    spring = End(energy=lambda x, c: loads.rotational_spring(x.q, 2.0 + c.P))
    massless = replace(floating((spring, free()), (0.0, 1.0)), inertia=Inertia())
    point = Solver(massless).equilibrium(0.0)
    assert (point.negative, point.zero) == (0, 3)


@pytest.mark.long
def test_states_of_a_rod_that_a_thrust_accelerates() -> None:
    """Beal's free beam without thrust: two planes of 22.37, 61.67; its rigid motions are neither unstable nor modes.

    Their eigenvalue, zero, took the digits of all others next to zero: the verdict was one complex eigenvalue.
    """
    solver = Solver(thrust((1e-6, 50.0)), MESH)
    point = solver.equilibrium(1e-6)
    verdict = solver.assess(point, number=4)
    assert verdict.negative == 0 and max(verdict.errors) < 1e-12
    squares = np.repeat(FREQUENCIES**2, 2)[:4]
    others = [value for value in verdict.values.real if value > 1.0]
    assert others == pytest.approx(squares[: len(others)], rel=1e-6) and len(others) > 1
    modes = solver.modes(point, 4)
    assert modes.value.real == pytest.approx(squares, rel=1e-6) and abs(modes.value.imag).max() < 1e-6
    few = ModeFinder(solver.equilibria).few(point.x, 4)
    moving = [i for i, motion in enumerate(few.motion) if motion != RIGID]
    assert few.value[moving] == pytest.approx(squares, rel=1e-6)
    assert moving == [0, 1, 2, 3] and not few.value[4:].any()
    # one plane's modes are free-free: cosh x s + cos x s - ..., with nodes at 0.2242 of the length
    shape = np.linalg.norm(few.displacement[0].real, axis=1)
    assert shape.argmin() in range(1, len(shape) - 1) and abs(shape[0] - shape[-1]) < 1e-4 * shape[0]


def test_momentum_of_modes_under_a_thrust() -> None:
    """A thrust that turns with the tip by ``u'`` moves the centre of mass: ``mu int u ds = P u'(1)``."""
    solver = Solver(thrust((1e-6, 50.0)), MESH)
    modes = solver.modes(solver.equilibrium(20.0), 2)
    for value, u, turned in zip(modes.value, modes.displacement, modes.rotation, strict=True):
        slope = 20.0 * np.cross(turned[-1], (0.0, 0.0, 1.0))
        assert value * CubicSpline(modes.s, u).integrate(0.0, 1.0) == pytest.approx(slope, rel=1e-6, abs=1e-6)
        assert abs(slope).max() > 1.0
