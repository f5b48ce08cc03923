"""Critical loads of classical problems with closed forms: on coarse and fine meshes, and in other units."""

from math import inf

from hard.case import Change, Measured, compare, run, said, singular
from literature.test_classics import CRITICAL
from rescaled import rescaled

from rodfem import Discretization

TWELVE_DIGITS = {"lateral", "tip on a plane"}
"""Problems of which the record has a value to twelve digits only."""
PROBLEMS = tuple(name for name in CRITICAL if name not in TWELVE_DIGITS)
MESHES = ((3, 6), (5, 6), (8, 6))
"""Elements and degree, the same of all, so that forms are compiled once.

There are twice as many elements of rods that are bent, or twist, from the start.
"""
MOLECULE, PIPELINE = (1e-9, 1e-12), (1e4, 10.0)
"""Metres and newtons of one unit of length and of force: 1e-21 J, and a bending stiffness of 1e9 N m^2."""
SAME = 1e-9
"""Relative difference of a load, stated in one unit and in another."""


def changes(name: str, force: float = 1.0) -> list[Change]:
    """Critical loads of a problem in units of ``force``, with the index on either side."""
    _, _, modes, loads = CRITICAL[name]
    return [Change(load * force, i * modes, (i + 1) * modes) for i, load in enumerate(loads)]


def critical(name: str) -> Measured:
    """All critical loads of a problem with the index on either side, on all meshes and formulations."""
    scene, formulations, *_ = CRITICAL[name]
    more = 2 if "ring" in name or name == "michell" else 1
    found = []
    for formulation in formulations:
        for elements, degree in MESHES:
            diagram = run(scene(), Discretization(formulation, more * elements, degree))
            found.append(compare(singular(diagram[0]), changes(name), said(diagram)))
    worst = max(found, key=lambda one: one.error)
    return Measured(worst.error, 1.0, worst.said, worst.wrong, tuple(r for one in found for r in one.ratios))


def in_units(name: str) -> Measured:
    """Critical loads of a classical problem, which each have a closed form, beside those in its own units.

    ``ratios`` are the errors over their bars, ``error`` is the largest difference of a load over ``SAME``.
    """
    scene, (formulation, *_), *_ = CRITICAL[name]
    mesh = Discretization(formulation, 8, 6)
    own = [s.point.load for s in singular(run(scene(), mesh)[0])]
    apart, ratios, sentences = 0.0, [], []
    for length, force in (MOLECULE, PIPELINE):
        diagram = run(rescaled(scene(), length, force, force), mesh)
        found = compare(singular(diagram[0]), changes(name, force), said(diagram))
        if found.wrong or max(found.ratios) > 1:
            return found
        sentences += found.said
        ratios += found.ratios
        other = [s.point.load / force for s in singular(diagram[0])]
        apart = max(apart, *(abs(b - a) / abs(a) for a, b in zip(own, other, strict=True))) if own else inf
    return Measured(apart / SAME, 1.0, tuple(sentences), ratios=tuple(ratios))
