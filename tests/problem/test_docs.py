"""What the documentation shows can be stated, and happens."""

from __future__ import annotations

import io
import re
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rows import verify

from rodfem.app.terminal import Report
from rodfem.continuation.branch import Branch
from rodfem.diagram.plan import Plan
from rodfem.diagram.trace import trace
from rodfem.errors import SceneError
from rodfem.fem.fields import Discretization
from rodfem.problem.ends import Attachment, clamped, free, pinned, sliding
from rodfem.problem.local_state import needs_centreline
from rodfem.problem.scene import Inertia, Scene

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


@pytest.mark.short
def test_every_scene_of_the_page() -> None:
    found = list(scenes().values())
    assert len(found) > 20
    assert {s.name for s in found if not s.conservative} == {"pflueger", "leipholz"}
    assert {s.name for s in found if needs_centreline(s)} >= {"heavy", "foundation", "midway", "pflueger", "leipholz"}


@cache
def traced(name: str) -> tuple[list[Branch], str]:
    """Branches of a scene of the page, and what the terminal says meanwhile."""
    terminal = io.StringIO()
    diagram = trace(scenes()[name], Discretization("auto", 8, 6), Plan(error_bars=False), Report(stream=terminal))
    verify(diagram.solvers[0], diagram.branches)
    return diagram.branches, terminal.getvalue()


@pytest.mark.alone
@pytest.mark.parametrize("name", [name for name, scene in scenes().items() if scene.conservative])
def test_scenes_of_the_page_are_traced_without_a_warning(name: str) -> None:
    branches, words = traced(name)
    assert "!" not in words
    assert all(re.match("end of range|meets ", b.ended) for b in branches)


@pytest.mark.alone
@pytest.mark.parametrize(
    ("name", "load", "accuracy"),
    [
        ("euler", np.pi**2, 1e-9),
        ("pressed", (1 + np.sqrt(1 - 16 * np.pi**2 / 1000)) / 2, 1e-9),  # 1000 (1 - d) is the thrust
        ("torque", np.pi, 3e-3),  # of a rod that does not twist; it gives way by M/1000
        ("twisted", 8.98681891582 / 2, 1e-9),
        ("ring", 2 / np.sqrt(3), 1e-9),
    ],
)
def test_scenes_of_the_page_buckle_where_it_says(name: str, load: float, accuracy: float) -> None:
    straight = traced(name)[0][0]
    first = next(s for s in straight.special if s.kind == "branch point")
    assert first.point.load == pytest.approx(load, rel=accuracy)
    assert (first.negative_before, first.negative_after > 0) == (0, True)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"ends": (clamped(), free(), free())}, "not two of the kind End"),
        ({"follower": lambda x, c: x.r}, r"distributed follower force is no function of 1 argument\(s\): give f\(c\)"),
        ({"ends": (free(), sliding(lambda c: (0.0, 0.0, None)))}, "can drift away along e3"),
        ({"ends": (free(), pinned(lambda c: (0.0, None, 0.0))), "inertia": Inertia(lambda c: 1)}, "away along e2"),
        ({"planar": "e2", "ends": (clamped(), free(lambda c: (0, c.P, 0)))}, "pushes the rod out of its plane"),
    ],
)
def test_limits(change: dict[str, Any], words: str) -> None:
    fields = {name: page()[name] for name in ("rigid", "bent")}
    column = {**fields["rigid"], **fields["bent"], "name": "column", "ordinate": page()["tip"], "span": (0.0, 1.0)}
    with pytest.raises(SceneError, match=words):
        Scene(**(column | {"ends": (clamped(), free(page()["push"]))} | change))


def test_no_hinge_inside_the_rod() -> None:
    with pytest.raises(TypeError, match="unexpected keyword argument 'hinge'"):
        Attachment(0.5, hinge=(1.0, 0.0, 0.0))  # type: ignore[call-arg]
