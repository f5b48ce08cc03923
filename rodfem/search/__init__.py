"""Search for equilibria that no branch connects to those that are known."""

from rodfem.lazy import attributes

__getattr__ = attributes(__name__)
