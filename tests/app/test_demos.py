"""Demos are lessons: they run, trace, and end with their number; with options they are ``rodfem run``."""

import re
import runpy
import subprocess
import sys
from pathlib import Path

import demo_cases
import pytest
from mpi4py import MPI

import rodfem
from rodfem.app import script

HOME = Path(__file__).parents[2]
LESSONS = ["hemitropic", *demo_cases.FUNCTIONS]
HEADINGS = ["Idea", "Form", "Program", "Number", "Exercises", "Where it breaks"]
LONGEST = 150
"""Lines of a lesson."""


def path_of(name: str) -> Path:
    return HOME / "demos" / f"{name}.py"


@pytest.mark.ranks
@pytest.mark.parametrize(
    "name", ["ruler", *(pytest.param(n, marks=pytest.mark.alone) for n in LESSONS if n != "ruler")]
)
def test_a_demo_ends_with_its_number(
    name: str, folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its own assertions compare it with a closed form or a published value; what it saves is the diagram."""
    monkeypatch.chdir(folder)
    monkeypatch.setattr(sys, "argv", [str(path_of(name))])
    monkeypatch.setattr(sys, "stdout", sys.stdout)  # which it may silence
    runpy.run_path(str(path_of(name)), run_name="__main__")
    said = capsys.readouterr().out
    assert (said == "") == (MPI.COMM_WORLD.rank > 0)
    MPI.COMM_WORLD.barrier()
    files = {file.name for file in (folder / "results" / name).iterdir()}
    assert {"diagram.json", "states.h5", "diagram.png"} <= files
    saved = rodfem.load_json(folder / "results" / name / "diagram.json")
    assert saved["scene"] == name and len(saved["branches"]) >= 1


@pytest.mark.parametrize("name", LESSONS)
def test_a_demo_is_a_lesson(name: str) -> None:
    text = path_of(name).read_text()
    assert text.count("\n") <= LONGEST
    assert re.findall(r"^# ## (.*)$", text, flags=re.MULTILINE) == HEADINGS
    assert text.startswith("# %% [markdown]\n# # ")
    cell = text[text.index("script.lesson(__name__)") :]
    assert "rodfem.trace(" in cell and "assert " in cell
    assert not re.search(r"argparse|sys\.argv", text)
    for command in re.findall(r"`(rodfem run [^`]*)`", text):
        assert f"demos/{name}.py" in command


@pytest.mark.long
def test_a_demo_with_options_is_the_command(folder: Path) -> None:
    words = ["--turns", "3", "--elements", "0"]
    ends = [
        subprocess.run([sys.executable, *begin, *words], capture_output=True, text=True, cwd=folder)
        for begin in ([str(path_of("cord"))], ["-m", "rodfem", "run", str(path_of("cord"))])
    ]
    assert (ends[0].returncode, ends[0].stdout, ends[0].stderr) == (ends[1].returncode, ends[1].stdout, ends[1].stderr)
    assert ends[0].returncode == 2 and ends[0].stderr.count("\n") == 1 and "elements" in ends[0].stderr


def test_a_file_that_is_imported_runs_no_lesson() -> None:
    assert not script.lesson("cord")
