"""What the documentation shows can be stated, and happens."""

import io
import json
import re
from functools import cache
from math import cos, pi, sin, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from closed_forms import TORQUE, flutter
from literature.test_classics import CRITICAL, root
from problem.test_tables import buckling
from rows import verify
from scipy.linalg import expm
from scipy.special import ellipe, ellipk

from rodfem import Branch, Discretization, Plan, Scene, trace
from rodfem.app.terminal import Report

PAGE = Path(__file__).parents[2] / "docs" / "rods.md"


@cache
def page() -> dict[str, Any]:
    """Names that the blocks of the page define."""
    names: dict[str, Any] = {}
    for block in re.findall(r"```python\n(.*?)```", PAGE.read_text(), flags=re.DOTALL):
        exec(block, names)
    return names


def scenes() -> dict[str, Scene]:
    return {name: x for name, x in page().items() if isinstance(x, Scene)}


def helix_tip(k: tuple[float, float, float]) -> np.ndarray:
    """End of a rod of length one and constant strains ``k``, (3,)."""
    generator = np.zeros((6, 6))
    generator[:3, :3] = [[0.0, -k[2], k[1]], [k[2], 0.0, -k[0]], [-k[1], k[0], 0.0]]
    generator[:3, 3:] = np.eye(3)
    return np.asarray(expm(generator)[:3, 5])


def sag(distance: float) -> float:
    """Displacement of the middle of a pinned elastica of length one whose ends are at a ``distance``."""
    m = root(lambda m: 2 * float(ellipe(m) / ellipk(m)) - 1 - distance, 1e-3, 1 - 1e-6)
    return sqrt(m) / float(ellipk(m))


TANGENT = TORQUE / 2
"""The first positive root of tan x = x."""


@pytest.mark.versions
def test_every_scene_of_the_page() -> None:
    found = list(scenes().values())
    assert len(found) > 20
    assert {s.name for s in found if not s.conservative} == {"pflueger", "leipholz"}
    assert {s.name for s in found if s.needs_centreline} >= {"heavy", "foundation", "midway", "pflueger", "leipholz"}


@cache
def traced(name: str) -> tuple[list[Branch], str]:
    """Branches of a scene of the page, and what the terminal says meanwhile."""
    terminal = io.StringIO()
    diagram = trace(scenes()[name], Discretization("auto", 8, 6), Plan(error_bars=False), Report(stream=terminal))
    verify(diagram.solvers[0], diagram.branches)
    return diagram.branches, terminal.getvalue()


@pytest.mark.few(3)
@pytest.mark.parametrize("name", [name for name, scene in scenes().items() if scene.conservative])
def test_scenes_of_the_page_are_traced_without_a_warning(name: str) -> None:
    branches, words = traced(name)
    assert "!" not in words
    assert all(re.match("end of range|meets ", b.ended) for b in branches)


@cache
def expected() -> dict[str, list[float]]:
    """What the page says of each scene, by its source: loads of special points, or the ordinate of the last state."""
    return {
        "shearable": CRITICAL["haringx"][3],
        "tapered": [4 * root(lambda x: sin(x) + x * cos(x), 1.6, 3.0) ** 2],
        "stepped": CRITICAL["stepped"][3],
        "coiled": [float(np.hypot(*helix_tip((0.0, 6.0, 1.0))[:2]))],
        "euler": [pi**2, 2 * pi**2],
        "slider": [4 * pi**2],
        "hinge": [TANGENT**2],
        "sprung": CRITICAL["tip spring"][3],
        "twisted": [TANGENT],
        "ring": [2 / sqrt(3)],
        "heavy": CRITICAL["heavy"][3],
        "winkler": CRITICAL["foundation"][3],
        "midway": CRITICAL["point load"][3],
        "pflueger": [flutter(16.0, 40.0, mass=1.0)[0]],
        "leipholz": [40.0537365149],
        "torque": [1000 * (pi / 998) / cos(pi / 998)],
        "on_a_plane": [pi**2 / 2, TANGENT**2],
        "bow": [sag(0.2)],
        "pressed": [(1 + sqrt(1 - 16 * pi**2 / 1000)) / 2],
        "untwistable": [pi**2],
        "measured": [buckling(page()["stiffness"].at, page()["rows"], 1)],
        "machine": [1 + 2 * (pi**2 / 4 - 2)],
        "in_plane": [4.62463226448],
        "other": [0.14683387714412863],
    }


LAST = ("coiled", "bow", "other")
"""Scenes of which the page has the ordinate of the last state: their indices do not change."""


def printed() -> dict[str, list[str]]:
    """Numbers of the tables of the page, by scene."""
    rows = re.findall(r"^\| `(\w+)` \|[^|]*\| ([\d., ]+) \|", PAGE.read_text(), flags=re.MULTILINE)
    return {name: numbers.split(", ") for name, numbers in rows}


@pytest.mark.long
def test_numbers_of_the_page_are_those_of_their_sources() -> None:
    assert set(printed()) == set(scenes()) == set(expected())
    for name, texts in printed().items():
        for text, value in zip(texts, expected()[name], strict=True):
            assert abs(float(text) - value) <= 0.51 * 10.0 ** -len(text.partition(".")[2]), (name, value)


@pytest.mark.few(6)
@pytest.mark.parametrize("name", [name for name, scene in scenes().items() if scene.conservative])
def test_scenes_of_the_page_do_what_it_says(name: str) -> None:
    first = traced(name)[0][0]
    found = [s for s in first.special if s.kind == "branch point"]
    if name in LAST:
        assert not found
        assert first.points[-1].ordinate == pytest.approx(expected()[name][0], rel=1e-7)
    elif name == "in_plane":
        assert all((p.negative, p.negative_in_space) == (0, p.load > expected()[name][0]) for p in first.points)
    else:
        assert [s.point.load for s in found] == pytest.approx(expected()[name], rel=1e-9)
        assert (found[0].negative_before, found[0].negative_after > 0) == (0, True)


def test_flutter_loads_of_the_page() -> None:
    """As they are recorded, and compared with what rodfem finds, in ``tests/golden``."""
    golden = json.loads((PAGE.parents[1] / "tests" / "golden" / "numbers.json").read_text())
    for name in ("pflueger", "leipholz"):
        (flutter,) = [s for s in golden[f"docs {name}"][0]["special"] if s["kind"] == "flutter"]
        assert [flutter["load"]] == pytest.approx(expected()[name], rel=1e-9)
