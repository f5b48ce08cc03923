"""The program ``rodfem``: its commands, and mistakes in calling it."""

from __future__ import annotations

from pathlib import Path

import pytest

from rodfem.app import console
from rodfem.app.commands import COMMANDS

HOME = Path(__file__).parents[2]

pytestmark = pytest.mark.alone


def test_every_command_is_listed_and_has_help(capsys: pytest.CaptureFixture[str]) -> None:
    console.main(["--help"])
    listed = capsys.readouterr().out
    for command in COMMANDS:
        assert f"\n  {command} " in listed
        with pytest.raises(SystemExit) as left:
            console.main([command, "--help"])
        assert left.value.code == 0 and f"rodfem {command}" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["inof"], "Unknown command 'inof': choose info"),
        (["info", "nowhere"], "nowhere"),
        (["info"], "folder"),
    ],
)
def test_mistakes_are_one_sentence(words: list[str], sentence: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as left:
        console.main(words)
    said = capsys.readouterr().err
    assert left.value.code == 2
    assert said.startswith("error: ") and said.count("\n") == 1 and sentence in said
