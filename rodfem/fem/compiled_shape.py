"""Slopes of the centreline and the least stretch of a state by compiled code (``shape.c``).

Each row of a branch asks for both; by arrays they cost as much as a factorisation.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rodfem import compat
from rodfem.forms.kinematics import UNDEFORMED
from rodfem.linalg.compiled import Memory, buffer, module

if TYPE_CHECKING:
    from rodfem.fem.fields import Fields


class CompiledShape:
    """The compiled code for the owned cells of one mesh."""

    def __init__(self, fields: Fields, points: np.ndarray) -> None:
        """Hand over the degrees of freedom of the ``fields`` and the Gauss ``points`` in [0, 1]."""
        code = module("fem/shape")
        self._lib, self._ffi, self._memory = code.lib, code.ffi, Memory(code.ffi)
        scene, k, owned = fields.scene, fields.discretization.degree, slice(0, fields.owned_cells)
        self._shape = (fields.owned_cells, len(points), 3)
        self.spacing = 0.5 / k
        """Distance of the samples in a cell, [-1, 1]."""
        shape = self._pointer = self._ffi.new("Shape *")
        shape.cells, shape.points, shape.nodes, shape.strain_nodes = fields.owned_cells, len(points), k + 1, k
        shape.normal = -1 if scene.normal is None else scene.normal
        shape.strains, shape.samples = len(scene.free_strains), 4 * k + 1
        strains = fields.dofs["v"][owned] if "v" in fields.dofs else np.zeros(0)
        integers = {
            "component": np.array(scene.free_strains),
            "rotation": fields.dofs[fields.turning.name][owned],
            "strain": strains,
        }
        doubles = {
            "held": [0.0 if i in scene.free_strains else x for i, x in enumerate(UNDEFORMED)],
            "basis": compat.lagrange_basis(k, points),
            "strain_basis": compat.lagrange_basis(k - 1, points),
            "sample_basis": compat.lagrange_basis(k - 1, np.linspace(0, 1, shape.samples)),
        }
        for kind, arrays in ((np.int32, integers), (float, doubles)):
            given = {name: np.ascontiguousarray(values, dtype=kind) for name, values in arrays.items()}
            self._memory.point(shape, **given)

    def slopes(self, local: np.ndarray) -> np.ndarray:
        """``r' = R v`` at the Gauss points of the owned cells, (cells, points, 3), of ``local`` values."""
        out = np.empty(self._shape)
        self._lib.slopes(self._pointer, buffer(self._ffi, local), buffer(self._ffi, out))
        return out

    def least_stretch(self, local: np.ndarray) -> tuple[float, int, int]:
        """Least stretch ``v3``, an unknown, at equally spaced samples of all cells; its cell, and the sample there."""
        place = self._ffi.new("int[2]")
        value = self._lib.least(self._pointer, buffer(self._ffi, local), place)
        return value, place[0], place[1]
