"""The mathematics of rodfem in pure UFL, to be read as lecture notes: no meshes, no PETSc.

Read in this order: :mod:`forms.rotation`, :mod:`forms.kinematics`, :mod:`forms.energy`,
:mod:`forms.lagrangian`, :mod:`forms.loads`, :mod:`forms.inertia`, :mod:`forms.symmetry`, :mod:`forms.paper`.
"""

import forms.importing  # noqa: F401, first of all that imports UFL
from forms import energy, inertia, kinematics, lagrangian, loads, paper, rotation, symmetry

__all__ = ["energy", "inertia", "kinematics", "lagrangian", "loads", "paper", "rotation", "symmetry"]
