"""Events that are not smooth where they are zero, corners, roots, pairs of them, on a curved branch."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import classics
import numpy as np
import pytest
from petsc4py import PETSc

import rodfem
from rodfem import Discretization, Event, InputError, Plan
from rodfem.continuation import states_between
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.event_samples import Samples, sampled
from rodfem.continuation.event_zeros import Zeros

pytestmark = pytest.mark.alone

COLUMN = classics.imperfect_column()
MESH = Discretization("auto", 5, 6)
PLAN = Plan(depth=0, error_bars=False, steps=rodfem.StepControl(first=0.05, largest=0.2))
SHAPES: dict[str, tuple[Callable[[float, float], float], Callable[[float], list[float]]]] = {
    "square": (lambda u, d: u * u, lambda d: [0.0]),
    "cube": (lambda u, d: u**3, lambda d: [0.0]),
    "fourth power": (lambda u, d: u**4, lambda d: [0.0]),
    "corner": (lambda u, d: abs(u), lambda d: [0.0]),
    "root": (lambda u, d: abs(u) ** 0.5, lambda d: [0.0]),
    "cube root": (lambda u, d: abs(u) ** (1 / 3), lambda d: [0.0]),
    "two": (lambda u, d: u * (u - d), lambda d: [0.0, d]),
    "two corners": (lambda u, d: min(abs(u), abs(u - d)), lambda d: [0.0, d]),
    "two squares": (lambda u, d: (u * (u - d)) ** 2, lambda d: [0.0, d]),
    "two roots": (lambda u, d: abs(u * (u - d)) ** 0.5, lambda d: [0.0, d]),
    "corner and zero": (lambda u, d: abs(u) * (u - d), lambda d: [0.0, d]),
    "three": (lambda u, d: u * (u * u - d * d), lambda d: [-d, 0.0, d]),
    "zigzag": (lambda u, d: u - 2.5 * min(max(u, -d), d), lambda d: [-2.5 * d, 0.0, 2.5 * d]),
    "above zero": (lambda u, d: abs(u) ** 0.5 + 1e-2, lambda d: []),
}
LEFT = 1e-11
"""Load that arithmetic leaves open."""


@pytest.fixture(scope="module")
def rows() -> list[float]:
    """Loads of the rows of the column."""
    return [row.load for row in rodfem.trace(COLUMN, MESH, PLAN)[0].points[1:-1]]


@pytest.mark.few(1)
@pytest.mark.parametrize("shape", SHAPES)
def test_all_zeros_are_found_once(rows: list[float], shape: str) -> None:
    """Between rows, at rows and beside them, ``d`` from 1e-1 to 1e-8 of a step: each within its bar, and no other."""
    of, zeros = SHAPES[shape]
    chosen = np.random.default_rng(2)
    exact: list[list[float]] = []
    events = []
    for i, aside in enumerate((None, None, None, 0.0, 1e-10, -3e-10, 1e-9, -2e-9, 1e-8, -1e-6)):
        row = int(chosen.integers(1, len(rows) - 2))
        h = rows[row + 1] - rows[row]
        b = rows[row] + h * (chosen.uniform() if aside is None else aside)
        d = h * 10 ** chosen.uniform(-8, -1)
        exact.append([b + z for z in zeros(d)])
        events.append(Event(f"{i}", of=lambda state, b=b, d=d: of(state.load - b, d)))
    found = rodfem.trace(COLUMN, MESH, replace(PLAN, events=tuple(events)))
    for event, loads in zip(events, exact, strict=True):
        points = found.special(event.name) if loads else []
        assert len(points) == len(loads)
        assert all(abs(s.point.load - P) <= s.located_to + LEFT for s, P in zip(points, loads, strict=True))
    assert len(found.special("event")) == sum(map(len, exact))
    assert not found.warnings


@pytest.mark.long
def test_bars_of_a_touch_beside_a_change_of_sign() -> None:
    """That of one is no distance from the other."""
    events = [
        Event(f"{d}", of=lambda state, d=d: (state.load - 2.1) ** 2 * (state.load - 2.1 - d)) for d in (1e-3, 0.1)
    ]
    found = rodfem.trace(COLUMN, MESH, replace(PLAN, events=tuple(events), error_bars=True)).special("event")
    assert sorted(s.point.load for s in found) == pytest.approx([2.1, 2.1, 2.101, 2.2], rel=0, abs=1e-9)
    assert all(s.resolved and s.error_estimate < 1e-8 for s in found)


def test_a_root_at_the_edge_of_its_values() -> None:
    event = Event("edge", of=lambda state: float(np.sqrt(4.0 - state.load)))
    with np.errstate(invalid="ignore"):
        found = rodfem.trace(COLUMN, MESH, replace(PLAN, events=(event,)))
    assert [s.point.load for s in found.special("event")] == [4.0]


def test_an_event_that_is_zero_on_a_part_is_said_to_be() -> None:
    """Of a ramp the zeros are no places."""
    found = rodfem.trace(
        COLUMN, MESH, replace(PLAN, events=(Event("ramp", of=lambda state: max(state.load - 2, 0.0)),))
    )
    assert not found.special("event")
    assert any("'ramp' is zero all along between loads 0 and 2" in note for note in found.notes)


def test_a_sweep_refuses_events() -> None:
    """It locates none: nothing would be found, without a word."""
    with pytest.raises(InputError, match=r"The event 'tip' is sought along branches"):
        rodfem.trace(classics.beck(), plan=Plan(events=(Event("tip", of=lambda state: state.r[-1, 0]),)))


@pytest.mark.few(2)
@pytest.mark.parametrize("power", [0.2, 1 / 3, 0.5, 1.0, 1.5, 3.0])
def test_samples_show_a_root_wherever_it_is(power: float) -> None:
    """Also beside a node, of which each side is a parabola to its error."""
    for z in np.random.default_rng(0).uniform(size=400):

        def f(s: float, z: float = float(z)) -> float:
            return float(abs(s - z) ** power)

        samples = sampled(f, 0.0, 1.0, (f(0.0), f(1.0)), lambda _: 1e-15)
        assert min(samples.values.values()) < 0.1 * max(samples.values.values())


def test_what_is_around_a_zero_is_sampled_at_all_distances() -> None:
    """Two samples of one sign at the ends have three zeros in between: one is added, the others come out."""

    def f(s: float) -> float:
        u = s - 0.3
        return u - 2.5 * min(max(u, -1e-6), 1e-6)

    zeros = Zeros(f, Samples({0.0: f(0.0), 1.0: f(1.0)}), lambda _: 1e-16)
    zeros.locate()
    assert len(zeros.found) == 1
    zeros.look_around()
    assert [zero.s for zero in zeros.found] == pytest.approx([0.3 - 2.5e-6, 0.3, 0.3 + 2.5e-6], rel=0, abs=1e-12)


def test_zeros_beside_a_row_that_is_nearly_zero() -> None:
    """One of two corners is before the interval, and the samples see a parabola that has its vertex at the end."""

    def f(s: float) -> float:
        return abs((s + 1e-9) * (s - 5e-8))

    zeros = Zeros(f, Samples({0.0: f(0.0), 0.5: f(0.5), 1.0: f(1.0)}), lambda _: 1e-22)
    zeros.locate()
    zeros.look_around()
    assert [zero.s for zero in zeros.found] == pytest.approx([5e-8], rel=0, abs=1e-12)


@pytest.mark.long
def test_states_with_round_off_of_their_own(monkeypatch: pytest.MonkeyPatch) -> None:
    """Equilibria that are solved for differ by 1e-8, as beside a soft mode: what touches zero is within its bar."""
    chosen, solve = np.random.default_rng(4), states_between.solve_at

    def rough(solver: BranchSolver, curve: states_between.Curve, s: float) -> PETSc.Vec:
        x, direction, aside = solve(solver, curve, s), curve(s)[1], solver.system.new_vector()
        solver.system.set_load(aside, 1.0)
        row = solver.row(direction)
        aside.axpy(-row.dot(aside) / row.dot(direction), direction)  # on the plane on which the state is solved for
        return x + aside * (1e-8 * chosen.normal())

    monkeypatch.setattr(states_between, "solve_at", rough)
    exact = [float(b) for b in np.linspace(1.5, 3.5, 41)]
    events = tuple(Event(f"at {b:.2f}", of=lambda state, b=b: (state.load - b) ** 2) for b in exact)
    diagram = rodfem.trace(COLUMN, MESH, replace(PLAN, events=events))
    found = [s for s in diagram[0].special if s.event]
    assert len(found) == len(exact)
    assert all(abs(s.point.load - b) <= s.located_to < 1e-6 for s, b in zip(found, exact, strict=True))
