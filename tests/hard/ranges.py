"""Ranges of the load of any width about, at and beside branch points, in either direction; loads asked for there."""

from __future__ import annotations

from math import inf

import numpy as np
import ufl
from classics import SUPPORTS, column
from hard.case import Change, Measured, compare, run, said, singular
from hard.stiffness import EULER
from hard.two_freedoms import scene

from rodfem import Discretization, Scene, clamped, free
from rodfem.forms.energy import bending_and_twist

LOADS = (EULER, 2 * EULER)
"""Branch points of a cantilever of bending stiffnesses 1 and 2."""
HEIGHT, LOW = 1e-5, 1e-8
"""Load of a fold, and a load so low that one step leads past two folds."""
TO = 1e-6
"""Relative error of the last state: its load is exact, and the curve is not steep there."""
MESH = Discretization("reduced", 4, 3)
RANGE, HALF, OTHER = (0.25, 2.3), 0.005, 0.3
"""Range of a load of which a pair of branch points has a small part, half of that, and the rate of another plane."""
AT_END = 1e-8
"""Distance from an end of a range within which a branch point is one of it."""


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


def about(half: float) -> Measured:
    return within(EULER - half, EULER + half)


def back(half: float) -> Measured:
    return within(EULER + half, EULER - half)


def beside(short: float) -> Measured:
    """A range that ends, or begins, just before a branch point."""
    return within(EULER + short, 2 * EULER - short)


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
    model = scene(lambda u, f2, c: 0.25 * u**4 - 0.5 * c.a * u**2 - c.P * u + 0.5 * f2, (-0.1, high), a=a)
    diagram = run(model, MESH)
    (branch,) = diagram
    u = np.roots([1.0, 0.0, -a, -high]).real.min()
    outside = max(p.load for p in branch.points) > high
    if outside or branch.ended != "end of range" or abs(branch.points[-1].ordinate - u) > TO * abs(u):
        return Measured(inf, 1.0, said(diagram), f"ended: {branch.ended}, at {branch.points[-1].ordinate}, not {u}")
    return compare(singular(branch), [], said(diagram))


def turning_in_the_last_step(short: float) -> Measured:
    """The same, with both folds and the end of the range in one step."""
    return turning(short, LOW)


def critical_twice(middle: float, sign: float) -> Scene:
    """A cantilever, in its plane, under Euler's load times ``1 + sign (HALF^2 - (P - middle)^2)``."""
    ends = clamped(), free(lambda c: (0.0, 0.0, -EULER * (1 + sign * (HALF**2 - (c.P - middle) ** 2))))
    return column("pair", ends, RANGE, energy=lambda v, k, c: bending_and_twist(k, (1.0, 9.0, 1.0)), planar="e1")


def pair_at_a_row(row: int, off: float, side: float = 1.0, sign: float = 1.0, error_bars: bool = True) -> Measured:
    """Two branch points, one ``off`` the load of a row, the other on one ``side`` of it: unstable or stable between."""
    mesh, plan = Discretization("auto", 6, 6), {"error_bars": error_bars}
    load = [p.load for p in run(critical_twice(10.0, 1.0), mesh, error_bars=False)[0].points][row]
    middle = load + off + side * HALF
    inside = [x for x in (middle - HALF, middle + HALF) if RANGE[0] + AT_END < x < RANGE[1] - AT_END]
    diagram = run(critical_twice(middle, sign), mesh, **plan)
    found = [s for s in singular(diagram[0]) if RANGE[0] + AT_END < s.point.load < RANGE[1] - AT_END]
    indices = [(0, 1), (1, 0)] if sign > 0 else [(1, 0), (0, 1)]
    expected = [Change(x, *indices[x > middle]) for x in inside]
    for point in diagram[0].points:
        away = abs(point.load - middle) - HALF
        if abs(away) > 1e-4 and point.negative != ((away < 0) == (sign > 0)):
            return Measured(inf, 1.0, said(diagram), f"index {point.negative} at {point.load}")
    return compare(found, expected, said(diagram))


def beside_a_pair(
    middle: float,
    apart: float,
    rate: float = OTHER,
    grow: float = 0.0,
    half: float = HALF,
    deep: float = 1.0,
    error_bars: bool = True,
) -> Measured:
    """A pair of branch points in one plane, and one in the other plane ``apart`` from the middle of the pair.

    Thrust and stiffnesses grow as ``exp(grow P)``.  The thrust over Euler's of the first plane is one at
    ``middle +- half``, by a parabola that is ``deep`` there, and over that of the second one at ``middle + apart``,
    where it changes at a ``rate``.
    """
    cross = middle + apart
    over = lambda P: 1 + deep * (half**2 - (P - middle) ** 2) / (1 + 4 * deep * (P - middle) ** 2)  # noqa: E731
    grows = lambda P: ufl.exp(grow * (P - 1.2))  # noqa: E731
    rod = column(
        "two planes", (clamped(), free(lambda c: (0.0, 0.0, -EULER * grows(c.P) * over(c.P)))), RANGE,
        energy=lambda v, k, c: grows(c.P)
        * bending_and_twist(k, (1.0, over(c.P) * (1 - rate * (c.P - cross)), 1.0)),
    )  # fmt: skip
    diagram = run(rod, Discretization("auto", 6, 6), error_bars=error_bars)
    index = lambda P: (abs(P - middle) < half) + ((P > cross) == (rate > 0))  # noqa: E731
    places = sorted((middle - half, middle + half, cross))
    expected = [Change(x, index(x - 1e-9), index(x + 1e-9)) for x in places]
    wrong = [p for p in diagram[0].points if not p.zero and p.negative != index(p.load)]
    if wrong:
        return Measured(inf, 1.0, said(diagram), f"index {wrong[0].negative} at {wrong[0].load}")
    return compare(singular(diagram[0]), expected, said(diagram))
