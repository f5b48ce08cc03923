"""Numbers of paper/paper.md: computed anew, right to their last digit, and those of references as well."""

from __future__ import annotations

import re
import runpy
from functools import cache
from math import log2, pi, sqrt
from pathlib import Path
from typing import Any

import closed_form_hemitropic
import numpy as np
import pytest
from closed_forms import double
from literature.test_free_rods import beal
from numpy.polynomial import Polynomial

HOME = Path(__file__).parents[2] / "paper"
TEXT = (HOME / "paper.md").read_text().partition("\n---\n")[2]
CODE = re.findall(r"```python\n(.*?)```", TEXT, flags=re.DOTALL)
PROSE = re.sub(r"```.*?```|\$.*?\$|\[@.*?\]", "", TEXT, flags=re.DOTALL)
ROWS = [[cell.strip() for cell in row.split("|")[1:-1]] for row in re.findall(r"^\|.*\d.*\|$", TEXT, flags=re.M)]

pytestmark = pytest.mark.alone


def thrust() -> float:
    """Flutter load of the free beam: there the square of an eigenvalue's imaginary part, which is smooth, vanishes."""
    beyond = np.linspace(109.7, 110.1, 10)
    squares = [np.max(beal(load).imag) ** 2 for load in beyond]
    roots = Polynomial.fit(beyond, squares, 5).roots()
    return float(roots[np.argmin(abs(roots - beyond[0]))].real)


REFERENCES = {
    "telephone cord": lambda: 5 * pi**2,
    "hemitropic rod": lambda: closed_form_hemitropic.loads(-3.0, 1.0, 1.0, 3.0)[0],
    "twisted ring": lambda: sqrt(3) / 1.5,
    "column": lambda: double(20.0, 120.0)[0],
    "free beam": thrust,
}
"""What rodfem did not compute, by the beginnings of the rows."""


@cache
def printed() -> tuple[dict[str, tuple[float, float]], list[float]]:
    """What ``paper/printed.py`` computes: loads with their error bars, errors of coarse meshes."""
    names: dict[str, Any] = runpy.run_path(str(HOME / "printed.py"))
    return names["loads"](), names["errors"]()


def is_right(text: str, value: float) -> bool:
    """Whether a number is right to the last digit printed."""
    return f"{value:.{len(text.partition('.')[2])}f}" == text


@pytest.mark.long
@pytest.mark.parametrize("name", REFERENCES)
def test_rows_of_the_table(name: str) -> None:
    (row,) = [row for row in ROWS if row[0].startswith(name)]
    load, bar = printed()[0][name]
    exact = REFERENCES[name]()
    assert is_right(row[2], load) and is_right(row[3], exact)
    assert abs(load - exact) < max(
        bar, 1e-6 if name == "free beam" else 1e-11
    )  # to which Galerkin's method was bisected
    assert bar < 10.0 ** -len(row[2].partition(".")[2]) / 2


@pytest.mark.long
def test_errors_of_coarse_meshes() -> None:
    wrong = printed()[1]
    assert "{:.1e}, {:.1e} and {:.1e} of itself".format(*wrong) in TEXT
    assert is_right((order := re.findall(r"an order\s+of ([\d.]+) between", TEXT))[0], log2(wrong[1] / wrong[2]))
    assert 3.8 < float(order[0]) < 4.2


def test_the_example_runs(capsys: pytest.CaptureFixture[str]) -> None:
    (block,) = CODE
    exec(block, {})
    kind, load, error = re.fullmatch(r"(.*) ([\d.]+) \+- (.*)\n", capsys.readouterr().out).groups()  # type: ignore[union-attr]
    assert kind == "branch point" and abs(float(load) - 5 * pi**2) < float(error) < 1e-8
    assert is_right("49.34802201", float(load)) and f"a {kind} at 49.34802201." in TEXT


def test_no_other_number_is_in_the_text() -> None:
    errors = re.findall(r"\d\.\d+e-\d+|(?<=of )\d\.\d+(?= between)", PROSE)
    known = {cell for row in ROWS for cell in row[2:4]} | set(errors)
    found = set(re.findall(r"\d+\.\d+(?:e[+-]?\d+)?", PROSE))
    assert found <= known, found - known


def test_citations_are_in_the_bibliography() -> None:
    cited = set(re.findall(r"@(\w+)", re.sub(r"```.*?```", "", TEXT, flags=re.DOTALL)))
    entries = set(re.findall(r"^@\w+\{(\w+),", (HOME / "paper.bib").read_text(), flags=re.M))
    assert cited == entries
