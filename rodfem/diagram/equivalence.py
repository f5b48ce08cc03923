"""Whether two points of a diagram are one, or neighbours, up to a symmetry: by what no symmetry changes."""

from __future__ import annotations

from math import isfinite

from rodfem.continuation.branch import Point
from rodfem.problem.units import Units
from rodfem.tolerances import unit

SAME_DETERMINANT = 1e-3
"""Logarithm of the ratio of two determinants that are one: of the last iterates of Newton's method, and of meshes that
are not symmetric."""
STEP = 0.05
"""Change of load and energy in a step of a branch, relative to values greater than the rod's units."""


def equivalent(a: Point, b: Point, units: Units, tolerance: float = 1e-8, of_strain: float = 0.0) -> bool:
    """Whether two points agree in all that a symmetry leaves alone: load, energy and stretch.

    Loads and energies of ``a`` and ``b`` may differ by ``tolerance``, relative to values greater than the rod's
    ``units``; so may stretches, or by ``of_strain`` where that is larger.
    """
    strain = max(tolerance, of_strain)
    pairs = (
        (a.load, b.load, tolerance, units.load),
        (a.energy, b.energy, tolerance, units.energy),
        (a.stretch, b.stretch, strain, 1.0),
    )
    return all(abs(p - q) <= allowed * unit(p, q, one=one) for p, q, allowed, one in pairs)


def equally_stable(a: Point, b: Point) -> bool:
    """Whether two equivalent points have the same index and, on one mesh, the same determinant.

    Two sides of a pitchfork may be mirror images in their plane, at the same loads, energies and stretches, and differ
    in what they do across it: then no symmetry of the rod carries one into the other.
    """
    if (a.negative, a.zero) != (b.negative, b.zero):
        return False
    known = a.mesh == b.mesh and isfinite(a.determinant) and isfinite(b.determinant)
    return not known or abs(a.determinant - b.determinant) <= SAME_DETERMINANT


def near(a: Point, b: Point, units: Units, steps: float = 2.0) -> bool:
    """Whether points ``a``, ``b`` of a rod with these ``units`` could be neighbours, ``steps`` apart, on one branch."""
    reach = STEP * steps
    close = abs(a.load - b.load) <= reach * unit(a.load, one=units.load)
    return close and abs(a.energy - b.energy) <= reach * unit(a.energy, one=units.energy)
