"""Events: zeros of a number of the state along a branch are special points with error bars."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import classics
import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

import rodfem
from rodfem import Discretization, Event, InputError, Level, Plan, clamped, sliding
from rodfem.forms.energy import bending_and_twist


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
    assert event.error_estimate < 1e-6
    assert [s.kind for s in found["straight"].special].count("event") == 0


def test_levels_of_eigenvalues() -> None:
    """Of a column of rotary inertia alone they are ``B (n pi)^2 - P``, each twice if it bends as easily either way."""
    rod = classics.column("pinned", classics.SUPPORTS["pinned-pinned"], (0.0, 45.0), constants={"B2": 1.0})
    found = rodfem.trace(rod, plan=Plan(depth=0, events=(Level(5.0), Level(-8.0))))
    for value, modes in ((5.0, (1, 2)), (-8.0, (1,))):
        points = found.special(f"eigenvalue {value:g}")
        exact = [(n * np.pi) ** 2 - value for n in modes]
        assert [s.point.load for s in points] == pytest.approx(exact, rel=0, abs=1e-7)
        assert all(abs(s.point.load - P) <= s.error_estimate < 1e-6 for s, P in zip(points, exact, strict=True))
        assert {s.kind for s in points} == {"level"}


def test_a_circle_of_states_begins_at_no_level() -> None:
    """The zero eigenvalue of a turn is below a level, as both are at the branch point; the radial one is 2.3."""
    rod = classics.column("pinned", classics.SUPPORTS["pinned-pinned"], (9.0, 11.0), constants={"B2": 1.0})
    found = rodfem.trace(rod, plan=Plan(depth=1, error_bars=False, events=(Level(5.0),)))
    assert len(found) == 2 and found[1].points[-1].zero == 2
    assert not found.special("eigenvalue 5")


def test_an_event_that_fails_is_named() -> None:
    rod = classics.column("pinned", classics.SUPPORTS["pinned-pinned"], (0.0, 5.0), planar="e1")
    wrong = Plan(depth=0, events=(Event("tip", of=lambda state: state.tip),))
    with pytest.raises(InputError, match=r"The event 'tip' fails with AttributeError, .*: it receives a state with"):
        rodfem.trace(rod, plan=wrong)
    with pytest.raises(InputError, match="give Events or Levels, as in"):
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
@pytest.mark.parametrize(
    ("of", "exact"),
    [
        (lambda z: (z - 0.95) ** 2, [2.5]),
        (lambda z: (z - 0.95) ** 2 + 1e-8, []),
        (lambda z: z - 1.0, [0.0]),
        (lambda z: (0.9 - z) ** 2, [5.0]),
        (lambda z: z - 0.9, [5.0]),
    ],
    ids=["parabola", "above", "first row", "last row touched", "last row"],
)
def test_zeros_without_a_change_of_sign(of: Callable[[float], float], exact: list[float]) -> None:
    found = straight(of)
    events = found.special("event")
    assert [s.point.load for s in events] == pytest.approx(exact, rel=0, abs=1e-7)
    assert all(abs(s.point.load - P) <= s.error_estimate < 1e-6 for s, P in zip(events, exact, strict=True))
    assert all(s.resolved for s in events)
    assert found["straight"].ended == "end of range"
    assert not found.warnings


COLUMN = classics.imperfect_column()
MESH = Discretization("auto", 5, 6)
PLAN = Plan(depth=0, error_bars=False, steps=rodfem.StepControl(first=0.05, largest=0.2))
LEFT = 1e-11
"""Load that arithmetic leaves open."""


@pytest.mark.few(1)
@pytest.mark.parametrize("kind", ["touch", "pair"])
def test_zeros_between_rows_and_beside_them(kind: str) -> None:
    """On a curved branch, each within its bar, and no other; the pair is 1e-4 to 1e-1 of a step apart."""
    rows, chosen = [row.load for row in rodfem.trace(COLUMN, MESH, PLAN)[0].points[1:-1]], np.random.default_rng(2)
    exact, events = list[list[float]](), list[Event]()
    for i, aside in enumerate((None, None, None, 0.0, 1e-10, -3e-10, 1e-9, -2e-9, 1e-8, -1e-6)):
        row = int(chosen.integers(1, len(rows) - 2))
        h = rows[row + 1] - rows[row]
        b = rows[row] + h * (chosen.uniform() if aside is None else aside)
        d = h * 10 ** chosen.uniform(-4, -1) if kind == "pair" else 0.0
        exact.append([b, b + d] if d else [b])
        events.append(Event(f"{i}", of=lambda state, b=b, d=d: (state.load - b) * (state.load - b - d)))
    found = rodfem.trace(COLUMN, MESH, replace(PLAN, events=tuple(events)))
    for event, loads in zip(events, exact, strict=True):
        points = found.special(event.name)
        assert len(points) == len(loads)
        assert all(abs(s.point.load - P) <= s.located_to + LEFT for s, P in zip(points, loads, strict=True))
    assert not found.warnings


def test_a_sweep_refuses_events() -> None:
    """It locates none: nothing would be found, without a word."""
    with pytest.raises(InputError, match=r"The event 'tip' is sought along branches"):
        rodfem.trace(classics.beck(), plan=Plan(events=(Event("tip", of=lambda state: state.r[-1, 0]),)))


@pytest.mark.long
def test_an_event_that_is_zero_all_along_is_said_to_be() -> None:
    """Of a straight branch the deflection is zero; where the buckled branch leaves it, that is no event of its own."""
    rod = classics.column("pinned", classics.SUPPORTS["pinned-pinned"], (0.0, 12.0), planar="e1")
    found = rodfem.trace(rod, plan=Plan(depth=1, events=(Event("side", of=lambda state: state.r[:, :2].mean()),)))
    assert not found.special("event")
    assert sum("'side' is zero all along between loads 0 and 12" in note for note in found.notes) == 1
    assert not found.warnings
