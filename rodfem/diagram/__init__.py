"""The whole picture: what is traced, in which order, and the diagram that comes of it."""

from rodfem.lazy import attributes

__getattr__ = attributes("rodfem.diagram")
