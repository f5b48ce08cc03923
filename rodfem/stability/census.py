r"""Unstable eigenvalues among all that a mesh has, of a rod under loads without a potential.

Eigenvalues nearest to a shift need not be those that flutter: where a rod has dozens of slow motions, as a soft one in
torsion, a pair farther off is not among them.  With ``K`` the rows and columns of ``(S - a M)^-1`` that have mass, and
``m`` the mass there, the eigenvalues of ``K m`` are ``nu = 1 / (mu - a)`` of all finite ``mu``, and zeros
(:mod:`rodfem.stability.outside`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.sparse.linalg import splu

from rodfem.errors import ConvergenceError
from rodfem.linalg.matrices import gathered
from rodfem.stability.nonsymmetric import FAR, SHIFT, NonsymmetricPencil
from rodfem.stability.outside import inverse_with_mass

CLEAR = 1e-5
"""Imaginary part, relative to its eigenvalue, above which that is complex, and negative real part, to natural size.

Round-off takes far and equal eigenvalues apart by less.
"""
MOST = 4000
"""Rows of a pencil that each rank factors by itself."""


class Census(NamedTuple):
    """Eigenvalues ``unstable`` (k,), ``mu = omega^2``, and how many are ``nearer`` (k,) to the shift than each."""

    unstable: np.ndarray
    nearer: np.ndarray


def census(pencil: NonsymmetricPencil) -> Census | None:
    """Unstable eigenvalues among all finite ones of a ``pencil``; None where it has too many rows to look at all.

    Those that are so far from the shift that round-off makes the like of them are left out.
    """
    one = pencil.system.scene.units.omega2
    values = _all(pencil)
    if values is None:
        return None
    values = values[np.argsort(abs(values - SHIFT), kind="stable")]
    bad = (abs(values.imag) > CLEAR * np.maximum(abs(values), 1.0)) | (values.real < -CLEAR)
    return Census(values[bad] * one, np.flatnonzero(bad))


def _all(pencil: NonsymmetricPencil) -> np.ndarray | None:
    """All finite eigenvalues in units of their natural size; None where there are too many rows, or no factors."""
    try:
        factors = pencil.eliminated(SHIFT * pencil.system.scene.units.omega2)
        if factors is not None:
            found = inverse_with_mass(pencil.mass_in_units(), factors.solve)
        elif pencil.matrix.getSize()[0] > MOST:
            return None
        else:  # on several ranks, or with PETSc's factors: each rank has all of it
            stiffness, mass = (gathered(A) for A in pencil.in_units())
            found = inverse_with_mass(mass, splu((stiffness - SHIFT * mass).tocsc()).solve)
    except (ConvergenceError, RuntimeError):  # the shift is an eigenvalue
        return None
    if found is None:
        return None
    _, inverse, m = found
    nu = np.linalg.eigvals(inverse @ m.toarray())
    nu = nu[abs(nu) > abs(nu).max(initial=0.0) / FAR]
    return np.asarray(SHIFT + 1.0 / nu, dtype=complex)
