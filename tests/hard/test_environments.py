"""Folders that cannot be written, a cache of compiled code that is broken or shared, locales, names with spaces.

Each is either no trouble, or one sentence.
"""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import ufl
from app.test_run_command import SCENE
from ffcx.codegeneration import jit
from mpi4py import MPI

from rodfem import compat

RUN = "import sys; from rodfem.app.console import main; main(sys.argv[1:])"
SMALL = ("--step", "0.15", "--no-figures", "--elements", "4", "--degree", "2", "--depth", "0")


def run(*words: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run ``rodfem`` with these words in a process of its own, whose environment differs in this."""
    env = os.environ | environment | {"PYTHONPATH": str(Path(__file__).parents[2])}
    command = [sys.executable, "-c", RUN, *words]
    return subprocess.run(command, env=env, capture_output=True, encoding="utf-8", timeout=300, check=False)


def one_sentence(ended: subprocess.CompletedProcess[str]) -> str:
    """The only line that it complains in, of status 2."""
    assert (ended.returncode, ended.stderr.count("\n"), ended.stderr[:7]) == (2, 1, "error: ")
    return ended.stderr


@pytest.fixture
def rod(folder: Path) -> Path:
    """A scene in a file whose name, and whose folder's, has spaces and letters that are not English."""
    place = folder / "Stäbe und Ström"
    place.mkdir(exist_ok=True)
    (place / "ein Stab.py").write_text(SCENE)
    return place / "ein Stab.py"


# --- names, locales -------------------------------------------------------------------------------------------------


@pytest.mark.long
@pytest.mark.parametrize("locale", ["C", "de_DE.UTF-8"])
def test_names_and_locales(locale: str, rod: Path) -> None:
    out = rod.parent / f"Ergebnisse é {locale}"
    ended = run("run", str(rod), *SMALL, "--output", str(out), LC_ALL=locale, LC_NUMERIC=locale)
    assert (ended.returncode, ended.stderr) == (0, "")
    assert out.name in ended.stdout and "2.467" in ended.stdout  # pi^2/4, with a point
    assert (out / "diagram.json").is_file()


# --- what cannot be written -----------------------------------------------------------------------------------------


def test_a_cache_that_cannot_be_made(rod: Path) -> None:
    """A file stands where the cache would be."""
    said = one_sentence(run("run", str(rod), *SMALL, XDG_CACHE_HOME=str(rod)))
    assert f"The folder {rod}/fenics, which keeps compiled code, cannot be written" in said
    assert "set XDG_CACHE_HOME" in said


# --- a cache that is broken -----------------------------------------------------------------------------------------


def form() -> Any:
    """A form of a cell, of no rod."""
    domain = compat.interval_mesh(MPI.COMM_SELF, 1, 0.0, 1.0)
    return ufl.SpatialCoordinate(domain)[0] ** 3 * ufl.dx(domain=domain)


@pytest.mark.versions
def test_the_compiler_warns_of_nothing(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Of an And in an Or it would: gcc suggests parentheses."""
    domain = compat.interval_mesh(MPI.COMM_SELF, 1, 0.0, 1.0)
    x = ufl.SpatialCoordinate(domain)[0]
    either = ufl.Or(ufl.And(ufl.gt(x, 0.2), ufl.lt(x, 0.4)), ufl.And(ufl.gt(x, 0.6), ufl.lt(x, 0.8)))
    jit.compile_forms([ufl.conditional(either, 2.0, 1.0) * ufl.dx(domain=domain)], cache_dir=tmp_path)
    assert capfd.readouterr().err == ""


@pytest.mark.versions
def test_a_form_that_is_lost_is_compiled_again(tmp_path: Path) -> None:
    asked = form()
    jit.compile_forms([asked], cache_dir=tmp_path)
    (made,) = (f for f in tmp_path.iterdir() if f.suffix not in (".c", ".o", ".cached"))
    made.unlink()
    objects, *_ = jit.compile_forms([asked], cache_dir=tmp_path)
    assert len(objects) == 1 and made.is_file()


KILLED = """
import sys, time
from pathlib import Path
from ffcx.codegeneration import jit
sys.path.insert(0, {tests!r})
from hard.test_environments import form
from rodfem.fem import form_compiler
def endless(*_, **__):
    print("compiling", flush=True)
    time.sleep(600.0)
form_compiler._COMPILE = endless
jit.compile_forms([form()], cache_dir=Path({folder!r}))
"""


@pytest.mark.long
def test_nobody_awaits_what_another_process_compiles(tmp_path: Path) -> None:
    """FFCx by itself waits for the module of a process, even if that is dead."""
    script = KILLED.format(tests=str(Path(__file__).parents[1]), folder=str(tmp_path))
    with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True) as other:
        assert other.stdout is not None and other.stdout.readline() == "compiling\n"
        objects, *_ = jit.compile_forms([form()], cache_dir=tmp_path)
        assert len(objects) == 1
        other.kill()
