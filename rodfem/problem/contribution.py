"""Contributions of a part of a scene to its problem: scalar unknowns, terms of the Lagrangian, virtual work.

An end, an attachment, a constraint, and the scene itself with what acts along the rod, are each a
:class:`Contribution`.  Unknowns, equations, words and checks of a discretised scene are those of its contributions.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from enum import Enum, auto
from typing import TYPE_CHECKING, Any

from rodfem.problem.roles import functions_of

if TYPE_CHECKING:
    from rodfem.problem.local_state import Constants, Place

Direction = tuple[float, ...]
UNIT: tuple[Direction, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


class Motion(Enum):
    """Action of a rigid motion of space on the unknowns of a group."""

    VECTOR = auto()
    """Vectors: they rotate with space."""
    POSITION = auto()
    """Points: they rotate and translate with space."""
    MIXED = auto()
    """A symmetry may combine any of them."""
    CLOSING = auto()
    """They follow from the others: they close a ring."""


@dataclass(frozen=True)
class Group:
    """Scalar unknowns that belong together, multipliers unless they are positions.

    Attributes
    ----------
    name
        Beginning of their names: that of component 0 is ``name1``.
    words
        What they are, for the terminal.
    equation
        What the equation of a multiplier states, with ``{}`` for its number; empty for positions, which are none.
    motion
        What rigid motions do to them.
    known
        ``known(c)``, values (3,) of the components of a vector that are no unknowns, None elsewhere.
    moment
        Whether a multiplier is a moment, not a force.
    """

    name: str
    words: str
    equation: str
    motion: Motion
    known: Callable[[Constants], Sequence[Any]] | None = field(default=None, compare=False)
    moment: bool = False


@dataclass(frozen=True)
class Unknown:
    """One scalar unknown: component of a group, along a direction (3,) where it is one of a vector in space."""

    group: Group
    component: int
    direction: Direction | None = None

    @property
    def name(self) -> str:
        """Name in files and on the terminal."""
        return f"{self.group.name}{self.component + 1}"

    @property
    def multiplier(self) -> bool:
        """Whether it is the multiplier of an equation."""
        return bool(self.group.equation)


@dataclass(frozen=True)
class Block:
    """One field: ``name``, number of components ``size``, ``degree``, whether ``continuous``, whether a ``multiplier``.

    ``along`` says whether it is that of a constraint all along the rod.
    """

    name: str
    size: int
    degree: int
    continuous: bool
    multiplier: bool
    along: bool = False


@dataclass(frozen=True)
class Site:
    """Expressions of the state where a contribution is, of which it makes its terms.

    Attributes
    ----------
    x, c
        Place and constants, as functions ``f(x, c)`` receive them.
    y
        Values of the contribution's own unknowns, in their order.
    turned
        Field of the rotation: quaternion (4,), or the angle of a planar rod.
    normal
        Component across the plane of a planar rod, None in space.
    free
        Components of the position that move.
    first, second
        Variations with ``r`` (3,), None without a centreline, and ``q`` (4,).
    whole
        Of a closed planar rod the angle by which it turns in all, else None.
    """

    x: Place
    c: Constants
    y: Sequence[Any]
    turned: Any
    normal: int | None
    free: Sequence[int]
    first: Any
    second: Any
    whole: Any = None


class Contribution:
    """Part of a scene; one without unknowns contributes its loads (:mod:`rodfem.problem.load`), and nothing else."""

    nodal = False
    """Whether its terms along the rod are collocated at nodes."""

    def unknowns(self, number: int, normal: int | None, centreline: bool) -> list[Unknown]:
        """Scalar unknowns of contribution ``number`` of its kind; ``centreline``: whether that is a field."""
        return []

    def blocks(self, number: int, degree: int) -> list[Block]:
        """Fields that it adds, for a rotation of this degree."""
        return []

    def held(self, c: Constants) -> list[Any]:
        """Position there: three expressions, None where it is free."""
        return [None] * 3

    def lagrangian(self, at: Site) -> Iterator[Any]:
        """Terms of the Lagrangian: those of loads with a potential."""
        for _, function, role in functions_of(self, nested=False):
            potential = role.load and role.load.potential_in(planar=at.normal is not None)
            term = potential and potential(at, function(at.x, at.c) if role.arguments == 2 else function(at.c))
            if term is not None:
                yield term

    def virtual_work(self, at: Site) -> Iterator[Any]:
        """Virtual work of loads without a potential."""
        for _, function, role in functions_of(self, nested=False):
            if role.load and role.load.potential_in(planar=at.normal is not None) is None:
                yield role.load.work(at, function(at.c))

    def kinetic(self, at: Site) -> Iterator[Any]:
        """Terms of the kinetic metric."""
        return iter(())
