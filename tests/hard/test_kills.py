"""A few of the kills of ``python -m tests.hard.kills``, and that a fault would be seen."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from hard import kills

pytestmark = pytest.mark.alone


def test_killed_and_gone_on(tmp_path: Path) -> None:
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
    """One that the run before the kill had, and the one that goes on has not."""
    known = kills.whole(tmp_path / "whole")
    monkeypatch.setattr(kills, "PROGRAM", (*kills.PROGRAM[:4], "0", *kills.PROGRAM[5:]))
    entry = kills.attempt(0, 1, known, tmp_path)
    assert entry["wrong"] == "AssertionError: another diagram"
    assert sum(int(row[-1]) for row in kills.in_rows([entry])) == 1
