"""Energy against the work of the load: closed forms for the quadrature, planted faults, and no false alarm."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import demo_cases
import hemitropic_cases
import numpy as np
import pytest
from classics import bow, column, euler, loop

from rodfem import Discretization, Plan, Scene, Solver, clamped, free, trace
from rodfem.continuation.load_work import LoadWork, quadrature
from rodfem.errors import ConvergenceError
from rodfem.fem.state import State

MESH = Discretization("auto", 6, 5)
SCENES: dict[str, Callable[[], Scene]] = {
    "hemitropic": hemitropic_cases.scene,
    "cord": lambda: demo_cases.scene("cord", span=(60.0, 8.0)),
    "ruler": lambda: demo_cases.scene("ruler"),
    "ring": lambda: demo_cases.scene("ring"),
    "bow": bow,
    "loop": loop,
}


def test_the_quadrature_is_exact_for_cubics() -> None:
    """``int g dp`` of cubics from 0.7 to 1.1, through a fold of p; the error is that of lower orders."""
    s = np.array([0.0, 0.3, 0.7, 1.1])
    p, g = np.polynomial.Polynomial([1.0, 0.9, 0.0, -0.4]), np.polynomial.Polynomial([0.3, -1.0, 2.0, 0.7])
    exact = (g * p.deriv()).integ()
    work, error = quadrature(s, p(s), g(s))
    assert work == pytest.approx(exact(1.1) - exact(0.7), rel=1e-12)
    assert 1e-3 < error < 1.0
    lines = np.polynomial.Polynomial([2.0, 3.0]), np.polynomial.Polynomial([1.0, -1.0])
    work, error = quadrature(s, *(line(s) for line in lines))
    assert work == pytest.approx(3 * ((1.1 - 0.7) - (1.1**2 - 0.7**2) / 2), rel=1e-12)
    assert error < 1e-14


@pytest.mark.alone
def test_potential_and_its_derivative_in_closed_form() -> None:
    """A rod pulled along its axis with stiffness 100: ``V = -P l - P^2 l / 200``, the sum of stored energy and load."""
    pulled = column(
        "pulled", (clamped(), free(lambda c: (0.0, 0.0, c.P))), (0.0, 3.0), rod="flexible",
        energy=lambda v, k, c: 0.5 * sum(x * x for x in (k[0], k[1], k[2])) + 50 * (v[0]**2 + v[1]**2 + (v[2] - 1)**2),
    )  # fmt: skip
    solver = Solver(pulled, MESH)
    for load in (0.0, 1.0, 3.0):
        state = solver.equilibria.system.at(solver.equilibrium(load).x)
        assert state.potential() == pytest.approx(-load - load**2 / 200, abs=1e-12)
        assert state.load_derivative() == pytest.approx(-1 - load / 100, rel=1e-12)


def test_rows_that_are_not_on_one_branch() -> None:
    """After three bent rows comes the straight one; and one whose arclength alone is wrong is none of them."""
    diagram = trace(euler("clamped-free"), MESH, Plan(depth=1, error_bars=False))
    straight, bent = diagram.branches[:2]
    check, rows = LoadWork(diagram.solvers[0].system), bent.points[2:6]
    check(rows)
    other = min(straight.points, key=lambda p: abs(p.load - rows[-2].load))
    fallen = replace(other, arclength=rows[-1].arclength)
    with pytest.raises(ConvergenceError, match="these states are not on one branch"):
        check([*rows[:-1], fallen])
    check(rows)


@pytest.mark.alone
def test_a_wrong_energy_ends_the_branch_with_a_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    """The energy, and not its equations, with a term that grows from some load on."""
    right = State.potential
    monkeypatch.setattr(State, "potential", lambda self: right(self) + 1e-4 * max(self.load - 5.0, 0.0))
    diagram = trace(euler("clamped-pinned"), MESH, Plan(depth=0, error_bars=False))
    (branch,) = diagram
    assert branch.ended.startswith("no convergence: From P = ")
    assert "the total potential energy changes by" in branch.ended
    assert 0.0 < max(p.load for p in branch.points) < 8.0
    assert any(branch.ended.endswith(sentence) for sentence in diagram.warnings)


@pytest.mark.alone
@pytest.mark.parametrize("name", SCENES)
def test_no_alarm(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    compared: list[float] = []
    right = LoadWork.__call__

    def counted(self: LoadWork, rows: list) -> None:  # type: ignore[type-arg]
        right(self, rows)
        compared.append(rows[-1].load)

    monkeypatch.setattr(LoadWork, "__call__", counted)
    diagram = trace(SCENES[name](), MESH, Plan(depth=1, error_bars=False, most_branches=5))
    assert len(compared) > 20
    assert not any("potential energy" in sentence for sentence in diagram.warnings)
