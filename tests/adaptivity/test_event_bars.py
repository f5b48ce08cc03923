"""Error bars of events that are sums over nodes hold, against shooting."""

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest
from classics import ON_AXIS, column, push
from scipy.integrate import quad, simpson, solve_ivp, trapezoid
from scipy.optimize import brentq, root

import rodfem
from rodfem import Diagram, Discretization, Event, Ordinate, Plan, Scene, clamped, pinned

pytestmark = pytest.mark.ranks

Curve = Callable[[float], np.ndarray]
MESHES = [(5, 3), *(pytest.param(mesh, marks=pytest.mark.alone) for mesh in [(8, 6), (3, 4), (7, 2)])]


def rod() -> Scene:
    """A planar column, clamped and pinned, under a load across it that grows along it."""
    return column(
        "column across which the wind blows", (clamped(), pinned(ON_AXIS, push)), (0.0, 20.0), planar="e2",
        constants={"B2": 1.0}, distributed=lambda c: (2.0 + 3 * c.s, 0.0, 0.0),
        ordinate=Ordinate("aside", s=0.37, of=lambda r, q: r[0]),
    )  # fmt: skip


@cache
def clamp(load: float) -> np.ndarray:
    """Moment and force at the clamp, (2,), followed from no load by steps of 2."""
    guess = clamp(2.0 * (np.ceil(load / 2) - 1)) if load > 0 else np.array([0.0, -1.5])
    found = root(lambda p: integrated(p, load).y[[1, 2], -1], guess, tol=1e-12)
    assert found.success
    return np.asarray(found.x)


@cache
def shot(load: float) -> Curve:
    """The equilibrium at a load: angle, moment, deflection, height, force across."""
    return integrated(clamp(load), load, dense=True).sol


def integrated(p: np.ndarray, load: float, *, dense: bool = False) -> Any:
    """Solution of the initial value problem for a moment and a force across the rod at its clamped end."""

    def slope(s: float, y: np.ndarray) -> list[float]:
        sin, cos = np.sin(y[0]), np.cos(y[0])
        return [y[1], -(cos * y[4] + sin * load), sin, cos, -(2 + 3 * s)]

    start = [0.0, p[0], 0.0, 0.0, p[1]]
    return solve_ivp(slope, (0, 1), start, method="DOP853", rtol=1e-12, atol=1e-13, dense_output=dense)


def integral(f: Callable[[float], float]) -> float:
    """Integral along the rod."""
    return float(quad(f, 0, 1, epsabs=1e-12, epsrel=1e-12)[0])


EVENTS: dict[str, tuple[Callable[[Any], float], Callable[[Curve], float]]] = {
    "area": (
        lambda st: trapezoid(st.r[:, 0], st.r[:, 2]) - 0.04,
        lambda y: integral(lambda s: y(s)[2] * np.cos(y(s)[0])) - 0.04,
    ),
    "by Simpson": (
        lambda st: simpson(st.r[:, 0] ** 2, x=st.s) - 0.002,
        lambda y: integral(lambda s: y(s)[2] ** 2) - 0.002,
    ),
    "mean of nodes": (lambda st: st.r[:, 0].mean() - 0.04, lambda y: integral(lambda s: y(s)[2]) - 0.04),
}


@cache
def happens(name: str) -> float:
    """Load at which the function of the rod itself vanishes."""
    return float(brentq(lambda P: EVENTS[name][1](shot(P)), 10.0, 20.0, xtol=1e-9))


@cache
def traced(mesh: tuple[int, int]) -> Diagram:
    """The branch with all events."""
    events = tuple(Event(name, of=of) for name, (of, _) in EVENTS.items())
    return rodfem.trace(rod(), Discretization("auto", *mesh), Plan(depth=0, events=events))


@pytest.mark.long
@pytest.mark.parametrize("name", [pytest.param(x, marks=[pytest.mark.alone] * (x != "area")) for x in EVENTS])
@pytest.mark.parametrize("mesh", MESHES)
def test_bars_have_what_nodes_miss_of_the_rod(mesh: tuple[int, int], name: str) -> None:
    """The same function of the rod itself, by shooting, vanishes within the bar."""
    special = [s for s in traced(mesh).special(name) if s.event is not None]
    (event,) = special
    load, exact = event.point.load, happens(name)
    assert abs(load - exact) <= event.error_estimate
    assert abs(shot(exact)(0.37)[2] - event.point.ordinate) <= event.ordinate_error
