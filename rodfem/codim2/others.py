"""How many eigenvalues other than those that meet or vanish on a locus are unstable, under loads without a potential.

The index of a symmetric tangent matrix comes with its factors (:mod:`rodfem.codim2.singular`).  Without symmetry
stability is decided by the eigenvalues ``omega^2``: those that are negative or complex count, of all that the mesh has
(:mod:`rodfem.stability.spectrum`).
"""

from __future__ import annotations

import numpy as np

from rodfem.stability.nonsymmetric import NonsymmetricPencil
from rodfem.stability.spectrum import Spectrum

MET = 1e-4
"""Imaginary part, relative to the eigenvalue, below which a pair has only just met: it has a square root there."""
VANISHED = "another eigenvalue has vanished since the row before, seen from the start"
UNSTABLE = "another frequency has become unstable, or stable, since the row before, seen from the start"
"""What is said of a row where their number has changed, with a potential and without one."""


NEAREST = "the index is that of the frequencies nearest zero: the mesh has too many unknowns to find all of them"
"""What is said of a locus on a fine mesh."""


def beside_cluster(pencil: NonsymmetricPencil, basis: np.ndarray) -> int:
    """Unstable eigenvalues but for those of an invariant subspace: ``basis`` (n, size), orthonormal in the mass."""
    shares = pencil.shares(basis)
    return _unstable(pencil.spectrum, np.argsort(shares, kind="stable")[: -basis.shape[1]])


def beside_zero(pencil: NonsymmetricPencil, size: int) -> int:
    """Unstable eigenvalues but for the ``size`` ones that are nearest to zero."""
    return _unstable(pencil.spectrum, np.argsort(abs(pencil.spectrum.values), kind="stable")[size:])


def unstable(pencil: NonsymmetricPencil) -> int:
    """Unstable eigenvalues."""
    return _unstable(pencil.spectrum, np.arange(len(pencil.spectrum.values)))


def all_looked_at(pencil: NonsymmetricPencil) -> bool:
    """Whether the mesh is so coarse that all its eigenvalues are."""
    return pencil.spectrum.complete


def _unstable(spectrum: Spectrum, chosen: np.ndarray) -> int:
    """Number of the ``chosen`` eigenvalues that are negative or complex."""
    values, noise = spectrum.values[chosen], np.maximum(spectrum.zero, spectrum.noise[chosen])
    return int(((values.real < -noise) | (abs(values.imag) > np.maximum(noise, MET * abs(values)))).sum())
