"""Is an equilibrium stable?  Inertia, eigensolvers, the paper's reduction, and one interface to all."""

from rodfem import libraries  # noqa: F401, before all that computes
