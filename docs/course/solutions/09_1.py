"""Ziegler's paradox: with x'' = -M^-1 (S x + D x'), an eigenvalue crosses the imaginary axis at 41/28, not 2.0858."""

import numpy as np
from scipy.optimize import brentq

M, K, thrust = np.array([[3.0, 1], [1, 1]]), np.array([[2.0, -1], [-1, 1]]), np.array([[-1.0, 1], [0, 0]])
b = 1e-3


def growth(P: float) -> float:
    """Largest real part, relative to the damping."""
    S, D = np.linalg.solve(M, K + P * thrust), np.linalg.solve(M, b * K)
    return float(np.linalg.eigvals(np.block([[np.zeros((2, 2)), np.eye(2)], [-S, -D]])).real.max() / b)


answer = brentq(growth, 1.0, 2.0, xtol=1e-12)
