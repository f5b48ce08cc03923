"""The mathematics of rodfem in pure UFL, to be read as lecture notes: no meshes, no PETSc.

Read in this order: :mod:`rodfem.forms.rotation`, :mod:`rodfem.forms.kinematics`, :mod:`rodfem.forms.energy`,
:mod:`rodfem.forms.lagrangian`, :mod:`rodfem.forms.loads`, :mod:`rodfem.forms.inertia`,
:mod:`rodfem.forms.symmetry`, :mod:`rodfem.forms.paper`.  They are installed as ``rodfem.forms``.
"""

import rodfem.forms.importing  # noqa: F401, first of all that imports UFL
from rodfem.forms import energy, inertia, kinematics, lagrangian, loads, paper, rotation, symmetry

__all__ = ["energy", "inertia", "kinematics", "lagrangian", "loads", "paper", "rotation", "symmetry"]
