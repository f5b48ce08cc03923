"""Strains of saved states: derivatives of nodal values, element by element."""

from __future__ import annotations

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from rodfem.problem.quaternions import directors

Floats = NDArray[np.float64]


def derivative(s: Floats, values: Floats, elements: int) -> Floats:
    """Derivative in arclength (m, k) of nodal values (m, k), at shared nodes the mean of two elements.

    ``s`` (m,) are the nodes of ``elements`` of one degree, which share their ends.
    """
    degree = (len(s) - 1) // elements
    first, out, count = degree * np.arange(elements), np.zeros(values.shape), np.zeros((len(s), 1))
    places = first[:, None] + np.arange(degree + 1)
    length = s[first + degree] - s[first]
    t = 2 * (s[: degree + 1] - s[0]) / length[0] - 1
    coefficients = legendre.legder(np.linalg.inv(legendre.legvander(t, degree)), axis=0)
    slopes = legendre.legvander(t, degree - 1) @ coefficients @ values[places] * (2 / length)[:, None, None]
    np.add.at(out, places, slopes)
    np.add.at(count, places, 1.0)
    return out / count


def strains(s: Floats, r: Floats, q: Floats, elements: int) -> tuple[Floats, Floats]:
    """Strains ``v = R^t r'`` and curvatures ``k``, the axial vector of ``R^t R'``, both (m, 3), at the nodes.

    ``s`` (m,), ``r`` (m, 3) and ``q`` (m, 4) are those of a state with so many ``elements``.
    """
    frame = directors(q / np.linalg.norm(q, axis=1)[:, None])
    turning = np.swapaxes(frame, 1, 2) @ derivative(s, frame.reshape(-1, 9), elements).reshape(-1, 3, 3)
    k = 0.5 * np.stack(
        [turning[:, 2, 1] - turning[:, 1, 2], turning[:, 0, 2] - turning[:, 2, 0], turning[:, 1, 0] - turning[:, 0, 1]],
        1,
    )
    return np.einsum("mij,mi->mj", frame, derivative(s, r, elements)), k
