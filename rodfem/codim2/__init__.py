"""Special points in the plane of two parameters."""

from rodfem import libraries  # noqa: F401, before all that computes
