"""How many eigenvalues other than those that meet or vanish on a locus are unstable, under loads without a potential.

The index of a symmetric tangent matrix comes with its factors (:mod:`rodfem.continuation.singular`).  Without symmetry
stability is decided by the eigenvalues ``omega^2``: those that are negative or complex count, of all that the mesh has
(:mod:`rodfem.stability.spectrum`).
"""

from __future__ import annotations

import numpy as np

from rodfem.stability.nonsymmetric import NonsymmetricPencil

MET = 1e-4
"""Imaginary part, relative to the eigenvalue, below which a pair has only just met: it has a square root there."""
VANISHED = "another eigenvalue has vanished since the row before, seen from the start"
UNSTABLE = "another frequency has become unstable, or stable, since the row before, seen from the start"
"""What is said of a row where their number has changed, with a potential and without one."""
NEAREST = "the index is that of the frequencies nearest zero: the mesh has too many unknowns to find all of them"
"""What is said of a locus on a fine mesh."""


def unstable(pencil: NonsymmetricPencil, size: int = 0, basis: np.ndarray | None = None) -> int:
    """Unstable eigenvalues but for ``size`` ones: those nearest to zero, or of an invariant subspace.

    Its ``basis`` (n, size) is orthonormal in the mass.
    """
    spectrum = pencil.spectrum
    own = -abs(spectrum.values) if basis is None else pencil.shares(basis)
    chosen = np.argsort(own, kind="stable")[: len(own) - size]
    values, noise = spectrum.values[chosen], np.maximum(spectrum.zero, spectrum.noise[chosen])
    return int(((values.real < -noise) | (abs(values.imag) > np.maximum(noise, MET * abs(values)))).sum())
