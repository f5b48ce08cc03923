"""Blocks, kernels and the reduced eigenproblem against their sizes, dense linear algebra and reference values."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import demo_cases
import numpy as np
import pytest
import scipy.linalg
import scipy.sparse as sp
from petsc4py import PETSc
from small_states import buckled, plain, scene

from rodfem.diagram.solver import Solver
from rodfem.errors import ConvergenceError, InputError
from rodfem.fem.fields import Discretization
from rodfem.fem.system import System
from rodfem.kumar_healey.coordinates import Coordinates, MappedPencil
from rodfem.kumar_healey.null_space import kernel
from rodfem.kumar_healey.reduction import INVERSES, ReducedPencil, cayley_shift
from rodfem.problem.scene import Inertia
from rodfem.stability.inertia import Inertia as Index

pytestmark = pytest.mark.alone

SMALL = (6, 3)
STATES = [
    ("cord", 20.0, False),
    ("cord", 40.0, True),
    ("hemitropic", 0.2, False),
    ("hemitropic", 0.2, True),
    ("ruler", 2.0, False),
    ("ruler", 6.0, True),
    ("follower", 10.0, False),
    ("follower", 40.0, False),  # past flutter: a complex pair
]
FORMULATIONS = ["reduced", "pointwise"]
CASES = [
    pytest.param(name, formulation, load, bent, coordinates, id=f"{name}-{formulation}-{load}-{bent}-{coordinates}")
    for name, load, bent in STATES
    for formulation in FORMULATIONS
    for coordinates in ("full", "tangent", "compatible")
    if formulation == "pointwise" or (name != "follower" and coordinates != "compatible")
]
REFERENCE = np.array([-341.416740999, 467.908344864, 735.029226438])


@cache
def pencil(name: str, formulation: str, load: float, bent: bool, coordinates: str = "tangent") -> MappedPencil:
    system, x = (buckled if bent else plain)(name, formulation, *SMALL, load)
    return Coordinates(system, coordinates).assemble(x)


def null_space_values(p: MappedPencil, target: float, number: int) -> np.ndarray:
    """Finite eigenvalues nearest to ``target`` by dense linear algebra only: an SVD of C, and QZ.

    QZ is applied to ``(M, K - target M)`` on the kernel: its values ``1/(mu - target)`` are most precise near there.
    """
    K, C, M = (a.toarray() for a in (p.K, p.C, p.M))
    Z = scipy.linalg.null_space(C.T) if C.shape[1] else np.eye(len(K))
    assert Z.shape[1] == C.shape[0] - C.shape[1]
    a, b = scipy.linalg.eig(Z.T @ M @ Z, Z.T @ (K - target * M) @ Z, right=False, homogeneous_eigvals=True)
    inverse = a / b
    nearest = inverse[np.argsort(-abs(inverse))][:number]
    values = target + 1 / nearest
    return values[np.lexsort((np.round(values.imag, 6), np.round(values.real, 6)))]


def below(p: MappedPencil) -> float:
    """A shift below the spectrum of all these states."""
    return -10.0 if p.symmetric else 1.0


# --- blocks ----------------------------------------------------------------------------------------------------


def sizes(name: str, formulation: str, coordinates: str, elements: int, degree: int) -> tuple[int, int]:
    solver = Solver(scene(name), Discretization(formulation, elements, degree)).equilibria
    found = Coordinates(solver.system, coordinates).assemble(solver.start(0.1))
    assert found.K.shape == found.M.shape == (found.C.shape[0],) * 2
    assert sum(len(found.where[n]) for n in ("theta", "q", "v", "r") if n in found.where) == found.K.shape[0]
    return found.C.shape


@pytest.mark.long
@pytest.mark.parametrize("n", [5])
def test_sizes_for_linear_elements_are_those_of_the_paper(n: int) -> None:
    assert sizes("cord", "pointwise", "tangent", n, 1) == (6 * n - 5, 3 * n)
    assert sizes("cord", "reduced", "tangent", n, 1) == (3 * (n - 1), 2)
    assert sizes("hemitropic", "pointwise", "compatible", n, 1) == (6 * (n - 1), 2 * n)
    assert sizes("hemitropic", "reduced", "tangent", n, 1) == (4 * n - 3, 3)
    assert sizes("ruler", "reduced", "tangent", n, 1) == (4 * n, 0)
    assert sizes("follower", "pointwise", "tangent", n, 1) == (6 * n, 3 * n)


@pytest.mark.long
@pytest.mark.parametrize("degree", [2])
@pytest.mark.parametrize(
    ("name", "ends", "free", "held"), [("cord", 2, 0, 5), ("hemitropic", 2, 1, 6), ("ruler", 1, 1, 3)]
)
def test_sizes_for_any_degree(name: str, ends: int, free: int, held: int, degree: int) -> None:
    nodes, cells = 4 * degree + 1, 4 * degree
    turning, centreline = nodes - ends, 3 * nodes - held
    forces = {"cord": 2, "hemitropic": 3, "ruler": 0}[name]
    for formulation, coordinates, rows, columns in (
        ("pointwise", "full", 4 * turning + free * cells + centreline, turning + 3 * cells),
        ("reduced", "full", 4 * turning + free * cells, turning + forces),
        ("pointwise", "tangent", 3 * turning + free * cells + centreline, 3 * cells),
        ("reduced", "tangent", 3 * turning + free * cells, forces),
        ("pointwise", "compatible", 3 * turning + centreline, (3 - free) * cells),
    ):
        assert sizes(name, formulation, coordinates, 4, degree) == (rows, columns)


@pytest.mark.few(1)
@pytest.mark.parametrize(("name", "load", "bent"), STATES)
def test_symmetry(name: str, load: float, bent: bool) -> None:
    p = pencil(name, "pointwise", load, bent)
    K, M = p.K, p.M
    assert abs(M - M.T).max() < 1e-14 * abs(M).max()
    asymmetry = abs(K - K.T).max() / abs(K).max()
    assert p.symmetric == (name != "follower")
    assert asymmetry < 1e-14 if p.symmetric else asymmetry > 1e-3


@pytest.mark.short
def test_blocks_have_names() -> None:
    p = pencil("hemitropic", "pointwise", 0.2, True)
    n, k = SMALL

    def block(matrix: sp.csr_matrix, row: str, column: str) -> sp.csr_matrix:
        return matrix[p.where[row]][:, p.where[column]]

    assert block(p.K, "theta", "theta").shape == (3 * (n * k - 1),) * 2
    assert block(p.C, "v", "n").shape == (n * k, 3 * n * k)
    assert abs(block(p.K, "r", "r")).max() == 0  # stiffness comes to the centreline through the constraints alone
    assert abs(block(p.C, "r", "n")).max() > 0


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_spins_fulfil_the_norm_conditions(formulation: str) -> None:
    full, tangent = (pencil("cord", formulation, 40.0, True, c) for c in ("full", "tangent"))
    C, T = full.C, tangent.T
    K = T.T @ full.K @ T - tangent.K
    assert abs(K).max() < 1e-12 * abs(full.K).max()
    everywhere = PETSc.COMM_WORLD.tompi4py().allgather(full.where["eta"])
    assert abs((T.T @ C)[:, np.concatenate(everywhere)]).max() < 1e-15


def test_impossible_coordinates() -> None:
    system = System(scene("cord"), Discretization("reduced", 4, 1))
    with pytest.raises(InputError, match="choose one of full, tangent, compatible"):
        Coordinates(system, "polar")
    with pytest.raises(InputError, match=r"use Discretization\(formulation='pointwise'\)"):
        Coordinates(system, "compatible")


# --- kernels ---------------------------------------------------------------------------------------------------


@pytest.mark.few(18)
@pytest.mark.parametrize(("name", "formulation", "load", "bent", "coordinates"), CASES)
def test_kernel_is_orthonormal(name: str, formulation: str, load: float, bent: bool, coordinates: str) -> None:
    p = pencil(name, formulation, load, bent, coordinates)
    C = p.C
    found = kernel(C, p.place)
    assert (found.size, found.dimension) == (C.shape[0], C.shape[0] - C.shape[1])
    Z = found.expand(np.eye(found.dimension))
    np.testing.assert_allclose(Z.T @ Z, np.eye(found.dimension), atol=1e-13)
    np.testing.assert_allclose(C.T @ Z, 0, atol=1e-13)
    np.testing.assert_allclose(found.project(np.eye(found.size)), Z.T, atol=1e-13)
    np.testing.assert_allclose(found.expand(np.ones(found.dimension)), Z.sum(axis=1), atol=1e-12)


@pytest.mark.parametrize("groups", [1, 2, 3, 8, 13])
def test_kernel_of_random_chains(groups: int) -> None:
    """Groups and links of any widths, rows without entries, and dense columns on top."""
    rng = np.random.default_rng(groups)
    widths = rng.integers(1, 4, groups)
    starts = np.append(0, np.cumsum(widths))
    rows = []
    for link in range(groups + 1):
        for _ in range(rng.integers(4, 9)):
            row = np.zeros(starts[-1] + 2)
            a, b = starts[max(link - 1, 0)], starts[min(link + 1, groups)]
            row[a:b] = rng.normal(size=b - a)
            row[-2:] = rng.normal(size=2)
            rows.append(row)
    rows += [np.zeros(starts[-1] + 2)] * 3
    C = np.array(rows)[rng.permutation(len(rows))]
    columns = rng.permutation(C.shape[1])
    place = np.append(np.repeat(np.linspace(-2, 5, groups), widths), [np.nan, np.nan])
    found = kernel(sp.csr_matrix(C[:, columns]), place[columns])
    Z = found.expand(np.eye(found.dimension))
    assert Z.shape == (C.shape[0], C.shape[0] - C.shape[1])
    np.testing.assert_allclose(Z.T @ Z, np.eye(found.dimension), atol=1e-13)
    np.testing.assert_allclose(C.T @ Z, 0, atol=1e-12)


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_dependent_constraints_are_an_error(formulation: str) -> None:
    p = pencil("hemitropic", formulation, 0.2, True)
    C = p.C.tolil()
    C[:, 1] = C[:, 0] - 2 * C[:, 2]
    with pytest.raises(InputError, match=r"depend on one another.*remove"):
        kernel(C.tocsr(), p.place)


def test_more_constraints_than_unknowns() -> None:
    for place in (np.full(5, np.nan), np.zeros(5)):
        with pytest.raises(InputError, match="5 constraints on 4 unknowns"):
            kernel(sp.csr_matrix(np.ones((4, 5))), place)


def test_rows_that_reach_too_far() -> None:
    with pytest.raises(InputError, match="more than two neighbouring groups"):
        kernel(sp.csr_matrix(np.ones((6, 3))), np.arange(3.0))


def test_work_is_linear() -> None:
    """Factors of twice as long a rod take twice the memory: that is what a product reads."""
    kernels, sizes = [], []
    for elements in (64, 128):
        solver = Solver(scene("cord"), Discretization("pointwise", elements, 2)).equilibria
        p = Coordinates(solver.system).assemble(solver.start(60.0))
        kernels.append(kernel(p.C, p.place))
        sizes.append(sum(rows.nbytes + Q.nbytes for rows, Q in kernels[-1].steps))
    assert 1.9 < sizes[1] / sizes[0] < 2.1
    assert sizes[1] < kernels[1].size ** 2  # a dense Q would take eight times that


# --- eigenvalues -----------------------------------------------------------------------------------------------


@pytest.mark.few(6)
@pytest.mark.parametrize(("name", "formulation", "load", "bent", "coordinates"), CASES)
def test_eigenvalues_are_those_of_dense_matrices(
    name: str, formulation: str, load: float, bent: bool, coordinates: str
) -> None:
    p = pencil(name, formulation, load, bent, coordinates)
    target, number = below(p), 4
    expected = null_space_values(p, target, number)
    reduction = ReducedPencil(p)
    modes = reduction.near(number, target)
    scale = abs(expected).max()
    np.testing.assert_allclose(modes.values, expected, rtol=1e-9, atol=1e-11 * scale)
    assert modes.errors.max() < 1e-12
    assert np.iscomplexobj(modes.values) == (not p.symmetric)
    np.testing.assert_allclose(p.C.T @ modes.vectors, 0, atol=1e-12 * abs(modes.vectors).max())


@pytest.mark.parametrize(("name", "load", "bent"), [s for s in STATES if s[0] != "follower"])
def test_elimination_is_the_same_inverse(name: str, load: float, bent: bool) -> None:
    p = pencil(name, "reduced", load, bent)
    one, other = (ReducedPencil(p, inverse).near(4, below(p)) for inverse in INVERSES)
    np.testing.assert_allclose(one.values, other.values, rtol=1e-9, atol=1e-10 * abs(one.values).max())


def test_all_eigenvalues_of_a_small_rod() -> None:
    """Strains have no mass: 9 of the 12 unknowns of the kernel move, the others are infinite eigenvalues."""
    solver = Solver(scene("hemitropic"), Discretization("reduced", 4, 1)).equilibria
    system = solver.system
    p = Coordinates(system).assemble(solver.at_load(solver.start(0.1), 0.1)[0])
    reduction = ReducedPencil(p)
    n = reduction.kernel.dimension
    rank = np.linalg.matrix_rank(reduction.kernel.project(reduction.M @ reduction.kernel.expand(np.eye(n))))
    assert rank < n
    found = reduction.near(rank, -1.0)
    np.testing.assert_allclose(found.values, null_space_values(p, -1.0, rank), rtol=1e-9)
    with pytest.raises(ConvergenceError, match="ask for fewer"):
        reduction.near(n, -1.0)


def test_elimination_fails_where_the_centreline_has_no_mass() -> None:
    p = pencil("cord", "pointwise", 20.0, False)
    with pytest.raises(ConvergenceError, match="use the inverse 'saddle'"):
        ReducedPencil(p, "elimination").near(3, -10.0)


def test_negative_eigenvalues_are_those_of_the_index() -> None:
    for name, load, bent in STATES[:4]:
        system, x = (buckled if bent else plain)(name, "pointwise", *SMALL, load)
        system.set_phase(x)
        index = Index(system).at(x).count()
        values = ReducedPencil(Coordinates(system).assemble(x)).near(5, -10.0).values
        assert (values < -1e-6).sum() == index.negative
        assert (abs(values) < 1e-6).sum() == index.zero == (1 if name == "hemitropic" and bent else 0)


@cache
def reference_pencil(coordinates: str) -> MappedPencil:
    inertia = Inertia(rho_A=lambda c: 1.0, rho_I=lambda c: (1e-3, 1e-3, 2e-3))
    solver = Solver(replace(demo_cases.scene("cord"), inertia=inertia), Discretization("pointwise", 9, 6)).equilibria
    x, outcome = solver.at_load(solver.start(20.0), 20.0)
    assert outcome.converged
    return Coordinates(solver.system, coordinates).assemble(x)


@pytest.mark.few(1)
@pytest.mark.versions
@pytest.mark.short
@pytest.mark.parametrize("inverse", INVERSES)
@pytest.mark.parametrize("coordinates", ["full", "tangent"])
def test_reference_values(coordinates: str, inverse: str) -> None:
    if (coordinates, inverse) == ("full", "elimination"):
        with pytest.raises(
            ConvergenceError, match="use the inverse 'saddle'"
        ):  # q at rest has no stiffness along itself
            ReducedPencil(reference_pencil(coordinates), inverse).near(3, -400.0)
        return
    reduction = ReducedPencil(reference_pencil(coordinates), inverse)
    np.testing.assert_allclose(reduction.near(3, -400.0).values, REFERENCE, rtol=1e-9)
    shift = cayley_shift(np.array([-300.0, 500.0]))
    np.testing.assert_allclose(reduction.near(3, shift).values, REFERENCE, rtol=1e-9)


def test_parameters_of_the_cayley_transform() -> None:
    a1 = cayley_shift(np.array([-3.0, -3.0 + 1e-9, 5.0, 7.0]))
    a2 = 2 * 5.0 - a1
    for mu, transformed in ((-3.0, 3.0), (5.0, -1.0)):
        assert (mu - a2) / (mu - a1) == pytest.approx(transformed)
    beyond = np.geomspace(5.01, 1e9, 50)
    assert abs((beyond - a2) / (beyond - a1)).max() < 1


def test_impossible_requests() -> None:
    p = pencil("cord", "reduced", 20.0, False)
    with pytest.raises(InputError, match="choose one of saddle, elimination"):
        ReducedPencil(p, "magic")
    reduction = ReducedPencil(p)
    with pytest.raises(InputError, match="ask for at most 49"):
        reduction.near(50, -1.0)
