"""Chains cut into open pieces, all in one process and on the ranks, against dense linear algebra."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp
from golden_cases import VARIED, cases
from mpi4py import MPI
from petsc4py import PETSc
from random_chains import chain_of_cells, petsc, random_chain

from rodfem import Discretization
from rodfem.diagram.solver import Solver
from rodfem.errors import ConvergenceError
from rodfem.linalg.chain import Elimination, sequence
from rodfem.linalg.factorization import Mumps
from rodfem.linalg.matrices import gathered, petsc_matrix
from rodfem.linalg.pieces import Pieces, added, dense_elimination

KINDS = pytest.mark.parametrize("kind", ["cholesky", "lu"])
BACKWARD = 1e-12
"""Backward error of a solution."""
alone = pytest.mark.skipif(MPI.COMM_WORLD.size > 1, reason="pieces in one process")


class Cut:
    """Factors of a dense matrix by the elimination of ``parts``, its inner unknowns, which the rest separates."""

    def __init__(self, kind: str, dense: np.ndarray, coupled: np.ndarray, parts: list[np.ndarray]) -> None:
        interface = np.setdiff1d(np.arange(len(dense)), np.concatenate(parts))
        self.kind, self.inner = kind, [len(part) for part in parts]
        self.unknowns, self.pieces, borders = [], [], []
        for r, part in enumerate(parts):
            border = np.flatnonzero(coupled[np.ix_(part, interface)].any(axis=0)) if r else np.arange(len(interface))
            unknowns = np.append(part, interface[border])
            pattern, inner = coupled[np.ix_(unknowns, unknowns)].copy(), len(part)
            pattern[inner:, inner:] &= r == 0  # entries of the interface belong to the first piece
            if kind == "cholesky":
                pattern[inner:, :inner] = False
            table = sp.csr_matrix(pattern)
            order = sequence(table.indptr, table.indices, np.arange(inner, len(unknowns)))
            piece = Elimination(kind, table.indptr, table.indices, order, is_open=True)
            piece.factor(dense[np.ix_(unknowns, unknowns)][table.nonzero()])
            self.unknowns.append(unknowns)
            self.pieces.append(piece)
            borders.append(border)
        left = [piece.schur() for piece in self.pieces]
        self.delayed = sum(len(part) - len(border) for part, border in zip(left, borders, strict=True))
        joint, self.places = added(left, borders, len(interface), symmetric=kind == "cholesky")
        self.joint = dense_elimination(kind, len(joint))
        self.joint.factor(joint.ravel())
        every = [*self.pieces, self.joint]
        self.negative = sum(each.inertia()[0] for each in every)
        self.determinant = sum(each.determinant() for each in every)

    def solve(self, right: np.ndarray) -> np.ndarray:
        """Solutions; the first piece has the right-hand sides of the interface."""
        joint = np.zeros((self.joint.rows, right.shape[1]))
        for r, (piece, unknowns, place) in enumerate(zip(self.pieces, self.unknowns, self.places, strict=True)):
            local = right[unknowns]
            if r:
                local[self.inner[r] :] = 0.0
            joint[place] += piece.forward(local)
        solved, out = self.joint.solve(joint), np.empty_like(right)
        for piece, unknowns, place in zip(self.pieces, self.unknowns, self.places, strict=True):
            out[unknowns] = piece.back(solved[place])
        return out

    def agrees(self, dense: np.ndarray, columns: int = 3) -> None:
        """Assert that inertia, determinant and solutions are those of the whole matrix."""
        right = np.random.default_rng(0).normal(size=(len(dense), columns))
        found = self.solve(right)
        size = abs(dense).sum(axis=1).max() * abs(found).max()
        assert abs(dense @ found - right).max() < BACKWARD * size
        assert self.determinant == pytest.approx(np.linalg.slogdet(dense)[1], abs=1e-5)
        if self.kind == "cholesky":
            assert (self.negative, self.joint.inertia()[1]) == ((np.linalg.eigvalsh(dense) < 0).sum(), 0)


def parts_of(cells: int, vertex: int, inner: int, pieces: int, rng: np.random.Generator) -> list[np.ndarray]:
    """Unknowns of the pieces between vertices at random places along a chain of cells."""
    cuts = np.sort(rng.choice(np.arange(1, cells), pieces - 1, replace=False)) * (vertex + inner)
    begin, end = np.append(0, cuts + vertex), np.append(cuts, cells * (vertex + inner) + vertex)
    return [np.arange(*ends) for ends in zip(begin, end, strict=True)]


@pytest.mark.few(3)
@pytest.mark.alone
@alone
@KINDS
@pytest.mark.parametrize("pieces", range(1, 9))
def test_random_pieces(kind: str, pieces: int) -> None:
    """In chains with many zero blocks pieces have pivots that their inner unknowns alone do not offer."""
    rng, tried, delayed = np.random.default_rng(pieces), 0, 0
    while tried < 40:
        cells, vertex, inner, border = rng.integers((pieces, 1, 0, 0), (pieces + 5, 6, 9, 5))
        zeros = rng.choice([0.0, 0.4, 0.7])
        dense, coupled = chain_of_cells(rng, cells, vertex, inner, border, symmetric=kind == "cholesky", zeros=zeros)
        if np.linalg.cond(dense) > 1e8:
            continue
        tried += 1
        cut = Cut(kind, dense, coupled, parts_of(cells, vertex, inner, pieces, rng))
        cut.agrees(dense, 1 + tried % 6)
        delayed += cut.delayed
    assert delayed > 5


@pytest.mark.alone
@alone
@KINDS
@pytest.mark.parametrize("pieces", range(2, 9))
def test_each_piece_is_singular(kind: str, pieces: int) -> None:
    """Five masses between walls vibrate at 1, so do all pieces of a chain whose ends are free to move otherwise."""
    n = 6 * pieces - 1 + 2
    dense = np.diag(np.ones(n)) - np.diag(np.ones(n - 1), 1) - np.diag(np.ones(n - 1), -1)
    dense[-2:, -2:] += 0.7 * np.eye(2)
    parts = [np.arange(6 * r, 6 * r + 5) for r in range(pieces)]
    for part in parts:
        assert np.linalg.matrix_rank(dense[np.ix_(part, part)]) == 4
    cut = Cut(kind, dense, dense != 0, parts)
    assert cut.delayed == pieces
    cut.agrees(dense)


@pytest.mark.alone
@alone
@KINDS
def test_a_piece_without_any_pivot(kind: str) -> None:
    """All of its inner unknowns are multipliers: all are delayed."""
    rng = np.random.default_rng(4)
    dense, coupled = chain_of_cells(rng, 3, 4, 3, 2, symmetric=kind == "cholesky", zeros=0.0)
    parts = [np.arange(7), np.arange(11, 14), np.arange(18, 25)]
    dense[np.ix_(parts[1], parts[1])] = 0.0
    cut = Cut(kind, dense, coupled, parts)
    assert cut.delayed == 3
    cut.agrees(dense)


@pytest.mark.alone
@alone
def test_the_elimination_runs_towards_the_cut() -> None:
    """A piece at the end of a rod has its cut in its last front alone, whichever end it is."""
    rng = np.random.default_rng(5)
    dense, coupled = chain_of_cells(rng, 20, 3, 2, 0, symmetric=True, zeros=0.0)
    middle = 10 * 5 + np.arange(3)
    cut = Cut("cholesky", dense, coupled, [np.arange(middle[0]), np.arange(middle[-1] + 1, len(dense))])
    assert [piece.largest for piece in cut.pieces] == [8, 8]


def distributed(right: np.ndarray, matrix: PETSc.Mat) -> PETSc.Vec:
    """Vector of given entries on all ranks."""
    out = matrix.createVecRight()
    out.array[:] = right[slice(*matrix.getOwnershipRange())]
    return out


@pytest.mark.few(1)
@pytest.mark.versions
@pytest.mark.short
@KINDS
def test_random_chains_on_ranks(kind: str) -> None:
    """Unknowns in any order, and ranks that have none: all of them may be on the interface."""
    rng, tried = np.random.default_rng(3), 0
    while tried < 60:
        dense, coupled, border = random_chain(rng, symmetric=kind == "cholesky")
        right = rng.normal(size=len(dense))
        if np.linalg.cond(dense) > 1e8:
            continue
        tried += 1
        factors, matrix = Pieces(kind, border), petsc(dense, coupled, PETSc.COMM_WORLD)
        given, out = distributed(right, matrix), matrix.createVecRight()
        for _ in range(2):
            factors(matrix)
            factors.solve(given, out)
            assert factors.regular
            assert (matrix * out - given).norm() < BACKWARD * abs(dense).sum(axis=1).max() * out.norm()
            assert factors.determinant() == pytest.approx(np.linalg.slogdet(dense)[1], abs=1e-5)
            if kind == "cholesky":
                assert factors.inertia() == ((np.linalg.eigvalsh(dense) < 0).sum(), 0)
            dense = 2.0 * dense
            matrix.scale(2.0)


@pytest.mark.versions
@pytest.mark.short
def test_all_ranks_hear_of_trouble() -> None:
    """An entry of one rank that is no number; a matrix that is exactly singular."""
    n = 12
    dense = 2.0 * np.eye(n) - np.diag(np.ones(n - 1), 1) - np.diag(np.ones(n - 1), -1)
    coupled = dense != 0
    factors = Pieces("cholesky", 0)
    dense[0, 0] = np.nan
    with pytest.raises(ConvergenceError, match="no numbers"):
        factors(petsc(dense, coupled, PETSc.COMM_WORLD))
    dense[0] = dense[:, 0] = 0.0
    factors(petsc(dense, coupled, PETSc.COMM_WORLD))
    assert not factors.regular and factors.inertia() == (0, 1) and factors.determinant() == -np.inf


@pytest.mark.skipif(MPI.COMM_WORLD.size == 1, reason="nothing is cut on one rank")
@pytest.mark.parametrize("name", VARIED)
def test_pieces_of_every_scene(name: str) -> None:
    """Rings, joints, planar rods, integral constraints: wherever the ranks cut them."""
    scene = cases()[name]()
    found = Solver(scene, Discretization("auto", 8, 6)).equilibria
    system = found.system
    x = found.start(scene.span[0] + 0.37 * (scene.span[1] - scene.span[0]), 0.3)
    system.set_phase(x)
    row = system.metric * x
    row.axpy(1.0, system.load_axis())
    solves(Pieces("lu", system.fields.dense_rows), system.at(x).jacobian(row))
    if not scene.conservative:
        return
    factors = Pieces("cholesky", system.fields.dense_rows)
    matrix, shift = found.inertia.at(x).matrix, 0.0
    for wanted in (-3.0, -1e-3, 0.3):
        sigma = wanted * system.stiffness_scale
        matrix.axpy(shift - sigma, found.inertia.metric, PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN)
        matrix.stateIncrease()
        shift = sigma
        solves(factors, matrix)
        alone = Mumps("cholesky", {24: 1, 8: 0}, {3: -1e-300, 1: 1e-3})  # dense eigenvalues are lost in round-off here
        alone(petsc_matrix(MPI.COMM_SELF, gathered(matrix)))
        assert factors.inertia() == alone.inertia()


def solves(factors: Pieces, matrix: PETSc.Mat) -> None:
    """Assert that factors of a matrix solve."""
    factors(matrix)
    assert factors.regular
    right, out = matrix.createVecs()
    right.array[:] = np.random.default_rng(0).normal(size=right.size)[slice(*matrix.getOwnershipRange())]
    factors.solve(right, out)
    assert (matrix * out - right).norm() < 1e-14 * matrix.norm(PETSc.NormType.INFINITY) * out.norm()
