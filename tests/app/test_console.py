"""The program ``rodfem``: its commands, and mistakes in calling it."""

import re
from importlib import metadata
from pathlib import Path

import petsc4py
import pytest

import rodfem
from rodfem.app import console

HOME = Path(__file__).parents[2]


def test_every_command_is_listed_and_has_help(capsys: pytest.CaptureFixture[str]) -> None:
    console.main(["--help"])
    listed = capsys.readouterr().out
    for command in console.COMMANDS:
        assert f"\n  {command} " in listed
        with pytest.raises(SystemExit) as left:
            console.main([command, "--help"])
        assert left.value.code == 0 and f"rodfem {command}" in capsys.readouterr().out


def test_versions_are_those_of_the_libraries(capsys: pytest.CaptureFixture[str]) -> None:
    """Against what their C headers and the package's metadata say."""
    console.main(["--version"])
    said = dict(line.split() for line in capsys.readouterr().out.splitlines())
    assert list(said) == ["rodfem", "python", "dolfinx", "petsc", "slepc", "numpy"]
    assert said["numpy"] == metadata.version("numpy") and said["rodfem"] == rodfem.__version__
    petsc = Path(petsc4py.get_config()["PETSC_DIR"])
    header = petsc / "include" / "petscversion.h"
    defined = dict(re.findall(r"^#define PETSC_VERSION_(\w+)\s+(\d+)", header.read_text(), flags=re.M))
    assert said["petsc"] == ".".join(defined[part] for part in ("MAJOR", "MINOR", "SUBMINOR"))


@pytest.mark.parametrize(
    ("words", "sentence"),
    [(["inof"], "Unknown command 'inof': choose info"), (["info", "nowhere"], "nowhere"), (["info"], "folder")],
)
def test_mistakes_are_one_sentence(words: list[str], sentence: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as left:
        console.main(words)
    said = capsys.readouterr().err
    assert left.value.code == 2
    assert said.startswith("error: ") and said.count("\n") == 1 and sentence in said
