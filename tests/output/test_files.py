"""What a run leaves: diagram.json, states.h5 and a picture, from the command line of the demo."""

import json
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from hemitropic_cases import DEFAULT, run_demo
from mpi4py import MPI
from numpy.polynomial import legendre
from scipy.spatial.transform import Rotation

pytestmark = pytest.mark.short

ELEMENTS, DEGREE, HALF = 8, 6, DEFAULT[3]
ARGUMENTS = f"--elements {ELEMENTS} --degree {DEGREE} --range 0 0.4 --at 0.2 0.35 --no-figures".split()
SPECTRUM = {"reduced": ("--spectrum", "3"), "pointwise": ()}
FORMULATIONS = pytest.mark.parametrize("formulation", ["reduced", "pointwise"])

COLUMNS = {"load", "ordinate", "energy", "negative", "zero"}


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Folders of one run in each formulation."""
    parent = Path(MPI.COMM_WORLD.bcast(str(tmp_path_factory.mktemp("runs"))))
    out = {name: parent / name for name in ("reduced", "pointwise")}
    for name, folder in out.items():
        run_demo(*ARGUMENTS, "--formulation", name, "--output", str(folder), *SPECTRUM[name])
    return out


def diagram(folder: Path) -> dict[str, Any]:
    return json.loads((folder / "diagram.json").read_text(), parse_constant=pytest.fail)  # no NaN, no Infinity


@FORMULATIONS
def test_columns_and_special_points_belong_together(results: dict[str, Path], formulation: str) -> None:
    branches = diagram(results[formulation])["branches"]
    names = [branch["name"] for branch in branches]
    assert len(set(names)) == len(branches) == 3
    for branch in branches:
        columns = branch["columns"]
        assert set(columns) >= COLUMNS
        assert len({len(column) for column in columns.values()}) == 1
        if SPECTRUM[formulation]:
            assert all(len(values) == 3 for values in columns["spectrum"])
        assert isinstance(branch["ended"], str)
        assert branch["parent"] is None or branch["parent"][0] in names
        for s in branch["special"]:
            assert all(columns[name][s["row"]] == s[name] for name in ("load", "ordinate", "energy", "zero"))
        assert branch["special"][-1]["row"] == len(columns["load"]) - 1
        if branch["parent"]:
            parent, number = branch["parent"]
            origin = branches[names.index(parent)]["special"][number]
            assert (origin["kind"], origin["load"]) == ("branch point", columns["load"][0])
    kinds = [[s["kind"] for s in branch["special"]] for branch in branches]
    assert kinds[0] == ["branch point", "user", "branch point", "user", "end"]
    assert kinds[1:] == [["user", "user", "end"], ["fold", "user", "end"]]


@pytest.mark.versions
@FORMULATIONS
def test_states_are_the_rows_of_the_columns(results: dict[str, Path], formulation: str) -> None:
    with h5py.File(results[formulation] / "states.h5", "r") as file:
        branches = diagram(results[formulation])["branches"]
        assert set(file["branches"]) == {branch["name"] for branch in branches}
        np.testing.assert_allclose(file["section/stiffness"], [np.eye(2)], rtol=0, atol=1e-8)
        for branch in branches:
            group, columns = file["branches"][branch["name"]], branch["columns"]
            middle = np.flatnonzero(group["s"][0] == 0.0)[0]
            np.testing.assert_array_equal(group["load"], columns["load"])
            assert [end.attrs["kind"] for end in group["supports"].values()] == ["clamp", "clamp"]
            assert all(len(end["force"]) == len(columns["load"]) for end in group["supports"].values())
            ordinate = np.hypot(*group["r"][:, middle, :2].T)
            np.testing.assert_allclose(ordinate, columns["ordinate"], rtol=0, atol=1e-12)
            least = group["v"][:].reshape(len(ordinate), -1).min(axis=1)
            assert np.all(np.array(columns["stretch"]) <= least + 1e-12)
            vectors = [s["multiplicity"] for s in branch["special"] if s["multiplicity"]]
            assert vectors == [len(group["special"][i]) for i in group.get("special", ())]


@FORMULATIONS
def test_shapes_are_those_of_a_clamped_unshearable_rod(results: dict[str, Path], formulation: str) -> None:
    """Ends where the clamps are, unit quaternions at the nodes, and ``r' = v3 d3`` by differentiating polynomials."""
    with h5py.File(results[formulation] / "states.h5", "r") as file:
        s = file["branches/straight/s"][0]
        np.testing.assert_allclose(s[::DEGREE], np.linspace(-HALF, HALF, ELEMENTS + 1), atol=1e-14)
        lobatto = [-1.0, *np.sort(legendre.legroots(legendre.legder(np.eye(DEGREE)[-1]))), 1.0]  # nodes of v
        for group in file["branches"].values():
            load, r, q, v = (group[name][:] for name in ("load", "r", "q", "v"))
            for end, sign in ((0, -1), (-1, 1)):
                expected = np.outer(sign * HALF * (1 - load), [0, 0, 1])
                np.testing.assert_allclose(r[:, end], expected, rtol=0, atol=1e-9)
                np.testing.assert_array_equal(q[:, end], np.tile([1.0, 0, 0, 0], (len(q), 1)))
            np.testing.assert_allclose(np.linalg.norm(q, axis=-1), 1, rtol=0, atol=1e-9)
            for row in (0, len(load) // 2):
                for e in range(ELEMENTS):
                    nodes = slice(e * DEGREE, (e + 1) * DEGREE + 1)
                    half = (s[nodes][-1] - s[nodes][0]) / 2
                    x = (s[nodes] - s[nodes][0]) / half - 1
                    slope = legendre.legval(lobatto, legendre.legder(legendre.legfit(x, r[row, nodes], DEGREE))) / half
                    turn = legendre.legval(lobatto, legendre.legfit(x, q[row, nodes], DEGREE)).T
                    d3 = Rotation.from_quat(turn[:, [1, 2, 3, 0]]).as_matrix()[:, :, 2]
                    np.testing.assert_allclose(slope.T, v[row, e] * d3, rtol=0, atol=2e-3)
