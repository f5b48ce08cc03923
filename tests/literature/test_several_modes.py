"""Branch points at which several different motions become unstable, by the quartic terms of the energy (Koiter)."""

from collections.abc import Callable
from math import hypot, pi, sin, sqrt
from typing import Any

import pytest
from classics import ON_AXIS, column, push
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import ellipj, ellipk

import rodfem
from rodfem import Attachment, Ordinate, Plan, Scene, pinned
from rodfem.forms import loads

S = 0.37
"""Where no mode of interest has a node."""
OFF = Ordinate("displacement", s=S, of=lambda r, q: hypot(r[0], r[1]))


def between_pins(B2: float, span: tuple[float, float], **loading: Any) -> Scene:
    ends = pinned(), pinned(ON_AXIS, push)
    return column("between pins", ends, span, ordinate=OFF, constants={"B2": B2}, **loading)


def on_foundation(B2: float) -> Scene:
    """One wave and two buckle at 5 pi^2."""
    k = 4 * pi**4
    return between_pins(B2, (45.0, 53.0), potential=lambda x, c: loads.spring(x.r, (k, k, 0.0)))


def propped(B2: float) -> Scene:
    """The least spring in the middle that makes the column buckle in two waves (Timoshenko & Gere, section 2.6)."""
    k = 16 * pi**2
    spring = Attachment(0.5, energy=lambda x, c: loads.spring(x.r, (k, k, 0.0)))
    return between_pins(B2, (36.0, 45.0), attachments=(spring,))


def quartic(P: float, k: float, n: int) -> float:
    """Coefficient of ``load = P + c x^2`` of n waves, ``theta = a cos(n pi s)``, on a foundation k.

    The energy is ``a^2/4 (n^2 pi^2 + k/(n pi)^2 - P) + a^4 (P/64 - k/(16 n^2 pi^2))``, ``x = a sin(n pi s)/(n pi)``.
    """
    return (P / 8 - k / (2 * n**2 * pi**2)) * (n * pi / sin(n * pi * S)) ** 2


@pytest.mark.long
@pytest.mark.parametrize("B2", [2.0, 5.0])
@pytest.mark.parametrize("make", [on_foundation, propped])
def test_both_branches_leave(make: Callable[[float], Scene], B2: float) -> None:
    """Which null vectors an eigensolver returns depends on B2; what leaves in the plane of B1 does not."""
    diagram = rodfem.trace(make(B2), plan=Plan(depth=1, error_bars=False))
    first = diagram[0].special[0]
    expected, k = (5 * pi**2, 4 * pi**4) if make is on_foundation else (4 * pi**2, 0.0)
    assert first.point.load == pytest.approx(expected, rel=1e-10)
    assert (first.negative_before, first.negative_after, first.multiplicity) == (0, 2, 2)
    assert first.law is not None and first.law.kind == "subcritical pitchfork"
    assert first.note.endswith("subcritical pitchfork, supercritical pitchfork")
    sub, super_ = (b for b in diagram.branches if b.parent == ("straight", 0))
    assert sub.points[1].load < expected < super_.points[1].load
    if make is on_foundation:
        assert first.law.coefficient == pytest.approx(quartic(expected, k, 1), rel=1e-6)
    for point in super_.points[1:3]:
        x = point.ordinate
        assert point.load - expected == pytest.approx(quartic(expected, k, 2) * x**2, rel=0.02)
    assert not diagram.warnings


@pytest.mark.long
def test_no_more_branches_than_asked_for_leave_one_point() -> None:
    """Two do; of a ring that its load leaves free in three motions there were tens, of seven asked for."""
    plan = Plan(depth=1, error_bars=False, most_branches=2)
    assert len(rodfem.trace(on_foundation(2.0), plan=plan).branches) == 2


@pytest.mark.long
def test_two_waves_are_two_elasticas() -> None:
    """They leave the spring in the middle alone: each half is a column between pins, ``P = (4 K(m))^2``."""
    P = 44.0
    m = brentq(lambda m: (4 * float(ellipk(m))) ** 2 - P, 1e-9, 0.5, xtol=1e-15)
    energy = quad(lambda s: 2 * m * P * ellipj(sqrt(P) * s, m)[1] ** 2, 0.0, 1.0, epsabs=1e-12)[0]
    found = rodfem.trace(propped(2.0), plan=Plan(depth=1, error_bars=False)).at(P)
    assert min(abs(point.energy - energy) for point in found) < 1e-8 * energy
