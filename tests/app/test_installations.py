"""Whatever is installed, Debian's libraries or those of PyPI, and on any ranks: the special points of the record.

``tests/diagram/test_golden.py`` has those of the five demos.  Here a whole run does all that a run can.
"""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from golden_cases import numbers
from mpi4py import MPI

import rodfem
from rodfem import SetupError, libraries
from rodfem.app.console import main

COMM = MPI.COMM_WORLD
HOME = Path(__file__).parents[2]
RECORDED = {b["name"]: b["special"] for b in numbers()["demo hemitropic"]}

pytestmark = pytest.mark.versions


@pytest.mark.ranks
def test_a_run_with_all_that_it_can_do(folder: Path) -> None:
    """Special points, loci, a search, modes and the page."""
    words = ["--locus", "A", "-3.02", "-2.98", "--at", "0.5", "--search", "2", "--modes", "2"]
    main(["run", str(HOME / "demos" / "hemitropic.py"), "--no-figures", *words, "--output", str(folder / "run")])
    COMM.barrier()
    saved = rodfem.load_json(folder / "run" / "diagram.json")
    for branch in saved["branches"]:
        found = [(t["kind"], [t["negative_before"], t["negative_after"]], t["load"]) for t in branch["special"]]
        for s in RECORDED.get(branch["name"], []):
            near = [load for kind, index, load in found if (kind, index) == (s["kind"], s["index"])]
            assert min(abs(load - s["load"]) for load in near) <= max(s["bar"], 1e-10)
    assert RECORDED.keys() <= {branch["name"] for branch in saved["branches"]}
    locus = json.loads((folder / "run" / "locus-1.json").read_text())
    first = RECORDED["straight"][0]
    (at_three,) = (lam for lam, A in zip(*(locus["columns"][name] for name in ("lam", "A")), strict=True) if A == -3)
    assert at_three == pytest.approx(first["load"], abs=first["bar"])
    (row,) = (s["row"] for s in saved["branches"][1]["special"] if s["load"] == 0.5)
    modes = rodfem.load_modes(folder / "run" / "modes.h5", "branch 1", row)
    assert len(modes.value) >= 2 and modes.load == 0.5
    if COMM.rank == 0:
        main(["view", str(folder / "run"), "--no-open"])
        assert str(first["load"])[:11] in (folder / "run" / "report.html").read_text()


# --- what must not be installed, what must be there -----------------------------------------------------------------


def test_wrong_builds_are_refused_in_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(libraries, "find_spec", lambda name: name)

    def mixed(name: str) -> None:
        raise ImportError("petsc4py is installed in this environment. More of it.")

    monkeypatch.setattr(libraries, "import_module", mixed)
    with pytest.raises(SetupError, match=r"several builds \(petsc4py is installed in this environment\): install"):
        libraries._load()


def test_every_package_that_computes_loads_the_libraries_first() -> None:
    """PyPI's PETSc finds no MPI otherwise."""
    uses = re.compile(r"^(?:from|import) (?:basix|dolfinx|ffcx|petsc4py|slepc4py)\b", flags=re.MULTILINE)
    for package in (HOME / "rodfem").glob("*/__init__.py"):
        files = [file for file in package.parent.rglob("*.py") if uses.search(file.read_text())]
        assert not files or "from rodfem import libraries" in package.read_text(), files


@pytest.mark.parametrize("given", ["", "no-such-compiler"])
def test_without_a_compiler(given: str, folder: Path) -> None:
    """One sentence, before anything is compiled; what the cache has is not compiled."""
    code = "import sys; from rodfem.app.console import main; main(sys.argv[1:])"
    words = ["run", str(HOME / "demos" / "ruler.py"), *"--elements 2 --degree 2 --output".split(), str(folder / "no")]
    env = os.environ | {"PATH": str(folder), "PYTHONPATH": str(HOME), "XDG_CACHE_HOME": str(folder / "cache")}
    env |= {"CC": given} if given else {}
    hidden = "import sys; sys.modules['ziglang'] = None; "
    done = subprocess.run([sys.executable, "-c", hidden + code, *words], env=env, capture_output=True, text=True)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    if given:
        assert "no C compiler 'no-such-compiler'" in done.stderr
    else:
        assert "apt install gcc" in done.stderr and 'pip install "rodfem[cc]"' in done.stderr
