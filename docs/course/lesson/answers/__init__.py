"""Right answers of the course: a module each lesson, ``lesson_03``, with its own number first and then its exercises.

An answer is named ``3`` for the number of lesson 3, and ``3.2`` for its second exercise.
"""

from __future__ import annotations

from importlib import import_module
from pkgutil import iter_modules

from lesson.answer import Answer
from rodfem.errors import InputError

LESSONS = tuple(sorted(module.name for module in iter_modules(__path__)))


def answers() -> dict[str, Answer]:
    """All answers by name, in the order of the course."""
    found = {}
    for module in LESSONS:
        lesson = str(int(module.removeprefix("lesson_")))
        for number, answer in enumerate(import_module(f"{__name__}.{module}").ANSWERS):
            found[f"{lesson}.{number}" if number else lesson] = answer
    return found


def answer_to(name: str) -> Answer:
    """Right answer of a name; raises :class:`~rodfem.errors.InputError` for a name that the course has not."""
    known = answers()
    if name not in known:
        raise InputError(f"The course has no question {name!r}: choose one of {', '.join(known)}.")
    return known[name]
