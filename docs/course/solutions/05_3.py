"""The null vector of the heavy column, and two derivatives of its energy along it."""

import numpy as np
from scipy.linalg import eigh
from ufl import SpatialCoordinate, cos, derivative, dx

from lesson.by_hand import angle, assemble, nodes

theta = angle()
phi = theta.copy()
s = SpatialCoordinate(theta.function_space.mesh)[0]
unknown = nodes(theta) > 0
bending, weight = theta.dx(0) ** 2 / 2 * dx, (1 - s) * cos(theta) * dx
K, M = (assemble(derivative(derivative(form, theta), theta))[np.ix_(unknown, unknown)] for form in (bending, weight))
values, vectors = eigh(-M, K)  # K is positive
phi.x.array[unknown] = vectors[:, -1]
phi.x.array[:] /= phi.x.array[nodes(theta).argmax()]  # one at the tip


def along(form, times):
    for _ in range(times):
        form = derivative(form, theta, phi)
    return assemble(form)


answer = -along(weight, 4) / (6 * along(weight, 2))
