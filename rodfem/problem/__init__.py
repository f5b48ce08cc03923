"""The statement of a rod: scene, ends, loads, constraints, what is checked of them.  No dolfinx, no PETSc."""

import rodfem.forms  # noqa: F401, before UFL: see rodfem.forms.importing
