"""The statement of a rod: scene, ends, loads, constraints, what is checked of them.  No dolfinx, no PETSc."""

import forms  # noqa: F401, before UFL: see forms.importing
from rodfem.lazy import attributes

__getattr__ = attributes("rodfem.problem")
