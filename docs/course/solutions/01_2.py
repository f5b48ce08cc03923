"""A transverse force F has the potential -F times the displacement of the tip, by hand."""

import numpy as np
from ufl import derivative, dx, sin

from lesson.by_hand import angle, assemble, constant, nodes

theta = angle()
F = constant(theta, 1.0)
Pi = (theta.dx(0) ** 2 / 2 - F * sin(theta)) * dx
dPi = derivative(Pi, theta)
d2Pi = derivative(dPi, theta)
unknown = nodes(theta) > 0
for _ in range(6):  # the straight rod is no equilibrium now, so that Newton leaves it
    theta.x.array[unknown] -= np.linalg.solve(assemble(d2Pi)[np.ix_(unknown, unknown)], assemble(dPi)[unknown])
answer = assemble(sin(theta) * dx)
