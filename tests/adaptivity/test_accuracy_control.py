"""An accuracy asked for: true errors stay below it at every row and special point, at less cost than uniform meshes."""

import json
from functools import cache
from pathlib import Path

import boundary_layer
import classics
import closed_form_hemitropic
import demo_cases
import h5py
import hemitropic_cases
import numpy as np
import pytest
import reference_values
from closed_forms import elastica

from rodfem import Branch, Diagram, InputError, Plan, Scene, Solver, run, trace
from rodfem.continuation.kinds import BRANCH_POINT, FOLD, USER
from rodfem.fem.fields import Discretization
from rodfem.output.files import load_state

ACCURACIES = pytest.mark.parametrize("accuracy", [1e-4, 1e-6, 1e-10])


def explored(scene: Scene, accuracy: float, at: tuple[float, ...] = (), depth: int = 1) -> Diagram:
    """Explore a scene to an accuracy, on meshes of the program's choice."""
    return trace(scene, plan=Plan(at=at, depth=depth, accuracy=accuracy))


def special(found: Diagram, branch: str, kind: str) -> list[tuple[float, float]]:
    """Loads and ordinates of the special points of a kind on a branch."""
    return [(s.point.load, s.point.ordinate) for s in found.special(kind, branch)]


def claimed(branches: list[Branch]) -> float:
    """Largest error that a row or a special point is estimated to have."""
    rows = [p.estimate for b in branches for p in b.points if np.isfinite(p.estimate)]
    return max(rows)


@pytest.mark.parametrize("accuracy", [1e-8, *(pytest.param(a, marks=pytest.mark.long) for a in (1e-4, 1e-6, 1e-10))])
def test_hemitropic(accuracy: float) -> None:
    found = explored(hemitropic_cases.scene(), accuracy, at=(0.5,))
    errors = np.subtract(
        [load for load, _ in special(found, "straight", BRANCH_POINT)], closed_form_hemitropic.loads(-3, 1, 1, 3)
    )
    assert abs(errors).max() < accuracy
    assert abs(special(found, "branch 1", USER)[0][1] - reference_values.FIRST[0.5][0]) < accuracy
    assert abs(np.subtract(special(found, "branch 2", FOLD)[0], reference_values.FOLD[:2])).max() < accuracy
    assert abs(special(found, "branch 2", USER)[0][1] - reference_values.SECOND[0.5][0]) < accuracy
    assert claimed(found.branches) <= accuracy


@pytest.mark.few(1)
@pytest.mark.parametrize("accuracy", [1e-5, 1e-9])
def test_every_row_of_an_elastica(accuracy: float) -> None:
    """Deflection of the tip of a column: ``2 k / sqrt(P)`` with ``K(k) = sqrt(P)``, all along the buckled branch."""
    found = explored(classics.elastica(20.0), accuracy)
    trunk, buckled = found.branches[:2]
    (buckling,) = [s.point.load for s in trunk.special if s.kind == BRANCH_POINT][:1]
    assert abs(buckling - np.pi**2 / 4) / buckling < accuracy
    for p in buckled.points[1:]:
        low, exact, high = (elastica(p.load + h)[1] for h in (-1e-4, 0.0, 1e-4))
        miss, slope = exact - p.ordinate, (high - low) / 2e-4
        assert abs(miss) / (1 + abs(slope)) < accuracy  # distance from the curve: upright where it begins
    assert claimed(found.branches) <= accuracy


@cache
def pulled(accuracy: float) -> Diagram:
    return explored(boundary_layer.scene(), accuracy, at=(4.0, 5.0))


@pytest.mark.long
@ACCURACIES
def test_every_row_of_a_taut_rod(accuracy: float) -> None:
    """Boundary layers that become thirty times thinner on the way, down to a thousandth of the rod."""
    found = pulled(accuracy)
    (branch,) = found.branches
    assert branch.ended == "end of range"
    assert max(abs(p.ordinate - boundary_layer.shortening(p.load)) for p in branch.points) < accuracy
    assert claimed(found.branches) <= accuracy
    assert len({p.mesh for p in branch.points}) > 2


def test_a_graded_mesh_beats_uniform_ones() -> None:
    """Equal elements with eight times the unknowns err more at the end of the branch of the taut rod."""
    found = pulled(1e-9)
    end = found.branches[0].points[-1]
    mesh = found.solvers[end.mesh].system.fields.discretization
    assert np.diff(mesh.vertices).max() > 100 * np.diff(mesh.vertices).min()
    uniform = Discretization("auto", 8 * (len(mesh.vertices) - 1), mesh.degree)
    solver = Solver(boundary_layer.scene(), uniform).equilibria
    x, outcome = solver.at_load(solver.shape.restore(found.solvers[end.mesh].shape.sample(end.x)), 6.0)
    assert outcome.converged
    errors = [abs(ordinate - boundary_layer.shortening(6.0)) for ordinate in (end.ordinate, solver.shape.ordinate(x))]
    assert 1000 * errors[0] < errors[1]


@pytest.mark.ranks
@pytest.mark.long
def test_what_was_used_where(folder: Path) -> None:
    """Files name the mesh of each row; rows of all meshes are read back, on another mesh too."""
    scene = boundary_layer.scene((3.0, 4.5))
    run(scene, plan=Plan(scene.span, accuracy=1e-6), output=folder, figures=False, quiet=True)
    data = json.loads((folder / "diagram.json").read_text())
    assert data["accuracy"] == 1e-6
    (branch,), meshes = data["branches"], data["meshes"]
    rows = branch["columns"]
    assert len(set(rows["mesh"])) > 1
    assert max(rows["estimate"]) < 1e-6
    assert data["discretization"]["unknowns"] == max(m["unknowns"] for m in meshes)
    with h5py.File(folder / "states.h5") as file:
        for row, number in enumerate(rows["mesh"]):
            s = file["branches/first branch/s"][row]
            s = s[np.isfinite(s)]
            assert s[:: meshes[number]["degree"]] == pytest.approx(meshes[number]["vertices"], abs=1e-14)
    other = Solver(scene, Discretization("auto", 40, 6)).equilibria
    for row in (0, len(rows["load"]) - 1):
        x = load_state(folder / "states.h5", "first branch", row, other)
        assert other.shape.ordinate(x) == pytest.approx(rows["ordinate"][row], abs=1e-5)


@pytest.mark.long
def test_elements_beside_an_accuracy() -> None:
    """They are not used; of a mesh that was had before nothing is, and vertices are the first."""
    scene = classics.column("euler", classics.SUPPORTS["clamped-free"], (0.0, 1.0))
    plan = Plan(depth=0, accuracy=1e-4)
    given = trace(scene, Discretization("reduced", 3, 2), plan)
    plain = trace(scene, Discretization("reduced"), plan)
    meshes = [diagram.solvers[0].system.fields.discretization for diagram in (given, plain)]
    assert meshes[0] == meshes[1]
    again = trace(scene, Discretization("reduced", 3, 2), Plan(depth=0, error_bars=False)).again(accuracy=1e-4)
    assert again.solvers[0].system.fields.discretization == meshes[0] and not again.notes
    graded = Discretization("reduced", 3, 6, (0.0, 0.2, 0.5, 1.0))
    kept = trace(scene, graded, plan)
    assert kept.solvers[0].system.fields.discretization == graded and not kept.notes


def test_a_sweep_has_one_mesh() -> None:
    scene = demo_cases.scene("follower")
    with pytest.raises(InputError, match="is swept on one mesh"):
        Plan(scene.span, accuracy=1e-4).check(scene)
