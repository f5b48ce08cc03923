"""A few of the random scenes of ``python -m tests.hard.fuzz``, each traced twice and counted densely."""

from dataclasses import replace

import pytest
from hard.fuzz import comparison
from hard.fuzz.comparison import compared
from hard.fuzz.oracle import Oracle
from hard.fuzz.scenes import scene

from rodfem import Discretization, Plan, Solver, trace

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

    The middle of the swinging column is farther from the axis on one side; both meshes trace the same one.
    """
    plan = Plan(depth=1, error_bars=False)
    diagrams = [trace(scene(32, 252), Discretization("pointwise", elements, 6), plan) for elements in (5, 9)]
    (a,), (b,) = (d.special("fold", "branch 1") for d in diagrams)
    assert a.point.load == pytest.approx(b.point.load, rel=1e-9)
    assert a.point.ordinate == pytest.approx(b.point.ordinate, abs=1e-7)
    for diagram in diagrams:
        assert any("has other ordinates, and is not traced" in said for said in diagram.notes)


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
    rod = scene(seed, number)
    found = compared(rod, number, depth=0)
    assert found.rows > found.unclear or not rod.conservative
    assert (found.wrong, found.differs, found.refused) == ([], [], [])
    assert not any("symmetry" in sentence for sentence in found.said)


@pytest.mark.long
def test_an_oval_that_lies_otherwise_to_the_elements_is_no_other_branch() -> None:
    """The index in space has a zero that the mesh makes 1.58e-9 of one oval, and 1.56e-9 of one that is turned."""
    rod = scene(43, 48)
    diagram = trace(rod, comparison.meshes(rod, 48)[0], replace(comparison.plans(rod, 1)[0], error_bars=False))
    assert [branch.name for branch in diagram] == ["ring", "branch 1"] and not diagram.warnings


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
def test_a_dip_before_a_stretch_of_zero() -> None:
    """The last row has no tangent, and an eigenvalue is least at the one before it: an exception left the program."""
    rod = scene(35, 459)
    diagram = trace(rod, comparison.meshes(rod, 459)[0], comparison.plans(rod, 1)[0])
    assert diagram[0].ended == "stretch reaches zero" and diagram[0].points[-1].tangent is None
