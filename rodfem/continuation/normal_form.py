"""Normal form of a bifurcating branch: the leading power of its load's change from the branch point.

With ``x`` the change of the scene's ordinate, a pitchfork obeys ``load = load_b + c x + ...`` where ``x`` is
quadratic in the amplitude (a shortening, say), ``load = load_b + c x^2 + ...`` where it is linear (a
displacement).  An ordinate that does not change along the branch to leading order, such as a position on the axis, or
the size of a displacement where the load is no even function of it, says nothing of it: ``x`` is the distance
in the metric then.  A pitchfork is supercritical where the branch exists on the side on which the index of the branch
that it leaves is higher, else subcritical.

The power series of a load in the amplitude converges up to the nearest other point at which the branch turns, or meets
another one, and that may be near: of two branch points about to merge, or a fold beside a transcritical point.
Amplitudes are made smaller until the series is resolved.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.branch import DISTANCE, ORDINATE, VERTICAL_BRANCH, NormalForm, SpecialPoint
from rodfem.continuation.branch_solver import VERTICAL, BranchSolver
from rodfem.fem.newton import correct
from rodfem.tolerances import round_off

AMPLITUDES = 0.12 * np.cos(np.pi * (np.arange(4) + 0.5) / 8)
"""Amplitudes, in the metric, at which the branch is solved: the positive half of eight Chebyshev nodes."""
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
        if best is not None and form.of == DISTANCE != best.of:
            break  # what the ordinate changes by is round-off
        if best is not None and odd * change <= seen and not alike(form, best):
            break  # what is odd, or even, is round-off
        if best is None or not alike(form, best) or form.uncertainty < best.uncertainty:
            best = form
        settled = odd > OPPOSITE or odd < RESOLVED or form.kind == VERTICAL_BRANCH
        if change <= seen or (settled and form.uncertainty <= RESOLVED * abs(form.coefficient)):
            break
    return best


def alike(a: NormalForm, b: NormalForm) -> bool:
    """Whether two normal forms differ in the coefficient only."""
    return (a.kind, a.power, a.of) == (b.kind, b.power, b.of)


def _at_scale(
    solver: BranchSolver, origin: Origin, direction: PETSc.Vec, row: PETSc.Vec, scale: float
) -> tuple[NormalForm, float, float] | None:
    """Normal form by amplitudes of a scale, the part of the load that is odd, and its change at the least amplitude.

    None where an equilibrium was not found at one of them.
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
        of = ORDINATE if max(map(abs, ordinates)) > SEEN * origin.ordinate_left else DISTANCE
        left = max(map(abs, loads)) / max(map(abs, ordinates if of == ORDINATE else amplitudes))
        return NormalForm(VERTICAL_BRANCH, 0.0, 1, left, 0, of), 0.0, 0.0
    change = abs(plus) + abs(minus)
    uneven = abs(plus - minus) / change
    if uneven > ODD:
        farther = near(-amplitudes[-2])
        if farther is None:
            return None
        pairs = np.stack([loads, ordinates], axis=1)
        loads, ordinates = np.array([pairs[-3], farther, pairs[-2], pairs[-1]]).T
        return _transcritical(loads, ordinates, amplitudes, origin), uneven, change
    form = _pitchfork(loads[:4], ordinates[:4], amplitudes, origin, solver.units.ordinate)
    form.uncertainty += uneven * abs(form.coefficient)
    form.side = _leading_side(amplitudes, loads[:4], origin.load_left)
    return form, uneven, change


def _leading_side(amplitudes: np.ndarray, loads: np.ndarray, left: float) -> int:
    """Sign of the leading coefficient of the load, uncertain by ``left``, in the amplitude; zero if not determined.

    Nearly degenerate pitchforks turn back in a fold: at the amplitudes the load may have the other sign.
    """
    best = _first(amplitudes, loads, False, 4)
    missed = abs(best - _first(amplitudes, loads, False, 3))
    missed += sum(abs(_first(amplitudes, loads + left * one, False, 4) - best) for one in np.eye(4))
    return int(np.sign(best)) if abs(best) > missed else 0


def _transcritical(loads: np.ndarray, ordinates: np.ndarray, amplitudes: np.ndarray, origin: Origin) -> NormalForm:
    """Slope of the load in the ordinate, from loads and ordinates at the last two amplitudes on both sides, (4,).

    In the distance where the ordinate does not change, or is an even function, of the amplitude.
    """
    of, apart = ORDINATE, abs(ordinates[-2] - ordinates[-1])
    if apart <= max(SEEN * origin.ordinate_left, ODD * (abs(ordinates[-2]) + abs(ordinates[-1]))):
        a, b = amplitudes[-2:]
        of, ordinates, origin = DISTANCE, np.array([a, -a, b, -b]), replace(origin, ordinate_left=0.0)
    best = _slope(loads, ordinates)
    left = abs(best - _slope(loads[:2], ordinates[:2])) + _left(_slope, loads, ordinates, origin)
    side = int(np.sign(loads[-2] - loads[-1]))
    return NormalForm("transcritical", best if of == ORDINATE else abs(best), 1, left, side, of)


def _pitchfork(
    loads: np.ndarray, ordinates: np.ndarray, amplitudes: np.ndarray, origin: Origin, one: float
) -> NormalForm:
    """Leading coefficient of the load in the ordinate, of the natural size ``one``, from both at the amplitudes, (4,).

    In the distance where the leading coefficient of the ordinate is not told from zero.
    """
    growth = abs(ordinates[0] / ordinates[3]) if ordinates[3] else np.inf
    odd, of = bool(growth < (AMPLITUDES[0] / AMPLITUDES[3]) ** 1.5), ORDINATE
    seen = max(map(abs, ordinates)) > SEEN * origin.ordinate_left
    if not (seen and _determined(amplitudes, ordinates / one, odd)):
        odd, of, ordinates, one, origin = True, DISTANCE, amplitudes, 1.0, replace(origin, ordinate_left=0.0)

    def leading(loads: np.ndarray, ordinates: np.ndarray, count: int = 4) -> float:
        return _leading(amplitudes, loads, ordinates / one, odd, count) / one ** (2 if odd else 1)

    best = leading(loads, ordinates)
    left = abs(best - leading(loads, ordinates, 3)) + _left(leading, loads, ordinates, origin)
    return NormalForm("pitchfork", best, 2 if odd else 1, left, 0, of)


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
    x = _first(amplitudes, ordinates, odd, count)
    return _first(amplitudes, loads, False, count) / (x**2 if odd else x)


def _first(amplitudes: np.ndarray, values: np.ndarray, odd: bool, count: int) -> float:
    """Leading coefficient of an even function of the amplitude, or of an odd one, from the least ``count`` of them."""
    a = amplitudes[-count:]
    powers = np.vander(a**2, count, increasing=True)
    return float(np.linalg.solve(powers, values[-count:] / (a if odd else a**2))[0])


def _determined(amplitudes: np.ndarray, ordinates: np.ndarray, odd: bool) -> bool:
    """Whether the leading coefficient of the ordinate, over its natural size, is told from zero."""
    x = _first(amplitudes, ordinates, odd, 4)
    return abs(x) > max(CONSTANT, abs(x - _first(amplitudes, ordinates, odd, 3)))
