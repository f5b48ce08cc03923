"""Round-off of the frequencies of motions that are far slower than bending, as those of a stiff rod on soft supports.

What round-off makes of an eigenvalue ``mu = omega^2`` that is zero is bounded by 1e-7 of the natural size of bending,
whatever the rod.  Where it has slow motions that is too much: theirs may be as small.  It is measured for them then, by
independent relative errors of all entries of the matrix, and they are solved for to what a state leaves open of them.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rodfem.linalg.matrices import rounding_of
from rodfem.stability.finite_pairs import SHIFT
from rodfem.stability.frequencies import EPS, NEAR_ZERO, REAL, Frequencies
from rodfem.stability.inertia import NOISE
from rodfem.stability.nonsymmetric import NonsymmetricPencil

SLOW, SOLVED, CLEAR = 1e-3, 1e-9, 10.0
"""Part of the natural size below which eigenvalues are slow, what a state leaves open of them, and times that."""
APART = 1e-3
"""Relative distance of two slow ones that are not one: one, or a multiple one, may be about to vanish in any rod."""
MANY = 100.0
"""Round-off of the inverse eigenvalues, in units of the largest and of eps.

Measured up to 50 for Greenhill's rod, but 1e6 and more for some eigenvalues: those are not covered.
"""


def begins_slowly(found: Frequencies) -> bool:
    """Whether one of the frequencies ``found`` at the first state is slow: it is about to vanish in no ordinary rod."""
    sizes = abs(found.values) / found.one
    return not found.floating and bool(((sizes > CLEAR * SOLVED) & (sizes < SLOW)).any())


def with_floor(pencil: NonsymmetricPencil, found: Frequencies) -> Frequencies:
    """Frequencies of a ``pencil``, with the round-off of slow ones where the rod has some."""
    slow = np.flatnonzero(abs(found.values) < SLOW * found.one)
    if found.floating or not len(slow) or not (pencil.slow or _several(found.values[slow])):
        return found
    energy = abs(pencil.squares(found.vectors[:, slow], found.weighed[:, slow]))
    vectors = found.vectors[:, slow].T
    rounded = [rounding_of(pencil.matrix, v, v) / e for v, e in zip(vectors, energy.tolist(), strict=True) if e > 0]
    floor = max(SOLVED * found.one, float(_of_solver(found)[slow].max()), NOISE * max(rounded, default=0.0))
    return replace(found, floor=floor)


def noise_of_slow(pencil: NonsymmetricPencil, values: np.ndarray) -> float:
    """Magnitude below which an eigenvalue of a ``pencil`` counts as zero; infinite where none of ``values`` is slow."""
    one = pencil.system.scene.units.omega2
    if not len(values) or abs(values).min() > SLOW * one:
        return float("inf")
    found = with_floor(pencil, pencil.near_zero(len(values)))
    return found.noise if np.isfinite(found.floor) else float("inf")


def without_round_off(pencil: NonsymmetricPencil, found: Frequencies) -> Frequencies:
    """Eigenvalues of a ``pencil`` found next to the shift, imaginary parts that are round-off of real ones dropped.

    The solver has ``1 / (mu - shift)`` to round-off of the largest of them: ``mu`` to ``eps |mu - shift|^2 / min |mu -
    shift|``, and one near zero to that of the matrix.
    """
    found = with_floor(pencil, found)
    doubt = np.maximum(REAL * np.maximum(abs(found.values), NEAR_ZERO * found.far), _of_solver(found))
    if np.isfinite(found.floor):
        slow = abs(found.values) < SLOW * found.one
        doubt[slow] = np.minimum(doubt, np.maximum(REAL * abs(found.values), found.floor))[slow]
    return replace(found, values=np.where(abs(found.values.imag) < doubt, found.values.real, found.values))


def _of_solver(found: Frequencies) -> np.ndarray:
    """What the solver leaves open of each of some eigenvalues: (k,)."""
    apart = abs(found.values - SHIFT * found.one)
    return np.asarray(MANY * EPS * apart**2 / apart.min())


def _several(values: np.ndarray) -> bool:
    """Whether there are several slow eigenvalues, that are not one."""
    return bool((abs(values - values[0]) > APART * abs(values).max()).any())
