"""Words of the terminal, of diagram.json and of the documentation say what is computed, and what is left out."""

import io
import json
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import classics
import demo_cases
import hemitropic_cases
import numpy as np
import pytest
from hemitropic_cases import run_demo
from mpi4py import MPI

import rodfem
from rodfem import Discretization, Plan, Scene, run
from rodfem.app.terminal import Report

HOME = Path(__file__).parents[2]
FIRST = MPI.COMM_WORLD.rank == 0
MESH = Discretization("reduced", 6, 3)


@pytest.fixture
def printed(capfd: pytest.CaptureFixture[str]) -> Iterator[Any]:
    """Returns what a run prints on the first rank, and its diagram.json."""

    def terminal(scene: Scene, plan: Plan, folder: Path, mesh: Discretization = MESH) -> tuple[str, dict[str, Any]]:
        run(scene, mesh, plan, folder, figures=False, verbose=True)
        return capfd.readouterr().out, json.loads((folder / "diagram.json").read_text())

    yield terminal


def compressed(rod: str = "flexible") -> Scene:
    """A column whose stretch and shear have an energy: haringx of docs/rods.md."""
    return classics.column(
        "column", classics.SUPPORTS["clamped-free"], (0.0, 1.0), rod=rod,
        energy=lambda v, k, c: (
            25.0 * (v[0] ** 2 + v[1] ** 2) + 100.0 * (v[2] - 1) ** 2 + 0.5 * (k[0] ** 2 + 2 * k[1] ** 2 + k[2] ** 2)
        ),
    )  # fmt: skip


# --- what an energy is, and what it does without ---------------------------------------------------------------------


def test_energy_is_that_of_the_rod_alone(folder: Path, printed: Any) -> None:
    """Under ``P`` the stretch is ``1 - P/200``: ``int W ds = P^2/400``, where the total energy is ``-P^2/400``."""
    out, data = printed(compressed(), Plan(error_bars=False), folder)
    columns = data["branches"][0]["columns"]
    np.testing.assert_allclose(columns["energy"], np.array(columns["load"]) ** 2 / 400, rtol=0, atol=1e-12)
    assert "without the potential of the loads" in data["meaning"]["energy"]
    assert set(columns) <= set(data["meaning"])
    assert not FIRST or re.search(r"ordinate +int W ds +index", out)


@pytest.mark.long
@pytest.mark.parametrize(
    ("rod", "ignored", "better"), [("unshearable", ["v1", "v2"], "flexible"), ("flexible", [], "")]
)
def test_an_energy_of_strains_that_a_rod_does_not_have(
    rod: str, ignored: list[str], better: str, folder: Path, printed: Any
) -> None:
    scene = compressed(rod)
    assert [f"v{i + 1}" for i in scene.ignored_strains] == ignored
    out, data = printed(replace(scene, span=(0.0, 0.1)), Plan(error_bars=False), folder)
    assert data["ignored_strains"] == ignored
    sentence = re.findall(r"The stored energy depends on (.*), but a rod .* choose rod='(\w+)'\.\n", out)
    if FIRST and ignored:
        assert [x.split(" ")[0] for x in sentence[0][0].split(", ")] == ignored
        assert sentence[0][1] == better
    else:
        assert not sentence


# --- eigenvalues and indices -----------------------------------------------------------------------------------------


@pytest.mark.long
def test_what_is_counted_under_loads_without_potential(folder: Path, printed: Any) -> None:
    beck = demo_cases.scene("follower", span=(0.0, 5.0))
    mesh = Discretization("pointwise", 4, 4)
    out, data = printed(beck, Plan(at=(2.0,), method="shift-invert", error_bars=False), folder, mesh)
    assert "negative or complex" in data["meaning"]["negative"]
    if FIRST:
        assert "not of an index" in out
        assert out.count("index") == 1
        assert len(re.findall(r"\bunstable *$|\bunstable +zero", out, flags=re.MULTILINE)) == 2
        assert "P = 2: stable" in out


# --- branch points that are not followed -----------------------------------------------------------------------------


@pytest.mark.long
def test_branch_points_below_the_depth_are_counted(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    common = ("--range", "0", "0.2", "--elements", "6", "--degree", "3", "--no-figures", "--output", str(folder))
    run_demo(*common, "--depth", "0")
    out = capfd.readouterr().out
    data = json.loads((folder / "diagram.json").read_text())
    assert [branch["name"] for branch in data["branches"]] == ["straight"]
    assert data["branch_points_not_followed"] == 1
    assert [s["followed"] for s in data["branches"][0]["special"] if s["kind"] == "branch point"] == [False]
    assert not FIRST or "not followed, as the depth is 0 (switches from the first branch): --depth 1 follows" in out
    run_demo(*common, "--depth", "1")
    out = capfd.readouterr().out
    data = json.loads((folder / "diagram.json").read_text())
    assert len(data["branches"]) == 2
    assert data["branch_points_not_followed"] == 0
    assert "not followed" not in out


# --- documentation ---------------------------------------------------------------------------------------------------


def test_the_spring_of_the_readme(capfd: pytest.CaptureFixture[str]) -> None:
    """It prints the stiffness that the page says, the same whatever the steps; by Kirchhoff's equations 2424.4 N/m."""
    block = re.findall(r"```python\n(.*?)```", (HOME / "README.md").read_text(), flags=re.DOTALL)[-1]
    exec(block, {})
    said, printed = (
        int(re.findall(rf"(\d+){after}", text)[-1])
        for text, after in ((block, "; the handbook's"), (capfd.readouterr().out, " N/m"))
    )
    assert said == printed == pytest.approx(2424.4, rel=0.005)


@pytest.mark.long
def test_python_of_the_readme(folder: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> None:
    """All its blocks, one after the other, as they stand."""
    monkeypatch.setattr("rodfem.app.run.draw", lambda *_: None)
    monkeypatch.chdir(folder)
    names: dict[str, Any] = {}
    pages = "".join((HOME / page).read_text() for page in ("README.md", "docs/python.md"))
    for block in re.findall(r"```python\n(.*?)```", pages, flags=re.DOTALL):
        exec(block, names)
    solver, straight, buckled = names["solver"], names["straight"], names["buckled"]
    assert (straight.index, buckled.index, buckled.zero, buckled.load) == (2, 0, 1, 0.52)
    np.testing.assert_allclose(names["modes"].value[0], solver.assess(straight, "dense").values[0], rtol=1e-8)
    assert capfd.readouterr().out.count("Locus of the branch point in lam and k0") == 1


def test_an_equilibrium_that_there_is_not() -> None:
    hemitropic = rodfem.Solver(hemitropic_cases.scene(), MESH)
    with pytest.raises(rodfem.SceneError, match=r"lam = 1.5 is outside its admissible range"):
        hemitropic.equilibrium(1.5)
    with pytest.raises(rodfem.ConvergenceError, match=r"No equilibrium was found at lam = 0.5: go there in steps"):
        hemitropic.equilibrium(0.5, guess=hemitropic.equilibria.system.new_vector())


def test_a_log_of_a_long_run_has_lines_of_progress(monkeypatch: pytest.MonkeyPatch) -> None:
    scene, plan = hemitropic_cases.scene(span=(0.0, 0.2)), Plan(depth=1, error_bars=False)
    plain, log = io.StringIO(), io.StringIO()
    rodfem.trace(scene, MESH, plan, Report(stream=plain))
    monkeypatch.setattr("rodfem.app.terminal.PAUSE", -1.0)
    rodfem.trace(scene, MESH, plan, Report(stream=log))
    assert [x for x in log.getvalue().splitlines() if not x.startswith("  ... ")] == plain.getvalue().splitlines()
    assert log.getvalue().count("\n  ... straight, 1 known, 0 branch points left to follow, lam = ") > 2
