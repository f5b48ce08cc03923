"""A notebook's lines: what a person types first, each of which does what it says."""

from __future__ import annotations

import pydoc
from pathlib import Path

import matplotlib.pyplot as plt
import pytest
from hemitropic_cases import scene

import rodfem
from rodfem import Diagram, InputError, Plan, Scene

pytestmark = pytest.mark.alone


@pytest.fixture(scope="module")
def diagram() -> Diagram:
    """Of a plan that is not named."""
    return rodfem.trace(scene(), depth=2, at=(0.5,))


def test_the_lines_of_a_notebook(diagram: Diagram) -> None:
    (point, *_) = [p for p in diagram.at(0.5) if p.stable]
    assert point.r.shape == (len(point.s), 3) and point.branch == "branch 1"
    assert point.directors.shape[1:] == (3, 3) and point.force.shape == point.moment.shape == point.r.shape
    assert point.reactions.left.force.shape == (3,)
    assert diagram["branch 1"]["load"].max() == pytest.approx(0.95)
    assert [s.freedoms for s in diagram.states(0.5) if s.point.branch == "branch 1"] == [1]
    assert [s.point.branch for s in diagram.special("pitchfork")] == ["straight", "straight"]
    assert [s.kind for s in diagram.special("subcritical pitchfork")] == ["branch point"]
    assert not diagram.special("transcritical") and diagram.special("fold")
    with pytest.raises(InputError, match=r"There is no kind 'fork': choose one of branch point, fold, .*pitchfork"):
        diagram.special("fork")


def test_a_locus_at_a_value_of_a_parameter(diagram: Diagram) -> None:
    """The second branch point: a locus that turns in the load, and has one load of each coupling."""
    second = diagram.special("branch point")[1]
    locus = diagram.locus(second, "A", (-3.1, -0.5))
    (row,) = locus.at(A=-2.0)
    other = diagram.again(A=-2.0, depth=0).special("branch point")[1]
    assert row.load == pytest.approx(other.point.load, abs=1e-9) and row.index == (2, 4)
    assert [r.load for r in locus.at(A=-3)] == pytest.approx([second.point.load], abs=1e-11)
    assert [r.parameter for r in locus.at(lam=0.35)] == pytest.approx([-2.30698308, -1.17925454], abs=1e-8)
    assert [r.parameter for r in locus.at(A=-0.5)] == [-0.5] and locus.at(A=5.0) == []
    with pytest.raises(InputError, match=r"is not one parameter of the locus: give lam or A, as in at\(A=1.0\)"):
        locus.at(B=1.0)


def test_pictures_of_a_notebook(diagram: Diagram) -> None:
    """The last line of a cell is a picture; axes take several diagrams, each in hues of its own."""
    figure, axes = plt.subplots()
    assert diagram.plot()._repr_png_().startswith(b"\x89PNG")  # type: ignore[attr-defined]
    assert diagram.plot(ax=axes) is figure and diagram.again(A=-2.0).plot(ax=axes) is figure
    words = [text.get_text() for text in axes.get_legend().get_texts()]  # type: ignore[union-attr]
    assert {"straight", "branch 1", "straight (2)", "branch 1 (2)"} <= {*words} and words.count("stable") == 1
    plt.close(figure)
    with pytest.raises(InputError, match="ax is 3: give axes of matplotlib"):
        diagram.plot(ax=3)  # type: ignore[arg-type]


def test_what_a_cell_prints_is_short(diagram: Diagram) -> None:
    pitchfork = diagram.special("pitchfork")[0]
    each = [pitchfork.law, diagram.assess(pitchfork), diagram.modes(pitchfork, 2), diagram, pitchfork]
    each.append(diagram.locus(pitchfork, "A", (-3.1, -2.9)))
    assert all(len(repr(thing)) < 160 and "array" not in repr(thing) for thing in each)
    assert "supercritical pitchfork, coefficient 0.0832134" in repr(pitchfork.law)


def test_help_has_what_a_person_calls() -> None:
    """A scene has its fields and a few methods, in help and in completion; all else serves the modules that compute."""
    page = pydoc.plain(pydoc.render_doc(Scene))
    assert "varying(self" in page and "ends" in page
    assert not any(f" |  {name}" in page for name in ("parts", "lagrangian", "known_force", "samples", "__eq__"))
    assert "varying" in dir(scene()) and "known_force" not in dir(scene())


def test_a_branch_of_too_many_points_names_the_remedy() -> None:
    steps = rodfem.StepControl(most=5)
    found = rodfem.trace(scene(), depth=0, steps=steps, error_bars=False)
    words = "straight ends: 5 points reached; use longer steps (StepControl(largest=...)) or more points (StepControl("
    assert any(sentence.startswith(words) for sentence in found.warnings)


def test_a_run_says_the_answer_first(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The words, one table in which each special point stands once, time and files; all else only if it is verbose."""
    technical = ("unknowns: ", "located to", "ended: end of range", "Time: setup", "factorisation", "inertia decides")
    plan = Plan(at=(0.5,), method="count")
    for verbose in (False, True):
        rodfem.run(scene(), plan=plan, output=tmp_path, figures=False, verbose=verbose)
        out = capsys.readouterr().out
        places = [out.index(words) for words in ("In words", "Special points", "points with their index", "Results in")]
        assert places == sorted(places) and [words in out for words in technical] == [verbose] * len(technical)
        assert verbose or out.count("0.11430421") == 3  # in the sentences on both branches, and in the table
