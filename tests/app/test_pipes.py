"""A reader that leaves, as ``head`` does: the program ends there, without a word."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

CHECK = Path(__file__).parents[2] / "docs" / "course" / "check.py"
PROGRAMS = {
    "lesson": "import rodfem.app.script as script\nif script.lesson(__name__):\n    from petsc4py import PETSc\n",
    "check": "import rodfem.app.console as console\nfrom petsc4py import PETSc\n",
}
LINES = "    for _ in range(100_000): print('a line')\n"


@pytest.mark.few(1)
@pytest.mark.parametrize("kind", PROGRAMS)
def test_a_reader_that_leaves_ends_the_program_quietly(tmp_path: Path, kind: str) -> None:
    program = tmp_path / "mine.py"
    loop = LINES if kind == "lesson" else LINES.lstrip() + "answer = 1\n"
    program.write_text(PROGRAMS[kind] + loop)
    command = [str(program)] if kind == "lesson" else [str(CHECK), "1", str(program)]
    with subprocess.Popen(
        [sys.executable, *command], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=tmp_path
    ) as run:
        assert run.stdout is not None and run.stderr is not None
        assert run.stdout.readline() == "a line\n"
        run.stdout.close()
        assert run.stderr.read() == ""
    assert run.returncode == -13


@pytest.mark.parametrize("words", ["help", "explain", "info nowhere", "run own.py --help"])
def test_commands_end_without_a_word(tmp_path: Path, words: str) -> None:
    """Nobody reads from the first character on."""
    shutil.copy(CHECK.parents[2] / "demos" / "cord.py", tmp_path / "own.py")
    command = [sys.executable, "-m", "rodfem", *words.split()]
    reader, writer = os.pipe()
    os.close(reader)
    run = subprocess.run(command, stdout=writer, stderr=subprocess.PIPE, text=True, cwd=tmp_path, check=False)
    os.close(writer)
    assert run.stderr == "" if words != "info nowhere" else run.stderr.startswith("error: There is no nowhere")
