"""Whether a student's program has the right answer to a question of the course."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rodfem.app.cli import Parser
from rodfem.app.persons_file import load
from rodfem.app.pipes import end_quietly
from rodfem.course.answers import answer_to, answers
from rodfem.errors import InputError

WRONG = 1
"""Status of the program where the answer is wrong."""


def main(words: Sequence[str]) -> None:
    """Run the program and print the judgement, or without a program the questions; a wrong answer leaves with status 1.

    Raises :class:`~rodfem.errors.InputError` for an unknown question, and for a program that fails or gives no number.
    """
    parser = Parser(prog="rodfem check", description=__doc__)
    parser.add_argument("question", nargs="?", help="3: number of lesson 3; 3.2: its second exercise; none: list all")
    parser.add_argument("program", nargs="?", type=Path, help="a Python file that assigns a number to the name answer")
    options = parser.parse_args(words)
    asked = {options.question: answer_to(options.question)} if options.question else answers()
    if options.program is None:
        print("\n".join(f"{name:<6}{answer.question}" for name, answer in asked.items()))
    else:
        right, sentence = asked[options.question].judge(answer_of(options.program))
        print(sentence)
        sys.exit(0 if right else WRONG)


def answer_of(program: Path) -> Any:
    """Value that a program assigns to ``answer``; raises :class:`~rodfem.errors.InputError` where it does not."""
    end_quietly()
    names = vars(load(program, "__main__"))
    if "answer" not in names:
        raise InputError(f"{program} assigns nothing to answer: end it with a line like answer = 9.8696.")
    return names["answer"]
