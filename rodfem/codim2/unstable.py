"""How many eigenvalues other than those that meet or vanish on a locus are unstable, under loads without a potential.

The index of a symmetric tangent matrix comes with its factors (:mod:`rodfem.continuation.singular`).  Without symmetry
stability is decided by the eigenvalues ``omega^2``: those that are negative or complex count.  Those nearest zero are
sought one by one, all others of a mesh that is not fine at once (:mod:`rodfem.stability.census`).
"""

from __future__ import annotations

import numpy as np

from rodfem.stability.census import census
from rodfem.stability.finite_pairs import SHIFT
from rodfem.stability.nonsymmetric import NonsymmetricPencil
from rodfem.stability.outside import LARGEST
from rodfem.stability.slow_motions import with_floor

NUMBER = 10
"""Eigenvalues that are sought besides those of the locus."""
MET = 1e-4
"""Imaginary part, relative to the eigenvalue, below which a pair has only just met: it has a square root there."""
BEYOND = 1 + 1e-6
"""Times the distance of the farthest eigenvalue that was sought from which on others are farther."""
VANISHED = "another eigenvalue has vanished since the row before, seen from the start"
UNSTABLE = "another frequency has become unstable, or stable, since the row before, seen from the start"
"""What is said of a row where their number has changed, with a potential and without one."""
NEAREST = (
    f"the index is that of the {NUMBER} frequencies nearest zero: the mesh has too many unknowns to look at all of them"
)
"""What is said of a locus on a fine mesh."""


def unstable(pencil: NonsymmetricPencil, size: int = 0, basis: np.ndarray | None = None) -> int:
    """Unstable eigenvalues but for ``size`` ones: those nearest to zero, or of an invariant subspace.

    Its ``basis`` (n, size) is orthonormal in the mass.
    """
    found = with_floor(pencil, pencil.near(NUMBER + size, SHIFT * pencil.system.scene.units.omega2))
    own = -abs(found.values)
    if basis is not None:
        own = (abs(pencil.product(basis, found.weighed)) ** 2).sum(axis=0)
        own /= pencil.squares(found.vectors, found.weighed)
    chosen = np.argsort(own, kind="stable")[: len(own) - size]
    values, noise = found.values[chosen], found.noise
    nearest = (values.real < -noise) | (abs(values.imag) > np.maximum(noise, MET * abs(values)))
    everything, shift = census(pencil, LARGEST), SHIFT * found.one
    if everything is None:
        return int(nearest.sum())
    farther = abs(everything.unstable - shift) > BEYOND * abs(found.values - shift).max()
    return int(nearest.sum() + farther.sum())


def all_looked_at(pencil: NonsymmetricPencil) -> bool:
    """Whether the mesh is so coarse that all its eigenvalues are."""
    return census(pencil, LARGEST) is not None
