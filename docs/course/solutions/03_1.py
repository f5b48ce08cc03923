"""The angle at the pinned end is free, its displacement is not: one constraint."""

import numpy as np
from scipy.linalg import eigh
from ufl import cos, derivative, dx, sin

from lesson.by_hand import angle, assemble, nodes

theta = angle()
unknown = nodes(theta) > 0
K, M = (
    assemble(derivative(derivative(form, theta), theta))[np.ix_(unknown, unknown)]
    for form in (theta.dx(0) ** 2 / 2 * dx, -cos(theta) * dx)
)
c = assemble(derivative(sin(theta) * dx, theta))[unknown]
admissible = np.linalg.svd(c[None])[2][1:].T  # a basis of the null space of c: the other way
answer = eigh(admissible.T @ K @ admissible, admissible.T @ M @ admissible, eigvals_only=True)[0]
