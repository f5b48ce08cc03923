"""Hard by their units: lengths and forces of a molecule, or of a pipeline, in metres and newtons."""

from __future__ import annotations

from math import inf

from hard.case import Change, Measured, compare, run, said, singular
from literature.test_classics import CRITICAL
from rescaled import rescaled

from rodfem import Discretization

MOLECULE, PIPELINE = (1e-9, 1e-12), (1e4, 10.0)
"""Metres and newtons of one unit of length and of force: 1e-21 J, and a bending stiffness of 1e9 N m^2."""
SAME = 1e-9
"""Relative difference of a load, stated in one unit and in another."""


def critical(name: str) -> Measured:
    """Critical loads of a classical problem, which each have a closed form, beside those in its own units.

    ``ratios`` are the errors over their bars, ``error`` is the largest difference of a load over ``SAME``.
    """
    scene, (formulation, *_), modes, loads = CRITICAL[name]
    mesh = Discretization(formulation, 8, 6)
    own = [s.point.load for s in singular(run(scene(), mesh)[0])]
    apart, ratios, sentences = 0.0, [], []
    for length, force in (MOLECULE, PIPELINE):
        diagram = run(rescaled(scene(), length, force, force), mesh)
        expected = [Change(load * force, i * modes, (i + 1) * modes) for i, load in enumerate(loads)]
        found = compare(singular(diagram[0]), expected, said(diagram))
        if found.wrong or max(found.ratios) > 1:
            return found
        sentences += found.said
        ratios += found.ratios
        other = [s.point.load / force for s in singular(diagram[0])]
        apart = max(apart, *(abs(b - a) / abs(a) for a, b in zip(own, other, strict=True))) if own else inf
    return Measured(apart / SAME, 1.0, tuple(sentences), ratios=tuple(ratios))
