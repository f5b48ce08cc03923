"""Special points in the plane of two parameters."""

from rodfem import libraries  # noqa: F401, before all that computes
from rodfem.lazy import attributes

__getattr__ = attributes("rodfem.codim2")
