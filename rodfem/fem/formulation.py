"""What a formulation is: a class derived from :class:`Formulation` in a file of :mod:`rodfem.fem.formulations`."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from rodfem.problem.contribution import Block, Unknown

if TYPE_CHECKING:
    from rodfem.fem.equations import Equations
    from rodfem.fem.fields import Fields
    from rodfem.fem.shape import Shape
    from rodfem.fem.values import NodalValues
    from rodfem.modes.perturbation import Motions
    from rodfem.problem.local_state import Constants, Place
    from rodfem.problem.scene import Scene

CONTACT_FORCE = "n"
"""Name of the contact force: a field, or the beginning of the names of scalars."""


class Formulation(ABC):
    """Which unknowns a rod has besides rotations and strains, its Lagrangian in them, and where they say it is.

    Attributes
    ----------
    name, words
        Name in files and options, and what is unknown, for the command line.
    centreline
        Whether that is a field, ``r``.
    """

    name: ClassVar[str]
    words: ClassVar[str]
    centreline: ClassVar[bool]

    def refusal(self, scene: Scene) -> str:
        """Why it does not apply to a scene, in words that follow its name; empty where it does."""
        return ""

    def blocks(self, degree: int) -> list[Block]:
        """Fields besides rotations and strains, for a rotation of this degree."""
        return []

    def unknowns(self, scene: Scene) -> list[Unknown]:
        """Scalar unknowns besides those of the parts of the scene."""
        return []

    def left_out(self, scene: Scene) -> list[str]:
        """What is no unknown, each with the reason."""
        return []

    # --- the equations: ``f`` has fields and scalars by name, ``c`` the constants, as in Equations ------------------

    @abstractmethod
    def integrand(self, equations: Equations, f: Any, c: Constants, W: Any, along: Place) -> Any:
        """Integrand of the Lagrangian of the rod with the stored energy ``W``: see :mod:`rodfem.forms.lagrangian`.

        ``equations`` are those that it is made for, ``f`` their fields and scalars by name, ``c`` the constants,
        ``along`` the place along the rod.
        """

    @abstractmethod
    def contact_force(self, equations: Equations, f: Any, c: Constants) -> list[Any]:
        """Components of the contact force in space (3,); ``equations``, ``f`` and ``c`` as for :meth:`integrand`."""

    @abstractmethod
    def position(self, equations: Equations, f: Any, c: Constants, at: Callable[[Any], Any], side: int | None) -> Any:
        """Position (3,) where ``at`` restricts a field to, None where there is none.

        ``equations``, ``f`` and ``c`` are as for :meth:`integrand`; ``side`` is 0 at the left end, 1 at the right end,
        None elsewhere.
        """

    # --- the shape of a state, on the nodes and quadrature of a Shape -----------------------------------------------

    @abstractmethod
    def sums(self, shape: Shape, state: NodalValues, integral: np.ndarray, value: np.ndarray) -> np.ndarray:
        """Share of this rank in the position at a place without its offset (3,), or in that and the chord (2, 3).

        ``shape`` has the nodes and quadrature, ``state`` the values.  ``integral`` are weights (2, points) of slopes in
        their integrals to the place and over the rod, ``value`` (nodes,) of nodal values in the value there.
        """

    @abstractmethod
    def nodal(self, shape: Shape, state: NodalValues) -> tuple[np.ndarray, np.ndarray]:
        """Positions of the nodes (m, 3) without their offset, and the chord (3,)."""

    @abstractmethod
    def offset(self, fields: Fields, state: NodalValues, s: np.ndarray, chord: np.ndarray) -> np.ndarray:
        """Offset of the positions of a ``state`` at the arclengths ``s`` (...,): (..., 3) or (3,).

        ``fields`` are those of the state, ``chord`` (3,) is the difference of its ends.
        """

    @abstractmethod
    def store(self, shape: Shape, out: np.ndarray, c: Constants, r: np.ndarray, ends: tuple[Any, Any]) -> None:
        """Write where the rod is into the local values ``out`` of a state.

        Parameters
        ----------
        shape, out, c
            Nodes, what is written to, and the constants of the state.
        r
            Positions of the owned cells' nodes, (cells, nodes, 3).
        ends
            Positions of the left and right end, (3,) each.
        """

    @abstractmethod
    def displacement(self, motions: Motions, state: NodalValues, change: NodalValues) -> np.ndarray:
        """Displacement of the nodes (m, 3) in a change of the state."""
