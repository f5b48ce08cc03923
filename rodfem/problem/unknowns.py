"""Unknowns of a discretised scene: fields along the rod, and scalars; what they are, not how they are discretised."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import Enum, auto
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rodfem.problem.functions import Constants

Direction = tuple[float, ...]
UNIT: tuple[Direction, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


class Motion(Enum):
    """Action of a rigid motion of space on the unknowns of a group."""

    VECTOR = auto()  # they rotate with space
    POSITION = auto()  # they rotate and translate with space
    MIXED = auto()  # a symmetry may combine any of them
    CLOSING = auto()  # they close a ring, and follow from the others


@dataclass(frozen=True)
class Group:
    """Scalar unknowns that belong together, multipliers unless they are positions; that of component 0 is ``name1``.

    ``equation`` is what that of a multiplier states, with ``{}`` for its number; positions have none.  ``known(c)``
    (3,) are the components of a vector that are no unknowns, ``moment`` says whether a multiplier is a moment.
    """

    name: str
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
    """One field; ``along`` says whether it is the multiplier of a constraint all along the rod.

    On a surface ``tangent`` says which ends hold that of the rod; if it is ``spare``, that of one node follows.
    """

    name: str
    size: int
    degree: int
    continuous: bool
    multiplier: bool
    along: bool = False
    tangent: tuple[bool, bool] | None = None
    spare: bool = False
