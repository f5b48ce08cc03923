r"""Unstable eigenvalues among all that a mesh has, of a rod under loads without a potential.

Eigenvalues nearest to a shift need not be those that flutter: where a rod has dozens of slow motions, as a soft one in
torsion, a pair farther off is not among them.  With ``K`` the rows and columns of ``(S - a M)^-1`` that have mass, and
``m = L L^t`` the mass there, of the rank that ``L`` has columns, the eigenvalues of ``L^t K L`` are those ``nu = 1 /
(mu - a)`` of all finite ``mu``, and zeros (:mod:`rodfem.stability.outside`).  Unlike in the pencil those zeros are in
no Jordan blocks: round-off leaves them as small as it is, and finite eigenvalues are told from them down to there.

Round-off of a matrix ``A`` moves a simple eigenvalue by up to ``|dA| / |y.x|``, for its right and left vectors ``x``
and ``y`` of norm one (Wilkinson, The Algebraic Eigenvalue Problem, 1965, chapter 2).  What that may have made unstable
is left out.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from scipy.linalg import eigh
from scipy.sparse.linalg import splu

from rodfem.errors import ConvergenceError
from rodfem.linalg.matrices import gathered
from rodfem.stability.finite_pairs import SHIFT
from rodfem.stability.nonsymmetric import NonsymmetricPencil
from rodfem.stability.outside import inverse_with_mass

CLEAR = 1e-5
"""Imaginary part, relative to its eigenvalue, above which that is complex, and negative real part, to natural size.

Equal eigenvalues are taken apart by less.
"""
ROUNDED = 1e-13
"""Round-off of the inverse relative to its norm, and to the natural size of its entries where that is larger.

Of free rods on six elements up to 1.2e-14 is seen."""
MANY = 1000
"""Rows with mass of which a second or so finds all eigenvalues."""
MOST = 4000
"""Rows of a pencil that each rank factors by itself."""


@dataclass(frozen=True)
class Motions:
    """Vectors of ``K m`` for the finite eigenvalues ``values`` (k,), ``mu = omega^2``, nearest to the shift first.

    ``inverse`` is ``K`` (h, h), ``mass`` is ``m`` (h, h), ``lower`` is ``L`` (h, n); ``nu`` (k,), ``right`` (n, k) and
    ``left`` (k, n) are those eigenvalues of ``L^t K L`` and their vectors, ``doubt`` (k,) the round-off of ``nu``.
    """

    values: np.ndarray
    nu: np.ndarray
    right: np.ndarray
    left: np.ndarray
    inverse: np.ndarray
    mass: sp.csr_matrix
    lower: np.ndarray
    doubt: np.ndarray

    @cached_property
    def operator(self) -> np.ndarray:
        """``K m`` (h, h), which is smooth in parameters of the rod."""
        return np.asarray(self.inverse @ self.mass)

    def vectors(self, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Right (h, j) and left vectors (j, h) of ``K m`` for j of the eigenvalues; their product is the identity."""
        right = self.inverse @ (self.lower @ self.right[:, places])
        return right / self.nu[places], self.left[places] @ self.lower.T


class Census(NamedTuple):
    """Eigenvalues ``unstable`` (k,), ``mu = omega^2``, and how many are ``nearer`` (k,) to the shift than each.

    ``motions`` has all finite ones; the unstable ones have these places there.
    """

    unstable: np.ndarray
    nearer: np.ndarray
    motions: Motions


def census(pencil: NonsymmetricPencil, largest: int = MANY) -> Census | None:
    """All finite eigenvalues of a ``pencil``, the unstable ones apart; None where more than ``largest`` rows have mass.

    Those that round-off may have made unstable are left out.  None also where the shift is an eigenvalue.
    """
    found = _inverse(pencil, largest)
    if found is None:
        return None
    inverse, mass, lower, round_off = found
    nu, right = np.linalg.eig(lower.T @ inverse @ lower)  # the vectors have norm one
    left = np.linalg.inv(right)
    doubt = round_off * np.linalg.norm(left, axis=1)
    order, values, unstable = _values(nu, doubt)
    values = values * pencil.system.scene.units.omega2
    motions = Motions(values, nu[order], right[:, order], left[order], inverse, mass, lower, doubt[order])
    return Census(values[unstable], np.flatnonzero(unstable), motions)


def _values(nu: np.ndarray, round_off: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places of the finite eigenvalues ``nu`` (n,), nearest to the shift first, ``mu``, and which are unstable.

    They are beyond the ``round_off`` (n,) of each.
    """
    order = np.argsort(-abs(nu), kind="stable")
    order = order[abs(nu[order]) > round_off[order]]
    doubt = np.maximum(CLEAR, round_off[order] / abs(nu[order]))
    values = SHIFT + 1.0 / nu[order]
    complex_ones = abs(values.imag) > doubt * abs(values - SHIFT)
    unstable = complex_ones & (abs(values.imag) > CLEAR) | (values.real < -doubt * abs(values - SHIFT))
    return order, values, unstable


def _inverse(pencil: NonsymmetricPencil, largest: int) -> tuple[np.ndarray, sp.csr_matrix, np.ndarray, float] | None:
    """``K``, ``m``, ``L`` of a pencil in units of natural sizes, and the round-off of ``L^t K L``.

    None for too many rows, or no factors.
    """
    try:
        factors = pencil.eliminated(SHIFT * pencil.system.scene.units.omega2)
        if factors is not None:
            found = inverse_with_mass(pencil.mass_in_units(), factors.solve, largest)
        elif pencil.matrix.getSize()[0] > MOST:
            return None
        else:  # on several ranks, or with PETSc's factors: each rank has all of it
            stiffness, mass = (gathered(A) for A in pencil.in_units())
            found = inverse_with_mass(mass, splu((stiffness - SHIFT * mass).tocsc()).solve, largest)
    except (ConvergenceError, RuntimeError):  # the shift is an eigenvalue
        return None
    if found is None:
        return None
    _, inverse, sparse = found
    m = sparse.toarray()
    masses, ways = eigh(m)  # a quaternion's own length has no mass
    lower = ways[:, masses > 0.0] * np.sqrt(masses[masses > 0.0])
    round_off = ROUNDED * max(float(np.linalg.norm(inverse, 2)), 1.0) * float(masses.max(initial=0.0))
    return inverse, sparse, lower, round_off
