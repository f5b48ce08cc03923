"""The rod under a follower load against the frequency equation of Beck's column, solved in complex arithmetic."""

from __future__ import annotations

import runpy
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from exact import column, double
from mpi4py import MPI
from rods import specials
from scenes import scene

from rodfem.branch import Branch
from rodfem.continuation import Equilibria
from rodfem.explore import Plan
from rodfem.fields import Discretization
from rodfem.report import Report
from rodfem.stability.vibration import Vibration
from rodfem.sweep import Sweep
from rodfem.system import System

DEMO = Path(__file__).parents[1] / "demos" / "follower.py"


@cache
def vibration(P: float, elements: int = 8, **constants: float) -> Vibration:
    """The pencil of the demo at one load."""
    solver = Equilibria(System(scene("follower", **constants), Discretization("pointwise", elements, 6)))
    x, outcome = solver.at_load(solver.start(P), P)
    assert outcome.converged
    found = Vibration(solver.system)
    found.assemble(x)
    return found


@cache
def swept(span: tuple[float, float], rotary_inertia: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Branch:
    rod = scene("follower", span=span, rotary_inertia=rotary_inertia)
    solver = Equilibria(System(rod, Discretization("pointwise", 4, 6)))
    (branch,) = Sweep(solver, Plan(span), Report(quiet=True), lambda: None).run()
    return branch


def test_where_eigenvalues_meet() -> None:
    assert double(20.0, 120.0) == pytest.approx([20.0509536189738, 121.342510140494], rel=1e-9)
    assert double(20.0, 120.0, J=1e-3)[0] == pytest.approx(19.8391305740585, rel=1e-9)


def test_two_flutters_in_a_coarse_sweep() -> None:
    """A step of two in the load, within which an eigenvalue of the strong plane passes by the pair that meets."""
    found = specials(swept((0.0, 200.0)), "flutter")
    assert len(found) == 2
    for s, expected in zip(found, (double(20.0, 120.0), double(128.0, 1370.0)), strict=True):
        assert abs(s.point.load - expected[0]) <= 3 * s.error_estimate <= 1e-4
    assert found[0].error_estimate < 1e-9


@pytest.mark.parametrize(("span", "J"), [((0.0, 25.0), 0.0), ((25.0, 15.0), 1e-3)])
def test_flutter(span: tuple[float, float], J: float) -> None:
    branch = swept(span, (J, 0.0, 0.0))
    (flutter,) = specials(branch, "flutter")
    load, mu = double(20.0, 120.0, J)
    assert abs(flutter.point.load - load) <= 3 * flutter.error_estimate <= 1e-9
    assert abs(flutter.omega2 - mu) <= 3 * flutter.omega2_error <= 1e-8
    assert sorted((flutter.negative_before, flutter.negative_after)) == [0, 2]
    for p in branch.points:
        if p is not flutter.point:
            assert p.negative == (2 if p.load > load else 0)
            for re, im in p.omega2[:2]:  # the two that meet, or the weak and the strong plane
                value = complex(re, im)
                assert np.nanmin([abs(column(value, p.load, *plane) - value) for plane in ((1, J), (10, 0))]) < 1e-6


@pytest.mark.parametrize("P", [0.0, 10.0])
def test_two_planes(P: float) -> None:
    values = vibration(P).near(6, 1.0).values[:6]
    assert abs(values.imag).max() < 1e-7
    for v in values.real:
        weak, strong, scaled = column(v, P), column(v, P, EI=10), 10 * column(v / 10, P / 10)
        assert np.nanmin([abs(v - weak), abs(v - strong)]) < 1e-9 * v
        assert np.nanmin([abs(v - weak), abs(v - scaled)]) < 1e-9 * v
    if P == 10:
        for expected in (26.7885149853, 345.468944394):
            assert abs(values - expected).min() < 1e-9 * expected
            assert column(expected, P) == pytest.approx(expected, rel=1e-11)


@pytest.mark.parametrize(("P", "near"), [(40.0, 10 - 11j), (100.0, 9.4 - 35j)])
def test_past_flutter(P: float, near: complex) -> None:
    expected = column(near**2, P)
    assert abs(expected.imag) > 100
    by_complex_shift = vibration(P).near(2, expected.conjugate() * 1.01).values
    by_real_shift = vibration(P).near(8, expected.real).values
    assert abs(by_complex_shift - expected.conjugate()).min() < 1e-8 * abs(expected)
    assert max(abs(by_real_shift - v).min() for v in (expected, expected.conjugate())) < 1e-8 * abs(expected)


@pytest.mark.parametrize("target", [20 + 5j, 340 - 30j])
def test_complex_shift_finds_real_eigenvalues(target: complex) -> None:
    one, other = (vibration(10.0).near(2, t).values for t in (target, target.real))
    assert max(abs(other / value - 1).min() for value in one) < 1e-9


def test_mass_and_inertia() -> None:
    heavy = vibration(10.0, mass=2.0).near(2, 10.0).values
    assert abs(heavy - 26.7885149853 / 2).min() < 1e-9
    twist = (np.pi / 2) ** 2 / 1e-3  # clamped and free, with B3 = 1
    assert abs(vibration(10.0, rotary_inertia=(0.0, 0.0, 1e-3)).near(2, 2400.0).values - twist).min() < 1e-9 * twist


def test_asymmetry_has_low_rank() -> None:
    assert [vibration(P).asymmetry()[0] for P in (0.0, 10.0, 40.0)] == [0, 4, 4]


def test_reduced_formulation_is_refused(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture
) -> None:
    monkeypatch.setattr(sys, "argv", [str(DEMO), "--formulation", "reduced", "--output", str(folder)])
    with pytest.raises(SystemExit) as ended:
        runpy.run_path(str(DEMO), run_name="__main__")
    out, err = capfd.readouterr()
    assert (ended.value.code, out) == (2, "")
    if MPI.COMM_WORLD.rank == 0:
        assert err.startswith("error: The reduced formulation") and err.find("\n") == len(err) - 1
