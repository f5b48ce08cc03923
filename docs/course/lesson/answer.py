"""A right answer, and the judgement of another one."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, isfinite, log10

from rodfem.errors import InputError

FINEST = 1e-12
"""Accuracy, relative to values greater than one, beyond which no digits are claimed."""
CONFUSED = 1e-3
"""Relative distance from a wrong number within which an answer is taken for it."""


@dataclass(frozen=True)
class Answer:
    """A number of the course.

    Attributes
    ----------
    question
        The number in words, with its symbol.
    value, source
        The number, and its closed form or where it is published.
    accuracy
        Error, relative to values greater than one, up to which an answer is right; zero for a count.
    hint
        Sentence for whoever is off.
    traps
        Wrong numbers that one may well come to, each with a sentence on the mistake.
    """

    question: str
    value: float
    source: str
    accuracy: float
    hint: str
    traps: tuple[tuple[float, str], ...] = ()

    def error(self, answer: float) -> float:
        """Error of an answer, relative to values greater than one."""
        return abs(answer - self.value) / max(1.0, abs(self.value))

    def judge(self, answer: object) -> tuple[bool, str]:
        """Whether an answer is right, and a sentence on it; raises :class:`InputError` for what is no number."""
        try:
            number = float(answer)  # type: ignore[arg-type]
        except (TypeError, ValueError):
            raise InputError(f"answer is {answer!r}: assign a number to it.") from None
        if not isfinite(number):
            raise InputError(f"answer is {number}: assign a finite number to it.")
        if self.error(number) <= self.accuracy:
            return True, f"{number:.12g} ({self.source}): {self._digits(number)}"
        for wrong, mistake in self.traps:
            if abs(number - wrong) <= CONFUSED * abs(wrong):
                return False, f"{number:.12g} is not right. {mistake}"
        return False, f"{number:.12g} is {self._distance(number)}. {self.hint}"

    def _digits(self, number: float) -> str:
        """Accuracy in powers of ten; a count is right or wrong."""
        return f"right to {10.0 ** ceil(log10(max(self.error(number), FINEST))):.0e}" if self.accuracy else "right"

    def _distance(self, number: float) -> str:
        """The side on which a number is, but not by how much: that would be the answer."""
        return f"too {'large' if number > self.value else 'small'}"
