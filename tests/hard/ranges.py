"""Ranges of the load of any width about, at and beside branch points, in either direction; loads asked for there."""

from math import inf

import numpy as np
from classics import SUPPORTS, column
from hard.case import Change, Measured, compare, run, said, singular
from hard.stiffness import EULER
from hard.two_freedoms import cubic

from rodfem import Discretization

LOADS = (EULER, 2 * EULER)
"""Branch points of a cantilever of bending stiffnesses 1 and 2."""
HEIGHT, LOW = 1e-5, 1e-8
"""Load of a fold, and a load so low that one step leads past two folds."""
TO = 1e-6
"""Relative error of the last state: its load is exact, and the curve is not steep there."""
MESH = Discretization("reduced", 4, 3)


def within(low: float, high: float) -> Measured:
    """Branch points of the straight column in a range, begun at ``low``, which may be the upper end.

    One at the start of a range is no point of its search, and is said to be there.
    """
    inside = [x for x in LOADS if min(low, high) < x < max(low, high)]
    index = sum(x < low for x in LOADS)
    step = 1 if high > low else -1
    expected = [Change(x, index + step * i, index + step * (i + 1)) for i, x in enumerate(inside[::step])]
    diagram = run(column("range", SUPPORTS["clamped-free"], (low, high)), error_bars=False)
    return compare(singular(diagram[0]), expected, said(diagram))


def asked(off: float) -> Measured:
    """A load asked for: its row is there, and has the index of its side; at the branch point one zero eigenvalue."""
    scene = column("asked", SUPPORTS["clamped-free"], (0.0, 4.0))
    diagram = run(scene, at=(EULER + off,), error_bars=False)
    found = compare(singular(diagram[0]), [Change(EULER, 0, 1)], said(diagram))
    (row,) = [s.point for s in diagram.special("user", diagram[0].name)]
    expected = {int(off > 0)} if off else {0, 1}
    if row.load != EULER + off or not expected & set(range(row.negative, row.negative + row.zero + 1)):
        return Measured(inf, 1.0, said(diagram), f"row at {row.load}, index {row.negative}, zero {row.zero}")
    return found


def turning(short: float, height: float = HEIGHT) -> Measured:
    """``u^3 - a u = P``, whose range ends before a fold, by a part ``short`` of its ``height``: there the branch ends.

    A step that turns at the fold begins and ends within the range.
    """
    a = 3 * (height / 2) ** (2 / 3)
    high = height * (1 - short)
    diagram = run(cubic(a, (-0.1, high)), MESH)
    (branch,) = diagram
    u = np.roots([1.0, 0.0, -a, -high]).real.min()
    outside = max(p.load for p in branch.points) > high
    if outside or branch.ended != "end of range" or abs(branch.points[-1].ordinate - u) > TO * abs(u):
        return Measured(inf, 1.0, said(diagram), f"ended: {branch.ended}, at {branch.points[-1].ordinate}, not {u}")
    return compare(singular(branch), [], said(diagram))
