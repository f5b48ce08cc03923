"""What pictures draw: supports, loads and cross-sections as files record them, directions of view, the state chosen."""

from itertools import combinations
from math import cos, pi, sin, sqrt
from pathlib import Path
from typing import Any

import classics
import h5py
import numpy as np
import pytest
import ufl
from classics import ON_AXIS, push
from matplotlib.image import imread

from rodfem import Attachment, InputError, Scene, at, everywhere, integral
from rodfem.file_format import STATES
from rodfem.forms import loads
from rodfem.output.glyphs import SIDES, Look, glyphs_of, profile_of, turn
from rodfem.output.pieces import typical_state
from rodfem.output.render import draw_shape_safely, read_state, view_of
from rodfem.output.style import DARK, GREY, LOAD, STEEL
from rodfem.problem.ends import End, clamped, elastic, free, hinged, pinned, sliding
from rodfem.problem.supports import foundation_of, supports_of, write, write_section

pytestmark = pytest.mark.versions

E1, E2, E3 = np.eye(3)
S = np.linspace(0.0, 1.0, 31)
STRAIGHT = {"s": S, "r": np.outer(S, E3), "q": np.tile([1.0, 0, 0, 0], (31, 1))}


def column(*ends: Any, **more: Any) -> Scene:
    """A straight rod along e3 between these ends, under a load P."""
    return classics.column("column", ends or (clamped(), free()), (0.0, 5.0), inertia=classics.BEAM, **more)


ENDS = {
    "clamp": clamped(lambda c: (0.0, 0.0, 1.0 - c.P / 10), lambda c: (ufl.cos(c.P / 2), 0.0, 0.0, ufl.sin(c.P / 2))),
    "slide": sliding(ON_AXIS, force=push),
    "hinge": hinged((0.0, 2.0, 0.0)),
    "pin": pinned(ON_AXIS, push),
    "spring": elastic(lambda c: (10.0, 20.0, 0.0), lambda c: 3.0, force=push),
    "free": free(follower=push),
}


def saved(path: Path, scene: Scene, load: float = 4.0, **state: Any) -> Path:
    """A file as a run writes it, with one state on one branch."""
    sample = STRAIGHT | {"load": load} | state
    with h5py.File(path, "w") as file:
        file.attrs.update(STATES.mark_attributes(), scene=scene.name, parameter=scene.load, first="straight")
        write_section(file, scene)
        group = file.create_group("branches/straight")
        for name, value in sample.items():
            group[name] = np.array([value])
        write(group, scene, [sample])
    return path


def colors(path: Path) -> set[str]:
    """Colours of what is drawn at the right end, beside the rod."""
    state = read_state(path, "straight", 0)
    return {x.color for x in state.solids(Look(0.01, state.view()))[2:] if x.points[:, 2].mean() > 0.5}


def test_curved_arrow_has_the_sense_of_the_moment() -> None:
    axis = np.array([0.0, 0.6, 0.8])
    path = turn(E1, axis, 1.0, E2, LOAD).points[:-2].reshape(-1, SIDES, 3).mean(axis=1) - E1
    turning = np.cross(path[:-1], np.diff(path, axis=0)) @ axis
    assert turning.min() > -1e-12 and 1.5 * pi < turning.sum() < 2 * pi


def test_constraints_are_named(folder: Path) -> None:
    kept = (
        at(1.0, lambda x, c: ufl.dot(x.r, x.r) - c.P**2),
        integral(lambda x, c: x.k[2], lambda c: c.P),
        everywhere(lambda x, c: x.k[2], strain=True),
    )
    state = read_state(saved(folder / "states.h5", column(constraints=kept)), "straight", 0)
    assert state.setting.notes == ("constraint at s = 1", "integral constraint", "constraint all along the rod")


def test_foundation_is_a_row_of_springs(folder: Path) -> None:
    bed = column(potential=lambda x, c: loads.spring(x.r, (300.0, 300.0, 0.0)))
    found = foundation_of(bed, STRAIGHT | {"load": 4.0})
    np.testing.assert_allclose(found[1], np.tile(np.diag([300.0, 300.0, 0.0]), (9, 1, 1)), atol=1e-3)
    state = read_state(saved(folder / "states.h5", bed), "straight", 0)
    assert [x.color for x in state.solids(Look(0.01, state.view()))].count(STEEL) == 9
    blown = column(potential=lambda x, c: loads.pressure(x.r, x.dr, c.P))
    state = read_state(saved(folder / "states.h5", blown), "straight", 0)
    assert state.setting.notes == ("load by a potential along the rod",)


def test_what_slides_goes_along_with_a_motion_and_its_rails_stay(folder: Path) -> None:
    state = read_state(saved(folder / "states.h5", column(clamped(), ENDS["slide"])), "straight", 0)
    moved = state.centres + 0.1 * np.outer(state.s, E3)
    here, there = (
        glyphs_of(state.setting, state.s, (r, state.directors), Look(0.01, np.eye(3)), state.centres)
        for r in (state.centres, moved)
    )
    shift = [(b.color, (b.points - a.points).mean(axis=0)[2]) for a, b in zip(here, there, strict=True)]
    assert [color for color, _ in shift] == [GREY, GREY, STEEL, STEEL, LOAD]
    np.testing.assert_allclose([z for _, z in shift], [0.0, 0.1, 0.0, 0.0, 0.1], atol=1e-12)


@pytest.mark.few(1)
@pytest.mark.parametrize("kind", ENDS)
def test_only_what_holds_an_end_is_drawn(folder: Path, kind: str) -> None:
    file = saved(folder / "states.h5", column(clamped(), ENDS[kind]))
    expected = {"clamp": {GREY}, "slide": {GREY, STEEL}, "hinge": {DARK, GREY}, "pin": {DARK, GREY, STEEL}}
    found = expected.get(kind, {"spring": {GREY, STEEL}}.get(kind, set()))
    assert colors(file) & {GREY, DARK, STEEL} == found
    assert (LOAD in colors(file)) == (kind not in ("clamp", "hinge"))


def test_a_picture_imports_nothing_from_the_current_folder(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    (folder / "json.py").write_text("open('ran', 'w')")
    assert "cannot read states.h5" in draw_shape_safely(Path("states.h5"), "straight", 0, folder / "shape.png", "")
    assert not (folder / "ran").exists()


@pytest.mark.long
def test_picture_shows_a_clamp_where_there_is_one(folder: Path) -> None:
    """Pixels: a grey block at the left end, and none at the free end."""
    pytest.importorskip("pyvista")
    file = saved(folder / "states.h5", column(clamped(), free()))
    assert draw_shape_safely(file, "straight", 0, folder / "shape.png", "") == ""
    pixels = imread(folder / "shape.png")[300:840, :, :3]  # without the axes and the caption
    grey = (np.ptp(pixels, axis=2) < 0.08) & (abs(pixels.mean(axis=2) - 0.55) < 0.2)
    assert np.count_nonzero(grey[:, :800]) > 2000 and np.count_nonzero(grey[:, 800:]) < 20


@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_cross_sections_have_the_proportion_of_the_stiffnesses(angle: float) -> None:
    """Bending stiffness of the outline, ``int (x_2^2, -x_1 x_2; -x_1 x_2, x_1^2) dA`` by triangles from its centre."""
    turn = np.array([[cos(angle), -sin(angle)], [sin(angle), cos(angle)]])
    B = turn @ np.diag([1.0, 10.0]) @ turn.T
    J = B[::-1, ::-1] * np.array([[1, -1], [-1, 1]])
    (outline,) = profile_of(np.zeros(1), (np.zeros(1), J[None]), np.linspace(0, 2 * pi, 4001)[:-1])
    after = np.roll(outline, -1, axis=0)
    area = (outline[:, 0] * after[:, 1] - outline[:, 1] * after[:, 0]) / 2
    moments = [np.einsum("i,ij,ik->jk", area, a, b) for a in (outline, after) for b in (outline, after)]
    both = [np.einsum("i,ij,ik->jk", area, x, x) for x in (outline, after)]
    second = (sum(moments) + sum(both)) / 12
    np.testing.assert_allclose(second / np.trace(second), J / np.trace(J), atol=1e-6)


def test_view_shows_the_plane_of_the_motion_and_tilts_nothing() -> None:
    bump = np.sin(pi * S)[:, None]
    for way in (E1, E2, np.array([0.6, 0.8, 0.0]), -E2):
        right, up, _ = view_of(STRAIGHT["r"], 0.3 * bump * way)
        np.testing.assert_allclose(right, E3, atol=1e-12)  # clamps are not tilted
        assert up @ abs(way) > 0.85  # upwards is a positive direction, wherever the rod moves
    right, up, _ = view_of(STRAIGHT["r"], 0.3 * bump * E1, down=-E3)
    np.testing.assert_allclose([abs(right @ E1), right @ E3, up @ E1], [1.0, 0.0, 0.0], atol=1e-12)
    assert up @ E3 > 0.9  # gravity is downwards
    view = view_of(STRAIGHT["r"], 0.3 * bump * E2, load=E1)
    np.testing.assert_allclose(view @ view.T, np.eye(3), atol=1e-12)
    seen = [view[:2] @ e for e in (E1, E2, E3)]
    assert min(map(np.linalg.norm, seen)) > 0.7  # none is along the line of sight, and all look different
    for a, b in combinations(seen, 2):
        assert abs(np.linalg.det([a, b])) > 0.4
    assert seen[0][0] == 0.0 < seen[0][1]  # the load is upwards


def branch(name: str, negative: list[int], special: list[dict] = [], **more: Any) -> dict[str, Any]:  # noqa: B006
    rows = [float(i) for i in range(len(negative))]
    columns = {"load": rows, "ordinate": rows, "negative": negative, "arclength": rows, **more.pop("columns", {})}
    return {"name": name, "parent": None, "columns": columns, "special": special, **more}


def singular(row: int, multiplicity: int = 1) -> dict[str, Any]:
    return {"row": row, "kind": "branch point", "multiplicity": multiplicity}


def test_typical_state_is_well_inside_what_it_is_said_to_be() -> None:
    first = branch("straight", [0, 0, 1, 1], [singular(2)])
    leaves = branch("branch 1", [0] * 6 + [1] * 6, [singular(0), singular(5)], parent=["straight", 0])
    assert typical_state({"branches": [first, leaves]}) == ("branch 1", 3, "3, stable")
    unstable = branch("branch 1", [0, 2, 1, 1, 1, 1], [singular(0)], parent=["straight", 0])
    assert typical_state({"branches": [first, unstable]}) == ("branch 1", 4, "4, unstable, index 1")
    planar = branch("straight", [0] * 6, columns={"negative_in_space": [0, 0, 1, 1, 1, 1]})
    assert typical_state({"branches": [planar | {"name": "x"}]})[2] == "1, stable"
    planar["columns"]["negative_in_space"] = [1] * 6
    assert typical_state({"branches": [planar]})[2] == "3, stable in the plane, unstable in space, index 1"
    with pytest.raises(InputError, match="no states"):
        typical_state({"branches": [branch("straight", [])]})


def test_what_is_no_spring_and_what_is_attached() -> None:
    """A semi-tangential moment has a potential, but holds nothing; an attachment is an end without an end."""
    moment = End(energy=lambda x, c: loads.semi_tangential(x.d1, x.d2, c.P))
    assert supports_of(column(clamped(), moment), STRAIGHT | {"load": 4.0})["right end"].kind == "free"
    foot = End(position=lambda c: (0.0, 0.0, 0.0), energy=lambda x, c: loads.rotational_spring(x.q, 3.0))
    left = supports_of(column(foot, free(push)), STRAIGHT | {"load": 4.0})["left end"]
    assert left.kind == "pin" and left.rotation_stiffness.any() and not left.translation_stiffness.any()
    spring = Attachment(0.5, force=push, mass=lambda c: 2.0, energy=lambda x, c: loads.spring(x.r, (7.0, 0.0, 0.0)))
    there = supports_of(column(attachments=(spring,)), STRAIGHT | {"load": 4.0})["attachment 1"]
    assert (there.kind, there.s, there.mass, there.force[2]) == ("spring", 0.5, 2.0, -4.0)
    assert there.translation_stiffness[0, 0] == pytest.approx(7.0)
    assert supports_of(classics.ring(), STRAIGHT | {"load": 0.0}) == {}


def test_a_load_arrow_has_the_direction_of_the_load(folder: Path) -> None:
    """A follower force turns with the end: the arrow's head is where the director points."""
    half = sqrt(0.5)
    turned = {"q": np.tile([half, 0, half, 0], (31, 1)), "r": np.outer(S, E1)}  # d3 = e1
    state = read_state(saved(folder / "states.h5", column(clamped(), free(follower=push)), **turned), "straight", 0)
    (arrow,) = [x for x in state.solids(Look(0.01, state.view())) if x.color == LOAD]
    head, tail = (arrow.points[arrow.points[:, 0].argsort()[[0, -1]]]) @ E1
    assert 1.0 < head < tail  # it pushes against the tip, from outside


def test_a_hanging_weight_pulls_downwards() -> None:
    """Where the scene has no gravity e1 is upwards: whichever way a rod moves, and whatever force does it."""
    bump = np.sin(pi * S)[:, None]
    for moved, load in (
        (-E1, -E1), (E1, -E1), (-E1, None), (E2, -E1), (-E2, -E1), (E2, E1), (np.array([-0.8, 0.6, 0.0]), None)
    ):  # fmt: skip
        view = view_of(STRAIGHT["r"], 0.3 * bump * moved, load=load)
        assert view[1] @ E1 > 0.5 and np.linalg.det(view) == pytest.approx(1.0)
        assert view[0] @ E3 > 0.5  # and the rod goes to the right
    turn = 2 * pi * S[:, None]
    for a, b in ((E1, E2), (E1, E3), (E2, E3), (-E1, E3)):
        view = view_of(2 * np.cos(turn) * a + np.sin(turn) * b, np.zeros((len(S), 3)))
        assert (view[:2] @ abs(a + b) > 0.5).all()  # a ring
