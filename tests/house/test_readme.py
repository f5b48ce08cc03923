"""Every command of the README, as it stands and in its order: what a reader types, one after the other."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

HOME = Path(__file__).parents[2]
PROGRAMS = {".venv/bin/rodfem": [sys.executable, "-m", "rodfem"], "rodfem": [sys.executable, "-m", "rodfem"]}
PROGRAMS |= {".venv/bin/python": [sys.executable], "mpirun": [shutil.which("mpirun.openmpi") or "mpirun"]}
DEMO = "rodfem run demos/hemitropic.py"
"""What ``make demo`` runs."""
ELSEWHERE = ("make", "docker", "tools/image.py")
"""What continuous integration runs, or a machine with containers."""
PATIENCE = 300
OURS = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1", "OMPI_MCA_btl": "self,vader"}
OURS |= {"OMP_NUM_THREADS": "1", "MPLBACKEND": "Agg", "HWLOC_HIDE_ERRORS": "2"}

pytestmark = pytest.mark.alone


def commands() -> list[str]:
    """Lines of the README that are indented by four spaces and begin with a program, without their comments."""
    text = re.sub(r"```.*?```", "", (HOME / "README.md").read_text(), flags=re.DOTALL)
    lines = [line[4:].partition("  # ")[0].strip() for line in text.splitlines() if line.startswith("    ")]
    return [DEMO, *(line for line in lines if line.partition(" ")[0] in PROGRAMS)]


def own_rod() -> str:
    """The rod of the README's first block."""
    return re.findall(r"```python\n(.*?)```", (HOME / "README.md").read_text(), flags=re.DOTALL)[0]


def test_all_commands_are_found() -> None:
    text = re.sub(r"```.*?```", "", (HOME / "README.md").read_text(), flags=re.DOTALL)
    lines = re.findall(r"^    ((?:\.venv/|rodfem|mpirun|make|docker|tools/).*)", text, flags=re.MULTILINE)
    here = [line for line in lines if not line.startswith(ELSEWHERE)]
    assert len(here) == len(commands()) - 1 > 20


def test_commands_of_the_readme(tmp_path: Path) -> None:
    for name in ("demos", "docs"):
        (tmp_path / name).symlink_to(HOME / name)
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("OMPI_", "PMIX"))}
    for command in commands():
        words = shlex.split(command)
        answers = HOME / "docs" / "course" / "solutions" / "03_2.py"
        (tmp_path / "mine.py").write_text(answers.read_text() if "check" in words else own_rod())
        program = [part for word in words for part in PROGRAMS.get(word, [word])]
        program += ["--no-figures"] if "run" in words and "--help" not in words else []
        done = subprocess.run(program, cwd=tmp_path, env=kept | OURS, capture_output=True, text=True, timeout=PATIENCE)
        assert done.returncode == 0, f"{command}\n{done.stdout[-2000:]}{done.stderr}"
    results = tmp_path / "results"
    assert (results / "cord" / "report.html").stat().st_size > 1e6 and (results / "hemitropic" / "report.html").exists()
    assert {"buckled.png", "mode.gif"} <= {path.name for path in tmp_path.iterdir()}
