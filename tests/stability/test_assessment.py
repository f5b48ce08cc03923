"""One verdict from all methods, the paper's among them; nasty pencils; the band of the count; the constraints' rank."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import classics
import demo_cases
import numpy as np
import pytest
import scipy.linalg
import scipy.sparse as sp
from mpi4py import MPI
from petsc4py import PETSc
from small_states import buckled, plain, scene

from rodfem import ConvergenceError, Discretization, Inertia, InputError, Plan, SceneError, Solver
from rodfem.continuation.first_equilibrium import first_equilibrium
from rodfem.kumar_healey.coordinates import Coordinates, MappedPencil
from rodfem.kumar_healey.null_space import kernel
from rodfem.kumar_healey.reduction import ReducedPencil, cayley_shift
from rodfem.stability import METHODS, find
from rodfem.stability.assessment import Assessor, Method
from rodfem.stability.dependence import smallest_singular, weakest
from rodfem.stability.pencil import Pencil

SMALL = (6, 3)
SOLVERS = [name for name in METHODS if name != "count"]
SPARSE = [name for name in SOLVERS if name != "dense"]
STATES = [
    ("cord", 20.0, False),
    ("cord", 40.0, True),
    ("hemitropic", 0.2, False),
    ("hemitropic", 0.2, True),
    ("ruler", 2.0, False),
    ("ruler", 6.0, True),
]
WITHOUT_POTENTIAL = [("follower", 10.0, False), ("follower", 40.0, False)]
"""Before and past flutter: the latter has a complex pair."""
REFERENCE = [-341.416740999, 467.908344864, 735.029226438]
SERIAL = pytest.mark.skipif(MPI.COMM_WORLD.size > 1, reason="long on several ranks")


@cache
def at(name: str, formulation: str, load: float, bent: bool) -> tuple[Assessor, PETSc.Vec]:
    system, x = (buckled if bent else plain)(name, formulation, *SMALL, load)
    return Assessor(system), x


@pytest.mark.few(1)
@pytest.mark.parametrize("formulation", ["reduced", "pointwise"])
@pytest.mark.parametrize(("name", "load", "bent"), STATES)
def test_methods_agree(name: str, load: float, bent: bool, formulation: str) -> None:
    assessor, x = at(name, formulation, load, bent)
    expected = assessor(x, "dense", 4)
    scale = abs(expected.values).max()
    for method in SPARSE:
        for _ in range(2):  # the second time from the modes of the first
            found = assessor(x, method, 4)
            np.testing.assert_allclose(found.values, expected.values, rtol=1e-9, atol=2e-11 * scale, err_msg=method)
            assert found.certified, method
            assert found.errors.max() < 1e-10
            assert (found.negative, found.zero) == (expected.negative, expected.zero)
            assert len(found.vectors) == 4
            assert found.method == method
            assert found.factorisations >= 2
    negative = int((expected.values < -1e-7 * scale).sum())
    assert expected.negative == negative < 4
    assert expected.zero == (1 if name == "hemitropic" and bent else 0)
    assert assessor(x, "count").negative == negative


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "formulation"), [("tip_on_plane", "reduced"), ("no_mean_deflection", "pointwise"), ("ring", "reduced")]
)
def test_methods_agree_with_other_ends_and_constraints(name: str, formulation: str) -> None:
    """Moving ends are rows, their moments and multipliers of constraints columns of C; eigenvalues come in pairs."""
    given = getattr(classics, name)()
    solver = Solver(given, Discretization(formulation, 4, 3)).equilibria
    assessor, (x, _) = Assessor(solver), first_equilibrium(solver, 0.9 * given.span[0] + 0.1 * given.span[1])
    for method in SPARSE:
        found = assessor(x, method, 3)
        np.testing.assert_allclose(found.values, assessor(x, "dense", 3).values, rtol=1e-9, err_msg=method)
        assert found.certified, method


def test_names() -> None:
    """Ten nodes that turn have 30 eigenvalues at most; docs/running.md says what each method does."""
    page = (Path(__file__).parents[2] / "docs" / "running.md").read_text()
    assert all(issubclass(find(name), Method) and f"`{name}`" in page for name in METHODS)
    held = classics.clamped(), classics.free(lambda c: (0.0, 0.0, -c.P))
    solver = Solver(classics.column("ten nodes", held, (0.0, 1.0)), Discretization("reduced", 3, 3))
    for ask in (solver.modes, solver.assess):
        with pytest.raises(InputError, match="no more than 30 eigenvalues, not 1000000: give number=30 or less"):
            ask(solver.equilibria.system.new_vector(), number=10**6)
    assessor, x = at("cord", "reduced", 20.0, False)
    with pytest.raises(
        InputError,
        match=r"Unknown method 'magic': choose one of auto, cayley, count, dense, reduction, shift-invert, slicing\.",
    ):
        assessor(x, "magic")
    with pytest.raises(InputError, match="ask for none or more"):
        assessor(x, "auto", -1)
    system, y = plain("follower", "pointwise", *SMALL, 10.0)
    for method in ("count", "cayley", "slicing"):
        with pytest.raises(InputError, match=r"symmetric pencil.*: choose one of dense, reduction, shift-invert\."):
            Assessor(system)(y, method)
    with pytest.raises(InputError, match="Unknown method 'magic'"):
        Plan(at=(10.0,), method="magic")
    assert assessor(x, number=0).method == "count"
    assert assessor(x, number=2).method == "shift-invert"
    assert assessor(x, number=30).method == "dense"
    assert Assessor(system)(y).reason.startswith("the load has no potential")
    assert "none missing" in str(assessor(x, number=2))


@cache
def reference() -> tuple[Assessor, PETSc.Vec]:
    inertia = Inertia(rho_A=lambda c: 1.0, rho_I=lambda c: (1e-3, 1e-3, 2e-3))
    solver = Solver(replace(demo_cases.scene("cord"), inertia=inertia), Discretization("pointwise", 9, 6)).equilibria
    solver.system.set_phase(None)
    x, outcome = solver.at_load(solver.start(20.0), 20.0)
    assert outcome.converged
    return Assessor(solver.system), x


@pytest.mark.few(1)
@pytest.mark.versions
@pytest.mark.short
@pytest.mark.parametrize("method", SOLVERS)
def test_reference_values(method: str) -> None:
    assessor, x = reference()
    np.testing.assert_allclose(assessor(x, method, 3).values, REFERENCE, rtol=1e-9)


# --- nasty -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", SOLVERS)
def test_shift_on_an_eigenvalue(method: str) -> None:
    """The first shift may be one, where the count below it is up to round-off (a column on a foundation)."""
    assessor, x = at("cord", "reduced", 20.0, False)
    expected = assessor(x, "dense", 4).values
    for i in range(3):
        assessor.symmetric.shift = expected[i]
        found = assessor(x, method, 4)
        np.testing.assert_allclose(found.values, expected, rtol=1e-9)
        assert found.certified


@pytest.mark.few(1)
@pytest.mark.parametrize("apart", [0.0, 1e-10, 1e-6])
@pytest.mark.parametrize("method", SOLVERS)
def test_triple_cluster(method: str, apart: float) -> None:
    """A cantilever bends about d1 and d2 and twists with equal stiffness, mu = (pi/2)^2 thrice; a thrust parts them."""
    given = classics.euler("clamped-free").varying("P", (0.0, 1.0), B2=1.0)
    solver = Solver(given, Discretization("reduced", *SMALL)).equilibria
    x, _ = solver.at_load(solver.start(apart), apart)
    assessor = Assessor(solver.system)
    for number in (2, 3, 4):
        found = assessor(x, method, number)
        expected = np.pi**2 / 4 - np.array([apart, apart, 0.0])
        np.testing.assert_allclose(found.values[:3], expected[:number], rtol=1e-6)
        assert np.diff(found.values[:3]).max() < apart + 1e-9
        assert found.values[3:].sum() == pytest.approx((number > 3) * 9 * np.pi**2 / 4, rel=1e-3)
        assert found.certified
        assert (found.negative, found.zero) == (0, 0)
    gram = np.array([[u.dot(assessor.symmetric.mass * v) for u in found.vectors[:3]] for v in found.vectors[:3]])
    assert np.linalg.eigvalsh(gram / np.sqrt(np.outer(np.diag(gram), np.diag(gram)))).min() > 0.1  # three directions


@pytest.mark.parametrize(("mass", "rotary"), [(1.0, 0.0), (0.0, 1.0), (1.0, 0.1)])
def test_fields_without_mass(mass: float, rotary: float) -> None:
    """Eigenvalues of a pinned column by each method: ``(w^4 - P w^2) / (mass + rotary w^2)`` with ``w = n pi``."""
    inertia = Inertia(rho_A=lambda c: mass, rho_I=lambda c: (rotary, 0.0, 0.0))
    given = classics.column("massless", classics.SUPPORTS["pinned-pinned"], (0.0, 8.0), planar="e1", inertia=inertia)
    solver = Solver(given, Discretization("pointwise", 6, 6)).equilibria
    x, _ = solver.at_load(solver.start(5.0), 5.0)
    w2 = (np.arange(1, 4) * np.pi) ** 2
    for method in SOLVERS:
        found = Assessor(solver.system)(x, method, 3)
        np.testing.assert_allclose(found.values, w2 * (w2 - 5.0) / (mass + rotary * w2), rtol=1e-8, err_msg=method)
        assert found.certified, method


@SERIAL
def test_ten_thousand_elements() -> None:
    """The straight cord is unstable below ``k0^2 - w^2`` = 49.348022 with ``tan(w/2) = w/2``."""
    solver = Solver(scene("cord"), Discretization("reduced", 10_000, 1)).equilibria
    solver.system.set_phase(None)
    for load, negative in ((49.3479, 1), (49.3481, 0)):
        x, _ = solver.at_load(solver.start(load), load)
        assert Assessor(solver.system)(x, "count").negative == negative


@pytest.mark.few(1)
@pytest.mark.parametrize("method", SOLVERS)
def test_an_unstable_direction_without_mass(method: str) -> None:
    """Its eigenvalue is minus infinity."""
    inertia = Inertia(rho_I=lambda c: (0.0, 1.0, 0.0))
    solver = Solver(replace(scene("cord"), inertia=inertia), Discretization("reduced", *SMALL)).equilibria
    x, _ = first_equilibrium(solver, 20.0)
    with pytest.raises(ConvergenceError, match="no lower end"):
        Assessor(solver.system)(x, method, 2)
    assert Assessor(solver.system)(x, "count").negative == 1


@pytest.mark.few(1)
@pytest.mark.parametrize("method", SOLVERS)
def test_no_mass_at_all(method: str) -> None:
    """One sentence: infinite eigenvalues are none."""
    inertia = Inertia(rho_I=lambda c: (0.0, 0.0, 0.0))
    solver = Solver(replace(scene("cord"), inertia=inertia), Discretization("reduced", *SMALL)).equilibria
    x, _ = first_equilibrium(solver, 60.0)
    with pytest.raises(SceneError, match="give it a mass or a rotary inertia"):
        Assessor(solver.system)(x, method, 2)
    assert Assessor(solver.system)(x, "count").stable


# --- rank of the constraints -------------------------------------------------------------------------------------


@pytest.mark.versions
@pytest.mark.short
@pytest.mark.parametrize("formulation", ["reduced", "pointwise"])
def test_smallest_singular_value(formulation: str) -> None:
    system, x = buckled("hemitropic", formulation, *SMALL, 0.2)
    for coordinates in ("full", "tangent"):
        pencil = Coordinates(system, coordinates).assemble(x)
        C = pencil.C.toarray()
        assert smallest_singular(pencil.C)[0] == pytest.approx(np.linalg.svd(C, compute_uv=False)[-1], rel=1e-9)


def test_smallest_singular_value_of_many_constraints() -> None:
    """Of more than 300 it is found by inverse iteration."""
    system = Solver(scene("cord"), Discretization("pointwise", 110, 1)).equilibria
    C = Coordinates(system.system).assemble(system.start(20.0)).C
    assert smallest_singular(C)[0] == pytest.approx(np.linalg.svd(C.toarray(), compute_uv=False)[-1], rel=1e-9)


def test_round_off_is_no_independence() -> None:
    """Two constraints on one unknown differ by round-off of another one; in a tiny rod by what is none."""
    unit, where = sp.identity(3, format="csr"), {"q": np.array([0, 1]), "r": np.array([2])}

    def least(C: list[list[float]], length: float) -> float:
        pencil = Pencil(unit, sp.csr_matrix(np.array(C)), unit, where, np.zeros(2))
        return weakest(pencil, np.zeros(0, dtype=int), length)[0]

    assert least([[1.0, 1.0], [0.0, 1e-16], [0.0, 0.0]], 1.0) < 1e-15
    # a rotation and a position, in a rod of the length 1e-13
    assert least([[1.0, -1.0], [0.0, 0.0], [1e13, 1e13]], 1e-13) == pytest.approx(1.0)


# --- the method of Kumar and Healey (2010) ---------------------------------------------------------------------


CASES = [
    pytest.param(name, formulation, load, bent, coordinates, id=f"{name}-{formulation}-{load}-{bent}-{coordinates}")
    for name, load, bent in (*STATES, *WITHOUT_POTENTIAL)
    for formulation in ("reduced", "pointwise")
    for coordinates in ("full", "tangent", "compatible")
    if formulation == "pointwise" or (name != "follower" and coordinates != "compatible")
]


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
def test_sizes_for_linear_elements_are_those_of_the_paper(n: int = 5) -> None:
    assert sizes("cord", "pointwise", "tangent", n, 1) == (6 * n - 5, 3 * n)
    assert sizes("cord", "reduced", "tangent", n, 1) == (3 * (n - 1), 2)
    assert sizes("hemitropic", "pointwise", "compatible", n, 1) == (6 * (n - 1), 2 * n)
    assert sizes("hemitropic", "reduced", "tangent", n, 1) == (4 * n - 3, 3)
    assert sizes("ruler", "reduced", "tangent", n, 1) == (4 * n, 0)
    assert sizes("follower", "pointwise", "tangent", n, 1) == (6 * n, 3 * n)


# --- kernels ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("formulation", ["reduced", "pointwise"])
def test_dependent_constraints_are_an_error(formulation: str) -> None:
    p = pencil("hemitropic", formulation, 0.2, True)
    C = p.C.tolil()
    C[:, 1] = C[:, 0] - 2 * C[:, 2]
    with pytest.raises(InputError, match=r"depend on one another.*remove"):
        kernel(C.tocsr(), p.place)


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
    modes = reduction.nearest(number, target)
    scale = abs(expected).max()
    np.testing.assert_allclose(modes.values, expected, rtol=1e-9, atol=1e-11 * scale)
    assert modes.errors.max() < 1e-12
    assert np.iscomplexobj(modes.values) == (not p.symmetric)
    np.testing.assert_allclose(p.C.T @ modes.vectors, 0, atol=1e-12 * abs(modes.vectors).max())


@pytest.mark.versions
@pytest.mark.short
@pytest.mark.parametrize("coordinates", ["full", "tangent"])
def test_elimination_by_the_paper_s_formula(coordinates: str) -> None:
    """In full coordinates a quaternion at rest has no stiffness along itself."""
    assessor, x = reference()
    reduction = ReducedPencil(Coordinates(assessor.system, coordinates).assemble(x), "elimination")
    if coordinates == "full":
        with pytest.raises(ConvergenceError, match="use the inverse 'saddle'"):
            reduction.nearest(3, -400.0)
        return
    for shift in (-400.0, cayley_shift(np.array([-300.0, 500.0]))):
        np.testing.assert_allclose(reduction.nearest(3, shift).values, REFERENCE, rtol=1e-9)


@pytest.mark.few(1)
@pytest.mark.parametrize("method", ["auto", "dense", "shift-invert", "slicing", "cayley"])
def test_there_are_no_more_than_the_nodes_that_turn(method: str) -> None:
    """Between clamps 2 elements of degree 2 have 3 nodes that turn, by 3 angles each: 9.

    That the end stays on the axis is two conditions, which leaves 7; the bound of a mesh is 15.
    """
    solver = Solver(
        classics.column("few", classics.SUPPORTS["clamped-clamped"], (0.0, 4.0)), Discretization("pointwise", 2, 2)
    )
    point = solver.equilibrium(1.0)
    assert np.isfinite(solver.modes(point, 7).value).all()
    for number in (8, 12, 15):
        with pytest.raises(InputError, match=f"The rod has 7 eigenvalues on this mesh, not {number}: give number=7"):
            solver.modes(point, number, method)
