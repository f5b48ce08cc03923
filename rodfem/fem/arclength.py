"""Derivative of the nodal values of all fields on a mesh in arclength, over its natural size, as sparse matrices."""

from __future__ import annotations

from functools import cache, cached_property
from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse as sp

from rodfem import compat

if TYPE_CHECKING:
    from rodfem.fem.fields import Fields
    from rodfem.problem.contribution import Block


class Arclength:
    """Derivatives of states on the cells of one :class:`~rodfem.fem.fields.Fields`; each made when it is asked for."""

    def __init__(self, fields: Fields) -> None:
        """Keep the fields."""
        self._fields = fields

    @cached_property
    def derivative(self) -> sp.csr_matrix:
        """Matrix (local size, local size) of the derivative at nodes, the mean of the cells that share one.

        Zero for scalars and at clamped degrees of freedom.
        """
        fields, size = self._fields, len(self._fields.number)
        mean = sp.csr_matrix((size, size))
        for block in fields.blocks:
            (columns, values), dofs = _slopes(fields, block), fields.dofs[block.name].ravel()
            rows = np.arange(len(dofs) + 1) * columns.shape[1]
            slopes = sp.csr_matrix((values.ravel(), columns.ravel(), rows), shape=(len(dofs), size))
            sums = sp.csr_matrix((np.ones(len(dofs)), (dofs, np.arange(len(dofs)))), shape=(size, len(dofs)))
            shared = np.maximum(np.asarray(sums.sum(axis=1)).ravel(), 1.0)
            mean += sp.diags(1.0 / shared) @ sums @ slopes
        return sp.diags(np.where(fields.number < 0, 0.0, 1.0)) @ mean.tocsr()

    @cached_property
    def jumps(self) -> sp.csr_matrix:
        """Matrix (shared nodes, local size) of its jumps between cells, of rotation and centreline."""
        fields = self._fields
        columns, values = [], []
        for block in (b for b in fields.blocks if b.name in (fields.turning.name, "r")):
            slopes, dofs = _slopes(fields, block), fields.dofs[block.name].ravel()
            order = np.argsort(dofs, kind="stable")
            twins = np.flatnonzero(np.diff(dofs[order]) == 0)
            sides = order[twins + 1], order[twins]
            columns.append(np.hstack([slopes[0][side] for side in sides]))
            values.append(np.hstack([sign * slopes[1][side] for sign, side in zip((1, -1), sides, strict=True)]))
        rows = sum(len(c) for c in columns)
        starts = np.cumsum([0, *(c.shape[1] for c in columns for _ in range(len(c)))])
        entries = (np.concatenate([x.ravel() for x in parts]) for parts in (values, columns))
        return sp.csr_matrix((*entries, starts), shape=(rows, len(fields.number)))


def _slopes(fields: Fields, block: Block) -> tuple[np.ndarray, np.ndarray]:
    """Derivative of a field at the nodes of each cell, in the order of the flattened ``fields.dofs``.

    Columns and values of as many rows, (dofs, nodes) each.
    """
    dofs, ends = fields.dofs[block.name], fields.vertices
    cells, nodes, components = dofs.shape
    sizes = (ends[:, 1] - ends[:, 0]) / fields.scene.units.length
    weights = differentiation(block.degree) / sizes[:, None, None]
    shape = (cells, nodes, components, nodes)
    columns = np.broadcast_to(dofs.transpose(0, 2, 1)[:, None], shape)
    values = np.broadcast_to(weights[:, :, None, :], shape)
    return columns.reshape(-1, nodes), values.reshape(-1, nodes)


@cache
def differentiation(degree: int) -> np.ndarray:
    """Matrix of the derivative of the polynomial through values at the nodes of an element, at the nodes: (m, m)."""
    nodes = compat.nodes(degree)
    powers = np.vander(2 * nodes - 1, increasing=True)
    slopes = np.zeros_like(powers)
    slopes[:, 1:] = 2 * powers[:, :-1] * np.arange(1, len(nodes))
    return np.asarray(slopes @ np.linalg.inv(powers))
