"""Random matrices whose graph is a chain of cells with a border, dense."""

import numpy as np
import scipy.sparse as sp
from mpi4py import MPI
from petsc4py import PETSc

from rodfem.linalg.matrices import shared, shared_matrix


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


def matrix_of(dense: np.ndarray, coupled: np.ndarray) -> PETSc.Mat:
    """Matrix of compiled code with a given pattern."""
    pattern = sp.csr_matrix(coupled)
    pattern.sort_indices()
    matrix = shared_matrix(MPI.COMM_SELF, pattern)
    own = shared(matrix)
    assert own is not None
    own.values[:] = dense[pattern.nonzero()]
    return matrix
