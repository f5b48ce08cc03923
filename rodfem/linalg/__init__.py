"""Matrices and factorisations, which know no rods."""

from rodfem.lazy import attributes

__getattr__ = attributes("rodfem.linalg")
