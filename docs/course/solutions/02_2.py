"""The section at s carries what is above it, q (1 - s): smallest q of K x = q M x."""

import numpy as np
from scipy.linalg import eigh
from ufl import SpatialCoordinate, cos, derivative, dx

from lesson.by_hand import angle, assemble, nodes

theta = angle()
s = SpatialCoordinate(theta.function_space.mesh)[0]
unknown = np.ix_(*[nodes(theta) > 0] * 2)
K, M = (
    assemble(derivative(derivative(form, theta), theta))[unknown]
    for form in (theta.dx(0) ** 2 / 2 * dx, -(1 - s) * cos(theta) * dx)
)
answer = 1 / eigh(M, K, eigvals_only=True)[-1]  # K is positive
