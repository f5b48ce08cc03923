"""One branch: pseudo-arclength continuation, test functions, special points, their normal forms."""

from rodfem.lazy import attributes

__getattr__ = attributes("rodfem.continuation")
