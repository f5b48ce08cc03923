"""States in which an energy is not smooth within elements: no error bar holds there.

Where an energy changes from one side of a kink to the other inside of the rod, states are as smooth as the kink lets
them be: with more elements they converge by a low power of their length, and two meshes may have the kink alike.  The
same holds for a change that is as sharp as a kink to the quadrature of both meshes.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from petsc4py import PETSc

from rodfem.fem.kinks_at import KinksAt
from rodfem.fem.quadrature_at import QuadratureAt
from rodfem.fem.shape import Shape
from rodfem.fem.transfer import halved

NO_ERROR = "no error is estimated where that is, and no accuracy is certain; compare meshes of many elements."
"""End of a sentence on such states."""


class Reasons(NamedTuple):
    """Words for the functions with a kink inside of the rod, and for those that change too sharply for the elements."""

    kinks: list[str]
    sharp: list[str]

    def __bool__(self) -> bool:
        """Whether there is one."""
        return bool(self.kinks or self.sharp)

    def __add__(self, other: Reasons) -> Reasons:  # type: ignore[override]
        """Those of both."""
        return Reasons(self.kinks + other.kinks, self.sharp + other.sharp)

    @property
    def remark(self) -> str:
        """Remark at a special point without an error bar."""
        return f"not estimated: a {'kink' if self.kinks else 'sharp change'} in the state"

    @property
    def sentence(self) -> str:
        """Why there is no error bar, without a subject before it."""
        clauses = []
        if self.kinks:
            clauses.append(
                f"the {listed(self.kinks)} has a kink in the state inside of the rod, with which convergence is "
                "algebraic and two meshes may err alike"
            )
        if self.sharp:
            clauses.append(
                f"the {listed(self.sharp)} changes in the state within an element too sharply for the points of its "
                "quadrature"
            )
        return f"{', and '.join(clauses)}: {NO_ERROR}"


class Nonsmooth:
    """Tells why no error bar holds in the states of a system; collective over its ranks."""

    def __init__(self, shape: Shape) -> None:
        """Examine the scene of a ``shape``."""
        self.kinks = KinksAt(shape)
        self._quadrature = QuadratureAt(shape, halved(shape.system.fields.discretization.degree))

    def __call__(self, x: PETSc.Vec) -> Reasons:
        """Return why no bar holds in a state ``x``; no reasons where one does."""
        kinks = self.kinks(x).inside
        return Reasons(kinks, [what for what in self._quadrature(x) if what not in kinks])


def listed(words: Iterable[str]) -> str:
    """Words after an article, each once."""
    return " and the ".join(dict.fromkeys(words))
