"""The whole picture: what is traced, in which order, and the diagram that comes of it."""

from rodfem import libraries  # noqa: F401, before all that computes
