"""Equilibria that no branch has reached."""

from rodfem import libraries  # noqa: F401, before all that computes
