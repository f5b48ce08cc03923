"""The stiffness of one amplitude, the rest of the rod following, is zero where the second variation is singular."""

import numpy as np
from scipy.interpolate import CubicHermiteSpline
from ufl import cos, derivative, dx

from lesson.by_hand import angle, assemble, nodes

theta = angle()
free, forms = nodes(theta) > 0, (theta.dx(0) ** 2 / 2 * dx, cos(theta) * dx)
K, G = (assemble(derivative(derivative(form, theta), theta))[np.ix_(free, free)] for form in forms)
b = nodes(theta)[free]  # a tilt of the whole rod
follows = [np.linalg.solve(K + load * G, b) for load in (2.0, 3.0)]
stiffness = CubicHermiteSpline((2.0, 3.0), [1 / (b @ y) for y in follows], [y @ G @ y / (b @ y) ** 2 for y in follows])
answer = float(stiffness.roots(extrapolate=False)[0])
