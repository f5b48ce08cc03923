"""The statement of a rod: scene, ends, loads, constraints, what is checked of them.  No dolfinx, no PETSc."""

from rodfem.lazy import attributes

__getattr__ = attributes("rodfem.problem")
