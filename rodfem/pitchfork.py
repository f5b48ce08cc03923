"""The local law of a bifurcating branch: how its load leaves that of the branch point.

With ``x`` the change of the scene's ordinate, a pitchfork obeys ``load = load_b + c x + ...`` where ``x`` is
quadratic in the amplitude (a shortening, say), ``load = load_b + c x^2 + ...`` where it is linear (a
displacement).  A pitchfork is supercritical where the branch exists on the side on which the index of the branch
that it leaves is higher, else subcritical.
"""

from __future__ import annotations

import numpy as np
from petsc4py import PETSc

from rodfem.branch import Law, Special
from rodfem.continuation import VERTICAL, Follower
from rodfem.newton import correct

AMPLITUDES = 0.12 * np.cos(np.pi * (np.arange(4) + 0.5) / 8)
"""Amplitudes, in the metric, at which the branch is solved: the positive half of eight Chebyshev nodes."""


def law_of(follower: Follower, special: Special, direction: PETSc.Vec) -> Law | None:
    """Law of the branch that leaves ``special`` along ``direction``; None where it cannot be had from nearby points.

    At a pitchfork the load is an even function of the amplitude, and the ordinate an even or an odd one;
    polynomials through four amplitudes give their leading coefficients, and through three the uncertainty.
    """
    row = follower.row(direction)
    loads, ordinates = [], []
    for amplitude in (*AMPLITUDES, -AMPLITUDES[-1]):
        near = _near(follower, special, direction, row, float(amplitude))
        if near is None:
            return None
        loads.append(near[0])
        ordinates.append(near[1])
    plus, minus = loads[-2], loads[-1]
    span = follower.system.scene.span
    if max(map(abs, loads)) < VERTICAL * abs(span[1] - span[0]):
        return Law("vertical branch", 0.0, 1, max(map(abs, loads)) / max(map(abs, ordinates)), 0)
    if abs(plus - minus) > 0.1 * (abs(plus) + abs(minus)):
        slopes = [(p - loads[-1]) / (q - ordinates[-1]) for p, q in zip(loads[:-1], ordinates[:-1], strict=True)]
        return Law("transcritical", slopes[-1], 1, abs(slopes[-1] - slopes[-2]), int(np.sign(plus)))
    growth = abs(ordinates[0] / ordinates[3]) if ordinates[3] else np.inf
    odd = growth < (AMPLITUDES[0] / AMPLITUDES[3]) ** 1.5
    best, rough = (_leading(np.array(loads[:4]), np.array(ordinates[:4]), odd, count) for count in (4, 3))
    if not np.isfinite(best):
        return None
    return Law("pitchfork", best, 2 if odd else 1, abs(best - rough), int(np.sign(plus)))


def _near(
    follower: Follower, special: Special, direction: PETSc.Vec, row: PETSc.Vec, amplitude: float
) -> tuple[float, float] | None:
    """Changes of load and ordinate at an amplitude of the bifurcating branch; None where Newton's method fails."""
    system, p = follower.system, special.point
    x = p.x.copy()
    x.axpy(amplitude, direction)
    system.set_phase(x)
    if not correct(system, x, row, reach=2.0 * abs(amplitude)).converged:
        return None
    return system.scalar(x) - p.load, follower.shape.ordinate(x) - p.ordinate


def _leading(loads: np.ndarray, ordinates: np.ndarray, odd: bool, count: int) -> float:
    """Ratio of the leading coefficients of the load and of the ordinate (squared if odd) in the amplitude."""
    a = AMPLITUDES[-count:]
    powers = np.vander(a**2, count, increasing=True)
    load = np.linalg.solve(powers, loads[-count:] / a**2)[0]
    x = np.linalg.solve(powers, ordinates[-count:] / (a if odd else a**2))[0]
    scale = x**2 if odd else x
    return float(load / scale) if abs(scale) > 1e-12 else float("nan")
