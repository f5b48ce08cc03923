"""The mathematics of rodfem in pure UFL, to be read as lecture notes: no meshes, no PETSc.

Read in this order: :mod:`forms.rotation`, :mod:`forms.kinematics`, :mod:`forms.energy`,
:mod:`forms.lagrangian`, :mod:`forms.inertia`, :mod:`forms.symmetry`.
"""
