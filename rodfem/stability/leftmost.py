"""Left-most eigenvalues of a state: those that a sweep records, names, and follows as curves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rodfem.stability.frequencies import Frequencies, groups, in_order
from rodfem.stability.nonsymmetric import BEYOND, SPARE, NonsymmetricPencil
from rodfem.stability.spectrum import SHIFT

FREQUENCIES = 6
"""Number of frequencies recorded at each load where nobody asks for another."""
OTHER = 3.0
"""Times this, the shift is another one, from which the same eigenvalues must be found."""
NEAR = 1e-3
"""Relative distance of eigenvalues below which their mean is compared: two that are about to meet have a root."""
AGREED = 1e-8
"""Difference of an inverse eigenvalue from two shifts, over the greatest."""


def leftmost(pencil: NonsymmetricPencil, number: int) -> Frequencies:
    """Left-most eigenvalues, ``number`` or more of those nearest the origin, whose motions have no names yet."""
    return in_order(pencil.nearest(max(number, FREQUENCIES) + BEYOND + SPARE))


def differ(pencil: NonsymmetricPencil, number: int) -> str:
    """Eigenvalues, in words, that another shift does not find alike; empty where it does.

    Of the ``pencil`` the ``number`` left-most are compared.  Eigenvalues of a singular pencil, ``S x = M x = 0`` for
    some ``x``, are any numbers, with residuals of round-off, and change with the shift.  So do two that are about to
    meet, by the root of round-off, but not their mean.
    """
    found = leftmost(pencil, number)
    other = in_order(pencil.near(len(found.values) - SPARE, OTHER * SHIFT * found.one))
    if _agree(found, other) or _agree(_with_means(found), _with_means(other)):
        return ""
    first, second = (
        ", ".join(f"{v:.6g}" if v.imag else f"{v.real:.6g}" for v in f.values[:2].tolist()) for f in (found, other)
    )
    return f"beginning with {first} from one shift and with {second} from another"


def _with_means(found: Frequencies) -> Frequencies:
    """Frequencies with their mean for those that are near one another."""
    values = np.empty_like(found.values)
    for group in groups(found.values, found.far, NEAR):
        values[group] = found.values[group].mean()
    return replace(found, values=values)


def _agree(one: Frequencies, other: Frequencies) -> bool:
    """Whether each eigenvalue from one shift is one of another's, and conversely, as far as both go."""
    shift = SHIFT * one.one
    a, b = (1.0 / (found.values - shift) for found in (one, other))
    tolerance = AGREED * abs(b).max()
    least = max(abs(a).min(), abs(b).min()) + tolerance
    return _among(a[abs(a) > least], b, tolerance) and _among(b[abs(b) > least], a, tolerance)


def _among(some: np.ndarray, others: np.ndarray, tolerance: float) -> bool:
    """Whether each of ``some`` numbers is one of ``others``, a different one for each."""
    left = others.tolist()
    for value in some.tolist():
        distance, place = min((abs(value - v), i) for i, v in enumerate(left)) if left else (np.inf, 0)
        if distance > tolerance:
            return False
        left.pop(place)
    return True
