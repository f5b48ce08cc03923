"""Slopes of the centreline and the least stretch of a state by compiled code (``shape.c``).

Each row of a branch asks for both; by arrays they cost as much as a factorisation.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from forms.kinematics import UNDEFORMED
from rodfem import compat
from rodfem.linalg.compiled import module

if TYPE_CHECKING:
    from rodfem.fem.fields import Fields

DECLARATIONS = """
typedef struct {
    int cells, points, nodes, strain_nodes, normal, strains; const int *component; const double *held;
    const int *rotation, *strain; const double *basis, *strain_basis; int samples; const double *sample_basis;
} Shape;
void slopes(const Shape *shape, const double *u, double *out);
double least(const Shape *shape, const double *u, int *place);
"""


class CompiledShape:
    """The compiled code for the owned cells of one mesh."""

    def __init__(self, fields: Fields, points: np.ndarray) -> None:
        """Hand over the degrees of freedom of the ``fields`` and the Gauss ``points`` in [0, 1]."""
        code = module("shape", DECLARATIONS, Path(__file__).parent)
        self._lib, self._ffi = code.lib, code.ffi
        self._kept: list[Any] = []
        scene, k, owned = fields.scene, fields.discretization.degree, slice(0, fields.owned_cells)
        self._shape = (fields.owned_cells, len(points), 3)
        self.spacing = 0.5 / k
        """Distance of the samples in a cell, [-1, 1]."""
        shape = self._pointer = self._ffi.new("Shape *")
        shape.cells, shape.points, shape.nodes, shape.strain_nodes = fields.owned_cells, len(points), k + 1, k
        shape.normal = -1 if scene.normal is None else scene.normal
        shape.strains, shape.samples = len(scene.free_strains), 4 * k + 1
        shape.component = self._array("int[]", np.array(scene.free_strains, dtype=np.int32))
        held = [0.0 if i in scene.free_strains else x for i, x in enumerate(UNDEFORMED)]
        shape.held = self._array("double[]", np.array(held))
        shape.rotation = self._array("int[]", fields.dofs[fields.turning.name][owned].astype(np.int32))
        strains = fields.dofs["v"][owned].astype(np.int32) if "v" in fields.dofs else np.zeros(0, np.int32)
        shape.strain = self._array("int[]", strains)
        shape.basis = self._array("double[]", compat.lagrange_basis(k, points))
        shape.strain_basis = self._array("double[]", compat.lagrange_basis(k - 1, points))
        samples = compat.lagrange_basis(k - 1, np.linspace(0, 1, shape.samples))
        shape.sample_basis = self._array("double[]", samples)

    def _array(self, kind: str, values: np.ndarray) -> Any:
        self._kept.append(self._ffi.from_buffer(kind, np.ascontiguousarray(values)))
        return self._kept[-1]

    def slopes(self, local: np.ndarray) -> np.ndarray:
        """``r' = R v`` at the Gauss points of the owned cells, (cells, points, 3), of ``local`` values."""
        out = np.empty(self._shape)
        buffer = self._ffi.from_buffer
        self._lib.slopes(self._pointer, buffer("double[]", local), buffer("double[]", out))
        return out

    def least_stretch(self, local: np.ndarray) -> tuple[float, int, int]:
        """Least stretch ``v3``, an unknown, at equally spaced samples of all cells; its cell, and the sample there."""
        place = self._ffi.new("int[2]")
        value = self._lib.least(self._pointer, self._ffi.from_buffer("double[]", local), place)
        return value, place[0], place[1]
