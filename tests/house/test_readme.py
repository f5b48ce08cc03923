"""Every command of README and docs/running.md, in their order: what a reader types, one after the other."""

import os
import re
import shlex
import shutil
import subprocess
import sys
from contextlib import nullcontext
from pathlib import Path

import pytest

from rodfem.app import console

HOME = Path(__file__).parents[2]
PROGRAMS = {"rodfem": [sys.executable, "-m", "rodfem"], "python": [sys.executable]}
PROGRAMS |= {"mpirun": [shutil.which("mpirun.openmpi") or "mpirun"]}
DEMO = "rodfem run demos/hemitropic.py"
"""What ``make demo`` runs."""
ELSEWHERE = ("make", "docker", "tools/image.py", "python3 -m venv")
"""What continuous integration runs, or a machine with containers."""
BY_HAND = re.compile(r"\.venv/bin/(?!activate)")
"""Programs by the path of one installation: a reader has their folder on the path."""
HERE = ("run", "info", "convert")
"""Commands of rodfem that are run in this process, once one of them was run in its own."""
PATIENCE = 300
OURS = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1", "OMPI_MCA_btl": "self,vader"}
OURS |= {"OMP_NUM_THREADS": "1", "MPLBACKEND": "Agg", "HWLOC_HIDE_ERRORS": "2", "OMPI_MCA_mpi_yield_when_idle": "1"}


def pages() -> str:
    """Text of the pages without their Python."""
    text = "\n".join((HOME / page).read_text() for page in ("README.md", "docs/running.md"))
    return re.sub(r"```.*?```", "", text, flags=re.DOTALL)


def commands() -> list[str]:
    """Lines of these pages that are indented by four spaces and begin with a program, without their comments."""
    lines = [line[4:].partition("  # ")[0].strip() for line in pages().splitlines() if line.startswith("    ")]
    return [DEMO, *(line for line in lines if line.partition(" ")[0] in PROGRAMS)]


def own_rod() -> str:
    """The rod of the README's first block."""
    return re.findall(r"```python\n(.*?)```", (HOME / "README.md").read_text(), flags=re.DOTALL)[0]


def test_all_commands_are_found() -> None:
    lines = re.findall(r"^    ((?:rodfem|python|mpirun|make|docker|tools/).*)", pages(), flags=re.MULTILINE)
    here = [line for line in lines if not line.startswith(ELSEWHERE)]
    assert len(here) == len(commands()) - 1 > 20
    found = [
        HOME / "README.md",
        *(HOME / "docs").glob("*.md"),
        *(HOME / "docs" / "course").glob("*.md"),
        *(HOME / "demos").glob("*.py"),
    ]
    named = [page.name for page in found if BY_HAND.search(page.read_text())]
    assert not named, "one way to call a program: without a path"


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder in which a reader types them."""
    folder = tmp_path_factory.mktemp("reader")
    for name in ("demos", "docs"):
        (folder / name).symlink_to(HOME / name)
    return folder


ON_TWO = "mpirun"
"""A demo that is run by another command, too, on two processes: long."""


@pytest.mark.parametrize(
    "command", [pytest.param(x, marks=[pytest.mark.long] * x.startswith(ON_TWO)) for x in commands()]
)
def test_a_command(command: str, place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The last of those that go together need the results of the others before."""
    words, answers = shlex.split(command), HOME / "docs" / "course" / "solutions" / "03_2.py"
    (place / "mine.py").write_text(answers.read_text() if "check.py" in command else own_rod())
    program = [part for word in words for part in PROGRAMS.get(word, [word])]
    program += ["--no-figures"] if "run" in words and "--help" not in words else []
    before = {path for path in place.rglob("*") if path.is_file()}
    if program[2] == "rodfem" and program[3] in HERE and command != DEMO:
        monkeypatch.chdir(place)
        with nullcontext() if "--help" not in words else pytest.raises(SystemExit, match="0"):
            console.main(program[3:])
    else:
        kept = {name: value for name, value in os.environ.items() if not name.startswith(("OMPI_", "PMIX"))}
        done = subprocess.run(program, cwd=place, env=kept | OURS, capture_output=True, text=True, timeout=PATIENCE)
        assert done.returncode == 0, done.stderr
    written = {path.name for path in place.rglob("*") if path.is_file()} - {path.name for path in before}
    if "--output" in words:
        assert words[-1] in written
    if "view" in words:
        assert (place / words[-1] / "report.html").stat().st_size > 1e6
