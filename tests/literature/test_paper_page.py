"""Numbers of docs/paper.md and docs/theory: each is on its page, and right to its last digit; the journal paper."""

import json
import re
from math import pi, sqrt
from pathlib import Path
from typing import Any

import closed_form_hemitropic
import demo_cases
import hemitropic_cases
import numpy as np
import pytest
import reference_values
from closed_forms import double, tensions

import rodfem
from rodfem import Discretization, Plan

HOME = Path(__file__).parents[2]
GOLDEN = json.loads((HOME / "tests" / "golden" / "numbers.json").read_text())
HEMITROPIC = (-3.0, 1.0, 1.0, 3.0)
TEXT = (HOME / "paper" / "paper.md").read_text().partition("\n---\n")[2]
SECTIONS = [
    *("Summary", "Statement of need", "State of the field", "Software design", "Research impact statement"),
    *("Availability", "References"),
]


def special(name: str, branch: str, number: int) -> dict[str, Any]:
    """A special point that is recorded, and that other tests compare with shooting."""
    (found,) = [b for b in GOLDEN[f"demo {name}"] if b["name"] == branch]
    point: dict[str, Any] = found["special"][number]
    return point


def numbers() -> list[tuple[str, float]]:
    """Each number as it is printed on a page, and its value."""
    cord, (one, two) = tensions(1.5), closed_form_hemitropic.loads(*HEMITROPIC)
    flutter, inertia, less = double(20.0, 120.0), double(20.0, 120.0, J=1e-3), double(20.0, 120.0, J=7.1e-4)
    return [
        ("49.348022005", cord[0]),
        ("8.0635253841", cord[1]),
        ("35.8009616", special("cord", "branch 1", 0)["load"]),
        ("0.1143042145200", one),
        ("0.3320390797", two),
        ("1.7290345503", reference_values.FIRST[0.5][0]),
        ("0.3216500866", reference_values.FOLD[0]),
        ("4.42594840", special("ruler", "plane", 0)["load"]),
        ("10.63522070", special("ruler", "plane", 1)["load"]),
        ("20.0509536190", flutter[0]),
        ("121.3425101", flutter[1]),
        ("19.8391305741", inertia[0]),
        ("19.89995", less[0]),
        ("19.74", 2 * pi**2),
        ("2.0858", 3.5 - sqrt(2)),
        ("39.478", 4 * pi**2),
        ("9.870", pi**2),
        ("7.8065554232", 7.8065554232),  # by shooting
    ]


@pytest.mark.parametrize(("text", "value"), numbers())
def test_numbers_are_right_to_their_last_digit(text: str, value: float) -> None:
    pages = [HOME / "docs" / "paper.md", *(HOME / "docs" / "theory").glob("*.md")]
    assert any(text in page.read_text() for page in pages)
    assert abs(float(text) - value) <= 0.51 * 10.0 ** -len(text.partition(".")[2])


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("cord", "49.3365"),
        ("hemitropic", "0.114344"),
        ("ruler", "4.42613"),
        pytest.param("follower", "20.0559", marks=pytest.mark.long),
    ],
)
def test_150_linear_elements(name: str, text: str) -> None:
    """The first critical load on the paper's mesh."""
    scene = hemitropic_cases.scene() if name == "hemitropic" else demo_cases.scene(name)
    near = {"follower": (20.0, 20.1)}.get(name, scene.span)
    diagram = rodfem.trace(scene, Discretization("auto", 150, 1), Plan(near, depth=0, error_bars=False))
    load = next(s.point.load for s in diagram.branches[0].special if s.kind in ("branch point", "flutter"))
    assert text in (HOME / "docs" / "paper.md").read_text()
    assert abs(float(text) - load) <= 0.51 * 10.0 ** -len(text.partition(".")[2])


def test_the_page_maps_every_equation_and_table() -> None:
    page = (HOME / "docs" / "paper.md").read_text()
    cells = re.findall(r"^\| ([^|]*) \|", page[: page.index("**Signs.**")], re.M)
    spans = [re.findall(r"\d+", part) for cell in cells if cell[0] == "(" for part in cell.split(",")]
    assert sorted(i for span in spans for i in range(int(span[0]), int(span[-1]) + 1)) == list(range(1, 46))
    assert {"Tables 1-4", "Table 5", "figures"} <= set(cells)


def test_ziegler_and_beck() -> None:
    """The characteristic equations of docs/theory/circulatory.md, and that their roots are double at flutter."""
    P = 3.5 - sqrt(2)
    stiffness, mass = np.array([[2 - P, P - 1], [-1, 1]]), np.array([[3.0, 1], [1, 1]])
    assert np.linalg.det(stiffness) == pytest.approx(1)
    trace = np.trace(np.linalg.solve(mass, stiffness))
    assert (trace, 1 / np.linalg.det(mass)) == pytest.approx(((7 - 2 * P) / 2, 1 / 2))

    def beck(mu: float, P: float) -> float:
        root = np.sqrt(P**2 / 4 + mu)
        a, b = np.sqrt(root - P / 2), np.sqrt(root + P / 2)
        return float(P**2 + 2 * mu * (1 + np.cosh(a) * np.cos(b)) + P * np.sqrt(mu) * np.sinh(a) * np.sin(b))

    P, mu = double(20.0, 120.0)
    assert beck(mu, P) == pytest.approx(0, abs=1e-7)
    assert beck(mu * (1 + 1e-5), P) == pytest.approx(beck(mu * (1 - 1e-5), P), rel=1e-3)


# --- the paper for a journal ------------------------------------------------------------------------------------------


def test_sections_and_length() -> None:
    assert re.findall(r"^# (.*)$", TEXT, flags=re.M) == SECTIONS
    assert "```" not in TEXT and 750 <= len(TEXT.split()) <= 1750


def test_citations_are_in_the_bibliography() -> None:
    cited = set(re.findall(r"@(\w+)", TEXT))
    assert cited == set(re.findall(r"^@\w+\{(\w+),", (HOME / "paper" / "paper.bib").read_text(), flags=re.M))


def test_numbers_are_those_of_the_documentation() -> None:
    page = (HOME / "docs" / "trades" / "two-grippers.md").read_text()
    found = re.findall(r"\d+\.\d+ %|\d+ of the 150", TEXT)
    assert found and all(number in page for number in found)
