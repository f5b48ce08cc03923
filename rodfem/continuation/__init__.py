"""One branch: pseudo-arclength continuation, special points, their local laws."""

from rodfem.lazy import attributes

__getattr__ = attributes("rodfem.continuation")
