"""The elimination along a chain against dense linear algebra, and against MUMPS on matrices of every scene."""

import subprocess
from pathlib import Path

import numpy as np
import pytest
from golden_cases import cases, distinct
from mpi4py import MPI
from petsc4py import PETSc
from random_chains import matrix_of, random_chain

import rodfem.linalg
from rodfem import ConvergenceError, Discretization, Solver
from rodfem.linalg.chain import Chain
from rodfem.linalg.factorization import Mumps

pytestmark = pytest.mark.skipif(MPI.COMM_WORLD.size > 1, reason="factors on one rank")
SHIFTS = (-3.0, -0.3, -1e-3, 1e-3, 0.3, 3.0)
"""Of the second variation, in units of the lowest bending eigenvalue."""
BACKWARD = 1e-14
"""Backward error of a solution."""


@pytest.mark.few(1)
@pytest.mark.parametrize("symmetric", [True, False])
def test_random_chains(symmetric: bool) -> None:
    rng, tried, delayed = np.random.default_rng(3), 0, 0
    while tried < 300:
        dense, coupled, border = random_chain(rng, symmetric=symmetric)
        if np.linalg.cond(dense) > 1e10:
            continue
        tried += 1
        factors = Chain("cholesky" if symmetric else "lu", border)
        factors(matrix_of(dense, coupled))
        right = rng.normal(size=(len(dense), int(rng.integers(1, 7))))
        found = factors.solve_all(right)
        size = abs(dense).sum(axis=1).max() * abs(found).max()
        assert factors.regular and abs(dense @ found - right).max() < 100 * BACKWARD * size
        growth, fronts = (of(factors.pointer) for of in (factors.lib.chain_growth, factors.lib.chain_fronts))
        assert growth <= 100.0 or fronts == 1
        delayed += factors.lib.chain_delayed(factors.pointer)
        if symmetric:
            assert factors.inertia() == ((np.linalg.eigvalsh(dense) < 0).sum(), 0)
    assert delayed > 100


def test_what_cannot_be_factored() -> None:
    """Exactly singular, no number; and a pattern is learnt anew for another matrix."""
    dense = np.array([[1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    factors = Chain("cholesky", 0)
    factors(matrix_of(dense, dense != 0))
    assert not factors.regular and factors.inertia()[1] == 1
    with pytest.raises(ConvergenceError, match="no numbers"):
        factors(matrix_of(np.diag([1.0, np.nan]), np.eye(2, dtype=bool)))
    factors(matrix_of(np.diag([1.0, -2.0]), np.eye(2, dtype=bool)))
    assert factors.regular and factors.inertia() == (1, 0)


class Both:
    """Factors along the rod and MUMPS's, of matrices with one pattern."""

    def __init__(self, kind: str, border: int) -> None:
        self.along, self.symmetric = Chain(kind, border), kind == "cholesky"
        self.other = Mumps(kind)

    def agree(self, matrix: PETSc.Mat) -> None:
        """Assert that both count the same, and that the chain's factors solve."""
        matrix.stateIncrease()
        self.along(matrix)
        self.other(matrix)
        if self.symmetric:
            assert self.along.inertia() == self.other.inertia()
        right, out = matrix.createVecs()
        right.array[:] = np.random.default_rng(0).normal(size=right.size)
        self.along.solve(right, out)
        assert (matrix * out - right).norm() < BACKWARD * matrix.norm(PETSc.NormType.INFINITY) * out.norm()


@pytest.mark.few(12)
@pytest.mark.parametrize("name", distinct())
def test_matrices_of_every_scene(name: str) -> None:
    """Second variations at bent states, with shifts on both sides of zero, and bordered Jacobians."""
    scene = cases()[name]()
    found = Solver(scene, Discretization("auto", 8, 6), MPI.COMM_SELF).equilibria
    system, border = found.system, found.system.fields.dense_rows
    symmetric, general = Both("cholesky", border), Both("lu", border)
    for place, bent in ((0.1, 0.0), (0.37, 0.3), (0.8, 0.7)):
        x = found.start(scene.span[0] + place * (scene.span[1] - scene.span[0]), bent)
        system.set_phase(x)
        row = system.metric * x
        row.axpy(1.0, system.load_axis())
        general.agree(system.at(x).jacobian(row))
        if not scene.conservative:
            continue
        matrix, shift = found.inertia.at(x).matrix, 0.0
        for wanted in SHIFTS:
            sigma = wanted * system.stiffness_scale
            matrix.axpy(shift - sigma, found.inertia.metric, PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN)
            shift = sigma
            symmetric.agree(matrix)


@pytest.mark.long
def test_clean_under_the_sanitizers(tmp_path: Path) -> None:
    here, source, program = Path(__file__).parent, Path(rodfem.linalg.__file__).parent, tmp_path / "driver"
    flags = "-g -O1 -Wall -Wextra -Werror -Wno-unused-function -fsanitize=address,undefined -fno-sanitize-recover"
    build = ["gcc", *flags.split(), f"-I{source}", str(here / "chain_driver.c"), "-o", str(program), "-lm"]
    built = subprocess.run(build, capture_output=True, text=True)
    assert built.returncode == 0, built.stderr
    done = subprocess.run([str(program)], capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, "0 wrong\n"), done.stdout + done.stderr
