"""Beside the straight rod: theta = cos(w (1 - s)), w^2 = P; natural at the foot is theta'(0) = 4 theta(0)."""

import numpy as np
from scipy.linalg import eigh
from ufl import SpatialCoordinate, conditional, cos, derivative, ds, dx, lt

from lesson.by_hand import angle, assemble

theta = angle()
s = SpatialCoordinate(theta.function_space.mesh)[0]
foot = conditional(lt(s, 0.5), 1.0, 0.0)  # ds sums over both ends
stiffness = theta.dx(0) ** 2 / 2 * dx + foot * 4 * theta**2 / 2 * ds
weight = -cos(theta) * dx  # the load's factor
K, M = (assemble(derivative(derivative(form, theta), theta)) for form in (stiffness, weight))
answer = eigh(K, M, eigvals_only=True)[0]  # K x = P M x: smallest load with a nearby bent equilibrium
assert np.tan(np.sqrt(answer)) * np.sqrt(answer) > 0
