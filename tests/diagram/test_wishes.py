"""A notebook's lines: what a person types first, each of which does what it says; tables, and the page."""

import pydoc
from pathlib import Path

import demo_cases
import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray
from hemitropic_cases import scene

import rodfem
from rodfem import Diagram, InputError, Plan, Scene, pinned
from rodfem.app import console


@pytest.fixture(scope="module")
def diagram() -> Diagram:
    """Of a plan that is not named."""
    return rodfem.trace(scene(), depth=2, at=(0.5,))


def test_twenty_wishes_are_a_line_each(diagram: Diagram) -> None:
    """What took a person a dozen tries, with its shape or its value."""
    point, branch = next(p for p in diagram.at(0.5) if p.stable), diagram["branch 1"]
    rows, fold, axes = len(point.s), diagram.special("fold")[0], plt.figure().gca()
    assert point.r.shape == (rows, 3)
    assert point.directors.shape == (rows, 3, 3)
    assert point.strain.shape == point.curvature.shape == (rows, 3)
    assert point.force.shape == point.moment.shape == (rows, 3)
    assert point.force_in_space.shape == point.moment_in_space.shape == (rows, 3)
    assert point.profile([0.0, 0.5]).r.shape == (2, 3)
    assert np.allclose(point.reactions.left.force + point.reactions.right.force, 0.0, atol=1e-9)
    assert point.branch == "branch 1"
    assert branch["load"].shape == (len(branch.points),) and branch["load"].max() == pytest.approx(0.95)
    assert list(branch.to_dataframe().load) == list(branch["load"])
    assert set(diagram.to_dataframe().branch) == {"straight", "branch 1", "branch 2"}
    assert diagram.to_xarray()["r"].dims == ("point", "node", "component")
    assert [(s.negative_before, s.point.branch) for s in diagram.special("pitchfork")] == [
        (0, "straight"),
        (2, "straight"),
    ]
    assert [s.kind for s in diagram.special("subcritical pitchfork")] == ["branch point"]
    assert not diagram.special("transcritical")
    with pytest.raises(InputError, match=r"There is no kind 'fork': choose one of branch point, fold, .*pitchfork"):
        diagram.special("fork")
    assert len(diagram.states(0.5)) == 3
    assert [s.freedoms for s in diagram.states(0.5) if s.point.branch == "branch 1"] == [1]
    assert diagram.plot(ax=axes) is axes.figure
    assert diagram.view()._repr_html_().startswith("<iframe")
    assert fold.errors["energy"] > 0.0 and fold.errors["reactions"].shape[-1] == 3
    assert pinned((0.0, 0.0, 1.0)).position == (0.0, 0.0, 1.0)
    assert diagram.again(depth=0)["straight"].parent is None
    assert repr(point) == "<Point at load 0.5: ordinate 1.72903, stable>"
    plt.close("all")


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
    assert " at 0x" not in page and "inertia = Inertia()" in page
    assert "varying(self" in page and "ends" in page
    assert not any(f" |  {name}" in page for name in ("parts", "lagrangian", "known_force", "samples", "__eq__"))
    assert "varying" in dir(scene()) and "known_force" not in dir(scene())


def test_a_branch_of_too_many_points_names_the_remedy() -> None:
    steps = rodfem.StepControl(most=5)
    found = rodfem.trace(scene(), depth=0, steps=steps, error_bars=False)
    assert repr(found).startswith("<Diagram of 'hemitropic': 1 branch, 6 points, 1 special point, lam from")
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


@pytest.fixture(scope="module")
def ruler() -> Diagram:
    return rodfem.trace(demo_cases.scene("ruler"), plan=Plan(depth=1, error_bars=False))


def test_columns_are_those_of_the_points(ruler: Diagram) -> None:
    branch = ruler["branch 1"]
    assert branch["load"].tolist() == [p.load for p in branch.points]
    assert branch["stable"].tolist() == [float("nan") if p.stable is None else p.stable for p in branch.points]
    with pytest.raises(KeyError, match="points have no number 'soft'"):
        branch["soft"]
    assert {point.branch for point in branch.points} == {"branch 1"}


def test_tables_of_other_libraries(ruler: Diagram) -> None:
    frame, data = ruler.to_dataframe(), ruler.to_xarray()
    branch = ruler["branch 1"]
    own = frame[frame.branch == "branch 1"]
    assert len(frame) == sum(len(b.points) for b in ruler) == data.sizes["point"]
    assert np.array_equal(own.load, branch["load"]) and np.array_equal(own.energy, branch["energy"])
    last = data.isel(point=(data.branch == "branch 1").values).isel(point=-1)
    for name in ("s", "r", "directors", "strain", "curvature", "force", "moment"):
        assert np.array_equal(last[name].dropna("node", how="all"), getattr(branch.points[-1], name))
    assert data["r"].dims == ("point", "node", "component") and data["ordinate"].attrs["units"] == ""


def test_states_that_coexist_with_their_copies(ruler: Diagram) -> None:
    """A buckled ruler has its mirror image; the straight one is its own."""
    load = ruler["branch 1"].points[-1].load
    found = {state.point.branch: (state.images, state.freedoms) for state in ruler.states(load)}
    assert found == {ruler[0].name: (1, 0), "branch 1": (2, 0), "branch 2": (2, 0)}


def test_the_page_from_python(ruler: Diagram, tmp_path: object) -> None:
    page = ruler.view()
    assert "ruler" in page.html and page._repr_html_().startswith("<iframe srcdoc=")
    assert len(repr(page)) < 100


def test_netcdf_of_files_is_the_table_of_the_diagram(ruler: Diagram, tmp_path: Path) -> None:
    """Coordinates, units and all; profiles in files are at other points, from which nodes are interpolated."""
    console.main(["convert", str(ruler.save(tmp_path)), "--to", "netcdf"])
    read, own = xarray.open_dataset(tmp_path / "netcdf" / "diagram.nc"), ruler.to_xarray()
    assert {*read.coords} == {*own.coords} and {*read.data_vars} == {*own.data_vars} and read.sizes == own.sizes
    assert read.attrs == own.attrs and read.branch.values.tolist() == own.branch.values.tolist()
    for name in own.variables.keys() - {"branch"}:
        assert read[name].attrs == own[name].attrs and read[name].dims == own[name].dims
        bound = 2e-4 if name in ("strain", "curvature", "force", "moment") else 1e-14
        np.testing.assert_allclose(read[name].astype(float), own[name].astype(float), rtol=bound, atol=bound)
