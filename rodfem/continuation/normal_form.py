"""Normal form of a bifurcating branch: the leading power of its load's change from the branch point.

With ``x`` the change of the scene's ordinate, a pitchfork obeys ``load = load_b + c x + ...`` where ``x`` is
quadratic in the amplitude (a shortening, say), ``load = load_b + c x^2 + ...`` where it is linear (a
displacement).  A pitchfork is supercritical where the branch exists on the side on which the index of the branch
that it leaves is higher, else subcritical.

The power series of a load in the amplitude converges up to the nearest other point at which the branch turns, or meets
another one, and that may be near: of two branch points about to merge, or a fold beside a transcritical point.
Amplitudes are made smaller until the series is resolved.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.branch import NormalForm, SpecialPoint
from rodfem.continuation.solvers import VERTICAL, BranchSolver
from rodfem.fem.newton import correct
from rodfem.tolerances import round_off

AMPLITUDES = 0.12 * np.cos(np.pi * (np.arange(4) + 0.5) / 8)
"""Amplitudes, in the metric, at which the branch is solved: the positive half of eight Chebyshev nodes."""
VERTICAL_BRANCH = "vertical branch"
SCALES = tuple(4.0**-i for i in range(4))
"""Factors of the amplitudes, of which the first is taken at which the series is resolved, else that of least error."""
RESOLVED = 1e-3
"""Uncertainty of a coefficient, relative to it, and part by which a load is no even function, of a resolved series."""
ODD = 0.1
"""Part of the change of the load that is odd in the amplitude, from which on a branch is transcritical."""
OPPOSITE = 1 - 1e-9
"""That part where the load rises on one side and falls on the other."""
SEEN = 100
"""Ratio of a change of the load to the uncertainty of the load that it is measured from, for which it counts."""
BESIDE = 1e-3
"""Distance along a branch, in the metric, over which the slope of the ordinate is taken."""
CONSTANT = 1e-12
"""Leading coefficient of the ordinate in the amplitude below which it does not change, over its natural size."""


@dataclass(frozen=True)
class Origin:
    """A branch point: state ``x``, ``load``, ``ordinate``; uncertainties ``load_left``, ``ordinate_left`` of these."""

    x: PETSc.Vec
    load: float
    ordinate: float
    load_left: float
    ordinate_left: float


def origin_of(solver: BranchSolver, special: SpecialPoint) -> Origin:
    """Branch point of a mesh; along a branch its ordinate is as uncertain as its load, times the ratio of slopes."""
    p = special.point
    left = round_off(p.ordinate, solver.units.ordinate)
    if p.tangent is not None and p.slope:
        left += abs(ordinate_along(solver, p.x, p.tangent) / p.slope) * special.located_to
    return Origin(p.x, p.load, p.ordinate, special.located_to, left)


def ordinate_along(solver: BranchSolver, x: PETSc.Vec, direction: PETSc.Vec) -> float:
    """Change of the ordinate of ``x`` along a direction, of unit size in the metric."""
    beside = x + direction * (BESIDE / solver.system.norm(direction))
    return (solver.shape.ordinate(beside) - solver.shape.ordinate(x)) / BESIDE


def normal_form_of(solver: BranchSolver, origin: Origin, direction: PETSc.Vec) -> NormalForm | None:
    """Normal form of the branch that leaves ``origin`` along ``direction``; None if nearby points do not determine it.

    At a pitchfork the load is an even function of the amplitude, and the ordinate an even or an odd one;
    polynomials through four amplitudes give their leading coefficients.  Uncertain is what those through three miss,
    what the load is odd by, and what the location of the branch point leaves open: of loads and ordinates that are
    measured from it, divided by the square of an amplitude.  Where the load has a slope in the amplitude, uncertain is
    what that at larger amplitudes differs by.
    """
    row, best, seen = solver.row(direction), None, SEEN * origin.load_left
    for scale in SCALES:
        found = _at_scale(solver, origin, direction, row, scale)
        if found is None:
            continue
        form, odd, change = found
        if best is not None and odd * change <= seen and form.kind != best.kind:
            break  # what is odd, or even, is round-off
        if best is None or form.kind != best.kind or form.uncertainty < best.uncertainty:
            best = form
        settled = odd > OPPOSITE or odd < RESOLVED or form.kind == VERTICAL_BRANCH
        if change <= seen or (settled and form.uncertainty <= RESOLVED * abs(form.coefficient)):
            break
    return best


def _at_scale(
    solver: BranchSolver, origin: Origin, direction: PETSc.Vec, row: PETSc.Vec, scale: float
) -> tuple[NormalForm, float, float] | None:
    """Normal form by amplitudes of a scale, the part of the load that is odd, and its change at the least amplitude.

    None where an equilibrium was not found at one of them, or the ordinate does not change.
    """
    amplitudes = AMPLITUDES * scale

    def near(a: float) -> tuple[float, float] | None:
        return _near(solver, origin, direction, row, float(a))

    points = [near(a) for a in (*amplitudes, -amplitudes[-1])]
    if None in points:
        return None
    loads, ordinates = np.array(points, dtype=float).T
    plus, minus = loads[-2], loads[-1]
    span = solver.system.scene.span
    if max(map(abs, loads)) < VERTICAL * abs(span[1] - span[0]) * scale**2:
        left = max(map(abs, loads)) / max(map(abs, ordinates))
        return NormalForm(VERTICAL_BRANCH, 0.0, 1, left, 0), 0.0, 0.0
    change = abs(plus) + abs(minus)
    uneven = abs(plus - minus) / change
    if uneven > ODD:
        farther = near(-amplitudes[-2])
        if farther is None:
            return None
        pairs = np.stack([loads, ordinates], axis=1)
        loads, ordinates = np.array([pairs[-3], farther, pairs[-2], pairs[-1]]).T
        best = _slope(loads, ordinates)
        left = abs(best - _slope(loads[:2], ordinates[:2])) + _left(_slope, loads, ordinates, origin)
        return NormalForm("transcritical", best, 1, left, int(np.sign(plus - minus))), uneven, change
    growth = abs(ordinates[0] / ordinates[3]) if ordinates[3] else np.inf
    odd = growth < (AMPLITUDES[0] / AMPLITUDES[3]) ** 1.5

    one = solver.units.ordinate

    def leading(loads: np.ndarray, ordinates: np.ndarray, count: int = 4) -> float:
        return _leading(amplitudes, loads[:4], ordinates[:4] / one, odd, count) / one ** (2 if odd else 1)

    best = leading(loads, ordinates)
    if not np.isfinite(best):
        return None
    left = abs(best - leading(loads, ordinates, 3)) + uneven * abs(best) + _left(leading, loads, ordinates, origin)
    return NormalForm("pitchfork", best, 2 if odd else 1, left, int(np.sign(plus))), uneven, change


def _near(
    solver: BranchSolver, origin: Origin, direction: PETSc.Vec, row: PETSc.Vec, amplitude: float
) -> tuple[float, float] | None:
    """Changes of load and ordinate at an amplitude of the bifurcating branch; None where Newton's method fails."""
    system = solver.system
    x = origin.x + direction * amplitude
    if not correct(system, x, row, reach=2.0 * abs(amplitude)).converged:
        return None
    return system.scalar(x) - origin.load, solver.shape.ordinate(x) - origin.ordinate


def _left(
    of: Callable[[np.ndarray, np.ndarray], float], loads: np.ndarray, ordinates: np.ndarray, origin: Origin
) -> float:
    """Greatest change of a coefficient with loads and ordinates that are uncertain as those of the origin are."""
    best, left = of(loads, ordinates), 0.0
    for one in np.eye(len(loads)):
        left += abs(of(loads + one * origin.load_left, ordinates) - best)
        left += abs(of(loads, ordinates + one * origin.ordinate_left) - best)
    return left


def _slope(loads: np.ndarray, ordinates: np.ndarray) -> float:
    """Slope of the load in the ordinate from the last two points, on both sides of the branch point."""
    return float((loads[-2] - loads[-1]) / (ordinates[-2] - ordinates[-1]))


def _leading(amplitudes: np.ndarray, loads: np.ndarray, ordinates: np.ndarray, odd: bool, count: int) -> float:
    """Ratio of the leading coefficients of the load and of the ordinate (squared if odd) in the amplitude."""
    a = amplitudes[-count:]
    powers = np.vander(a**2, count, increasing=True)
    load = np.linalg.solve(powers, loads[-count:] / a**2)[0]
    x = np.linalg.solve(powers, ordinates[-count:] / (a if odd else a**2))[0]
    scale = x**2 if odd else x
    return float(load / scale) if abs(scale) > CONSTANT else float("nan")
