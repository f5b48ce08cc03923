"""The pointwise formulation: centreline and contact force are fields."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from rodfem.fem.formulation import CONTACT_FORCE, Formulation
from rodfem.forms import lagrangian
from rodfem.problem.contribution import Block

if TYPE_CHECKING:
    from rodfem.fem.equations import Equations
    from rodfem.fem.fields import Fields
    from rodfem.fem.shape import Shape
    from rodfem.fem.values import NodalValues
    from rodfem.modes.perturbation import Motions
    from rodfem.problem.local_state import Constants, Place


class Pointwise(Formulation):
    """It applies to all scenes; the field ``r`` is measured from the lift of the ends' positions."""

    name, words, centreline = "pointwise", "all fields", True

    def blocks(self, degree: int) -> list[Block]:
        """Centreline and contact force."""
        return [Block("r", 3, degree, True, False), Block(CONTACT_FORCE, 3, degree - 1, False, True)]

    def integrand(self, equations: Equations, f: Any, c: Constants, W: Any, along: Place) -> Any:
        """With ``r' = R v`` at each point."""
        return lagrangian.pointwise(W, along.R, along.v, along.dr, f.n)

    def contact_force(self, equations: Equations, f: Any, c: Constants) -> list[Any]:
        """A field."""
        return [f.n[i] for i in range(3)]

    def position(self, equations: Equations, f: Any, c: Constants, at: Callable[[Any], Any], side: int | None) -> Any:
        """Known everywhere."""
        return at(f.r) + equations.lift(c)

    def sums(self, shape: Shape, state: NodalValues, integral: np.ndarray, value: np.ndarray) -> np.ndarray:
        """No chord is needed."""
        return value @ state.values("r")[shape.cells].reshape(-1, 3)

    def nodal(self, shape: Shape, state: NodalValues) -> tuple[np.ndarray, np.ndarray]:
        """Values of the field."""
        r = shape.nodal(state.values("r")[shape.cells])
        return r, r[-1] - r[0]

    def offset(self, fields: Fields, state: NodalValues, s: np.ndarray, chord: np.ndarray) -> np.ndarray:
        """The lift."""
        return fields.lift(s, state.constants())

    def store(self, shape: Shape, out: np.ndarray, c: Constants, r: np.ndarray, ends: tuple[Any, Any]) -> None:
        """In the field."""
        fields = shape.system.fields
        out[fields.dofs["r"][shape.cells][:, shape.order]] = r - fields.lift(shape.s, c)

    def displacement(self, motions: Motions, state: NodalValues, change: NodalValues) -> np.ndarray:
        """Values of the field."""
        return motions.nodal(change.values("r")[motions.cells])
