"""Normal form of a bifurcating branch: the leading power of its load's change from the branch point.

With ``x`` the change of the scene's ordinate, a pitchfork obeys ``load = load_b + c x + ...`` where ``x`` is
quadratic in the amplitude (a shortening, say), ``load = load_b + c x^2 + ...`` where it is linear (a displacement, or a
shortening and part of a displacement).  An ordinate that does not change along the branch to leading order, such as a
position on the axis, or the size of a displacement where the load is no even function of it, says nothing of it: ``x``
is the distance in the metric then.  A pitchfork is supercritical where the branch exists on the side on which the index
of the branch that it leaves is higher, else subcritical.

The power series of a load in the amplitude converges up to the nearest other point at which the branch turns, or meets
another one, and that may be near: of two branch points about to merge, or a fold beside a transcritical point.
Amplitudes are made smaller until the series is resolved.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.amplitude_series import LINEAR, ONE, QUADRATIC, SEEN, Leading, leading, leading_term, parts
from rodfem.continuation.branch import DISTANCE, ORDINATE, VERTICAL_BRANCH, NormalForm, SpecialPoint
from rodfem.continuation.branch_solver import VERTICAL, BranchSolver
from rodfem.fem.newton import correct
from rodfem.tolerances import round_off

AMPLITUDES = 0.12 * np.cos(np.pi * (np.arange(4) + 0.5) / 8)
"""Amplitudes, in the metric, at which the branch is solved on both sides: half of eight Chebyshev nodes."""
SCALES = tuple(4.0**-i for i in range(4))
"""Factors of the amplitudes, of which the first is taken at which the series is resolved, else that of least error."""
RESOLVED = 1e-3
"""Uncertainty of a coefficient, relative to it, and part by which a load is no even function, of a resolved series."""
ODD = 0.1
"""Part of the change of the load that is odd in the amplitude, from which on a branch is transcritical."""
OPPOSITE = 1 - 1e-9
"""That part where the load rises on one side and falls on the other."""
BESIDE = 1e-3
"""Distance along a branch, in the metric, over which the slope of the ordinate is taken."""
Term = tuple[str, Leading, float] | None
"""How the ordinate changes with the amplitude: :func:`~rodfem.continuation.amplitude_series.leading_term`."""


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

    At a pitchfork the load is an even function of the amplitude, at a transcritical point it has a slope in it; the
    ordinate has an even part and an odd one.  Polynomials through four amplitudes give their leading coefficients.
    Uncertain is what those through three miss, what a slope of the load adds at a pitchfork, and what the location of
    the branch point leaves open: of loads and ordinates that are measured from it, divided by a power of an amplitude.
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
    amplitudes, points = AMPLITUDES * scale, list[tuple[float, float]]()
    for a in (*amplitudes, *-amplitudes):
        point = _near(solver, origin, direction, row, float(a))
        if point is None:
            return None
        points.append(point)
    loads, ordinates = np.array(points).T.reshape(2, 2, len(amplitudes))
    span = solver.system.scene.span
    most, moved = np.abs(loads).max(), np.abs(ordinates).max()
    if most < VERTICAL * abs(span[1] - span[0]) * scale**2:
        of = ORDINATE if moved > SEEN * origin.ordinate_left else DISTANCE
        left = float(most / (moved if of == ORDINATE else amplitudes[0]))
        return NormalForm(VERTICAL_BRANCH, 0.0, 1, left, 0, of), 0.0, 0.0
    (even, odd), one = parts(loads), solver.units.ordinate
    change = abs(loads[0, -1]) + abs(loads[1, -1])
    uneven = float(2 * abs(odd[-1]) / change)
    x = leading_term(amplitudes, ordinates / one, origin.ordinate_left / one)
    slope = leading(amplitudes, odd, 1, origin.load_left)
    if uneven > ODD:
        return _transcritical(slope, x, one), uneven, change
    hidden = (abs(slope.best) + abs(slope.best - slope.rough)) / float(amplitudes[-1])
    return _pitchfork(leading(amplitudes, even, 2, origin.load_left), hidden, x, one), uneven, change


def _transcritical(load: Leading, x: Term, one: float) -> NormalForm:
    """Slope of the load in the ordinate, of the natural size ``one``, from their leading terms in the amplitude.

    In the distance where the ordinate has no linear one.
    """
    side = int(np.sign(load.best))
    if x is None or x[0] != LINEAR:
        best, left = load.over(ONE, 1)
        return NormalForm("transcritical", abs(best), 1, left, side, DISTANCE)
    best, left = load.over(x[1], 1)
    return NormalForm("transcritical", best / one, 1, left / one, side)


def _pitchfork(load: Leading, hidden: float, x: Term, one: float) -> NormalForm:
    """Leading coefficient of the load in the ordinate, of the natural size ``one``, from their terms in the amplitude.

    In the distance where the ordinate has none.  ``hidden`` is what a slope of the load adds to its coefficient at the
    least amplitude.  The side is that of the coefficient: nearly degenerate pitchforks turn back in a fold, and at the
    amplitudes the load may have the other sign.
    """
    term, of, part = (ONE, DISTANCE, 0.0) if x is None else (x[1], ORDINATE, x[2])
    power = 1 if x is not None and x[0] == QUADRATIC else 2
    size = 1.0 if x is None else one**power
    best, left = load.over(term, power)
    left += part * abs(best) + hidden / abs(term.best) ** power
    side = int(np.sign(load.best)) if load.told() else 0
    return NormalForm("pitchfork", best / size, power, left / size, side, of)


def _near(
    solver: BranchSolver, origin: Origin, direction: PETSc.Vec, row: PETSc.Vec, amplitude: float
) -> tuple[float, float] | None:
    """Changes of load and ordinate at an amplitude of the bifurcating branch; None where Newton's method fails."""
    system = solver.system
    x = origin.x + direction * amplitude
    if not correct(system, x, row, reach=2.0 * abs(amplitude)).converged:
        return None
    return system.scalar(x) - origin.load, solver.shape.ordinate(x) - origin.ordinate
