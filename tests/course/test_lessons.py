"""Lessons and solutions of the course run, and end with the right numbers."""

import ast
import re
import runpy
from pathlib import Path

import pytest

from lesson.answers import answer_to, answers

COURSE = Path(__file__).parents[2] / "docs" / "course"
LESSONS = sorted(COURSE.glob("[0-9]*.py"))
SOLUTIONS = sorted((COURSE / "solutions").glob("*.py"))
HEADINGS = ["Idea", "Picture", "Form", "Program", "Number", "Exercises", "Where it breaks"]
LONGEST = 162
"""Lines of a lesson."""


def question(path: Path) -> str:
    """Name of the question that a lesson or a solution answers: 3 of 03_constraints.py, 3.2 of 03_2.py."""
    lesson, rest = path.stem.split("_", 1)
    return f"{int(lesson)}.{rest}" if rest.isdigit() else f"{int(lesson)}"


def judged(path: Path) -> tuple[bool, str]:
    """Run a program, and judge its answer."""
    return answer_to(question(path)).judge(runpy.run_path(str(path))["answer"])


@pytest.mark.parametrize("path", LESSONS, ids=lambda path: path.stem)
def test_a_lesson_ends_with_its_number(path: Path, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    right, sentence = judged(path)
    assert right, sentence
    assert list((folder / "results" / "course").glob("*.png")), "a lesson has a picture"


@pytest.mark.long
@pytest.mark.parametrize("path", SOLUTIONS, ids=lambda path: path.stem)
def test_a_solution_is_right(path: Path, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    right, sentence = judged(path)
    assert right, sentence


@pytest.mark.parametrize("path", LESSONS, ids=lambda path: path.stem)
def test_a_lesson_has_its_sections(path: Path) -> None:
    text = path.read_text()
    assert text.count("\n") <= LONGEST
    assert re.findall(r"^# ## (.*)$", text, flags=re.MULTILINE) == HEADINGS
    assert re.search(rf"^# # {int(path.name[:2])}\. ", text, flags=re.MULTILINE)
    number = text[text.index("# ## Number") : text.index("# ## Exercises")]
    assert any(isinstance(node, ast.Assert) for node in ast.walk(ast.parse(number)))
    asked = re.findall(r"\*\*(\d+\.\d)\*\*", text)
    assert asked == [name for name in answers() if name.startswith(f"{question(path)}.")]
    assert 2 <= len(asked) <= 4 and "*After it you can*" in text and "*Time:*" in text


def test_every_question_has_its_program() -> None:
    assert sorted(map(question, LESSONS + SOLUTIONS)) == sorted(answers())


@pytest.mark.parametrize("path", LESSONS, ids=lambda path: path.stem)
def test_a_lesson_is_a_notebook(path: Path) -> None:
    jupytext = pytest.importorskip("jupytext")
    notebook = jupytext.read(path)
    assert {cell.cell_type for cell in notebook.cells} == {"markdown", "code"}
    assert notebook.cells[0].source.startswith("# ")


def test_the_page_lists_all_lessons() -> None:
    assert re.findall(r"\]\((\d\d_\w+\.py)\)", (COURSE / "README.md").read_text()) == [p.name for p in LESSONS]
