r"""Branch jumping: whether a step of continuation has ended on another branch that runs beside the one it began on.

A branch is the integral of its unit tangent in arclength, ``x_b - x_a = int_a^b t ds``.  Between two rows ``t`` is
interpolated through the tangents at the last rows (Adams-Moulton weights) or at both rows and the equilibrium half-way
(Simpson's rule).  What is left of the equation across the chord is the *defect*.  It is of higher order in the step on
one branch; if the rows are on two branches it is at least of the size of their distance, which no shorter piece
lessens (Allgower & Georg, Introduction to Numerical Continuation Methods, 2003, 6.1, on path jumping).

A step is suspected if its defect is not small beside the correction of its prediction: on one branch both are of the
same order, with ratios 1/24 and less.  Then the piece is halved, by equilibria in between, until the defects of all
halves vanish or one is no smaller than a part of its chord: there the rows are not joined.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.branch import Point
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.prediction import ROWS, hermite, lagrange, predict
from rodfem.continuation.states_between import solve_at
from rodfem.errors import ConvergenceError
from rodfem.fem.system import System
from rodfem.linalg.orthogonal import combine
from rodfem.tolerances import APART

SHARE = 0.1
"""Defect, relative to the correction of the prediction, from which on a step is suspected."""
FAR = 1e-2
"""Correction, in the metric, from which on a step is suspected whatever its defect."""
TORN = 0.25
"""Defect, relative to the chord, of two rows that are not joined."""
HALVINGS = 14
"""How many times a piece is halved: a bend of a smaller part of a step is taken for a jump."""
STEADY, PROPORTIONAL = 4, 1.5
"""A defect is in proportion to its piece if over so many halvings their ratio changes by less than that factor."""
GROWN = 1.5
"""Defect over length, relative to that of the step before, from which on a step is suspected."""
PLACES = (0.5, 0.43)
"""Where a piece is divided; at the second place if no equilibrium is found at the first, which may be singular."""
GAUSS = 0.5 / np.sqrt(3.0)
"""Distance of the two points of Gauss' rule from the middle of a piece of length one: exact for cubics."""


def suspected(solver: BranchSolver, rows: Sequence[Point]) -> bool:
    """Whether the step to the last of the ``rows`` may have jumped; all have tangents on the mesh of ``solver``.

    A defect for its length like that of the step before is none of a jump.
    """
    *known, b = rows
    off = defect(solver.system, rows[-ROWS:], known[-1], b)
    if off <= APART:
        return False
    prediction, _ = predict(known, b.arclength)
    moved = _across(solver.system, b.x - prediction, b.x - known[-1].x)
    if moved <= FAR and off <= SHARE * moved:
        return False
    if len(known) < 2:
        return True
    before = defect(solver.system, known, *known[-2:]) / _length(*known[-2:])
    return off / _length(known[-1], b) > GROWN * before


def joined(solver: BranchSolver, a: Point, b: Point, rates: tuple[float, ...] = ()) -> bool:
    """Whether equilibria join two rows, by halving the piece between them.

    The rows ``a``, ``b`` have tangents on the mesh of ``solver``.  Halves whose defects do not vanish are halved again.
    On one branch a defect decreases faster than its piece; that of a jump stays.  One in proportion to its piece is
    that of a tangent along a symmetry, by which states do not move.  ``rates`` are defects over lengths of the pieces
    that this is a half of.
    """
    middle = between(solver, a, b) if len(rates) < HALVINGS else None
    if middle is None:
        return False
    rows = (a, middle, b)
    off = defect(solver.system, rows, a, b)
    rates = (*rates, off / _length(a, b))
    recent = rates[-STEADY:]
    if off <= APART or (len(recent) == STEADY and max(recent) < PROPORTIONAL * min(recent)):
        return True
    if rates[-1] > TORN:
        return False
    halves = ((a, middle), (middle, b))
    return all(defect(solver.system, rows, p, q) <= APART or joined(solver, p, q, rates) for p, q in halves)


def _length(a: Point, b: Point) -> float:
    return b.arclength - a.arclength


def defect(system: System, rows: Sequence[Point], a: Point, b: Point) -> float:
    """Size, in the metric, of ``x_b - x_a - int_a^b t ds`` across the chord, ``t`` interpolated through the ``rows``.

    ``a`` and ``b`` are two of the rows, states of one ``system``.  The component along the chord is that of the
    difference between chord and arc.
    """
    middle, length = (a.arclength + b.arclength) / 2, b.arclength - a.arclength
    nodes = np.array([p.arclength for p in rows])
    first, second = (lagrange(nodes, middle + sign * GAUSS * length)[0] for sign in (-1, 1))
    chord = b.x - a.x
    return _across(system, chord - combine([p.tangent for p in rows], length / 2 * (first + second)), chord)


def _across(system: System, x: PETSc.Vec, chord: PETSc.Vec) -> float:
    """Size of what is left of ``x`` without its component along the ``chord``."""
    image = system.metric * chord
    rest = x.copy()
    rest.axpy(-image.dot(x) / image.dot(chord), chord)
    return float(system.norm(rest))


def between(solver: BranchSolver, a: Point, b: Point) -> Point | None:
    """Equilibrium on a plane across the piece, with its tangent; None where there is none between the rows."""
    whole = solver.system.distance(a.x, b.x)
    for place in PLACES:
        s = a.arclength + place * (b.arclength - a.arclength)
        try:
            x = solve_at(solver, lambda t: hermite(a, b, t), s)
            tangent = solver.tangent(solver.row(hermite(a, b, s)[1]), at=x)
        except ConvergenceError:
            continue
        if max(solver.system.distance(a.x, x), solver.system.distance(x, b.x)) <= whole:
            return replace(a, x=x, tangent=tangent, arclength=s)
    return None
