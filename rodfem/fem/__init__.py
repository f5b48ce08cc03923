"""The discrete rod: unknowns, weak form, symmetries, the bordered saddle point, Newton's method."""

from rodfem import libraries  # noqa: F401, before all that computes
from rodfem.lazy import attributes

__getattr__ = attributes("rodfem.fem")
