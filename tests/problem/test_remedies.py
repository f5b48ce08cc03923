"""Remedies name arguments: each exists in Python and has an option of the command line, which is named there."""

import ast
import inspect
import re
from pathlib import Path

import hemitropic_cases
import pytest
from hemitropic_cases import run_demo
from mpi4py import MPI

import rodfem
from rodfem.app.cli import Parser
from rodfem.app.main import Statement, parser_of
from rodfem.errors import SMALLER_STEPS
from rodfem.fem.formulations import AUTO, FORMULATIONS

HOME = Path(__file__).parents[2] / "rodfem"
pytestmark = pytest.mark.versions


def parser() -> Parser:
    scene = hemitropic_cases.scene()
    return parser_of(Statement(scene), scene, "rod.py")


def named() -> set[tuple[str, str]]:
    """Owner and name of every argument that a text of the package names."""
    found, argument = set(), re.compile(r"\b(Discretization|Plan|StepControl|run)\((\w+)=")
    for path in HOME.rglob("*.py"):
        tree = ast.parse(path.read_text())
        texts = [n.value for n in ast.walk(tree) if isinstance(n, ast.Constant) and isinstance(n.value, str)]
        found |= {pair for text in texts for pair in argument.findall(text)}
    return found


@pytest.mark.long
def test_every_argument_exists_and_has_an_option() -> None:
    assert {("StepControl", "largest"), ("Plan", "depth"), ("Discretization", "elements"), ("run", "output")} <= named()
    for owner, name in named():
        assert name in inspect.signature(getattr(rodfem, owner)).parameters, (owner, name)
        assert name in ("most_branches", "most") or parser().option(name).startswith("--")  # which only Python has


def test_words_of_python_and_of_the_command_line() -> None:
    assert parser().in_options(f"{SMALLER_STEPS} or Plan(depth=3).") == "use smaller steps (--step) or --depth 3."
    assert parser().in_options("use Discretization(formulation='pointwise')") == "use --formulation pointwise"
    for unknown in ("use Event(name=...)", "use StepControl(smallest=...)"):
        assert parser().in_options(unknown) == unknown


def test_terminal_of_the_command_line_names_options(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        run_demo("--depth", "-1", "--output", str(folder))
    err = capfd.readouterr().err
    assert not err or err == "error: -1 is not a depth: give 0 or more in --depth.\n"
    assert bool(err) == (MPI.COMM_WORLD.rank == 0)


def test_all_formulations_are_named() -> None:
    """By their keys, in the help and in the page about files."""
    page, words = (HOME.parent / "docs" / "files.md").read_text(), " ".join(parser().format_help().split())
    assert "{" + ",".join((AUTO, *FORMULATIONS)) + "}" in words
    for name, made in FORMULATIONS.items():
        assert made.name == name and f"`{name}`" in page and f"{name}: {made.words}" in words
