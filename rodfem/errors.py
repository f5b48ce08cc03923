"""The errors that rodfem raises on purpose; each message is one sentence for a person, its remedy is data as well.

A remedy names arguments of the interface in Python, as in ``StepControl(largest=...)``.  The command line, which has an
option for each, names that instead (:meth:`rodfem.app.cli.Parser.in_options`).
"""

from __future__ import annotations

from dataclasses import dataclass

INTERRUPTED = 130  # status of a program that is interrupted


def many(count: int, noun: str, plural: str = "") -> str:
    """A number of things: ``1 point``, ``2 points``."""
    return f"{count} {noun if count == 1 else plural or noun + 's'}"


@dataclass(frozen=True)
class Argument:
    """An argument of a public class or function, with the ``value`` to give where there is one to recommend."""

    owner: str
    name: str
    value: object = ...

    def __str__(self) -> str:
        return f"{self.owner}({self.name}={'...' if self.value is ... else repr(self.value)})"


class Remedy:
    """What to try: words in which each ``{}`` stands for an argument."""

    def __init__(self, words: str, *arguments: Argument) -> None:
        self.words, self.arguments = words, arguments

    def __str__(self) -> str:
        return self.words.format(*self.arguments)


SMALLER_STEPS = Remedy("use smaller steps ({})", Argument("StepControl", "largest"))
POINTWISE = Remedy("use {}", Argument("Discretization", "formulation", "pointwise"))


class _Remediable(Exception):
    """An error in one sentence, or in the first half of one that its ``remedy`` completes."""

    def __init__(self, sentence: str, remedy: Remedy | None = None) -> None:
        super().__init__(sentence if remedy is None else f"{sentence}: {remedy}.")
        self.remedy = remedy


class InputError(_Remediable, ValueError):
    """An option, an argument or a file that does not make sense: names the value, what was expected, what to try."""


class SceneError(InputError):
    """A scene that does not make sense."""


class ConvergenceError(_Remediable, RuntimeError):
    """Newton's method found no equilibrium where one was needed; says at which load and what to try."""


class SetupError(_Remediable, RuntimeError):
    """A missing or unfit installation (complex PETSc, no dolfinx, a locked form cache); says what to do."""
