"""Files and pictures."""

from rodfem.lazy import attributes

__getattr__ = attributes("rodfem.output")
