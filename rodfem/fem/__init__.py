"""The discrete rod: unknowns, weak form, symmetries, the bordered saddle point, Newton's method."""

from rodfem import libraries  # noqa: F401, before all that computes
