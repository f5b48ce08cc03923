"""Error bars are bounds: of special points, of local laws, of what is printed; against closed forms."""

from dataclasses import replace
from io import StringIO
from math import hypot, pi

import classics
import hemitropic_cases
import numpy as np
import pytest
import reference_values
from classics import SUPPORTS, column
from closed_forms import elastica
from mpi4py import MPI

from rodfem import Branch, Diagram, Discretization, InputError, Ordinate, Plan, Scene, clamped, free, trace
from rodfem.adaptivity.error_estimate import Enriched
from rodfem.app.terminal import Report
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.kinds import BRANCH_POINT, USER
from rodfem.output.words import number

LARGE = 3.0
"""A bar is not larger than this times the error, but for round-off."""
ROUND_OFF = 1e-10


def explored(scene: Scene, mesh: tuple[int, int], at: tuple[float, ...] = (), depth: int = 0) -> list[Branch]:
    """Explore a scene with error bars, on equal elements of a degree."""
    return trace(scene, Discretization("auto", *mesh), Plan(at=at, depth=depth, steps=classics.WIDE)).branches


def branch_solver(diagram: Diagram) -> BranchSolver:
    """Solver of the first mesh."""
    return diagram.solvers[0]


def check(value: float, exact: float, bar: float) -> None:
    """The bar holds, and is not needlessly large."""
    assert abs(value - exact) <= bar <= LARGE * abs(value - exact) + ROUND_OFF


# --- special points -------------------------------------------------------------------------------------------------


@pytest.mark.ranks
@pytest.mark.long
@pytest.mark.parametrize(
    "mesh",
    [*(pytest.param(x, marks=pytest.mark.alone) for x in [(8, 1), (3, 2), (4, 3), (2, 4), (4, 5), (2, 6)]), (8, 6)],
)
def test_elastica(mesh: tuple[int, int]) -> None:
    """Buckling loads, and deflections between the elements' ends and at one of them."""
    stops = (3.0, 6.0)
    trunk, *buckled = explored(classics.elastica(8.0), mesh, stops, depth=1)
    loads = [s for s in trunk.special if s.kind == BRANCH_POINT]
    assert len(loads) == 2
    for EI, s, branch in zip((1.0, 2.0), loads, buckled, strict=True):
        check(s.point.load, EI * pi**2 / 4, s.error_estimate)
        for end in (s for s in branch.special if s.kind != BRANCH_POINT):
            check(end.point.ordinate, elastica(end.point.load / EI)[1], end.ordinate_error)


@pytest.mark.long
@pytest.mark.parametrize(
    ("mesh", "place", "expected"),
    [
        pytest.param((1, 4), 0.102, 0.011063597569247392, marks=pytest.mark.alone),
        ((2, 3), 0.078, 0.006552052974001866),
        ((2, 5), 0.622, 0.29689081540928547),
    ],
)
def test_deflection_inside_of_an_element(mesh: tuple[int, int], place: float, expected: float) -> None:
    """By shooting.  Near a zero of what an element misses the richer mesh misses as much, up to 45 % at 0.102."""
    ends = (clamped(), free(force=lambda c: (c.P, 0.0, 0.0)))
    deflection = Ordinate("deflection", s=place, of=lambda r, q: float(r[0]))
    rod = column("bent", ends, (0.0, 3.5), planar="e2", ordinate=deflection, constants={"B2": 1.0})
    (branch,) = explored(rod, mesh, (3.0,))
    (found,) = (s for s in branch.special if s.kind == USER)
    assert abs(found.point.ordinate - expected) <= found.ordinate_error


# --- meshes that do not resolve the rod -----------------------------------------------------------------------------


def coarse(accuracy: float | None) -> Diagram:
    """The hemitropic rod on two elements of degree 2 to begin with."""
    mesh = Discretization("auto", 2, 2, vertices=(-3.0, 0.0, 3.0))  # given, so that the accuracy chooses none
    return trace(hemitropic_cases.scene(), mesh, Plan((0.0, 0.55), (0.5,), 1, accuracy=accuracy))


@pytest.mark.ranks
def test_a_mesh_that_does_not_resolve_a_state_says_so() -> None:
    """At 0.5 two meshes agree by accident in the ordinate, not in the strains: its bar is a tenth of its error."""
    diagram = coarse(None)
    (s,) = diagram.special("user", "branch 1")
    assert abs(s.point.ordinate - reference_values.FIRST[0.5][0]) > 5 * s.ordinate_error
    assert s.resolved is False
    stream = StringIO()
    report = Report(stream=stream)
    report.table(diagram.data, diagram.branches)
    report.summary(diagram.data)
    if MPI.COMM_WORLD.rank == 0:
        assert "(at least 2e-03)" in stream.getvalue()
        assert "does not resolve" in stream.getvalue()


@pytest.mark.long
def test_an_accuracy_is_not_reached_by_accident() -> None:
    """Points that agree on two meshes to the accuracy asked for, and are not resolved, are computed on a finer one."""
    (s,) = coarse(1e-2).special("user", "branch 1")
    assert s.resolved
    assert abs(s.point.ordinate - reference_values.FIRST[0.5][0]) <= s.ordinate_error <= 1e-2 * s.point.ordinate


def test_straight_rod_is_resolved_by_any_mesh() -> None:
    """It has no strains but constant ones; its null vector, a quarter of a cosine, has."""
    for mesh, buckling in (((1, 1), False), ((4, 1), True)):
        (straight,) = explored(classics.elastica(7.0), mesh, (2.0,))
        found = {s.kind: s.resolved for s in straight.special}
        assert found == {"user": True, BRANCH_POINT: buckling, "end": True}


# --- local laws -----------------------------------------------------------------------------------------------------


def across(s: float) -> Ordinate:
    return Ordinate("across", s=s, of=lambda r, q: hypot(r[0], r[1]))


def along(s: float) -> Ordinate:
    return Ordinate("along", s=s, of=lambda r, q: float(r[2]))


# supports, ordinate, end of the span, coefficient for bending stiffness one: ``P = p^2 (1 + m/2 + ...)`` with the
# elliptic parameter m of each bent quarter, of length pi/(2 p), whose deflection is ``2 sqrt(m)/p`` and shortening m
LAWS = {
    "cantilever": ("clamped-free", across(1.0), 6.0, pi**4 / 128),
    "cantilever, shortening": ("clamped-free", along(1.0), 6.0, -(pi**2) / 8),
    "pinned": ("pinned-pinned", across(0.5), 25.0, pi**4 / 8),
    "pinned, shortening": ("pinned-pinned", along(1.0), 25.0, -(pi**2) / 2),
    "clamped": ("clamped-clamped", across(0.5), 42.0, pi**4 / 2),
    "clamped, shortening": ("clamped-clamped", along(1.0), 42.0, -2 * pi**2),
}


@pytest.mark.few(1)
@pytest.mark.parametrize("mesh", [(4, 3), (4, 5), (8, 6)])
@pytest.mark.parametrize("name", LAWS)
def test_coefficient_of_a_pitchfork(name: str, mesh: tuple[int, int]) -> None:
    supports, ordinate, most, expected = LAWS[name]
    scene = replace(column(name, SUPPORTS[supports], (0.0, most)), ordinate=ordinate)
    trunk = explored(scene, mesh, depth=1)[0]
    found = [s for s in trunk.special if s.kind == BRANCH_POINT]
    assert found
    for EI, s in zip((1.0, 2.0), found, strict=False):
        assert s.law.kind == "supercritical pitchfork"
        miss = abs(s.law.coefficient - EI * expected)
        assert miss <= s.law.uncertainty <= 10 * miss + 1e-6 * EI * abs(expected)


# --- what is printed ------------------------------------------------------------------------------------------------


def test_printed_bars_hold() -> None:
    """Digits that are left out count: the bar printed is one of the number printed."""
    rng = np.random.default_rng(5)
    for value, error in zip(rng.normal(size=300), 10.0 ** rng.uniform(-12, 0, 300), strict=True):
        shown, _, bar = number(value, error).partition(" (")
        assert abs(float(shown) - value) + error <= float(bar[:-1]) * (1 + 1e-9) <= 3 * error


def test_round_off_that_two_meshes_have_alike_has_no_bar() -> None:
    """Haringx' column with stretch 2e13 times as stiff as bending: its load is right to 2e-10, which no bar told."""
    scene = classics.shearable("flexible", 1e13, 2e13)
    diagram = trace(scene, Discretization("reduced", 8, 6), Plan(depth=0))
    (lost,) = (s for s in diagram[0].special if s.kind == BRANCH_POINT)
    assert abs(lost.point.load - pi**2 / 4) < 1e-8
    assert all(np.isnan(s.error_estimate) for s in diagram[0].special)
    assert "2e+13 times as stiff as bending" in diagram.warnings[0] and "no error is estimated" in diagram.warnings[0]
    with pytest.raises(InputError, match=r"2e\+13 times as stiff as bending.*no accuracy can be promised"):
        trace(scene, plan=Plan(depth=0, accuracy=1e-6))


def test_a_bar_is_no_less_than_the_location() -> None:
    """Of Euler's column, whose mesh leaves no error, with a location that is said to be poor."""
    diagram = trace(classics.euler("pinned-pinned"), Discretization("reduced", 8, 8), Plan(span=(0.0, 12.0), depth=0))
    Enriched(diagram.solvers[0]).estimate(poor := replace(diagram.special(BRANCH_POINT)[0], located_to=1e-3))
    assert poor.error_estimate == 1e-3
