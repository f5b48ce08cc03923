"""Decay of Legendre coefficients, from which meshes are chosen, for a function whose best approximation is known."""

import numpy as np
import pytest
from numpy.polynomial import legendre

from rodfem.adaptivity.grading import _decay

ELEMENTS, DEGREE, WAVES = 10, 6, 5
VERTICES = np.linspace(0.0, 2 * np.pi, ELEMENTS + 1)
X, WEIGHTS = legendre.leggauss(40)


def coefficients(phase: float, number: int) -> np.ndarray:
    """Orthonormal Legendre coefficients of ``cos(5 s + phase)`` on each element of a circle, (elements, number)."""
    half = np.diff(VERTICES)[:, None] / 2
    s = VERTICES[:-1, None] + half * (1 + X)
    polynomials = legendre.legvander(X, number - 1) * np.sqrt((2 * np.arange(number) + 1) / 2)
    return np.cos(WAVES * s + phase) * WEIGHTS @ polynomials


@pytest.mark.parametrize("phase", [0.0, 0.3, np.pi / 2 - 1e-5, np.pi / 2 - 1e-8, np.pi / 2])
def test_the_indicator_is_that_of_the_part_that_is_missed(phase: float) -> None:
    """Of a wave that is even or odd about the middle of an element, exactly or but for round-off, too."""
    every = coefficients(phase, DEGREE + 20)
    missed = np.sum(np.diff(VERTICES)[:, None] * every[:, DEGREE:] ** 2)
    found = _decay(VERTICES, np.abs(every[:, :DEGREE])).indicator
    assert missed / 10 < found < 1000 * missed
