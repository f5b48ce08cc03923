"""A diagram in sentences: what is known of classical rods, and of diagrams made by hand."""

import re
from functools import cache
from math import pi
from typing import Any

import classics
import golden_cases
import pytest

import rodfem
from rodfem import Diagram, Discretization, Plan
from rodfem.output.summary import in_sentences
from rodfem.output.words import special_lines, words_of


def branch(name: str, loads: list[float], negative: list[int], **more: Any) -> dict[str, Any]:
    energy = more.pop("energy", [x**2 for x in loads])
    columns = {"load": loads, "ordinate": loads, "energy": energy, "negative": negative, "zero": [0] * len(loads)}
    made = {"name": name, "parent": None, "columns": columns | more.pop("columns", {}), "special": []}
    return made | {"ended": "end of range", **more}


def special(kind: str, row: int, load: float, before: int, after: int, **more: Any) -> dict[str, Any]:
    known = {"kind": kind, "row": row, "load": load, "negative_before": before, "negative_after": after}
    return known | {"multiplicity": abs(after - before), "law": None, "followed": True, **more}


def said(*branches: dict[str, Any], span: tuple[float, float] = (0.0, 4.0), **more: Any) -> str:
    return " ".join(in_sentences({"parameter": "P", "range": list(span), "branches": list(branches), **more}))


@cache
def traced(name: str) -> Diagram:
    """Diagram of a recorded scene, traced on its usual mesh."""
    return golden_cases.trace(golden_cases.cases()[name](), error_bars=False)


def known(name: str) -> str:
    """Sentences on a recorded scene."""
    return traced(name).in_words()


# --- what is known ----------------------------------------------------------------------------------------------------


def test_hysteresis_between_a_subcritical_pitchfork_and_a_fold() -> None:
    words = known("classic tip spring")
    assert "Branch 1, which leaves straight at 9.95634, is unstable (index 1) from P = 9.95634 to 3.40805" in words
    assert "where it turns back in a fold; then stable to 15." in words
    assert "From P = 3.40805 to 9.95634 two stable states coexist, of straight and branch 1" in words


def test_a_range_without_a_stable_state() -> None:
    assert "From t0 = 1.16279 to 1.6 no stable state was found." in known("demo ring")
    assert "no stable state" not in known("demo hemitropic")


def test_stable_in_the_plane_only() -> None:
    """A planar column, twice as stiff in its plane: by rows, it is unstable in space from pi^2/4 on."""
    words = known("classic planar column")
    found = re.search(r"some load between ([\d.]+) and ([\d.]+), where it loses its stability against motions", words)
    assert found and float(found[1]) < pi**2 / 4 < float(found[2])
    assert "then stable in its plane but not in space (index 1 at most) to 4.9348, where it buckles super" in words
    rod = classics.planar_column()
    columns = branch("straight", [0.0, 1.0], [0, 0])
    assert "stable in its plane (not examined in space) on" in said(columns, span=(0.0, 1.0), planar=rod.planar)
    columns = branch("straight", [0.0, 1.0], [0, 0], columns={"omega2": []})
    words = said(columns, span=(0.0, 1.0), planar=rod.planar)
    assert "stable in its plane (not examined in space), by the frequencies found, on" in words


def test_a_change_that_no_special_point_explains() -> None:
    """Of a rod in space, and of a planar one whose index in its plane changes, it is none out of a plane."""
    words = said(branch("straight", [0.0, 1.0, 2.0, 4.0], [0, 0, 1, 1]))
    assert "loses its stability, and no special point says why" in words
    rod = classics.planar_column()
    columns = branch("straight", [0.0, 1.0, 2.0, 4.0], [0, 0, 1, 1], columns={"negative_in_space": [0, 0, 1, 1]})
    assert "loses its stability, and no special point says why" in said(columns, planar=rod.planar)


def test_how_a_branch_ends() -> None:
    words = said(branch("straight", [0.0, 4.0], [0, 0], ended="meets another branch at P = 4"))
    assert words.endswith("from P = 0 to 4; it ends where it meets another branch at P = 4.")
    words = said(branch("straight", [0.0, 4.0], [0, 0], ended="stretch reaches zero"))
    assert words.endswith("; it ends there: stretch reaches zero.")
    *_, last = special_lines(traced("demo hemitropic").data)
    assert last == "    stretch reaches zero"


# --- by hand ----------------------------------------------------------------------------------------------------------

LAW = {"kind": "transcritical", "coefficient": 1.0, "power": 1, "uncertainty": 0.01, "side": 1}


@pytest.mark.parametrize(
    ("more", "verb"),
    [
        ({"law": LAW}, "meets another branch transcritically;"),
        ({"law": LAW | {"kind": "subcritical pitchfork"}}, "buckles subcritically and jumps;"),
        (
            {"law": LAW | {"kind": "supercritical pitchfork", "uncertainty": 2.0}},
            "buckles supercritically (or nearly so);",
        ),
        (
            {"law": LAW | {"kind": "supercritical pitchfork", "uncertainty": None}},
            "buckles supercritically (or nearly so);",
        ),
        ({"law": LAW | {"kind": "vertical branch", "side": 0}}, "meets a family of states at one and the same load;"),
        ({"law": LAW | {"kind": "pitchfork"}}, "passes a branch point of undetermined form;"),
        ({}, "passes a branch point of undetermined form;"),
        ({"followed": False}, "passes a branch point that was not followed;"),
        ({"kind": "fold"}, "turns back in a fold;"),
        ({"kind": "imperfect bifurcation", "unfolding": -3e-9}, "passes a branch point that an imperfection of the"),
        ({"resolved": False}, "passes a branch point of undetermined form, as far as this mesh tells"),
    ],
)
def test_verbs(more: dict[str, Any], verb: str) -> None:
    point = special("branch point", 2, 2.0, 0, 1) | more
    words = said(branch("straight", [0.0, 1.0, 2.0, 3.0, 4.0], [0, 0, 0, 1, 1], special=[point]))
    assert f"to 2, where it {verb}" in words


@pytest.mark.parametrize(
    ("more", "verb"),
    [
        ({"law": LAW | {"kind": "subcritical pitchfork"}}, "passes a subcritical pitchfork; then stable"),
        ({"kind": "flutter"}, "ceases to flutter: two complex frequencies coincide and become real; then stable"),
        ({"kind": "divergence"}, "ceases to diverge: a frequency passes through zero; then stable"),
        ({"kind": "fold"}, "turns back in a fold; then stable"),
    ],
)
def test_no_rod_buckles_where_the_index_falls(more: dict[str, Any], verb: str) -> None:
    point = special("branch point", 2, 2.0, 2, 0, multiplicity=1) | more
    assert f"to 2, where it {verb}" in said(
        branch("straight", [0.0, 1.0, 2.0, 3.0, 4.0], [2, 2, 2, 0, 0], special=[point])
    )


def test_a_step_in_which_a_change_is_not_located_is_not_called_unstable() -> None:
    """Of a planar rod that falls out of its plane, and of one whose index changes without a special point."""
    loads, planar = [-9.0, -3.0, 2.0, 4.0], {"negative_in_space": [0, 0, 1, 1]}
    in_plane, lost = branch("straight", loads, [0] * 4, columns=planar), branch("straight", loads, [0, 0, 1, 1])
    for rod, state in ((in_plane, "state that is stable in space, too,"), (lost, "stable state")):
        words = said(rod, span=(-9.0, 4.0))
        assert f"From P = 2 to 4 no {state} was found." in words
        assert "Stability is not examined between P = -3 and 2, where it changes." in words
        stable = branch("other", loads, [0] * 4)
        assert "no stable state" not in said(rod, stable) and "not examined" not in said(rod, stable)


def test_out_of_the_plane_a_singular_row_has_an_index_as_others_have() -> None:
    """Straight, it falls out of its plane in the step that ends where it buckles in the plane."""
    rows = branch("straight", [-1.0, 0.0, 2.5, 4.0], [0, 0, 0, 1], columns={"negative_in_space": [0, 0, 1, 2]})
    rows["special"] = [special("branch point", 2, 2.5, 0, 1)]
    words = said(rows, planar="e2")
    assert "is stable from P = -1 to some load between 0 and 2.5, where it loses its stability against motions" in words


def test_states_that_the_mesh_does_not_resolve_may_coexist() -> None:
    loads = [0.0, 2.0, 4.0]
    ends = [special("end", 2, 4.0, 0, 0, resolved=resolved) for resolved in (True, False)]
    rods = [branch("straight", loads, [0] * 3), branch("found 1", loads, [0] * 3, energy=[1.0, 9.0, 20.0])]
    for end, verb in zip(ends, ("two stable states coexist", "two stable states may coexist"), strict=True):
        words = said(rods[0], rods[1] | {"special": [end]})
        assert f"From P = 0 to 4 {verb}, of straight and found 1" in words
        assert ("hysteresis" in words) == end["resolved"]


def test_all_who_say_whether_a_state_is_stable_agree() -> None:
    """A planar column under P = 3: it falls out of its plane at pi^2/4 and buckles in it at pi^2/2."""
    found = rodfem.trace(classics.planar_column(), Discretization(elements=4), Plan((0.0, 6.0), at=(3.0,), depth=0))
    (special,) = (s for s in found[0].special if s.kind == "user")
    point, row = special.point, special.row
    assert pi**2 / 4 < point.load < pi**2 / 2 and (point.negative, point.negative_in_space) == (0, 1)
    assert point.stable is found.assess(point).stable is found.at(3.0)[0].stable is False
    for words in (repr(point), repr(found.at(3.0)[0])):
        assert "stable in the plane, unstable in space, index 1" in words
    assert found[0]["stable"][row] == 0.0 and words_of(found.data["branches"][0], planar=True)[row].verdict == "planar"
    assert "stable in its plane but not in space (index 1 at most)" in found.in_words()


def test_rows_decide_where_a_bar_is_wide() -> None:
    """A special point that the mesh does not resolve, with a bar over three rows: their indices are the mesh's."""
    point = special("fold", 1, 1.0, 1, 0, error_estimate=5.0, located_to=1e-9, resolved=False)
    loads, index = [0.0, 1.0, 2.0, 3.0, 4.0], [1, 1, 1, 1, 1]
    words = said(branch("straight", loads, index, special=[point]))
    assert "is unstable (index 1) on its whole range, from P = 0 to 4" in words
    columns = {"undecided": [0, 0, 1, 0, 0]}
    assert "then unstable (index 1) to 4" in said(branch("straight", loads, index, special=[point], columns=columns))


def test_digits_are_those_of_the_error_bar() -> None:
    point = special("fold", 2, 2.123456789, 0, 1, error_estimate=1e-4)
    rod = branch("straight", [0.0, 1.0, 2.123456789, 3.0, 4.0], [0, 0, 0, 1, 1], special=[point])
    assert "to 2.1235, where" in said(rod)
    point["error_estimate"] = None
    assert "to 2.12346, where" in said(rod)


def test_what_is_open_is_said() -> None:
    change = [{"row": 1, "before": 0, "after": 2}]
    jump = branch("straight", [0.0, 1.0, 2.0, 4.0], [0, 0, 2, 2], unexplained=change, singular_start=1)
    words = said(jump, branch_points_not_followed=2)
    assert "to some load between 1 and 2, where it changes its index without a special point" in words
    for sentence in (
        "The first state is singular: what leaves it was not followed.",
        "2 branch points were not followed.",
        "1 change of the index without a special point: see the warnings.",
    ):
        assert sentence in words
    coarse = special("fold", 1, 1.0, 0, 1, resolved=False)
    rod = branch("straight", [0.0, 1.0, 4.0], [0, 0, 1], special=[coarse])
    assert "does not resolve 1 special point, whose error bars are no bounds: use more elements" in said(rod)


def test_undecided_stability_is_no_stability() -> None:
    """An eigenvalue that is not told from zero: the branch is neither called stable nor unstable there."""
    loads, columns = [0.0, 1.0, 2.0, 3.0], {"undecided": [0, 0, 1, 1]}
    words = said(branch("straight", loads, [0, 0, 0, 0], columns=columns))
    assert "straight, is stable from P = 0 to some load between 1 and 2" in words
    assert "then of undecided stability" in words and "its whole range" not in words
    assert "no stable state was found, but there are states of undecided stability" in words
    for index, undecided in (([0, 0, 1, 1], [1, 1, 0, 0]), ([1, 1, 0, 0], [0, 0, 1, 1])):
        words = said(branch("straight", loads, index, columns={"undecided": undecided}))
        assert "to some load between 1 and 2, where it has an eigenvalue that is not told from zero" in words
    side = branch("branch 1", loads, [0] * 4, columns={"undecided": [1] * 4}, parent=["straight", 0])
    first = branch("straight", loads, [0] * 4) | {"special": [special("branch point", 1, 1.0, 0, 0)]}
    assert "of undecided stability" in said(first, side) and "unstable on its whole range" not in said(first, side)


def test_a_load_asked_for_that_is_critical() -> None:
    """Its own state is undecided, on both branches, which says nothing of the states next to it."""
    at = pi**2 / 4
    columns = {"undecided": [0, 0, 1, 0], "arclength": [0.0, 1.0, 1.0 + 1e-12, 2.0]}
    point = special("branch point", 1, at, 0, 1, located_to=1e-11)
    trunk = branch("straight", [1.0, at, at + 1e-12, 4.0], [0, 0, 0, 1], special=[point], columns=columns)
    columns = {"undecided": [0, 1, 0], "arclength": [0.0, 1e-12, 1.0]}
    side = branch("branch 1", [at, at + 1e-12, 4.0], [0, 0, 0], parent=["straight", 0], columns=columns)
    words = said(trunk, side)
    assert "then unstable (index 1) to 4." in words
    assert "Branch 1, which leaves straight at 2.4674, is stable on its whole range" in words


def test_states_that_have_one_energy_at_one_load_alone_coexist() -> None:
    """As a ring twisted by none and by two turns does, where its natural state is twisted by one."""
    loads, turns = [0.0, 0.5, 1.0, 1.5, 2.0], (0.0, 2.0)
    ring, twisted = (
        branch(f"twist {turn:g}", loads, [0] * 5, energy=[(turn - load) ** 2 for load in loads]) for turn in turns
    )
    coexist = "From P = 0 to 2 two stable states coexist, of twist 0 and twist 2"
    assert coexist in said(ring, twisted, span=(0.0, 2.0)) and "coexist" not in said(ring, ring, span=(0.0, 2.0))


def test_many_branches_and_many_intervals_are_counted() -> None:
    unstable = [branch(f"branch {i}", [0.0, 4.0], [1, 1]) for i in range(9)]
    straight = branch("straight", [0.0, 4.0], [0, 0])
    assert "9 other branches are unstable on their whole range." in said(straight, *unstable)
    assert "Branch 0 and branch 1 are unstable on their" in said(straight, *unstable[:2])
    turns = [special("fold", i, float(i), i % 2 == 0, i % 2, multiplicity=1) for i in range(1, 12)]
    winding = branch("straight", [float(i) for i in range(13)], [i % 2 for i in range(13)], special=turns)
    assert "then its stability changes" in said(winding, span=(0.0, 12.0))


def test_of_many_stable_branches_a_hundred_are_compared(monkeypatch: pytest.MonkeyPatch) -> None:
    """All pairs of ten thousand, which a file may have, would take an hour."""
    asked: list[Any] = []
    monkeypatch.setattr("rodfem.output.summary._shared", lambda *pair: asked.append(pair))
    said(*(branch(f"found {i}", [0.0, 2.0, 4.0], [0] * 3) for i in range(300)))
    assert len(asked) == 100 * 99 // 2
