"""Follow the branch point in the plane of the compression and A, or solve the closed form of the lesson for A."""

import numpy as np
from scipy.optimize import brentq


def condition(A: float, lam: float = 0.12) -> float:
    """Zero where the straight rod buckles."""
    a = A * lam / 2
    p, q = (3 * (a + sign * np.sqrt(a * a + 10 * lam * (1 - lam))) for sign in (-1, 1))
    return float(np.sin(q - p) - (q - p) * np.sin(p) * np.sin(q) / (p * q))


answer = brentq(condition, 1.0, 3.0, xtol=1e-14)
