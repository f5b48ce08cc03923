"""The rod of a file, with its constants as options: ``rodfem run FILE.py``."""

import importlib
import sys
import sysconfig
from math import pi
from pathlib import Path

import demo_cases
import pytest
from petsc4py import PETSc
from slepc4py import SLEPc

import rodfem
from rodfem.app import console
from rodfem.app.main import Statement
from rodfem.app.persons_file import load
from rodfem.compat import slepc_errors
from rodfem.ranks import in_words

SCENE = """
from rodfem.forms.energy import bending_and_twist
from rodfem import Discretization, Ordinate, Parameter, Scene, clamped, free

column = Scene(
    name="column",
    interval=(0.0, 1.0),
    rod="unshearable and inextensible",
    energy=lambda v, k, c: bending_and_twist(k, (c.EI, 2 * c.EI, 1.0)),
    parameters={"P": Parameter(0.0), "EI": Parameter(1.0)},
    load="P",
    ends=(clamped(), free(force=lambda c: (0.0, 0.0, -c.P))),
    ordinate=Ordinate("tip", s=1.0, of=lambda r, q: r[0] + r[1]),
    span=(0.0, 10.0),
)
"""
FUNCTION = SCENE.replace("column = Scene(", "def column(EI: float = 1) -> Scene:\n  return Scene(")
FUNCTION = FUNCTION.replace("Parameter(1.0)", "Parameter(EI)")
FUNCTION += "\ndef mesh(EI=1) -> Discretization:\n  return Discretization(elements=5)\n"


@pytest.mark.long
@pytest.mark.parametrize("text", [SCENE, FUNCTION])
def test_a_file_with_a_rod(text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Euler's load is pi^2 EI / 4; the elements are those of the file's mesh where it has one."""
    file = tmp_path / "mine.py"
    file.write_text(text)
    line = ["run", str(file), "--EI", "2", "--range", "0", "6", "--no-figures", "--output", str(tmp_path / "made")]
    console.main(line)
    said = capsys.readouterr().out
    assert ("5 elements" if "mesh" in text else "8 elements") in said
    data = rodfem.load_json(tmp_path / "made" / "diagram.json")
    first = data["branches"][0]["special"][0]
    assert abs(first["load"] - pi**2 / 2) < first["error_estimate"] < 1e-8
    assert data["range"] == [0.0, 6.0]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("x = 1 / 0", "line 1: ZeroDivisionError"),
        ("x = (", "line 1: SyntaxError"),
        ("import no_such_module", "line 1: ModuleNotFoundError"),
        ("x = 1", "states no rod"),
        (SCENE + "other = column", "has the scenes column, other"),
        (SCENE + "from rodfem import Plan\na, b = Plan(), Plan()", "has more than one Plan (a, b): keep one of them"),
        (SCENE.replace("span=(0.0, 10.0)", "span=(0.0, 0.0)"), "range"),
        (FUNCTION.replace("EI: float = 1", "EI"), "The argument EI of column has no default"),
        (FUNCTION.replace("EI: float = 1", "EI=None"), "The argument EI of column has the default None"),
        (FUNCTION.replace("EI: float = 1", "degree=1, EI=1.0"), "has the name of an option of all rods"),
        (FUNCTION.replace("return Scene(", "return (lambda **_: 3)("), "column returns 3"),
        (FUNCTION.replace("return Scene(", "raise KeyError('x'); return Scene("), "KeyError: 'x'; correct column, or"),
        (SCENE + "exit(0)", "line 16: SystemExit: 0"),
    ],
)
def test_files_with_mistakes(text: str, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "mine.py"
    file.write_text(text)
    with pytest.raises(SystemExit) as left:
        console.main(["run", str(file)])
    said = capsys.readouterr().err
    assert left.value.code == 2
    assert said.startswith("error: ") and said.count("\n") == 1 and words in said


def test_a_scene_is_named_among_the_options(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "mine.py"
    file.write_text(SCENE + "other = column")
    with pytest.raises(SystemExit):
        console.main(["run", str(file), "--depth", "0", "--scene", "third"])
    assert "has no scene 'third': choose one of column, other" in capsys.readouterr().err


def test_a_load_is_no_constant(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "mine.py"
    file.write_text(SCENE)
    for words in (["--P", "3"], ["--P=3"]):
        with pytest.raises(SystemExit):
            console.main(["run", str(file), *words])
        assert capsys.readouterr().err == "error: P is the load, which a run varies: give its range, --range FROM TO.\n"


@pytest.mark.long
def test_a_file_that_runs_its_rod_itself(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The rod is traced once, over the range of the command line, and nothing is written where the file says."""
    file, there, here = (tmp_path / name for name in ("mine.py", "there", "here"))
    file.write_text(f"{SCENE}\nimport rodfem\nrodfem.run(column, output={str(there)!r})\nnot_reached()\n")
    console.main(["run", str(file), "--range", "0", "3", "--no-figures", "--output", str(here)])
    assert capsys.readouterr().out.count("column: ") == 1
    assert not there.exists() and rodfem.load_json(here / "diagram.json")["range"] == [0.0, 3.0]
    rodfem.run(load(file).column, output=there, figures=False, quiet=True)  # as ever, once it has been read
    assert (there / "diagram.json").exists()
    for name in ("", "diagram.json", "states.h5"):
        console.main(["info", str(here / name)])
        assert capsys.readouterr().out.startswith("column: EI = 1\n")


OWN = "\nfrom rodfem import Plan\nplan = Plan(span=(0.0, 3.0), depth=0, at=(1.0, 2.0))\n"


@pytest.mark.parametrize(
    "end", ["", "import rodfem\nother = Plan()\nrodfem.run(column, Discretization(elements=3), plan)\n"]
)
def test_the_options_of_a_file_are_those_of_its_own_plan(end: str, tmp_path: Path) -> None:
    """Of the plan that it has, or with which it runs its rod; an option replaces one field of it."""
    file = tmp_path / "mine.py"
    file.write_text(SCENE + OWN + end)
    line = ["run", str(file), "--at", "1.5", "--no-figures", "--output", str(tmp_path / "made")]
    console.main(line)
    data = rodfem.load_json(tmp_path / "made" / "diagram.json")
    assert data["range"] == [0.0, 3.0] and data["asked"]["plan"]["depth"] == 0 and len(data["branches"]) == 1
    assert data["asked"]["plan"]["at"] == [1.5] and data["discretization"]["elements"] == (3 if end else 8)


def test_what_stands_beside_a_file_hides_no_module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its own modules are found; a name that Python has, too, is Python's."""
    monkeypatch.setattr(sys, "path", list(sys.path))
    (tmp_path / "colorsys.py").write_text("mine = True")
    (tmp_path / "stiffnesses_of_mine.py").write_text("EI = 3.0")
    (tmp_path / "sched.py").write_text("import stiffnesses_of_mine as s\nEI = s.EI")  # the name of one of Python's
    assert load(tmp_path / "sched.py").EI == 3.0
    assert not hasattr(importlib.import_module("colorsys"), "mine")
    assert importlib.import_module("sched").__file__ == f"{sysconfig.get_path('stdlib')}/sched.py"


@pytest.mark.few(3)
@pytest.mark.parametrize("name", demo_cases.FUNCTIONS)
def test_constants_of_the_demos_are_described(name: str) -> None:
    statement = Statement(getattr(demo_cases.module(name), demo_cases.FUNCTIONS[name]))
    assert statement.constants and all(constant.words for constant in statement.constants)


def test_an_option_that_slepc_refuses_is_one_sentence() -> None:
    options = PETSc.Options()
    options["refused_eps_type"] = "nonsense"
    solver = SLEPc.EPS().create()
    solver.setOptionsPrefix("refused_")
    with pytest.raises(PETSc.Error) as refused, slepc_errors():
        solver.setFromOptions()
    options.delValue("refused_eps_type")
    assert "nonsense): use smaller steps, another discretisation, or other options" in in_words(refused.value)
