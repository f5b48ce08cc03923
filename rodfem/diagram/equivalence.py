"""Whether two points of a diagram are one, or neighbours, up to a symmetry: by what no symmetry changes."""

from __future__ import annotations

from rodfem.continuation.branch import Point
from rodfem.problem.units import Units
from rodfem.tolerances import unit

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


def near(a: Point, b: Point, units: Units, steps: float = 2.0) -> bool:
    """Whether points ``a``, ``b`` of a rod with these ``units`` could be neighbours, ``steps`` apart, on one branch."""
    reach = STEP * steps
    close = abs(a.load - b.load) <= reach * unit(a.load, one=units.load)
    return close and abs(a.energy - b.energy) <= reach * unit(a.energy, one=units.energy)
