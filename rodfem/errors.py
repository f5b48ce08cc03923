"""The errors that rodfem raises on purpose; each message is one sentence for a person, with its remedy.

A remedy names arguments of the interface in Python, as in ``StepControl(largest=...)``.  The command line, which has an
option for each, names that instead (:meth:`rodfem.app.cli.Parser.in_options`).
"""

from __future__ import annotations

INTERRUPTED = 130  # status of a program that is interrupted
SMALLER_STEPS = "use smaller steps (StepControl(largest=...))"


def many(count: int, noun: str, plural: str = "") -> str:
    """A number of things: ``1 point``, ``2 points``."""
    return f"{count} {noun if count == 1 else plural or noun + 's'}"


class InputError(ValueError):
    """An option, an argument or a file that does not make sense: names the value, what was expected, what to try."""


class SceneError(InputError):
    """A scene that does not make sense."""


class ConvergenceError(RuntimeError):
    """Newton's method found no equilibrium where one was needed; says at which load and what to try."""


class SetupError(RuntimeError):
    """A missing or unfit installation (complex PETSc, no dolfinx, a locked form cache); says what to do."""
