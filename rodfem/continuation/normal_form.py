"""Normal form of a bifurcating branch: the leading power of its load's change from the branch point.

With ``x`` the change of the scene's ordinate, a pitchfork obeys ``load = load_b + c x + ...`` where ``x`` is
quadratic in the amplitude (a shortening, say), ``load = load_b + c x^2 + ...`` where it is linear (a displacement, or a
shortening and part of a displacement).  An ordinate that does not change along the branch to leading order, such as a
position on the axis, or the size of a displacement where the load is no even function of it, says nothing of it: ``x``
is the distance in the metric then.

The power series of a load in the amplitude converges up to the nearest other point at which the branch turns, or meets
another one: amplitudes are made smaller until the series is resolved.  Leading coefficients come from the states on
both sides of a point.  Values at the amplitudes ``a`` and ``-a`` tell the even part of a function from its odd one
exactly.  Either is a power of ``a`` times a series in ``a^2``, of which a polynomial through four amplitudes has the
leading coefficient.  The size of a displacement is not smooth: it is ``|a|`` times a series in ``a``, even to leading
order.  Where neither is so (a size plus a shortening) the series has all powers, and its leading coefficient is known
less well.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.branch import (
    DISTANCE,
    ORDINATE,
    PITCHFORK,
    TRANSCRITICAL,
    VERTICAL_BRANCH,
    NormalForm,
    SpecialPoint,
)
from rodfem.continuation.curves import VERTICAL
from rodfem.fem.newton import correct
from rodfem.tolerances import NEGLIGIBLE, round_off

if TYPE_CHECKING:
    from rodfem.continuation.branch_solver import BranchSolver

AMPLITUDES = 0.12 * np.cos(np.pi * (np.arange(4) + 0.5) / 8)
"""Amplitudes, in the metric, at which the branch is solved on both sides: half of eight Chebyshev nodes."""
RESOLVED = 1e-3
"""Uncertainty of a coefficient, relative to it, part by which a load is no even function, and other terms of an
ordinate, of a resolved series."""
SEEN = 100
"""Ratio of a change of a load or an ordinate to the uncertainty of where it is measured from, for which it counts."""
SIZE, LINEAR, QUADRATIC = "size", "linear", "quadratic"
"""Leading terms of an ordinate: ``|a|``, ``a`` and ``a^2``."""


@dataclass(frozen=True)
class Leading:
    """Leading coefficient of a series."""

    best: float  # by all amplitudes
    rough: float  # by all but the largest
    left: float  # what the uncertainty of the values leaves of it

    @property
    def missed(self) -> float:
        """Uncertainty of the coefficient."""
        return abs(self.best - self.rough) + self.left

    def significant(self, least: float = 0.0) -> bool:
        """Whether it is certainly not zero, and more than ``least``."""
        return abs(self.best) > max(least, self.missed)

    def ratio(self, other: Leading, power: int) -> tuple[float, float]:
        """Ratio to a ``power`` of another coefficient, which is significant, and its uncertainty."""
        best, size = self.best / other.best**power, abs(other.best)
        left = (abs(self.best) + self.left) / (size - other.left) ** power - abs(self.best) / size**power
        return best, abs(best - self.rough / other.rough**power) + left


ONE = Leading(1.0, 1.0, 0.0)
"""Coefficient of the amplitude in itself."""


def parts(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Even and odd part, (m,) each, of ``values`` (2, m) at m amplitudes and at their opposites."""
    return (values[0] + values[1]) / 2, (values[0] - values[1]) / 2


def leading(amplitudes: np.ndarray, values: np.ndarray, power: int, left: float, step: int = 2) -> Leading:
    """Coefficient of a ``power`` of the amplitude, from which on powers rise by a ``step``.

    ``values`` (m,) at the ``amplitudes`` (m,), from the largest to the least, are each uncertain by ``left``.
    """

    def weights(a: np.ndarray) -> np.ndarray:
        """Factors of values whose sum is the leading coefficient of the polynomial."""
        return np.asarray(np.linalg.inv(np.vander(a**step, len(a), increasing=True))[0] / a**power)

    best = weights(amplitudes)
    return Leading(float(best @ values), float(weights(amplitudes[1:]) @ values[1:]), left * float(np.abs(best).sum()))


def leading_term(amplitudes: np.ndarray, ordinates: np.ndarray, left: float) -> tuple[str, Leading, float] | None:
    """How an ordinate changes: its leading term, the coefficient, and the part of it that a lower term may hide in.

    The ``ordinates`` (2, m), each uncertain by ``left``, are changes at the amplitudes and at their opposites, over the
    natural size.  None where they do not change to leading order, or not alike on both sides.  With ``x = o1 a + o2
    a^2`` the linear term leads up to the amplitude ``o1/o2``: where the ordinate has not changed visibly there the
    quadratic one is taken, and what the other adds at the largest amplitude is the part.
    """
    even, odd = parts(ordinates)
    if np.abs(ordinates).max() <= SEEN * left:
        return None
    linear, quadratic = leading(amplitudes, odd, 1, left), leading(amplitudes, even, 2, left)
    size = _size(amplitudes, even, left)
    if size is not None and size.significant(max(NEGLIGIBLE, RESOLVED * abs(linear.best))):
        differs = leading(amplitudes, odd, 1, left, step=1).significant(RESOLVED * abs(size.best))
        return None if differs else (SIZE, size, 0.0)
    turns = quadratic.significant(NEGLIGIBLE)
    if linear.significant(NEGLIGIBLE) and not (turns and linear.best**2 <= SEEN * left * abs(quadratic.best)):
        return LINEAR, linear, 0.0
    hidden = (abs(linear.best) + linear.missed) / amplitudes[0]
    return (QUADRATIC, quadratic, hidden / abs(quadratic.best)) if turns else None


def _size(amplitudes: np.ndarray, even: np.ndarray, left: float) -> Leading | None:
    """Coefficient of ``|a|`` in the ``even`` part (m,) of an ordinate; None where that has no such term."""
    if abs(even[-2]) > abs(even[-1]) * (amplitudes[-2] / amplitudes[-1]) ** 1.5:  # it grows by a greater power
        return None
    any_powers, odd_powers = (leading(amplitudes, even, 1, left, step) for step in (1, 2))
    agree = abs(odd_powers.best - any_powers.best) <= any_powers.missed
    return odd_powers if agree else any_powers


Term = tuple[str, Leading, float] | None
"""How the ordinate changes with the amplitude: :func:`leading_term`."""


@dataclass(frozen=True)
class Expansion:
    """A branch near its branch point, by states at ``amplitudes`` (m,), and its normal form.

    The ``load`` has its leading coefficient, of the amplitude to its ``order``, the ordinate ``x`` its leading term.
    """

    form: NormalForm
    amplitudes: np.ndarray
    states: list[PETSc.Vec]  # at the amplitudes, then at their opposites
    load: Leading
    order: int
    x: Term
    odd: float  # part of the load that is odd
    change: float  # of the load, at the least amplitude

    def resolved(self, least: bool) -> bool:
        """Whether no smaller scale is tried: this has the ``least`` change, or the series is resolved, odd or even."""
        return least or (min(self.odd, 1 - self.odd) < RESOLVED and self.form.resolved(RESOLVED))


@dataclass(frozen=True)
class Origin:
    """A branch point, with the uncertainties of its load and ordinate."""

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
    offset = 1e-3  # in the metric
    nearby = x + direction * (offset / solver.system.norm(direction))
    return (solver.shape.ordinate(nearby) - solver.shape.ordinate(x)) / offset


def normal_form_of(solver: BranchSolver, origin: Origin, direction: PETSc.Vec) -> NormalForm | None:
    """Normal form of the branch that leaves ``origin`` along ``direction``; None if nearby points do not determine it.

    Uncertain is what polynomials through three of four amplitudes miss, what a slope of the load adds at a pitchfork,
    and what the location of the branch point leaves open of loads and ordinates that are measured from it.
    """
    found = expansion_of(solver, origin, direction)
    return None if found is None else found.form


def expansion_of(solver: BranchSolver, origin: Origin, direction: PETSc.Vec) -> Expansion | None:
    """The branch near ``origin``, at the first of several scales at which the series is resolved, else the best."""
    row, best, seen = solver.row(direction), None, SEEN * origin.load_left
    for scale in (1.0, 1 / 4, 1 / 16, 1 / 64):
        found = _at_scale(solver, origin, direction, row, scale)
        if found is None:
            continue
        other = best is not None and not alike(found.form, best.form)
        if other and (found.form.of == DISTANCE or found.odd * found.change <= seen):
            break  # what the ordinate changes by, or what is odd, or even, is round-off
        best = found if best is None or other else min(best, found, key=lambda each: each.form.uncertainty)
        if found.resolved(found.change <= seen):
            break
    return best


def alike(a: NormalForm, b: NormalForm) -> bool:
    """Whether two normal forms differ in the coefficient only."""
    return (a.kind, a.power, a.of) == (b.kind, b.power, b.of)


def _at_scale(
    solver: BranchSolver, origin: Origin, direction: PETSc.Vec, row: PETSc.Vec, scale: float
) -> Expansion | None:
    """The branch by amplitudes of a scale; None where it has no states at one of them."""
    amplitudes, points, states = AMPLITUDES * scale, list[tuple[float, float]](), list[PETSc.Vec]()
    for a in (*amplitudes, *-amplitudes):
        x = origin.x + direction * float(a)
        if not correct(solver.system, x, row, reach=2.0 * abs(float(a))).converged:
            return None
        states.append(x)
        points.append((solver.system.scalar(x) - origin.load, solver.shape.ordinate(x) - origin.ordinate))
    loads, ordinates = np.array(points).T.reshape(2, 2, len(amplitudes))
    span = solver.system.scene.span
    most, moved = np.abs(loads).max(), np.abs(ordinates).max()
    if most < VERTICAL * abs(span[1] - span[0]) * scale**2:
        of = ORDINATE if moved > SEEN * origin.ordinate_left else DISTANCE
        left = float(most / (moved if of == ORDINATE else amplitudes[0]))
        form = NormalForm(VERTICAL_BRANCH, 0.0, 1, left, 0, of)
        return Expansion(form, amplitudes, states, Leading(0.0, 0.0, most), 2, None, 0.0, 0.0)
    (even, odd), one = parts(loads), solver.units.ordinate
    change = abs(loads[0, -1]) + abs(loads[1, -1])
    uneven = float(2 * abs(odd[-1]) / change)
    x = leading_term(amplitudes, ordinates / one, origin.ordinate_left / one)
    slope = leading(amplitudes, odd, 1, origin.load_left)
    if uneven > 0.1:
        return Expansion(_transcritical(slope, x, one), amplitudes, states, slope, 1, x, uneven, change)
    hidden = (abs(slope.best) + abs(slope.best - slope.rough)) / float(amplitudes[-1])
    load = leading(amplitudes, even, 2, origin.load_left)
    return Expansion(_pitchfork(load, hidden, x, one), amplitudes, states, load, 2, x, uneven, change)


def _transcritical(load: Leading, x: Term, one: float) -> NormalForm:
    """Slope of the load in the ordinate, of a size ``one``, or in the distance where that has no linear term."""
    side = int(np.sign(load.best))
    if x is None or x[0] != LINEAR:
        best, left = load.ratio(ONE, 1)
        return NormalForm(TRANSCRITICAL, abs(best), 1, left, side, DISTANCE)
    best, left = load.ratio(x[1], 1)
    return NormalForm(TRANSCRITICAL, best / one, 1, left / one, side)


def _pitchfork(load: Leading, hidden: float, x: Term, one: float) -> NormalForm:
    """Leading coefficient of the load in the ordinate, of a natural size ``one``, or in the distance where it has none.

    ``hidden`` is what a slope of the load adds at the least amplitude.  The side is that of the coefficient: nearly
    degenerate pitchforks turn back in a fold, and at the amplitudes the load may have the other sign.
    """
    term, of, part = (ONE, DISTANCE, 0.0) if x is None else (x[1], ORDINATE, x[2])
    power = 1 if x is not None and x[0] == QUADRATIC else 2
    size = 1.0 if x is None else one**power
    best, left = load.ratio(term, power)
    left += part * abs(best) + hidden / abs(term.best) ** power
    side = int(np.sign(load.best)) if load.significant() else 0
    return NormalForm(PITCHFORK, best / size, power, left / size, side, of)
