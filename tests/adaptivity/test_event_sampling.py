"""Error bars of events whose functions see the rod at nodes alone hold, against shooting."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest
from petsc4py import PETSc
from scipy.integrate import quad, simpson, solve_ivp, trapezoid
from scipy.optimize import brentq, minimize_scalar, root

import rodfem
from rodfem import Diagram, Discretization, Event, Ordinate, Plan, Scene, clamped, pinned
from rodfem.adaptivity.event_sampling import finer, where_places_matter
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.forms.energy import bending_and_twist

Curve = Callable[[float], np.ndarray]
MESHES = [(5, 3), *(pytest.param(mesh, marks=pytest.mark.alone) for mesh in [(8, 6), (3, 4), (7, 2)])]
POST = np.array([0.3, 0.45])
"""Place beside the rod, from which its distance is taken."""


def push(c: Any) -> tuple[float, float, Any]:
    """Load at the upper end."""
    return (0.0, 0.0, -c.P)


def rod() -> Scene:
    """A planar column, clamped and pinned, under a load across it that grows along it."""
    return Scene(
        "column across which the wind blows",
        interval=(0.0, 1.0),
        rod="unshearable and inextensible",
        energy=lambda v, k, c: bending_and_twist(k, (1.0, 1.0, 1.0)),
        parameters={"P": 0.0},
        load="P",
        ends=(clamped(), pinned(lambda c: (0.0, 0.0, None), push)),
        distributed=lambda c: (2.0 + 3 * c.s, 0.0, 0.0),
        ordinate=Ordinate("aside", s=0.37, of=lambda r, q: r[0]),
        span=(0.0, 20.0),
        planar="e2",
    )


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


def highest(y: Curve) -> float:
    """Arclength at which the deflection is largest: there the rod is upright."""
    return float(brentq(lambda s: y(s)[0], 0.4, 0.8, xtol=1e-13))


def integral(f: Callable[[float], float]) -> float:
    """Integral along the rod."""
    return float(quad(f, 0, 1, epsabs=1e-12, epsrel=1e-12)[0])


def distance(y: Curve) -> float:
    """Least distance from the post."""
    found = minimize_scalar(
        lambda s: float(np.hypot(*(y(s)[[2, 3]] - POST))), bounds=(0.2, 0.8), method="bounded", options={"xatol": 1e-12}
    )
    return float(found.fun)


EVENTS: dict[str, tuple[Callable[[Any], float], Callable[[Curve], float]]] = {
    "largest deflection": (lambda st: st.r[:, 0].max() - 0.1, lambda y: y(highest(y))[2] - 0.1),
    "area": (
        lambda st: trapezoid(st.r[:, 0], st.r[:, 2]) - 0.04,
        lambda y: integral(lambda s: y(s)[2] * np.cos(y(s)[0])) - 0.04,
    ),
    "by Simpson": (
        lambda st: simpson(st.r[:, 0] ** 2, x=st.s) - 0.002,
        lambda y: integral(lambda s: y(s)[2] ** 2) - 0.002,
    ),
    "distance": (
        lambda st: np.hypot(st.r[:, 0] - POST[0], st.r[:, 2] - POST[1]).min() - 0.21,
        lambda y: distance(y) - 0.21,
    ),
    "at a place": (lambda st: np.interp(0.37, st.s, st.r[:, 0]) - 0.05, lambda y: y(0.37)[2] - 0.05),
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
@pytest.mark.parametrize(
    "name", [pytest.param(x, marks=[pytest.mark.alone] * (x != "largest deflection")) for x in EVENTS]
)
@pytest.mark.parametrize("mesh", MESHES)
def test_bars_have_what_nodes_miss_of_the_rod(mesh: tuple[int, int], name: str) -> None:
    """The same function of the rod itself, by shooting, vanishes within the bar."""
    special = [s for s in traced(mesh).special(name) if s.event is not None]
    (event,) = special
    load, exact = event.point.load, happens(name)
    assert abs(load - exact) <= event.error_estimate
    assert abs(shot(exact)(0.37)[2] - event.point.ordinate) <= event.ordinate_error


def solver_and_state(mesh: tuple[int, int]) -> tuple[BranchSolver, PETSc.Vec]:
    """Solver of a mesh and a state of it."""
    diagram = traced(mesh)
    solver, point = diagram.solvers[0], diagram.branches[0].points[-1]
    assert isinstance(solver, BranchSolver)
    return solver, point.x


@pytest.mark.long
def test_more_places_of_the_same_polynomials() -> None:
    """They are those of each element through its nodes, and ends of elements are exactly what they are."""
    solver, x = solver_and_state((5, 3))
    sample = solver.shape.sample(x)
    t = np.array([0.0, 0.1, 0.45, 0.9, 1.0])
    more = finer(solver.shape, sample, t)
    assert [len(more[name]) for name in ("s", "r", "q")] == [21, 21, 21]
    for name in ("s", "r", "q"):
        assert np.array_equal(more[name][::4], sample[name][::3])
    for i in range(5):
        nodes, own = slice(3 * i, 3 * i + 4), slice(4 * i, 4 * i + 5)
        assert more["s"][own] == pytest.approx((i + t) / 5, abs=1e-14)
        fit = np.polyfit(sample["s"][nodes], sample["r"][nodes], 3)
        through = sum(c * more["s"][own, None] ** n for c, n in zip(fit, (3, 2, 1, 0), strict=True))
        assert more["r"][own] == pytest.approx(through, abs=1e-11)
    assert np.linalg.norm(more["q"], axis=1) == pytest.approx(1.0, abs=1e-14)


@pytest.mark.long
@pytest.mark.alone
@pytest.mark.parametrize(
    "of",
    [
        lambda st: st.r[-1, 2] - 0.9,
        lambda st: np.interp(0.375, st.s, st.r[:, 0]) - 0.1,  # an end of elements
        lambda st: st.r[len(st.s) // 2, 0] - 0.1,
        lambda st: st.load - 10,
    ],
)
def test_places_that_do_not_matter_cost_nothing(of: Callable[[Any], float]) -> None:
    solver, x = solver_and_state((8, 6))
    assert where_places_matter(solver.shape, Event("ends", of=of), x, 1e-14) == []
    assert len(where_places_matter(solver.shape, Event("sum", of=lambda st: st.r.sum()), x, 1e-14)) == 2


@pytest.mark.long
def test_a_function_that_takes_no_more_places_has_no_bar() -> None:
    """It is said in the note of the special point."""

    def of(state: Any) -> float:
        if len(state.s) > 41:
            raise ValueError("too many places")
        return float(state.r[-1, 2] - 0.97)

    found = rodfem.trace(rod(), Discretization("auto", 5, 3), Plan(depth=0, events=(Event("short", of=of),)))
    (event,) = found.special("short")
    assert event.error_estimate == np.inf
    assert not event.resolved
    assert "no error estimate: with more places along the rod the event 'short' fails with ValueError" in event.note


@pytest.mark.long
@pytest.mark.parametrize("mesh", [pytest.param((8, 6), marks=pytest.mark.alone), (7, 2)])
def test_a_function_that_jumps_from_node_to_node_has_no_bar(mesh: tuple[int, int]) -> None:
    """The place at half height is a node: by shooting it may be elsewhere by more than samples tell."""
    place = Event("half", of=lambda st: st.s[abs(st.r[:, 2] - 0.5).argmin()] - 0.506)
    found = rodfem.trace(rod(), Discretization("auto", *mesh), Plan(depth=0, events=(place,)))
    if not found.special("half"):
        assert any("Zeros of the event 'half' may be missing" in said for said in found.warnings)
        return
    (event,) = found.special("half")
    assert event.error_estimate == np.inf
    assert "no error estimate: the event 'half' jumps there from node to node: interpolate between" in event.note
