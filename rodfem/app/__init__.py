"""A run from a shell: command line, terminal, many rods."""

from rodfem.lazy import attributes

__getattr__ = attributes("rodfem.app")
