"""Enough digits: error bars, graded meshes, an accuracy kept along a branch."""

from rodfem import libraries  # noqa: F401, before all that computes
