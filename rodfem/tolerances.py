"""Tolerances that mean the same in several packages; all others stand where they are used."""

from __future__ import annotations

ROUND_OFF = 1e-12
"""Uncertainty of a load or an ordinate, relative to it or to one, by Newton's tolerance and the conditioning near a
singular point."""
INSIDE = 1e-9
"""Part of a step that is left out at its ends: what happens there belongs to the row."""
SAME_STATE, SAME_SPECIAL = 1e-7, 1e-6
"""Equilibria, and special points, that agree to this in load, energy and stretch are one, up to a symmetry."""


def unit(*values: float) -> float:
    """What errors of numbers are relative to: the largest of them, at least one."""
    return max(1.0, *map(abs, values))


def round_off(value: float) -> float:
    """Uncertainty of a load or an ordinate that is solved for, or given."""
    return ROUND_OFF * unit(value)
