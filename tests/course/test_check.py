"""The program that judges a student's program."""

from math import pi
from pathlib import Path

import pytest

import check
from lesson.answer import Answer
from lesson.answers import answers
from rodfem.errors import InputError

EULER = Answer("load", pi**2 / 4, "exact pi^2/4", 1e-4, "Look at the clamp.", ((pi**2, "Those are pinned ends."),))


@pytest.mark.parametrize(
    ("answer", "right", "sentence"),
    [
        (pi**2 / 4, True, "2.46740110027 (exact pi^2/4): right to 1e-12"),
        (2.4674, True, "2.4674 (exact pi^2/4): right to 1e-06"),
        (2.5, False, "2.5 is too large. Look at the clamp."),
        (-1, False, "-1 is too small. Look at the clamp."),
        (9.8696, False, "9.8696 is not right. Those are pinned ends."),
    ],
)
def test_judgement(answer: float, right: bool, sentence: str) -> None:
    assert EULER.judge(answer) == (right, sentence)


def test_a_count_is_right_or_wrong() -> None:
    count = Answer("index", 3, "exact 3", 0.0, "Count again.")
    assert count.judge(3) == (True, "3 (exact 3): right")
    assert count.judge(2) == (False, "2 is too small. Count again.")


@pytest.mark.parametrize("answer", ["many", None, float("nan"), float("inf"), [1.0]])
def test_what_is_no_number(answer: object) -> None:
    with pytest.raises(InputError, match="assign a"):
        EULER.judge(answer)


@pytest.mark.parametrize("name", answers())
def test_traps_are_wrong_and_answers_right(name: str) -> None:
    answer = answers()[name]
    assert answer.judge(answer.value)[0]
    for wrong, mistake in answer.traps:
        assert answer.judge(wrong) == (False, f"{wrong:.12g} is not right. {mistake}")


@pytest.mark.parametrize(
    ("program", "status", "words"),
    [
        ("answer = 2 / 3.141592653589793", 0, "0.636619772368 (exact 2/pi: a quarter of a circle): right to 1e-12\n"),
        ("answer = 0.5", 1, "0.5 is too small. "),
        ("x = 1\nanswer = x / 0", 2, "mine.py, line 2: ZeroDivisionError: division by zero"),
        ("x = 1\ny = (", 2, "mine.py, line 2: SyntaxError"),
        ("x = 1", 2, "mine.py assigns nothing to answer: end it with a line like answer = 9.8696."),
    ],
)
def test_a_program(program: str, status: int, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "mine.py").write_text(program)
    with pytest.raises(SystemExit) as left:
        check.main(["1.1", str(tmp_path / "mine.py")])
    said = capsys.readouterr()
    assert left.value.code == status
    assert words in said.out + said.err


def test_mistakes_and_questions(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    check.main(["1.1"])
    assert capsys.readouterr().out == f"1.1   {answers()['1.1'].question}\n"
    check.main([])
    assert capsys.readouterr().out.count("\n") == len(answers())
    for words, sentence in ((["12"], "no question '12'"), (["1", str(tmp_path / "none.py")], "is no file")):
        with pytest.raises(SystemExit):
            check.main(words)
        assert sentence in capsys.readouterr().err
