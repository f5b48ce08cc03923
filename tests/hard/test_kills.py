"""A few of the kills of ``python -m tests.hard.kills``, and that a fault would be seen."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest
from hard import kills

pytestmark = pytest.mark.alone


def test_killed_at_random_moments(tmp_path: Path) -> None:
    """At a random time, and while files are written; tries that have a line are not repeated."""
    file = tmp_path / "kills.jsonl"
    entries = kills.run(file, 2)
    assert [entry["kind"] for entry in entries] == ["process", "writing"]
    assert [(entry["status"], entry["wrong"]) for entry in entries] == [(-9, "")] * 2
    lines = file.read_text().splitlines()
    assert kills.run(file, 2) == [json.loads(line) for line in lines] == entries
    assert [row[1] for row in kills.in_rows(entries)] == ["1", "1", "0", "0"]


@pytest.mark.long
def test_a_lost_branch_is_seen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One that a run which was not killed had first, and the killed one has not."""
    known = kills.whole(tmp_path / "whole")

    def losing(kind: str, chance: Any, known: kills.Whole, folder: Path) -> kills.Entry:
        shutil.copytree(known.folder, folder)
        data = json.loads((folder / "diagram.json").read_text())
        del data["branches"][0]
        (folder / "diagram.json").write_text(json.dumps(data))
        return {"status": -9, "left": []}

    monkeypatch.setattr(kills, "struck", losing)
    entry = kills.attempt(0, 1, known, tmp_path)
    assert entry["wrong"] == "AssertionError: other branches"
    assert sum(int(row[-1]) for row in kills.in_rows([entry])) == 1
