"""Round-off of the frequencies of motions that are far slower than bending, as those of a stiff rod on soft supports.

What round-off makes of an eigenvalue ``mu = omega^2`` that is zero is bounded by 1e-7 of the natural size of bending,
whatever the rod.  Where it has slow motions that is too much: theirs may be as small.  It is measured for them then, by
independent relative errors of all entries of the matrix, and they are solved for to what a state leaves open of them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rodfem.linalg.matrices import rounding_of
from rodfem.stability.inertia import NOISE
from rodfem.stability.spectrum import Spectrum

if TYPE_CHECKING:
    from rodfem.stability.nonsymmetric import NonsymmetricPencil

SLOW, SOLVED, CLEAR = 1e-3, 1e-9, 10.0
"""Part of the natural size below which eigenvalues are slow, what a state leaves open of them, and times that."""
APART = 1e-3
"""Relative distance of two slow ones that are not one: one, or a multiple one, may be about to vanish in any rod."""


def begins_slowly(values: np.ndarray, one: float) -> bool:
    """Whether one of the eigenvalues (k,) of the first state is slow: it is about to vanish in no ordinary rod."""
    sizes = abs(values) / one
    return bool(((sizes > CLEAR * SOLVED) & (sizes < SLOW)).any())


def floor_of_slow(pencil: NonsymmetricPencil, spectrum: Spectrum) -> float:
    """Round-off of the slow eigenvalues in the ``spectrum`` of a ``pencil``; infinite where the rod has none."""
    values, one = spectrum.values, spectrum.one
    slow = np.flatnonzero(abs(values) < SLOW * one)
    if pencil.floating or not len(slow) or not (pencil.slow or _several(values[slow])):
        return np.inf
    found = pencil.of(spectrum, slow)
    energy = abs(pencil.squares(found.vectors, found.weighed))
    columns = zip(found.vectors.T, energy.tolist(), strict=True)
    rounded = [rounding_of(pencil.matrix, v, v) / e for v, e in columns if e > 0]
    return max(SOLVED * one, float(spectrum.noise[slow].max()), NOISE * max(rounded, default=0.0))


def _several(values: np.ndarray) -> bool:
    """Whether there are several slow eigenvalues, that are not one."""
    return bool((abs(values - values[0]) > APART * abs(values).max()).any())
