"""Equations that the rod must fulfil, each with a multiplier of its own."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

from rodfem.problem.arguments import finite, yes_or_no
from rodfem.problem.contribution import Block, Contribution, Group, Motion, Site, Unknown
from rodfem.problem.roles import Role, role_field

if TYPE_CHECKING:
    from rodfem.problem.local_state import Constants, Given, OfPlace, Place

MULTIPLIERS = Group("g", "multipliers of constraints", "constraint {} of the scene", Motion.MIXED)


@dataclass(frozen=True)
class Constraint(Contribution):
    """An equation ``of(x, c) = 0`` with a multiplier of its own, at arclength ``s`` or, where that is None, of the rod.

    Made by :func:`integral`, :func:`at` and :func:`everywhere`.
    """

    of: OfPlace = field(metadata={"role": lambda x: Role("constraint", "f(x, c)", 0, along=x.s is None)})
    s: float | None = None
    letter: ClassVar[str] = "g"
    """Beginning of the name of its multiplier: constraints of one letter are numbered together."""
    words: ClassVar[str] = ""
    """Name of the constraint, for a picture in which it has no place."""
    whole: ClassVar[bool] = False
    """Whether it is one of the whole rod, by an integral."""

    def __post_init__(self) -> None:
        """Check the place; raises :class:`InputError`."""
        if self.s is not None:
            object.__setattr__(self, "s", finite("s", self.s, 0.5))

    def unknowns(self, number: int, normal: int | None, centreline: bool) -> list[Unknown]:
        """One scalar multiplier."""
        return [Unknown(MULTIPLIERS, number)]

    def lagrangian(self, at: Site) -> Iterator[Any]:
        """Multiplier times equation."""
        yield at.y[0] * self.value(at.x, at.c)

    def value(self, x: Place, c: Constants) -> Any:
        """Expression that is zero; of an integral the integrand."""
        return self.of(x, c)


@dataclass(frozen=True)
class Integral(Constraint):
    """An integral over the rod that ``equals(c)``, which is spread over the rod."""

    equals: Given = role_field(Role("value of an integral constraint", "f(c)", 0, placed=False), lambda c: 0.0)
    words = "integral constraint"
    whole = True

    def value(self, x: Place, c: Constants) -> Any:
        """Integrand of the integral that is zero."""
        return self.of(x, c) - self.equals(c) / x.length


@dataclass(frozen=True)
class Everywhere(Constraint):
    """A constraint all along the rod, whose multiplier is a field."""

    nodal: bool = False
    """Whether it is one of positions or rotations: its multiplier is continuous, the equation collocated at nodes."""
    letter, words = "p", "constraint all along the rod"

    def unknowns(self, number: int, normal: int | None, centreline: bool) -> list[Unknown]:
        """No scalar."""
        return []

    def blocks(self, number: int, degree: int) -> list[Block]:
        """Multiplier, of the degree of the field that is constrained."""
        return [Block(f"{self.letter}{number}", 1, degree if self.nodal else degree - 1, self.nodal, True, True)]


def integral(of: OfPlace, equals: Given = 0.0) -> Constraint:
    """Constrain ``int of(x, c) ds = equals(c)``: a total twist, say.  The multiplier is one scalar."""
    return Integral(of, equals=equals)


def at(s: float, of: OfPlace) -> Constraint:
    """Constrain ``of(x, c) = 0`` at arclength ``s``: a point kept on a plane, say.  The multiplier is one scalar."""
    return Constraint(of, s)


def everywhere(of: OfPlace, *, strain: bool) -> Constraint:
    """Constrain ``of(x, c) = 0`` all along the rod; ``strain`` says whether it is one of strains or of positions."""
    return Everywhere(of, nodal=not yes_or_no("strain", strain))
