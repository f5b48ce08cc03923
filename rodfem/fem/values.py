"""Values of the unknowns of a rod on one rank, by the names of fields and scalars."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from rodfem.fem.fields import Fields
    from rodfem.fem.parameters import Line
    from rodfem.problem.ends import Constants

LOAD = "load"
"""Name of the load among the scalars."""


class NodalValues:
    """Values of fields and scalars, of a state or of a change of one; they never change.

    Attributes
    ----------
    local
        Value of each local degree of freedom, clamped ones and ghosts included, (local size,); read only.
    line
        Parameters that the scalar ``load`` stands for.
    """

    def __init__(self, fields: Fields, local: np.ndarray, line: Line) -> None:
        """Own the array from now on."""
        local.setflags(write=False)
        self.fields, self.local, self.line = fields, local, line

    def values(self, name: str) -> np.ndarray:
        """Nodal values of a field in all local cells, ghosts last, (cells, nodes, components)."""
        return self.local[self.fields.dofs[name]]

    @property
    def turned(self) -> np.ndarray:
        """Nodal values of the field of the rotation, (cells, nodes, components)."""
        return self.values(self.fields.turning.name)

    @property
    def load(self) -> float:
        """Value of the scalar ``load``."""
        return float(self.local[self.fields.copies[0, -1]])

    @cached_property
    def scalars(self) -> dict[str, float]:
        """Values of the scalars by name, the load among them."""
        return dict(zip(self.fields.scalars, self.local[self.fields.copies[0]].tolist(), strict=False))

    @property
    def named(self) -> dict[str, Any]:
        """Values of all fields and scalars by name: see :meth:`~rodfem.fem.fields.Fields.filled`."""
        return {name: self.values(name) for name in self.fields.dofs} | self.scalars

    def constants(self) -> Constants:
        """Parameters as numbers, at the middle of the rod."""
        return self.line.constants(self.load)
