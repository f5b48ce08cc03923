"""The method of Kumar & Healey (2010): coordinates, null space of the constraints, reduction, Cayley transform.

Only the registry of methods (:data:`rodfem.stability.METHODS`) knows of it.
"""

from rodfem import libraries  # noqa: F401, before all that computes
