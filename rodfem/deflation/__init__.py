"""Equilibria that no branch has reached."""

from rodfem.lazy import attributes

__getattr__ = attributes("rodfem.deflation")
