"""The errors that rodfem raises on purpose; each message is one sentence for a person."""

from __future__ import annotations


class SceneError(ValueError):
    """A scene, an option or a file that does not make sense: names the value, what was expected, what to try."""


class ConvergenceError(RuntimeError):
    """Newton's method found no equilibrium where one was needed; says at which load and what to try."""


class EnvironmentTrouble(RuntimeError):
    """A missing or unfit installation (complex PETSc, no dolfinx, a locked form cache); says what to do."""
