"""Critical loads of classical problems with closed forms, on coarse and fine meshes."""

from hard.case import Change, Measured, compare, run, said, singular
from literature.test_classics import CRITICAL

from rodfem import Discretization

TWELVE_DIGITS = {"lateral", "tip on a plane"}
"""Problems of which the record has a value to twelve digits only."""
PROBLEMS = tuple(name for name in CRITICAL if name not in TWELVE_DIGITS)
MESHES = ((3, 6), (5, 6), (8, 6))
"""Elements and degree, the same of all, so that forms are compiled once.

There are twice as many elements of rods that are bent, or twist, from the start.
"""


def changes(name: str) -> list[Change]:
    """Critical loads of a problem, with the index on either side."""
    _, _, modes, loads = CRITICAL[name]
    return [Change(load, i * modes, (i + 1) * modes) for i, load in enumerate(loads)]


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
