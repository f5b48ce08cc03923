"""Motion of a rod in a perturbation, and its left-most modes."""

from rodfem import libraries  # noqa: F401, before all that computes
