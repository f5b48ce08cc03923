"""Soft modes by name, value and uncertainty, and an index that is undecided where a mesh cannot tell it."""

import io
from dataclasses import replace
from functools import cache
from math import pi
from pathlib import Path

import numpy as np
import pytest
from classics import SUPPORTS, column, push
from continuation.test_index_chain import localised
from mpi4py import MPI

from rodfem import Diagram, Discretization, Ordinate, Plan, Scene, Solver, clamped, free, load, pinned, trace
from rodfem.adaptivity.soft_states import SoftStates
from rodfem.app.terminal import Report
from rodfem.forms import loads
from rodfem.forms.energy import bending_and_twist
from rodfem.output.pieces import UNSTABLE, pieces_of

SLIDING = "sliding along the rod"


def nearly_free(k: float) -> Scene:
    """A rod on a ball joint with a spring of stiffness k: it swings rigidly, at no load with the eigenvalue k."""
    joint = replace(pinned(), energy=lambda x, c: loads.rotational_spring(x.q, c.k))
    return column("nearly free", (joint, free(push)), (-1.0, 1.0), constants={"k": k})


@pytest.mark.few(1)
@pytest.mark.parametrize("part", [1 - 1e-9, pytest.param(1.0, marks=pytest.mark.short), 1 + 1e-9, 1 + 1e-7])
def test_an_eigenvalue_at_the_tolerance_of_the_count(part: float) -> None:
    """``mu = pi^2 - P``: at -1e-7 of the lowest bending eigenvalue the count and the quotient need not agree."""
    rod = column("euler", (pinned(), pinned(lambda c: (0.0, 0.0, None), push)), (8.0, 12.0), planar="e2")
    point = Solver(replace(rod, parameters={**rod.parameters, "B2": 1.0})).equilibrium(pi**2 * (1 + 1e-7 * part))
    assert (point.stable, point.negative, point.zero, point.undecided) == (False, 1, 0, 0)


def test_an_end_too_free_to_tell() -> None:
    """A spring of 1e-10 is below what a state is solved to: rotations about all axes, which it holds, are undecided."""
    solver = Solver(nearly_free(1e-10), Discretization("reduced", 4, 4))
    point = solver.equilibrium(0.0)
    assert (point.stable, point.negative, point.undecided) == (None, 0, 3)
    assert "undecided, index 0 to 3" in repr(point)
    assert all(abs(m.value - 1e-10) < m.uncertainty and "rotation about e" in m.name for m in point.soft)
    verdict = solver.assess(point)
    assert verdict.stable is None and "3 undecided" in str(verdict)
    if MPI.COMM_WORLD.rank == 0:
        stream = io.StringIO()
        Report(MPI.COMM_SELF, stream).verdict("branch 1", "P = 0", verdict)
        assert "undecided, index 0 to 3" in stream.getvalue() and "sign undecided" in stream.getvalue()


@pytest.mark.long
@pytest.mark.parametrize(
    ("k", "error_bars"),
    [
        pytest.param(5e-8, False, marks=pytest.mark.short),
        (-5e-8, True),
        *(pytest.param(*given, marks=pytest.mark.alone) for given in [(-5e-8, False), (5e-8, True)]),
    ],
)
def test_a_zero_of_the_count_is_decided_by_richer_meshes_or_not_at_all(k: float, error_bars: bool) -> None:
    """A spring of +-5e-8, beyond round-off and within the tolerance of a count: without error bars its sign is open."""
    foot = replace(pinned(), energy=lambda x, c: loads.rotational_spring(x.q, c.k * (1 - c.P)))
    scene = column("soft", (foot, free()), (0.0, 0.1), constants={"k": k}, planar="e2")
    diagram = trace(scene, Discretization("reduced", 8, 6), Plan(depth=0, error_bars=error_bars))
    index = int(k < 0)
    expected = (index, 0, 0, not index) if error_bars else (0, 1, 1, None)
    assert {(p.negative, p.zero, p.undecided, p.stable) for p in diagram[0].points} == {expected}
    for point in diagram[0].points:
        (mode,) = point.soft
        assert mode.value == pytest.approx(k * (1 - point.load), abs=2e-9) and mode.decided == error_bars
    assert ("undecided stability" in diagram.in_words()) == (not error_bars)
    said = [sentence for sentence in diagram.warnings if "the index is 0 or 1 (rotation about e2" in sentence]
    assert len(said) == (not error_bars) and all(s.endswith("decide that, ask for error bars.") for s in said)


@pytest.mark.parametrize(
    ("k", "last"), [(5e-10, 0.02), *(pytest.param(k, 0.5, marks=pytest.mark.long) for k in (2e-10, 1e-7))]
)
def test_what_no_mesh_decides_is_not_refined_again(k: float, last: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """By a second richer mesh."""
    levels, companion = list[int](), SoftStates._companion
    monkeypatch.setattr(SoftStates, "_companion", lambda self, level: levels.append(level) or companion(self, level))
    (branch,) = trace(nearly_free(k).varying("P", (0.0, last)), Discretization("reduced", 4, 4), Plan(depth=0))
    assert any(p.undecided for p in branch.points) == (k < 1e-8) and set(levels) == {0}


# --- a localised buckle ---------------------------------------------------------------------------------------------


@cache
def buckle(elements: int) -> Diagram:
    return trace(localised(), Discretization("reduced", elements, 6), Plan(at=(2900.0,), depth=1))


@pytest.mark.long
def test_a_mesh_that_pins_a_buckle_is_found_out(folder: Path) -> None:
    """With 27 elements it is in the middle of one, unstable on this mesh: a second direction that no rod has."""
    diagram = buckle(27)
    branch = diagram[1]
    undecided = [p for p in branch.points if p.undecided]
    assert len(undecided) > 6 and {p.negative for p in branch.points[1:]} == {1}  # as the rod has
    assert all(m.name == SLIDING and m.uncertainty > 1e-5 for p in undecided for m in p.soft)
    assert any("the index is 1 or 2 (sliding along the rod" in sentence for sentence in diagram.warnings)
    (asked,) = diagram.special("user", "branch 1")
    assert (asked.negative_before, asked.negative_after, asked.point.undecided) == (1, 1, 1)
    verdict = diagram.assess(asked)
    assert (verdict.negative, verdict.undecided, verdict.stable) == (1, 1, False)
    stream = io.StringIO()
    Report(MPI.COMM_SELF, stream).table(diagram.data, diagram.branches)
    assert " 1 or 2" in stream.getvalue() and "sliding along the rod, mu = " in stream.getvalue()
    pieces = [p for p in pieces_of(diagram.data["branches"][1]) if p.undecided]
    assert {(p.label, p.kind) for p in pieces} == {("1 or 2", UNSTABLE)}
    again = load(diagram.save(folder / "pinned"), localised())
    assert [p.undecided for p in again[1].points] == [p.undecided for p in branch.points]
    assert [p.soft for p in again[1].points] == [p.soft for p in branch.points]


# --- in words and pictures ------------------------------------------------------------------------------------------


def test_a_bent_cantilever_that_is_nearly_round_has_one_name_for_its_rotation() -> None:
    """It turns about its axis as its sections turn back; it slides nowhere, and its mode is that soft mode."""
    round_but = lambda v, k, c: bending_and_twist(k, (1.0, 1.0 + 1e-6, 1.0))  # noqa: E731
    rod = replace(column("bent", SUPPORTS["clamped-free"], (0.0, 10.0)), energy=round_but)
    diagram = trace(rod, Discretization("reduced", 6, 6), Plan(at=(4.0,), depth=1, most_branches=3, error_bars=False))
    for branch in diagram.branches[1:]:
        (point,) = [s.point for s in branch.special if s.kind == "user"]
        (mode,) = diagram.assess(point).soft
        assert mode.name == "rotation about e3 with turning of the cross-sections about d3"
        assert mode.name in diagram.modes(point, 2).motion and "mixed" not in diagram.modes(point, 2).motion


@pytest.mark.parametrize(
    "elements", [8, pytest.param(16, marks=pytest.mark.long), pytest.param(32, marks=pytest.mark.long)]
)
def test_a_sign_that_is_the_error_of_the_mesh(elements: int) -> None:
    """A strip between two clamps that pass each other has one branch point in its plane, as they meet: d = 1.

    The index is 0 before it, and 1 from there on: conjugate points in 60 digits at d = 1.2, 1.5, 1.8, 1.87, each with
    one.  That eigenvalue becomes exponentially small, so that each mesh has zeros of its own of it.
    """

    def start(s: np.ndarray) -> np.ndarray:
        half = 0.1 * np.sin(2 * pi * s)
        return np.stack([np.cos(half), 0 * s, np.sin(half), 0 * s], axis=1)

    strip = column(
        "passed", (clamped(), clamped(lambda c: (0.0, 0.0, 1 - c.d))), (0.01, 1.95), load="d", planar="e2", start=start,
        constants={"d": 0.01, "B2": 1.0}, ordinate=Ordinate("height", s=0.5, of=lambda r, q: r[0]),
    )  # fmt: skip
    found = trace(strip, Discretization("reduced", elements, 6), Plan(depth=0))
    (point,) = found.special("branch point")
    assert point.resolved and abs(point.point.load - 1) <= 1.5 * point.error_estimate < 1e-8
    assert (point.negative_before, point.negative_after) == (0, 1)
    for row in found[0].points:
        assert row.negative <= (row.load > 1) <= row.negative + row.undecided or row is point.point
    assert sum(row.undecided for row in found[0].points if row.load < 1.6) == 0
    assert any("the index is 0 or 1" in sentence for sentence in found.warnings)
