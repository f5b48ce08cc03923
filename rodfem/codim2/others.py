"""How many eigenvalues other than those that meet or vanish on a locus are unstable, under loads without a potential.

The index of a symmetric tangent matrix comes with its factors (:mod:`rodfem.codim2.singular`).  Without symmetry
stability is decided by the eigenvalues ``omega^2``: those that are negative or complex count.  Those nearest zero are
sought one by one, all others of a mesh that is not fine at once (:mod:`rodfem.stability.census`).
"""

from __future__ import annotations

import numpy as np

from rodfem.stability.census import census
from rodfem.stability.finite_pairs import SHIFT
from rodfem.stability.nonsymmetric import Frequencies, NonsymmetricPencil
from rodfem.stability.outside import LARGEST
from rodfem.stability.slow_motions import with_floor

NUMBER = 10
"""Eigenvalues that are sought besides those of the locus."""
MET = 1e-4
"""Imaginary part, relative to the eigenvalue, below which a pair has only just met: it has a square root there."""
VANISHED = "another eigenvalue has vanished since the row before, seen from the start"
UNSTABLE = "another frequency has become unstable, or stable, since the row before, seen from the start"
"""What is said of a row where their number has changed, with a potential and without one."""


NEAREST = (
    f"the index is that of the {NUMBER} frequencies nearest zero: the mesh has too many unknowns to look at all of them"
)
"""What is said of a locus on a fine mesh."""
BEYOND = 1 + 1e-6
"""Times the distance of the farthest eigenvalue that was sought from which on others are farther."""


def beside_cluster(pencil: NonsymmetricPencil, basis: np.ndarray) -> int:
    """Unstable eigenvalues but for those of an invariant subspace: ``basis`` (n, size), orthonormal in the mass."""
    found, size = _found(pencil, basis.shape[1]), basis.shape[1]
    inside = (abs(pencil.product(basis, found.weighed)) ** 2).sum(axis=0)
    chosen = np.argsort(inside / pencil.squares(found.vectors, found.weighed), kind="stable")[:-size]
    return _unstable(found, chosen) + _farther(pencil, found)


def beside_zero(pencil: NonsymmetricPencil, size: int) -> int:
    """Unstable eigenvalues but for the ``size`` ones that are nearest to zero."""
    found = _found(pencil, size)
    return _unstable(found, np.argsort(abs(found.values), kind="stable")[size:]) + _farther(pencil, found)


def unstable(pencil: NonsymmetricPencil) -> int:
    """Unstable eigenvalues."""
    found = _found(pencil, 0)
    return _unstable(found, np.arange(len(found.values))) + _farther(pencil, found)


def all_looked_at(pencil: NonsymmetricPencil) -> bool:
    """Whether the mesh is so coarse that all its eigenvalues are."""
    return census(pencil, LARGEST) is not None


def _found(pencil: NonsymmetricPencil, size: int) -> Frequencies:
    return with_floor(pencil, pencil.near(NUMBER + size, SHIFT * pencil.system.scene.units.omega2))


def _unstable(found: Frequencies, chosen: np.ndarray) -> int:
    """Number of the ``chosen`` eigenvalues that are negative or complex."""
    values, noise = found.values[chosen], found.noise
    return int(((values.real < -noise) | (abs(values.imag) > np.maximum(noise, MET * abs(values)))).sum())


def _farther(pencil: NonsymmetricPencil, found: Frequencies) -> int:
    """Number of unstable eigenvalues that are farther from zero than all that were ``found``; 0 on a fine mesh."""
    everything, shift = census(pencil, LARGEST), SHIFT * found.one
    if everything is None:
        return 0
    return int((abs(everything.unstable - shift) > BEYOND * abs(found.values - shift).max()).sum())
