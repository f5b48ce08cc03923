"""Is an equilibrium stable?  Inertia, eigensolvers, the paper's reduction, and one interface to all."""

from rodfem.lazy import attributes

__getattr__ = attributes("rodfem.stability")
