"""Events: zeros of a number of the state along a branch are special points with error bars."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import classics
import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar
from scipy.special import ellipe, ellipk

import rodfem
from rodfem import Discretization, Event, InputError, Plan, clamped, sliding
from rodfem.forms.energy import bending_and_twist

pytestmark = pytest.mark.alone


def AXIS(c: Any) -> tuple[float, float, None]:
    """Place of an end that slides along the axis."""
    return (0.0, 0.0, None)


@pytest.mark.long
@pytest.mark.parametrize("apart", [0.5, 0.0, -0.1])
def test_the_distance_of_the_ends_of_an_elastica(apart: float) -> None:
    """That of a pinned column is ``2 E(m)/K(m) - 1`` at ``P = 4 K(m)^2``; where they meet the loop may turn, too."""
    m = brentq(lambda m: 2 * ellipe(m) / ellipk(m) - 1 - apart, 0.01, 0.99)
    meet = Event("apart", of=lambda state: state.r[-1, 2] - state.r[0, 2] - apart)
    rod = classics.column("pinned", classics.SUPPORTS["pinned-pinned"], (0.0, 25.0), planar="e1")
    found = rodfem.trace(rod, Discretization("auto", 8, 6), Plan(depth=1, events=(meet,)))
    (event,) = found.special("event")
    assert event in found["branch 1"].special
    assert event.note.startswith("apart")
    assert event.negative_before == event.negative_after == event.point.index
    error = abs(event.point.load - 4 * ellipk(m) ** 2)
    assert error <= event.error_estimate
    assert error < 1e-6
    assert event.error_estimate < 1e-6 or not apart  # at a branch point the richer mesh may be on its other branch
    assert [s.kind for s in found["straight"].special].count("event") == 0


def test_an_event_that_fails_is_named() -> None:
    rod = classics.column("pinned", classics.SUPPORTS["pinned-pinned"], (0.0, 5.0), planar="e1")
    wrong = Plan(depth=0, events=(Event("tip", of=lambda state: state.tip),))
    with pytest.raises(InputError, match=r"The event 'tip' fails with AttributeError, .*: it receives a state with"):
        rodfem.trace(rod, plan=wrong)
    with pytest.raises(InputError, match="give Events, as in"):
        Plan(events=(np.sin,))  # type: ignore[arg-type]


def straight(
    of: Callable[[float], float], *, error_bars: bool = True, load: tuple[float, float] = (0.0, 5.0)
) -> rodfem.Diagram:
    """Trace a straight extensible column, whose length is ``1 - P / 50``, with an event of its length."""
    rod = classics.column("pinned", (clamped(), sliding(AXIS, force=lambda c: (0.0, 0.0, -c.P))), load)
    rod = replace(
        rod, rod="unshearable", energy=lambda v, k, c: 25 * (v[2] - 1) ** 2 + bending_and_twist(k, (1.0, 2.0, 1.0))
    )
    event = Event("length", of=lambda state: of(state.r[-1, 2]))
    return rodfem.trace(rod, plan=Plan(depth=0, events=(event,), error_bars=error_bars))


@pytest.mark.few(1)
@pytest.mark.parametrize("gap", [1.0, 0.02, 1e-3, 1e-5])
def test_two_zeros_near_each_other(gap: float) -> None:
    """Each is found and resolved, both where one step has the two and where the richer mesh has both within reach."""
    exact = 2.5, 2.5 + gap
    a, b = (1 - P / 50 for P in exact)
    found = straight(lambda z: 1e4 * (z - a) * (z - b))
    events = found.special("event")
    assert [s.point.load for s in events] == pytest.approx(exact, rel=0, abs=1e-9)
    assert all(abs(s.point.load - P) <= s.error_estimate < 1e-9 for s, P in zip(events, exact, strict=True))
    assert all(s.resolved for s in events)
    assert not found.warnings


@pytest.mark.few(1)
@pytest.mark.parametrize("rate", [400, 4000])
def test_many_zeros_in_a_step(rate: int) -> None:
    exact = [50 * (1 - n * np.pi / rate) for n in range(rate, 0, -1) if 0.9 < n * np.pi / rate < 1]
    found = straight(lambda z: np.sin(rate * z), error_bars=False)
    assert [s.point.load for s in found.special("length")] == pytest.approx(exact, rel=0, abs=1e-9)
    assert not found.warnings


@pytest.mark.long
def test_what_varies_too_fast_is_said() -> None:
    (sentence,) = straight(lambda z: np.sin(4e6 * z), error_bars=False).warnings
    assert sentence.startswith("Zeros of the event 'length' may be missing between loads 0 and 5, where it varies too")
    assert "StepControl(largest=...)" in sentence


@pytest.mark.few(1)
@pytest.mark.parametrize(
    ("of", "exact"),
    [
        (lambda z: (z - 0.95) ** 2, [2.5]),
        (lambda z: abs(z - 0.9513), [2.435]),
        (lambda z: (z - 0.95) ** 2 + 1e-8, []),
        (lambda z: 0.001 + abs(z - 0.95), []),
        (lambda z: z - 1.0, [0.0]),
        (lambda z: (0.9 - z) ** 2, [5.0]),
        (lambda z: z - 0.9, [5.0]),
    ],
    ids=["parabola", "corner", "above", "corner above", "first row", "last row touched", "last row"],
)
def test_zeros_without_a_change_of_sign(of: Callable[[float], float], exact: list[float]) -> None:
    found = straight(of)
    events = found.special("event")
    assert [s.point.load for s in events] == pytest.approx(exact, rel=0, abs=1e-7)
    assert all(abs(s.point.load - P) <= s.error_estimate < 1e-6 for s, P in zip(events, exact, strict=True))
    assert all(s.resolved for s in events)
    assert found["straight"].ended == "end of range"
    assert not found.warnings


@pytest.mark.long
@pytest.mark.parametrize("largest", [0.3, pytest.param(0.11, marks=pytest.mark.long)])
def test_corners_on_a_curved_branch(largest: float) -> None:
    """Each is found where interpolated states are not equilibria, and beside a row, where no sample is between."""
    rod = classics.imperfect_column()
    mesh, steps = Discretization("auto", 5, 6), rodfem.StepControl(first=0.05, largest=largest)
    plan = Plan(depth=0, error_bars=False, steps=steps)
    rows = [row.load for row in rodfem.trace(rod, mesh, plan)[0].points[1:-1]]
    exact = [*np.random.default_rng(1).uniform(0.05, 3.95, 40)]
    exact += [load + off for load in rows for off in (-1e-4, -1e-8, -1e-10, 0.0, 1e-10, 1e-8, 1e-4)]
    events = tuple(Event(f"{i}", of=lambda state, b=b: abs(state.load - b)) for i, b in enumerate(exact))
    found = rodfem.trace(rod, mesh, replace(plan, events=events))
    loads = {s.note: s.point.load for s in found.special("event")}
    assert [loads.get(event.name) for event in events] == pytest.approx(exact, rel=0, abs=1e-8)
    assert not found.warnings


@pytest.mark.long
def test_an_event_that_is_zero_all_along_is_said_to_be() -> None:
    """Of a straight branch the deflection is zero; where the buckled branch leaves it, that is no event of its own."""
    rod = classics.column("pinned", classics.SUPPORTS["pinned-pinned"], (0.0, 12.0), planar="e1")
    found = rodfem.trace(rod, plan=Plan(depth=1, events=(Event("side", of=lambda state: state.r[:, :2].mean()),)))
    assert not found.special("event")
    assert sum("'side' is zero all along between loads 0 and 12" in note for note in found.notes) == 1
    assert not found.warnings


def height(m: float) -> float:
    """Largest deflection of a pinned elastica of parameter ``m``."""
    return float(np.sqrt(m) / ellipk(m))


def deflection(state: Any) -> float:
    """Deflection of the middle of a rod of an even number of elements."""
    return float(np.hypot(*state.r[len(state.s) // 2, :2]))


@pytest.mark.long
@pytest.mark.parametrize("below", [1e-2, 1e-5, 1e-8, -1e-6])
def test_the_height_of_an_elastica_near_its_largest(below: float) -> None:
    """Two zeros beside the load of the largest height, or none: equilibria decide, not states between rows."""
    top = minimize_scalar(lambda m: -height(m), bounds=(0.3, 0.95), method="bounded", options={"xatol": 1e-12}).x
    level = height(top) - below
    ends = [(0.3, top), (top, 0.95)] if below > 0 else []
    exact = [4 * ellipk(brentq(lambda m: height(m) - level, *pair)) ** 2 for pair in ends]
    rod = classics.column("pinned", classics.SUPPORTS["pinned-pinned"], (0.0, 25.0), planar="e1")
    plan = Plan(depth=1, events=(Event("height", of=lambda state: deflection(state) - level),))
    found = rodfem.trace(rod, Discretization("auto", 8, 8), plan)
    events = found.special("event")
    assert not found.warnings  # beside the largest height the event varies by round-off only
    assert len(events) == len(exact)
    for event, P in zip(sorted(events, key=lambda s: s.point.load), exact, strict=True):
        assert abs(event.point.load - P) <= event.error_estimate + 1e-9
        assert event.error_estimate < 0.1
