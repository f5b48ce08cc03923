"""A few of the random scenes of ``python -m tests.hard.fuzz``, each traced twice and counted densely."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from classics import column, push
from hard.fuzz import comparison, known, wider, worker
from hard.fuzz.comparison import Compared, check_specials, compared, of_a_sentence
from hard.fuzz.known import Known
from hard.fuzz.oracle import Oracle, scaling
from hard.fuzz.scenes import scene
from hard.fuzz.summary import in_words

from rodfem import Discretization, Plan, Scene, Solver, StepControl, clamped, free, trace
from rodfem.errors import ConvergenceError, SceneError

pytestmark = pytest.mark.alone

SCENES = [
    *((1, 50), (1, 9), (1, 21), (1, 37), (1, 57), (7, 110), (12, 253), (15, 73)),
    *(pytest.param(*given, marks=pytest.mark.long) for given in ((4, 55), (17, 431))),
]
"""Seed and number: a plane; a clamp that turns; a thrust, with cosh; a load without a potential; a logarithm;
a stretch that vanishes at the very load of a coarser mesh; a curved rod that bends further, whose straight start has
36 half-waves at the end of the range; a ring under dead loads, begun at an unstable circle.  Long: a rod of a
millimetre that turns freely, with frequencies as of the third; another ring, begun beside a circle."""


@pytest.mark.long
def test_a_side_with_other_ordinates_is_said() -> None:
    """With a small force across only an exchange of the ends carries one side of a pitchfork to the other.

    The middle of the swinging column is farther from the axis on one side: which one is traced depends on the mesh.
    """
    plan = Plan(depth=1, error_bars=False)
    diagrams = [trace(scene(32, 252), Discretization("pointwise", elements, 6), plan) for elements in (5, 9)]
    (a,), (b,) = (d.special("fold", "branch 1") for d in diagrams)
    assert a.point.load == pytest.approx(b.point.load, rel=1e-9)
    assert abs(a.point.ordinate - b.point.ordinate) > 1e-4
    for diagram in diagrams:
        assert any("has other ordinates, and is not traced" in said for said in diagram.warnings)


@pytest.fixture
def few_rows(monkeypatch: pytest.MonkeyPatch, few_loads: None) -> None:
    """A third of the rows are counted densely: each of them costs much."""
    monkeypatch.setattr(comparison, "ROWS", (14, 5))


@pytest.mark.few(1)
@pytest.mark.parametrize(("seed", "number"), SCENES)
@pytest.mark.usefixtures("few_rows")
def test_a_random_scene(seed: int, number: int) -> None:
    """Indices are those of dense matrices, special points within their bars; no symmetry is claimed that is none.

    A generic state of great curvature under a cosh energy would hide all forces but its own: a thrust, say.
    """
    found = compared(scene(seed, number), number, depth=0)
    assert found.rows > found.unclear
    assert (found.wrong, found.differs, found.refused) == ([], [], [])
    assert not any("symmetry" in sentence for sentence in found.said)


UNLIKE = [
    (49, 207, "2 eigenvalues that this mesh does not tell apart"),
    (49, 317, "the index changes from 3 to 5, and no special point was found that says why"),
    (51, 11, "is not resolved"),
    (51, 17, ""),
    (51, 475, "the index changes from 6 to 8, and no special point was found that says why"),
    (51, 484, ""),
]
"""Seed, number, and words of a scene of which two meshes show different things, or nothing if they do not.

Critical loads 1.3e-7 apart, rings and a column that are nearly symmetric, a thrust to a singular state, a follower
moment on a rod of which many frequencies nearly meet.
"""


@pytest.mark.long
@pytest.mark.parametrize(("seed", "number", "words"), UNLIKE)
def test_a_scene_that_two_meshes_show_unlike_says_so(seed: int, number: int, words: str) -> None:
    found = compared(scene(seed, number), number, depth=1)
    assert not found.wrong
    assert any(words in sentence for sentence in found.said) if words else not found.differs
    assert max(found.ratios, default=0.0) <= 1


def test_two_points_far_apart_are_no_pair() -> None:
    """Otherwise their distance would count as an error, be it half of the range."""
    rod = column("far", (clamped(), free(push)), (2.0, 3.0))
    (here,) = trace(rod, Discretization("reduced", 4, 5), Plan(depth=0)).special("branch point")
    for away, ratios, alone in ((1.6 * here.error_estimate, 1, 0), (0.02, 1, 0), (0.5, 0, 2)):
        there, found = replace(here, point=replace(here.point, load=here.point.load + away)), Compared("far")
        check_specials("trunk", [here], [there], found, 1.0)
        assert (len(found.ratios), sum("partner" in sentence for sentence in found.differs)) == (ratios, alone)
    there, found = replace(there, point=here.point, note="not estimated: see the warnings"), Compared("no bar")
    check_specials("trunk", [here], [there], found, 1.0)
    assert (found.ratios, found.differs, found.unresolved) == ([], [], 1)


WIDE = [(1, 31), pytest.param(1, 8, marks=pytest.mark.long)]
"""Seed and number."""


@pytest.mark.parametrize(("seed", "number"), WIDE)
@pytest.mark.usefixtures("few_rows")
def test_a_scene_of_the_wider_family(seed: int, number: int) -> None:
    rod, facts = wider.scene(seed, number)
    found = compared(rod, number, 0, facts)
    assert found.rows > found.unclear
    assert (found.wrong, found.differs, found.refused) == ([], [], [])


def test_the_wider_family_changes_no_base_scene() -> None:
    """Its base is the scene of the same number, but for units; the latter draws the same whatever is made before."""
    before = scene(1, 31)
    rod, _ = wider.scene(1, 31)
    assert rod.name.startswith(before.name)
    assert (scene(1, 31).parameters, scene(1, 31).span) == (before.parameters, before.span)


def test_zeros_of_events_are_those_of_arithmetic() -> None:
    """Each function is zero where it says so, and of other signs or falling to zero beside."""
    for timed in (known.sine(7, 0.3), known.touching(0.4), known.pair(0.5, 0.1), known.steep(0.6)):
        assert [timed.of(z) for z in timed.zeros] == pytest.approx([0.0] * len(timed.zeros), abs=1e-13)
    assert len(known.sine(7, 0.3).zeros) == 8
    assert len(known.sine(12, -0.3).zeros) == 12
    assert min(known.above(0.3).of(t) for t in np.linspace(0, 1, 101)) > 0


@pytest.mark.long
def test_a_missing_or_moved_event_is_seen() -> None:
    """An event that is taken away, one that is moved by three bars, and a row beyond the loss of convexity."""
    rod, _ = wider.scene(1, 8)
    facts = Known(rod.span[1], (known.sine(2, 0.3), known.touching(0.4)))
    diagram = trace(rod, Discretization("auto", 5, 6), Plan(depth=0, events=facts.events))
    assert not list(facts.faults(diagram))
    assert "where the stored energy is not convex" in next(Known(rod.span[1], (), 0.5).faults(diagram))
    branch = diagram[0]
    first, second = [s for s in branch.special if s.note == "sine of 2"]
    first.point.load += 3 * first.error_estimate
    branch.special.remove(second)
    branch.points = [p for p in branch.points if p is not second.point]  # its row may be on the zero to the last digit
    assert ["zero is" in sentence or "happens 0 times" in sentence for sentence in facts.faults(diagram)] == [True] * 2


@pytest.mark.long
def test_critical_loads_beside_a_motion_near_zero() -> None:
    """A ring turns its cross-sections at an eigenvalue of -6e-6: beside it two others pass zero, on both meshes."""
    found = compared(scene(49, 249), 249, depth=0)
    assert (found.wrong, found.differs, found.said, len(found.ratios)) == ([], [], [], 2)


@pytest.mark.long
def test_an_oval_that_lies_otherwise_to_the_elements_is_no_other_branch() -> None:
    """The index in space has a zero that the mesh makes 1.58e-9 of one oval, and 1.56e-9 of one that is turned."""
    rod = scene(43, 48)
    diagram = trace(rod, comparison.meshes(rod, 48)[0], replace(comparison.plans(rod, 1)[0], error_bars=False))
    assert [branch.name for branch in diagram] == ["ring", "branch 1"] and not diagram.warnings


@pytest.mark.long
@pytest.mark.parametrize(("seed", "number"), [pytest.param(5, 29, marks=pytest.mark.long), (24, 195)])
@pytest.mark.usefixtures("few_rows")
def test_sides_that_differ_across_their_plane_are_both_traced(seed: int, number: int) -> None:
    """Hinges askew: on one side of the pitchfork the index is 0, or rises to 2, where the other has one more, or less.

    In its plane each is the other's mirror image.  The determinants of the second rod's differ by 6e-4 only.
    """
    found = compared(scene(seed, number), number, depth=1)
    assert (found.wrong, found.differs, found.said) == ([], [], [])


@pytest.mark.long
def test_a_side_that_turns_beside_the_branch_point_is_no_image() -> None:
    """One side turns at a fold 1.4e-9 in load below the branch point, the other has none: both are traced."""
    rod = scene(45, 63)
    for mesh, plan in zip(comparison.meshes(rod, 63), comparison.plans(rod, 1), strict=True):
        diagram = trace(rod, mesh, replace(plan, error_bars=False))
        assert len(diagram) == 5


@pytest.mark.long
@pytest.mark.parametrize(("seed", "number", "factors"), [(1, 98, "petsc"), (13, 14, "chain")])
def test_dependent_constraints_have_no_index(seed: int, number: int, factors: str) -> None:
    """Both ends are held about d1, about which nothing bends: by MUMPS there was an index of -1.

    In the second rod, a millimetre long and compressed, rows of round-off were scaled up: one mesh was traced.
    """
    solver = Solver(scene(seed, number), Discretization("pointwise", 7, 5, factors=factors))
    with pytest.raises((ConvergenceError, SceneError), match="depend on"):
        solver.equilibrium(0.0)


@pytest.mark.long
def test_the_way_down_leaves_a_saddle() -> None:
    """A ring with nearly round sections: a mode of mu = -2e-4 is passed slowly, and one mesh in two stayed there."""
    found = []
    for elements, degree in ((10, 6), (14, 5)):
        solver = Solver(scene(6, 78), Discretization("pointwise", elements, degree))
        found.append(solver.equilibrium(0.2))
        assert Oracle(solver.equilibria.system).eigenvalues(found[-1].x).min() > -1e-9
    assert found[0].energy == pytest.approx(found[1].energy, abs=1e-10)
    assert [point.negative for point in found] == [0, 0]


@pytest.mark.long
def test_the_way_down_from_a_saddle_does_not_turn_back() -> None:
    """Its unstable eigenvalue grows on the way: steps that were uphill led back, round and round on some meshes.

    The first state was the saddle on three of these meshes, and the equilibrium below it on the other.
    """
    energies = []
    for mesh in ((5, 6), (7, 5), (8, 6), (20, 3)):
        solver = Solver(wider.scene(3, 144)[0], Discretization("pointwise", *mesh))
        point = solver.equilibrium(solver.scene.span[0])
        assert point.negative == 0
        assert Oracle(solver.equilibria.system).eigenvalues(point.x).min() > 0
        energies.append(point.potential)
    assert energies == pytest.approx([energies[-1]] * len(energies), abs=1e-7)


@pytest.mark.long
@pytest.mark.parametrize(
    ("seed", "number", "ended"),
    [(15, 177, "stretch reaches zero"), (15, 400, "meets branch 1"), (16, 159, "120 points reached")],
)
def test_how_branches_end(seed: int, number: int, ended: str) -> None:
    """A gap in the last step before the stretch vanishes; a branch found to meet another before loads asked for.

    In the third the other side of a gap is no state of a rod, but squeezed through nothing: no branch begins there.
    """
    rod = scene(seed, number)
    plan = replace(comparison.plans(rod, 1)[0], error_bars=False)
    diagram = trace(rod, comparison.meshes(rod, number)[0], plan)
    assert any(branch.ended.startswith(ended) for branch in diagram)
    for branch in diagram:
        assert all(branch.points[s.row] is s.point for s in branch.special)
        assert min(point.stretch for point in branch.points) > -1e-9


@pytest.mark.long
@pytest.mark.parametrize(("seed", "number"), [pytest.param(11, 221, marks=pytest.mark.long), (19, 252), (19, 255)])
def test_forces_of_a_taut_rod_are_not_determined(seed: int, number: int) -> None:
    """Its ends are as far apart as it is long: by round-off some meshes converged, to forces of 1e9 even."""
    taut, plan = scene(seed, number), Plan(depth=0, steps=StepControl(most=3), error_bars=False)
    for mesh in (*comparison.meshes(taut, number), Discretization("pointwise", 4, 3)):
        with pytest.raises(SceneError, match=r"depend on one another .*is taut"):
            trace(taut, mesh, plan)
    slack = taut.varying("P", (0.01, 0.02))
    assert not any("forces" in words for words in trace(slack, Discretization("auto", 5, 6), plan).warnings)


@pytest.mark.long
def test_both_factors_refuse_a_rod_that_is_held_twice() -> None:
    """About d1, about which it cannot bend: by MUMPS sigma is 1e-9, whose rows were scaled up, and it was traced."""
    rod, plan = wider.scene(2, 168)[0], Plan(depth=0, steps=StepControl(most=3), error_bars=False)
    for mesh in (("auto", 5, 6), ("pointwise", 7, 5), ("pointwise", 2, 2)):
        for factors in ("chain", "petsc"):
            with pytest.raises(SceneError, match=r"depend on one another .*remove"):
                trace(rod, Discretization(*mesh, factors=factors), plan)


@pytest.mark.long
def test_a_difference_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """An index too high by one, and a special point moved by three bars, of the first trace."""
    trace, traces = comparison.trace, []

    def spoilt(*given: object) -> object:
        diagram = trace(*given)
        traces.append(diagram)
        if len(traces) == 1:
            diagram[0].points[2].negative += 1
            special = next(s for s in diagram[0].special if not s.kind.given)
            special.point.load += 3 * special.error_estimate
        return diagram

    monkeypatch.setattr(comparison, "trace", spoilt)
    found = compared(scene(1, 57), 57, depth=0)
    assert any("row 2" in sentence and "dense" in sentence for sentence in found.wrong)
    assert any("times their bars" in sentence for sentence in found.differs)
    assert found.silent


@pytest.mark.long
@pytest.mark.parametrize(("excess", "differs"), [(0.0, False), (1e-3, True)])
def test_energies_where_the_ordinate_is_zero(monkeypatch: pytest.MonkeyPatch, excess: float, differs: bool) -> None:
    """By symmetry, on any mesh: its bar is round-off, but the energies of coarse meshes differ by 2.5e-6."""
    trace = comparison.trace

    def raised(scene: Scene, mesh: Discretization, plan: Plan) -> object:
        diagram = trace(scene, mesh, plan)
        if mesh.degree == 6:  # the first one, and a finer one
            for s in diagram[0].special:
                s.point.energy *= 1 + excess
        return diagram

    monkeypatch.setattr(comparison, "trace", raised)
    found = compared(scene(34, 174), 174, depth=0)
    assert [sentence for sentence in found.differs if "energies" not in sentence] == []
    assert bool(found.differs) == differs


@pytest.mark.long
def test_energies_that_meshes_have_in_error() -> None:
    """By symmetry the ordinate is zero; the energies are 1e-3 in error, apart by a fourth of that, and converge."""
    found = compared(scene(44, 392), 392)
    assert not found.silent and found.unresolved


def test_a_scene_is_the_same_whatever_else_is_asked_for() -> None:
    first, again = scene(3, 5), scene(3, 5)
    assert (first.name, first.parameters, first.span) == (again.name, again.parameters, again.span)
    assert scene(3, 6).parameters != first.parameters
    assert scene(3, 6).rod == first.rod


def test_sentences() -> None:
    assert of_a_sentence("The load 3 is outside the range: choose less.") == ""
    for bad in ("no end", "One line.\nTwo lines.", "At P = nan nothing holds: give a number.", ""):
        assert of_a_sentence(bad)


def test_results_go_on_and_are_summed_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Scenes that have a line are not repeated; one that hangs, and one that dies, have a line and a new child."""
    asked: list[int] = []

    class Child:
        done = 0

        def __init__(self, *given: object) -> None:
            pass

        def ask(self, seed: int, number: int, limit: float) -> worker.Entry:
            asked.append(number)
            outcome = {2: worker.HUNG, 3: worker.CRASHED}.get(number, worker.COMPARED)
            return {
                "seed": seed,
                "number": number,
                "outcome": outcome,
                "rows": 5,
                "unclear": 1,
                "ratios": [0.5, number],
            }

        def end(self) -> None:
            pass

    monkeypatch.setattr(worker, "Child", Child)
    file = tmp_path / "results.jsonl"
    worker.run(file, 1, 2, 0, 1.0)
    entries = worker.run(file, 1, 4, 0, 1.0)
    assert asked == [0, 1, 2, 3]
    assert [json.loads(line)["number"] for line in file.read_text().splitlines()] == asked
    assert [worker.is_fault(entry) for entry in entries] == [False, False, True, True]
    words = in_words(entries)
    assert "4 scenes: 2 compared, 1 hung, 1 crashed" in words
    assert "20 rows counted densely (4 too near a critical state)" in words
    assert "75.00% are within the sum of their bars; the largest ratios: 3, 2, 1" in words


def test_the_oracle_knows_a_saddle_point() -> None:
    """Scaling of rows changes no sign: a matrix of known inertia with entries from 1e-8 to 1e8."""
    rng = np.random.default_rng(1)
    S = rng.normal(size=(9, 9))
    S += S.T
    size = 10.0 ** rng.uniform(-4, 4, 9)
    scaled = (d := scaling(size[:, None] * S * size, np.arange(9)))[:, None] * (size[:, None] * S * size) * d
    assert abs(scaled).max(axis=1) == pytest.approx(1.0, rel=0.05)
    assert (np.linalg.eigvalsh(scaled) < 0).sum() == (np.linalg.eigvalsh(S) < 0).sum()


@pytest.mark.long
def test_the_oracle_knows_a_frequency_that_is_zero() -> None:
    """Nothing holds a rod against a rotation: beside elements of 2e-7 its omega^2 is round-off of up to 2e-4."""
    made, _ = worker.made_by(20, 155, wide=True)
    solver = Solver(made, comparison.meshes(made, 155)[0])
    point = solver.equilibrium(4.9212295)
    zero, *others = Oracle(solver.equilibria.system).squares(point.x)
    assert zero == 0
    assert np.real(others[:3]) == pytest.approx([omega2 for omega2, _ in point.omega2[:3]], rel=1e-6)


@pytest.mark.long
def test_the_oracle_knows_what_it_does_not_know() -> None:
    """A molecule: omega^2 by rodfem are those of three more meshes to 1e-11, dense ones are 3e-5 off."""
    made, _ = worker.made_by(21, 389, wide=True)
    solver = Solver(made, comparison.meshes(made, 389)[0])
    for load in (-1.18e-20, -1.2e-20):
        point = solver.equilibrium(load)
        oracle = Oracle(solver.equilibria.system)
        dense = oracle.squares(point.x)
        off = max(abs(dense - omega2).min() / omega2 for omega2, _ in point.omega2)
        assert off <= comparison.SQUARE or oracle.noise > comparison.SURE * comparison.SQUARE


@pytest.mark.long
def test_a_dip_before_a_stretch_of_zero() -> None:
    """The last row has no tangent, and an eigenvalue is least at the one before it: an exception left the program."""
    rod = scene(35, 459)
    diagram = trace(rod, comparison.meshes(rod, 459)[0], comparison.plans(rod, 1)[0])
    assert diagram[0].ended == "stretch reaches zero" and diagram[0].points[-1].tangent is None
