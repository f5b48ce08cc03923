"""Whether a student's program has the right answer to a question of the course."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from lesson.answers import answer_to, answers
from rodfem.app.cli import Parser, complain
from rodfem.app.persons_file import load
from rodfem.errors import InputError
from rodfem.ranks import end_quietly

WRONG = 1
"""Status of the program where the answer is wrong."""


def main(words: Sequence[str]) -> None:
    """Run the program and print the judgement, or without a program the questions.

    A wrong answer leaves with status 1.  An unknown question, and a program that fails or gives no number, are one
    sentence and status 2.
    """
    parser = Parser(description=__doc__)
    parser.add_argument("question", nargs="?", help="3: number of lesson 3; 3.2: its second exercise; none: list all")
    parser.add_argument("program", nargs="?", type=Path, help="a Python file that assigns a number to the name answer")
    options = parser.parse_args(words)
    try:
        asked = {options.question: answer_to(options.question)} if options.question else answers()
        if options.program is None:
            print("\n".join(f"{name:<6}{answer.question}" for name, answer in asked.items()))
        else:
            right, sentence = asked[options.question].judge(answer_of(options.program))
            print(sentence)
            sys.exit(0 if right else WRONG)
    except InputError as trouble:
        complain(str(trouble))


def answer_of(program: Path) -> Any:
    """Value that a program assigns to ``answer``; raises :class:`~rodfem.errors.InputError` where it does not."""
    end_quietly()
    names = vars(load(program, "__main__"))
    if "answer" not in names:
        raise InputError(f"{program} assigns nothing to answer: end it with a line like answer = 9.8696.")
    return names["answer"]


if __name__ == "__main__":
    main(sys.argv[1:])
