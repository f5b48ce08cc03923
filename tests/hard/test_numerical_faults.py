"""Numerical faults, made on purpose at a chosen moment: the branch ends with the reason, the others go on."""

from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import demo_cases
import numpy as np
import pytest
from hemitropic_cases import scene
from mpi4py import MPI
from petsc4py import PETSc

import rodfem
from rodfem import ConvergenceError, Diagram, InputError, Observer, run
from rodfem.adaptivity.error_estimate import Enriched
from rodfem.continuation import branch_solver
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.fem.system import System
from rodfem.stability.nonsymmetric import NonsymmetricPencil

MESH, PLAN = rodfem.Discretization("reduced", 8, 6), rodfem.Plan((0.0, 0.35), depth=1)
FAULTS: list[tuple[Callable[[], Exception], str]] = [
    (lambda: ConvergenceError("MUMPS could not factor the matrix."), "MUMPS could not factor the matrix."),
    (
        lambda: PETSc.Error(76),
        "PETSc gave up (error code 76): use smaller steps, another discretisation, or other options of PETSc.",
    ),
    (lambda: PETSc.Error(55), "Memory is exhausted: use fewer elements or a lower degree."),
    (lambda: MemoryError(), "Memory is exhausted: use fewer elements or a lower degree."),
    (lambda: np.linalg.LinAlgError("Singular matrix"), "Numbers allow no answer (Singular matrix): use smaller steps"),
]


class On(Observer):
    """Knows the branch that is being traced."""

    name, saved = "", 0

    def branch(self, branch: Any) -> None:
        self.name = branch.name

    def complete(self, diagram: Diagram) -> None:
        self.saved = len(diagram)


@pytest.fixture(scope="module")
def whole() -> Diagram:
    """What a computation without a fault finds."""
    return rodfem.trace(scene(), MESH, PLAN)


def failing(method: Callable[..., Any], when: Callable[[], bool], fault: Callable[[], Any]) -> Callable[..., Any]:
    """The method, or the fault instead of it."""

    def instead(*arguments: Any, **options: Any) -> Any:
        if when():
            raise fault()
        return method(*arguments, **options)

    return instead


@pytest.mark.ranks
@pytest.mark.long
@pytest.mark.versions
@pytest.mark.parametrize(
    ("fault", "sentence"), [FAULTS[0], *(pytest.param(*x, marks=pytest.mark.alone) for x in FAULTS[1:])]
)
def test_a_branch_ends_and_others_go_on(
    fault: Callable[[], Exception], sentence: str, whole: Diagram, monkeypatch: pytest.MonkeyPatch
) -> None:
    on, calls = On(), [0]

    def on_the_first_side() -> bool:
        calls[0] += on.name == "branch 1"
        return on.name == "branch 1" and calls[0] > 3

    monkeypatch.setattr(BranchSolver, "step", failing(BranchSolver.step, on_the_first_side, fault))
    diagram = rodfem.trace(scene(), MESH, PLAN, on)
    assert [b.name for b in diagram] == [b.name for b in whole] == ["straight", "branch 1", "branch 2"]
    assert diagram["branch 1"].ended.startswith(f"no convergence: {sentence}")
    assert [w for w in diagram.warnings if w.startswith(sentence)]
    assert 2 <= len(diagram["branch 1"].points) < len(whole["branch 1"].points)
    for name in ("straight", "branch 2"):
        assert [p.negative for p in diagram[name].points] == [p.negative for p in whole[name].points]
        loads = [p.load for p in whole[name].points]
        assert [p.load for p in diagram[name].points] == pytest.approx(loads, rel=1e-12)
        assert diagram[name].ended == whole[name].ended
    assert on.saved == 3


@pytest.mark.ranks
@pytest.mark.short
def test_a_step_with_nan_is_retried(whole: Diagram, monkeypatch: pytest.MonkeyPatch) -> None:
    """One correction that gives no numbers costs a smaller step, and changes nothing else."""
    correct, calls = branch_solver.correct, [0]

    def broken(system: System, x: PETSc.Vec, *arguments: Any) -> Any:
        calls[0] += len(arguments) == 3  # those of steps
        if calls[0] in (3, 7) and len(arguments) == 3:
            x.set(np.nan)
        return correct(system, x, *arguments)

    monkeypatch.setattr(branch_solver, "correct", broken)
    diagram = rodfem.trace(scene(), MESH, PLAN)
    assert calls[0] > 7
    assert [b.ended for b in diagram] == [b.ended for b in whole]
    found, expected = ([(str(s.kind), s.point.load) for s in d.special()] for d in (diagram, whole))
    assert [kind for kind, _ in found] == [kind for kind, _ in expected]
    np.testing.assert_allclose([load for _, load in found], [load for _, load in expected], rtol=0, atol=1e-9)


def test_no_error_is_estimated_where_memory_is_exhausted(monkeypatch: pytest.MonkeyPatch) -> None:
    calls = [0]

    def second() -> bool:
        calls[0] += 1
        return calls[0] == 2

    monkeypatch.setattr(Enriched, "estimate", failing(Enriched.estimate, second, MemoryError))
    diagram = rodfem.trace(scene(), MESH, PLAN)
    assert len(diagram) == 3
    estimates = [s.error_estimate for b in diagram for s in b.special]
    assert np.isnan(estimates).tolist() == [False, True] + [False] * (len(estimates) - 2)
    assert [w for w in diagram.warnings if "Memory is exhausted" in w and w.startswith("No error was estimated at lam")]


@pytest.mark.ranks
@pytest.mark.long
@pytest.mark.versions
@pytest.mark.parametrize(
    "fault",
    [pytest.param(lambda: ConvergenceError("SLEPc found none."), marks=pytest.mark.alone), lambda: PETSc.Error(76)],
)
def test_a_sweep_keeps_what_it_has(
    fault: Callable[[], Exception], folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Rows that SLEPc has certified before it fails, and no other: where nothing is proved."""
    rod, mesh, calls = demo_cases.scene("follower"), rodfem.Discretization("auto", 6, 3), [0]
    whole = rodfem.trace(rod, mesh, rodfem.Plan(error_bars=False))[0].points

    def later() -> bool:
        calls[0] += 1
        return calls[0] > 9  # three of them at the first state alone, for its two shifts

    monkeypatch.setattr(NonsymmetricPencil, "inverse", failing(NonsymmetricPencil.inverse, later, fault))
    (branch,) = run(rod, mesh, None, folder, figures=False, quiet=True)
    assert branch.ended.startswith("no convergence: ") and str(branch.special[-1].kind) == "end"
    assert 4 <= len(branch.points) < len(whole)
    for kept, other in zip(branch.points, whole, strict=False):
        assert kept.load == other.load and kept.negative == other.negative
        np.testing.assert_allclose(kept.omega2, other.omega2, rtol=1e-6, atol=1e-6)
    assert rodfem.load_json(folder / "diagram.json")["branches"][0]["ended"] == branch.ended


@pytest.mark.ranks
@pytest.mark.short
@pytest.mark.parametrize("name", ["constant", "number", "ordinate", "discretisation", "plan"])
def test_ranks_with_different_input(name: str) -> None:
    """One sentence on every rank that names what differs."""
    own, rod = MPI.COMM_WORLD.rank, scene(span=(0.0, 0.1))
    energy, of = rod.energy, rod.ordinate.of
    scenes = {
        "constant": lambda: rod.varying(A=-3.0 + 0.1 * own),
        "number": lambda: replace(rod, energy=lambda v, k, c: energy(v, k, c) + 0.1 * own * k[0] ** 2),
        "ordinate": lambda: replace(rod, ordinate=replace(rod.ordinate, of=lambda r, q: own + of(r, q))),
    }
    stated, what = (scenes[name](), "scene") if name in scenes else (rod, name)
    mesh = rodfem.Discretization("reduced", 8 + own * (name == "discretisation"), 6)
    plan = rodfem.Plan(depth=own * (name == "plan"), error_bars=False)
    several = MPI.COMM_WORLD.size > 1
    with pytest.raises(InputError, match=rf"different input \({what}\)") if several else nullcontext():
        rodfem.trace(stated, mesh, plan)


@pytest.mark.ranks
def test_an_ordinate_that_is_no_number() -> None:
    """It is one in the trial states, and none in those of the branch."""
    rod = scene(span=(0.0, 0.1))
    rod = replace(rod, ordinate=replace(rod.ordinate, of=lambda r, q: 0.0 if abs(q[1]) > 1e-3 else np.nan))
    diagram = rodfem.trace(rod, MESH, rodfem.Plan(depth=0, error_bars=False))
    sentence = "the ordinate is not a finite number, and perhaps at other loads: return one at every state."
    assert diagram.warnings == [f"straight: at lam = 0 {sentence}"]
