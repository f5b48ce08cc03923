"""Command lines with mistakes: status 2 and one sentence, before a folder is made or anything is computed."""

import re
import runpy
import shlex
import sys
from pathlib import Path
from typing import Any

import pytest
from hemitropic_cases import run_demo
from mpi4py import MPI

from rodfem.diagram import solver

HOME = Path(__file__).parents[2]

LINES = {
    # numbers out of their range
    "--elements 1000000000": "too large: give 1 to",
    "--elements nan": "invalid int value",
    "--accuracy 0": "not attainable",
    "--accuracy 1e-6 --elements 8": "leave out --elements, or --accuracy",
    "--accuracy 1e-6 --deg=6": "--accuracy chooses elements and degree itself: leave out --",
    "--range 0 1e-320": "as narrow as round-off",
    "--range 0 1e308": "outside its admissible range",
    "--range -inf 0": "lam = -inf is not a finite number",
    "--at 1e308": "outside the range",
    "--step 0": "out of bounds",
    "--depth -1": "is not a depth",
    "--spectrum 10000000000": "no more than 147 eigenvalues, not 10000000000: give less in --spectrum",
    "--modes 10000000000 --at 0.1": "give less in --modes",
    "--modes 2": "give them in --at",
    "--modes 2 --method count --at 0.1": "Counting alone",
    "--method foo": "Unknown method",
    "--search 3": "give them in --at",
    "--search -3 --at 0.1": "is not a number of tries",
    "--locus A 0": "expected 3 arguments",
    "--locus A x y": "is no interval",
    "--locus Q 0 1": "is no constant of the scene",
    "--locus lam 0 1": "is no constant of the scene",
    "--locus A -3 -3": "does not hold its value",
    "--locus A -3 1e308": "cannot reach A = 1e.308",
    # constants
    "--half-length 1e10": "convex, but for round-off",
    "--half-length 1e3": "more half-waves than a mesh of 48 nodes",
    "--bending 1e-5": "more half-waves .*use smaller loads, or more elements \\(--elements",
    "--twisting 0.9000000001": "convex, but for round-off",
    # words
    "--formulation foo": "formulation",
    "blue": "nrecognized arguments: blue",
    "--output ''": "name of the folder is empty",
    "--output /etc/passwd/x": "cannot be written",
    "--foo": "Unrecognized arguments: --foo; see",
    "--lenght 2": "--lenght 2 .did you mean --half-length[?]",
    "--cuopling -2 --elemnts 4": "--elemnts 4 .did you mean --coupling, --elements[?]",
}
AFTER_SET_UP = ("--half-length 1e3", "--bending 1e-5")
"""What is found with the discrete rod, in a folder that has been made."""
ON_RANKS = (*AFTER_SET_UP, "--output /etc/passwd/x")
"""What ranks find together, or in what they share."""


@pytest.mark.ranks
@pytest.mark.versions
@pytest.mark.parametrize(
    "line", [pytest.param(x, marks=pytest.mark.short if x in ON_RANKS else pytest.mark.alone) for x in LINES]
)
def test_bad_lines(line: str, folder: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> None:
    def compute(*_: object, **__: object) -> None:
        raise AssertionError("set up a system for bad input")

    if line not in AFTER_SET_UP:
        monkeypatch.setattr(solver, "System", compute)
    output, words = folder / "a b \N{GREEK SMALL LETTER LAMDA}", shlex.split(line)
    ours = [] if "--output" in words else ["--output", str(output), "--no-figures"]
    with pytest.raises(SystemExit) as ended:
        run_demo(*ours, *words)
    out, err = capfd.readouterr()
    assert ended.value.code == 2
    if line not in AFTER_SET_UP:
        assert not output.exists()
    if MPI.COMM_WORLD.rank == 0:
        assert err.startswith("error: ")
        assert err.count("\n") == 1
        assert re.search(LINES[line], err)
        assert out == "" or (line in AFTER_SET_UP and out.startswith("Compiling the forms for the first time"))
    else:
        assert out == err == ""


@pytest.mark.parametrize(
    ("program", "line", "words"),
    [
        ("map", "--couplings 99999999999999", "at most 10000"),
        ("map", "--couplings 2 --output /proc/x", "cannot be written"),
        ("map", "--couplings 2 --output ''", "name of the folder is empty"),
        ("follower", "--formulation reduced", "use --formulation pointwise"),
    ],
)
def test_other_demos(program: str, line: str, words: str, folder: Path, monkeypatch: Any, capfd: Any) -> None:
    path = str(HOME / "demos" / f"{program}.py")
    monkeypatch.setattr(sys, "argv", [path, *shlex.split(line)])
    monkeypatch.chdir(folder)
    with pytest.raises(SystemExit) as ended:
        runpy.run_path(path, run_name="__main__")
    out, err = capfd.readouterr()
    assert (ended.value.code, out, err.count("\n")) == (2, "", 1), err
    assert words in err
    assert not list(folder.iterdir())
