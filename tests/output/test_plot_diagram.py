"""Diagrams drawn from hand-made dictionaries: what is seen of stability, and of what a branch does not explain."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.image import imread
from scipy.special import ellipe, ellipk

from rodfem.file_format import LOCUS
from rodfem.output.pieces import PLANAR, STABLE, UNSTABLE, pieces_of
from rodfem.output.plot_diagram import SINGULAR, UNEXPLAINED, dense, draw_branches, draw_diagram, drawn, figure_of
from rodfem.output.plot_locus import draw_locus
from rodfem.output.style import PALETTE


def branch(name: str, ordinate: list[float], negative: list[int], **more: Any) -> dict[str, Any]:
    rows = range(len(negative))
    columns = {"load": list(map(float, rows)), "ordinate": ordinate, "negative": negative, "arclength": rows}
    columns["slope"] = [None] * len(rows)
    return {"name": name, "parent": None, "columns": columns | more.pop("columns", {}), "special": [], **more}


def diagram(*branches: dict[str, Any]) -> dict[str, Any]:
    return {"title": "made by hand", "parameter_label": "P", "ordinate": "x", "branches": list(branches)}


def legend(*branches: dict[str, Any]) -> list[str]:
    axes = Figure().subplots()
    return [str(handle.get_label()) for handle in draw_branches(axes, branches)[0]]


def pixels(path: Path, color: str, rows: slice = slice(None), columns: slice = slice(0, 1450)) -> np.ndarray:
    picture = imread(path)[rows, columns, :3]
    return np.asarray(np.all(abs(picture - np.array(to_rgb(color))) < 0.04, axis=2))


def test_the_legend_has_nothing_that_is_not_drawn() -> None:
    stable, unstable = branch("a", [0.0] * 3, [0] * 3), branch("b", [1.0] * 3, [1] * 3)
    assert legend(stable) == ["a", "stable", "negative eigenvalues"]
    assert legend(unstable) == ["b", "unstable", "negative eigenvalues"]
    assert legend(stable, unstable)[2:4] == ["stable", "unstable"]
    assert legend(branch("c", [0.0], [0])) == ["c"]


def test_nothing_unstable_is_hidden_below_something_stable(folder: Path) -> None:
    """Two branches at the same place: in the pixels of their line both colours are seen."""
    both = [branch("a", [0.0] * 9, [0] * 9), branch("b", [0.0] * 9, [1] * 9)]
    path = draw_diagram(diagram(*both), folder / "diagram.png")
    line = int(pixels(path, PALETTE[0]).sum(axis=1).argmax())  # most of the stable line
    here = slice(line - 8, line + 9)
    dark, blue = (pixels(path, color, here).sum() for color in PALETTE[:2])
    assert dark > 2000 and blue > 500


def test_stable_in_the_plane_is_not_called_stable(folder: Path) -> None:
    """The pitchfork of a planar rod at row 4, which is unstable in space from row 2 on."""
    point = {"kind": "branch point", "row": 4, "load": 4.0, "ordinate": 0.0, "negative_before": 0, "negative_after": 1}
    column = {"negative_in_space": [0, 0, 1, 1, 0, 2, 2]}  # at the branch point itself an eigenvalue is zero
    planar = branch("planar", [0.0] * 7, [0, 0, 0, 0, 0, 1, 1], special=[point], columns=column)
    found = [(p.kind, p.label, p.first, p.last) for p in pieces_of(planar)]
    assert found == [(STABLE, "0 (0)", 0, 1), (PLANAR, "0 (1)", 1, 4), (UNSTABLE, "1 (2)", 4, 6)]
    assert {STABLE, PLANAR, "negative eigenvalues in the plane (in space)"} <= set(legend(planar))
    del planar["columns"]["negative_in_space"]
    assert [p.label for p in pieces_of(planar)] == ["0", "1"]
    assert PLANAR not in legend(planar)
    planar["columns"]["negative_in_space"] = [None] * 7  # end moments have no potential in space
    assert [p.label for p in pieces_of(planar)] == ["0", "1"]


def words(*branches: dict[str, Any], **more: Any) -> tuple[set[str], set[str]]:
    """What stands inside the axes, and in the legend."""
    figure = figure_of(diagram(*branches) | more)
    inside, legend = figure.axes[0].texts, figure.axes[0].get_legend().get_texts()
    return {text.get_text() for text in inside}, {text.get_text() for text in legend}


def test_indices_stand_beside_the_curves_and_names_in_the_legend() -> None:
    far = [branch(name, [float(i)] * 9, [i] * 9) for i, name in enumerate(("straight", "branch 1"))]
    inside, legend = words(*far)
    assert inside == {"0", "1"} and {"straight", "branch 1"} <= legend
    figure = figure_of(diagram(*far))
    for text in figure.axes[0].texts:
        box = text.get_window_extent()
        for line in far:
            places = np.column_stack([line["columns"][x] for x in ("load", "ordinate")])
            assert not box.count_contains(dense(figure.axes[0], places))


def test_an_end_before_the_end_of_the_range_is_marked() -> None:
    for ended, mark in (
        ("stretch reaches zero", "ends: stretch reaches zero"),
        ("no convergence at P = 3 (steps below 1e-05)", "ends: no convergence"),
        ("the stored energy is not convex any more at P = 2", "ends: the stored energy is not convex"),
    ):
        assert mark in legend(branch("a", [0.0, 1.0, 2.0], [0, 0, 0], ended=ended))
    for ended in ("end of range", "closed loop", "meets straight at P = 2"):
        assert not any(x.startswith("ends") for x in legend(branch("a", [0.0, 1.0], [0, 0], ended=ended)))


def test_an_ordinate_that_is_round_off_is_drawn_as_zero() -> None:
    """A tip that does not move: numbers of 1e-17 are no shape, beside error bars of 1e-12."""
    end = {"kind": "end", "row": 2, "load": 2.0, "ordinate": 1e-17, "ordinate_error_estimate": 1e-12}
    noise = [branch(name, [0.0, 3e-17, 1e-17], [0, 0, 0], special=[end]) for name in ("straight", "branch 1")]
    assert figure_of(diagram(*noise)).axes[0].get_ylim() == (-1.0, 1.0)
    assert "the ordinate is zero all over: another one tells branches apart" in words(*noise)[0]
    real = branch("branch 1", [0.0, 3e-11, 1e-11], [0, 0, 0], special=[end])
    assert figure_of(diagram(real)).axes[0].get_ylim()[1] < 1e-10


def test_what_is_stable_beside_loci_ends_at_the_next_one(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Below a line at P = 2 as far as another one from (0, 0) to (1, 1), which ends there, and then to the bound -1."""
    mesh = {"formulation": "reduced", "elements": 1, "degree": 1, "unknowns": 1}
    about = {"labels": ["P", "A"], "words": ["force", ""], "title": "by hand", "discretization": mesh}
    about |= {"kind": "branch point", "parameters": ["P", "A"], "marks": [], "start": 1, "bounds": [[-1, 3], [0, 2]]}

    def locus(P: list[float], A: list[float], index: list[int], lower: int) -> dict[str, Any]:
        columns = {"P": P, "A": A, "index": [index] * len(P), "error": [[None, None]] * len(P)}
        return about | {"columns": columns, "lower": lower, "format": LOCUS.mark()}

    drawn: list[Figure] = []
    monkeypatch.setattr("rodfem.output.plot_locus.save", lambda figure, path: drawn.append(figure))
    draw_locus([locus([2, 2, 2], [0, 1, 2], [0, 1], -1), locus([0, 0.5, 1], [0, 0.5, 1], [1, 2], -1)], folder / "a.png")
    axes = drawn[0].axes[0]
    (region,) = (x for x in axes.collections if "as far as" in str(x.get_label()))
    places = ((0.5, 1.0), (0.5, 0.4), (0.9, 0.8), (1.5, -0.9), (1.5, 2.1))
    assert [region.get_paths()[0].contains_point(place) for place in places] == [True, False, False, True, False]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("$A$", "force $P$")
    assert axes.get_legend().get_window_extent().y1 < axes.xaxis.label.get_window_extent().y0
    starts = {(1.0, 2.0), (0.5, 0.5)}
    assert len(axes.texts) == 2 and starts.isdisjoint(tuple(text.xy) for text in axes.texts)  # no label on a mark


# --- curves between rows


def elastica(k: np.ndarray) -> dict[str, Any]:
    """A clamped column, P = K(k)^2, whose tip moves by 2 k / K(k), with k for its arclength, as a branch of a file."""
    K = ellipk(k**2)
    derivative = np.divide(ellipe(k**2) / (1 - k**2) - K, k, out=np.zeros_like(k), where=k > 0)
    columns = {"arclength": k, "load": K**2, "slope": 2 * K * derivative, "ordinate": 2 * k / K}
    negative = {"negative": [0] * len(k)}
    return {"name": "b", "parent": ["straight", 0], "special": [], "columns": {**columns, **negative}}


def test_long_steps_are_no_chords() -> None:
    branch = elastica(np.array([0.0, 0.3, 0.45, 0.6, 0.7]))
    ((_, curve),) = drawn(branch)
    load, height = curve[:10].T
    exact = ellipk((height * np.sqrt(load) / 2) ** 2) ** 2
    chord = np.interp(height, branch["columns"]["ordinate"], branch["columns"]["load"])
    assert abs(load - exact).max() < 2e-3 < 6e-3 < abs(chord - exact).max()
    assert all(row in curve for row in np.column_stack([branch["columns"][x] for x in ("load", "ordinate")]))


def test_what_a_diagram_does_not_explain_is_marked() -> None:
    plain = branch("a", [0.0, 1.0, 2.0, 3.0], [0, 0, 2, 2])
    marks = {UNEXPLAINED: {"unexplained": [{"row": 1, "before": 0, "after": 2}]}, SINGULAR: {"singular_start": 1}}
    assert not {*marks} & {*legend(plain)}
    for mark, more in marks.items():
        assert mark in legend(plain | more)
