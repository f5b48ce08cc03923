"""Richardson: the error is a h^2 + b h^4 + ..., so that (4 x(h/2) - x(h))/3 loses the first term, and so on."""

import numpy as np
from scipy.linalg import eigh
from ufl import derivative, dx

from lesson.by_hand import angle, assemble, nodes


def load(elements: int) -> float:
    """Smallest stationary value of int theta'^2 / int theta^2."""
    theta = angle(0.0, 1.0, elements, degree=1)
    free = nodes(theta) > 0
    forms = theta.dx(0) ** 2 / 2 * dx, theta**2 / 2 * dx
    K, M = (assemble(derivative(derivative(form, theta), theta))[np.ix_(free, free)] for form in forms)
    return float(eigh(K, M, eigvals_only=True)[0])


values = np.array([load(n) for n in (2, 4, 8)])
for order in (2, 4):
    values = (2**order * values[1:] - values[:-1]) / (2**order - 1)
answer = values[0]
