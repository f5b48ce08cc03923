"""Matrices and factorisations, which know no rods."""

from rodfem import libraries  # noqa: F401, before all that computes
