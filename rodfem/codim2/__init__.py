"""Special points in the plane of two parameters."""

from rodfem.lazy import attributes

__getattr__ = attributes("rodfem.codim2")
