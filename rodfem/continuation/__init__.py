"""One branch: pseudo-arclength continuation, test functions, special points, their normal forms."""

from rodfem import libraries  # noqa: F401, before all that computes
