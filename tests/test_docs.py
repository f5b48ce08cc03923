"""What the documentation shows can be stated."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from rodfem.places import needs_centreline
from rodfem.scene import Scene

PAGE = Path(__file__).parents[1] / "docs" / "rods.md"


@pytest.mark.short
def test_every_scene_of_the_page() -> None:
    names: dict = {}
    for block in re.findall(r"```python\n(.*?)```", PAGE.read_text(), flags=re.DOTALL):
        exec(block, names)
    scenes = [x for x in names.values() if isinstance(x, Scene)]
    assert len(scenes) > 20
    assert {s.name for s in scenes if not s.conservative} == {"pflueger", "leipholz"}
    assert {s.name for s in scenes if needs_centreline(s)} >= {"heavy", "foundation", "midway", "pflueger", "leipholz"}
