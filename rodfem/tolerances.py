"""Numerical policy: what is relative to what, and the constants that mean the same in several packages.

A tolerance has no unit.  Arclengths are relative to the rod's length, loads and ordinates to themselves or to
their natural size (:mod:`rodfem.problem.units`: one, where a scene is stated in numbers not far from it),
differences of loads to the span, eigenvalues to the rod's lowest bending eigenvalue (``Inertia.scale``), and entries of
matrices to the largest one.  Distances of states and lengths along a branch are in the metric: about the root mean
square of the rotation, in radian.  What is absolute says so.

All other constants stand at the top of the module that uses them.  A user changes ``Plan.accuracy``, ``Plan.steps``
(:class:`~rodfem.continuation.follow.StepControl`) and the mesh; the others belong to the methods, and a change of
one is a change of results (``tests/golden``).  ``tests/house/test_literals.py`` finds those without a name.
"""

from __future__ import annotations

from typing import Any

import numpy as np

Pair = tuple[float, float]
TINY = 1e-300  # floor of a number that may be zero and is divided by, or has its root or logarithm taken: absolute
NEGLIGIBLE = 1e-12
"""A difference or a part below this, relative to the whole, is round-off of arithmetic: nothing was solved for."""
ROUND_OFF = 1e-12
"""Uncertainty of a load or an ordinate, relative to it or to one, by Newton's tolerance and the conditioning near a
singular point."""
INSIDE = 1e-9  # part of a step that is left out at its ends: what happens there belongs to the row
SAME_PLACE = 1e-9  # arclengths that differ by less than this, relative to the rod's length, are one place
SAME_LOAD = 1e-9  # loads that differ by less than this, relative to the span, are one: that of a bound, or of a search
SAME_STATE, SAME_SPECIAL = 1e-7, 1e-6
"""Equilibria, and special points, that agree to this in load, energy and stretch are one, up to a symmetry."""
LOCATED = 10.0  # uncertainties of a load on one mesh by which that of another special point differs at least
APART = 1e-5  # equilibria nearer to each other than this, in the metric, are one
SAME_EIGENVALUE = 1e-6  # eigenvalues closer than this, relative to the greatest, are one
DRIFT = 1e-6
"""Largest drift scalar of an equilibrium, or of a unit vector, over the lowest bending eigenvalue: beyond it a mesh
breaks a symmetry, or the vector is one of a Jordan block."""


def unit(*values: float, one: float) -> float:
    """What errors of numbers are relative to: the largest of them, at least ``one``, their natural size."""
    return max(one, *map(abs, values))


def round_off(value: float, one: float) -> float:
    """Uncertainty of a load or an ordinate that is solved for, or given; ``one`` is its natural size."""
    return ROUND_OFF * unit(value, one=one)


def same_place(x: Any, s: float, length: float) -> Any:
    """Whether arclengths ``x``, a number or an array, are ``s`` to round-off, on a rod of this ``length``."""
    return np.isclose(x, s, rtol=0, atol=SAME_PLACE * length)


def same_special(special: Pair, located_to: float, place: Pair, one: Pair) -> bool:
    """Whether a ``special`` point and a ``place`` on one mesh, each a load and an ordinate, are one."""
    (load, ordinate), (of_load, of_ordinate) = special, one
    near = abs(load - place[0]) <= LOCATED * (located_to + round_off(load, of_load))
    return near and abs(ordinate - place[1]) <= SAME_SPECIAL * unit(ordinate, place[1], one=of_ordinate)
