"""Random matrices whose graph is a chain of cells with a border, dense."""

import numpy as np
import scipy.sparse as sp
from petsc4py import PETSc


def chain_of_cells(
    rng: np.random.Generator, cells: int, vertex: int, inner: int, border: int, *, symmetric: bool, zeros: float = 0.4
) -> tuple[np.ndarray, np.ndarray]:
    """Matrix of cells that share vertices, with zero blocks as of multipliers, and its pattern; the border is last."""
    fields = cells * (vertex + inner) + vertex
    n = fields + border
    dense, coupled = np.zeros((n, n)), np.zeros((n, n), dtype=bool)
    for first in np.arange(cells) * (vertex + inner):
        cell = np.arange(first, first + 2 * vertex + inner)
        block = rng.normal(size=(len(cell), len(cell)))
        zero = rng.random(len(cell)) < zeros
        block[np.ix_(zero, zero)] = 0.0
        dense[np.ix_(cell, cell)] += block + block.T if symmetric else block
        coupled[np.ix_(cell, cell)] = True
    across = rng.normal(size=(2, border, fields))
    dense[fields:, :fields], dense[:fields, fields:] = across[0], across[0 if symmetric else 1].T
    coupled[fields:], coupled[:, fields:] = True, True
    return dense, coupled


def random_chain(rng: np.random.Generator, *, symmetric: bool) -> tuple[np.ndarray, np.ndarray, int]:
    """Such a matrix of random sizes, its unknowns in random order; its pattern, and the size of its border."""
    cells, vertex, inner, border = rng.integers((1, 1, 0, 0), (9, 6, 9, 5))
    dense, coupled = chain_of_cells(rng, cells, vertex, inner, border, symmetric=symmetric)
    fields = len(dense) - border
    order = np.append(rng.permutation(fields), np.arange(fields, len(dense)))
    return dense[np.ix_(order, order)], coupled[np.ix_(order, order)], int(border)


def petsc(dense: np.ndarray, coupled: np.ndarray, comm: PETSc.Comm = PETSc.COMM_SELF) -> PETSc.Mat:
    """Matrix with a given pattern, its rows in equal shares on the ranks."""
    ranks, rank = comm.getSize(), comm.getRank()
    begin, end = np.linspace(0, len(dense), ranks + 1).astype(int)[rank : rank + 2]
    pattern = sp.csr_matrix(coupled[begin:end])
    pattern.sort_indices()
    size = (end - begin, len(dense))
    values = dense[begin:end][pattern.nonzero()]
    return PETSc.Mat().createAIJ((size, size), csr=(pattern.indptr, pattern.indices, values), comm=comm)
