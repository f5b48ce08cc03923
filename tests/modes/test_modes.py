"""Modes against closed forms, finite differences of the shape and of the energy; files, pictures, the command line."""

from dataclasses import replace

import classics
import numpy as np
import pytest
from closed_forms import column as beck_value
from petsc4py import PETSc
from scipy.spatial.transform import Rotation
from small_states import buckled, plain
from small_states import solver as solver_of

from rodfem import ConvergenceError, Discretization, Scene, Solver
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.first_equilibrium import first_equilibrium
from rodfem.modes.finder import ModeFinder, Motions
from rodfem.modes.modes import SYMMETRY, Modes

FINE = Discretization("reduced", 6, 6)
METHODS = ("shift-invert", "cayley", "slicing", "reduction")
"""That work on all ranks."""


def state(given: Scene, discretization: Discretization, load: float, steps: int = 1) -> tuple[BranchSolver, PETSc.Vec]:
    """Equilibrium that Newton's method finds from the scene's start, in ``steps`` of the load."""
    solver = Solver(given, discretization).equilibria
    x, outcome = first_equilibrium(solver, load / steps)
    for part in np.linspace(0, load, steps + 1)[2:]:
        x, outcome = solver.at_load(x, part)
    assert outcome.converged
    return solver, x


def modes_of(solver: BranchSolver, x: PETSc.Vec, number: int, method: str = "auto", error_bars: bool = False) -> Modes:
    return ModeFinder(solver, error_bars)(x, number, method)[1]


# --- closed forms ------------------------------------------------------------------------------------------------


@pytest.mark.short
def test_euler_column() -> None:
    """Clamped-free, EI = 1 and 2: rotation sqrt(2) sin w s, displacement its integral, mu = EI w^2 - P."""
    P, given = 10.0, classics.euler("clamped-free")
    modes = modes_of(*state(given, FINE, P), 3, error_bars=True)
    w = np.pi / 2 * np.array([1, 1, 3])
    EI = [1.0, 2.0, 1.0]
    torsion = np.pi**2 / 4
    expected = sorted([(e * x**2 - P, a, x) for e, x, a in zip(EI, w, (0, 1, 0), strict=True)] + [(torsion, 2, w[0])])
    assert modes.motion == ("bending about d1", "bending about d2", "torsion")
    for i, (mu, axis, wave) in enumerate(expected[:3]):
        assert modes.value[i] == pytest.approx(mu, rel=1e-9)
        assert abs(modes.value[i] - mu) < 2 * modes.error[i] < 1e-6
        rotation = np.zeros((len(modes.s), 3))
        rotation[:, axis] = 2**0.5 * np.sin(wave * modes.s)
        along = {0: (1, -1.0), 1: (0, 1.0), 2: (0, 0.0)}[axis]  # dr' = w x e3
        moved = np.zeros_like(rotation)
        moved[:, along[0]] = along[1] * 2**0.5 * (1 - np.cos(wave * modes.s)) / wave
        sign = np.sign(modes.rotation[i, :, axis].sum())
        np.testing.assert_allclose(sign * modes.rotation[i], rotation, atol=1e-6)
        np.testing.assert_allclose(sign * modes.displacement[i], moved, atol=1e-6)


def shape(mu: complex, P: float, s: np.ndarray, adjoint: bool) -> np.ndarray:
    """Mode of Beck's column (EI = mass = 1), or of its adjoint: w'' + P w = w''' + P w' = 0 at s = 1 (Reut's)."""
    root = np.sqrt(P * P / 4 + mu + 0j)
    a, b = np.sqrt(root - P / 2), np.sqrt(root + P / 2)

    def basis(x: np.ndarray, k: int) -> np.ndarray:
        shift = [np.cosh, np.sinh]
        bent = [np.cos(b * x), -np.sin(b * x), -np.cos(b * x), np.sin(b * x)][k]
        other = [np.sin(b * x), np.cos(b * x), -np.sin(b * x), -np.cos(b * x)][k]
        first = a**k * shift[k % 2](a * x) - b**k * bent
        return np.array([first, a**k * shift[1 - k % 2](a * x) / a - b**k * other / b])

    one = np.ones(1)
    row = basis(one, 2)[:, 0] + (P * basis(one, 0)[:, 0] if adjoint else 0.0)
    return np.tensordot([row[1], -row[0]], basis(s, 0), 1)


@pytest.mark.few(1)
@pytest.mark.versions
@pytest.mark.parametrize(
    ("P", "near"), [(10.0, 26.8), (10.0, 345.5), pytest.param(30.0, 50 + 150j, marks=pytest.mark.short)]
)
def test_beck_column(P: float, near: complex) -> None:
    """Right and left modes, before flutter and after: those of the column and of its adjoint."""
    solver, x = state(classics.beck(span=(1.0, 35.0)), Discretization("pointwise", 6, 6), P)
    modes = modes_of(solver, x, 3)
    mu = beck_value(near, P)
    (i,) = [i for i, v in enumerate(modes.value) if abs(v - mu) < 1e-6 * abs(mu)]
    assert modes.value[i] == pytest.approx(mu, rel=1e-9)
    for found, adjoint in ((modes.displacement[i], False), (modes.left_displacement[i], True)):
        exact = shape(mu, P, modes.s, adjoint)
        scaled = exact * (found[-1, 1] / exact[-1])
        np.testing.assert_allclose(found[:, 1], scaled, atol=1e-6 * abs(scaled).max())
        assert abs(found[:, [0, 2]]).max() < 1e-8 * abs(scaled).max()
    overlap = np.array([modes.amplitude(u, w) for u, w in zip(modes.displacement, modes.rotation, strict=True)])
    np.testing.assert_allclose(overlap, np.eye(3), atol=1e-8)


NEAR_FLUTTER: dict[float, tuple[complex, ...]] = {
    20.05094361897376: (121.49409035459695, 121.19106101892271),
    20.05095261897376: (121.39042983816877, 121.29460355207321),
    20.05095360897376: (121.34730152058704, 121.33771889149413),
    20.050954618973762: (121.34250358586762 + 0.04791314260919833j,),
}
"""Loads 1e-5 to 1e-8 beside Beck's, and omega^2: roots of his characteristic equation, by mpmath with 40 digits."""


@pytest.mark.few(1)
@pytest.mark.parametrize("elements", [4, 6])
@pytest.mark.parametrize("load", NEAR_FLUTTER)
def test_bars_where_frequencies_meet(load: float, elements: int) -> None:
    """Round-off, and the mesh's error, under a square root: 4e-8 where round-off of the values alone is 6e-10."""
    solver, x = state(classics.beck(span=(19.5, 20.5)), Discretization("auto", elements, 6), load)
    modes = ModeFinder(solver)(x, 3)[1]
    for exact in NEAR_FLUTTER[load]:
        i = np.argmin(abs(modes.value - exact))
        assert abs(modes.value[i] - exact) <= modes.error[i] < 1e-4 * abs(exact)


@pytest.mark.few(1)
@pytest.mark.parametrize(("elements", "degree"), [(3, 1), (2, 2), (2, 3), (2, 4)])
def test_bars_on_coarse_meshes_are_those_of_the_same_mode(elements: int, degree: int) -> None:
    """Beck's column: the third mode of a coarse mesh is nearer to a higher one of the next mesh than to the third."""
    solver, x = state(
        replace(classics.beck(span=(1.0, 35.0)), planar="e1"), Discretization("pointwise", elements, degree), 10.0
    )
    modes = ModeFinder(solver)(x, 3)[1]
    exact = [beck_value(near, 10.0).real for near in (26.8, 345.5, 3450.0)]
    assert (abs(modes.value - exact) <= modes.error).all()
    with pytest.raises(ConvergenceError, match=r"has \d+ modes?, not 40"):
        modes_of(solver, x, 40)


# --- finite differences ------------------------------------------------------------------------------------------


CASES = {
    "cord": lambda f: (solver_of("cord", f, 6, 3), buckled("cord", f, 6, 3, 40.0)[1]),
    "hemitropic": lambda f: (solver_of("hemitropic", f, 6, 3), buckled("hemitropic", f, 6, 3, 0.2)[1]),
    "ruler": lambda f: (solver_of("ruler", f, 6, 3), buckled("ruler", f, 6, 3, 6.0)[1]),
    "semi-tangential": lambda f: state(classics.semi_tangential(), Discretization(f, 4, 3), 2.0),
    "tip on plane": lambda f: state(classics.tip_on_plane(), Discretization(f, 4, 3), 2.0),
    "linear elements": lambda f: state(classics.lateral(), Discretization(f, 12, 1), 5.0, 5),
}


@pytest.mark.few(1)
@pytest.mark.parametrize("formulation", ["reduced", "pointwise"])
@pytest.mark.parametrize("name", [pytest.param(x, marks=pytest.mark.short) if x == "cord" else x for x in CASES])
def test_motion_is_the_derivative_of_the_shape(name: str, formulation: str) -> None:
    solver, x = CASES[name](formulation)
    motions = Motions(solver.system)
    d = solver.system.new_vector()
    begin, end = d.getOwnershipRange()
    d.array[:] = np.sin(1.3 * np.arange(begin, end))
    solver.system.set_load(d, 0.0)
    found, eps = motions.at(x, d), 1e-5
    ends = []
    for sign in (1, -1):
        y = x.copy()
        y.axpy(sign * eps, d)
        ends.append(motions.sample(y))
    np.testing.assert_allclose(found.r, (ends[0]["r"] - ends[1]["r"]) / (2 * eps), atol=1e-6)
    turn = [Rotation.from_quat(np.roll(e["q"], -1, axis=1)) for e in ends]
    np.testing.assert_allclose(found.w, (turn[0] * turn[1].inv()).as_rotvec() / (2 * eps), atol=1e-6)


# --- methods, symmetries, planes ---------------------------------------------------------------------------------


@pytest.mark.versions
@pytest.mark.parametrize("method", [*(pytest.param(m, marks=pytest.mark.short) for m in METHODS), "dense"])
def test_modes_do_not_depend_on_the_method(method: str) -> None:
    """Straight, with eigenvalues in pairs, whose modes are turned to a fixed basis; and buckled, with a symmetry."""
    for system, x in (plain("hemitropic", "reduced", 6, 3, 0.2), buckled("hemitropic", "reduced", 6, 3, 0.2)):
        solver = solver_of("hemitropic", "reduced", 6, 3)
        assert solver.system is system
        expected, found = modes_of(solver, x, 4), modes_of(solver, x, 4, method)
        assert found.motion == expected.motion
        np.testing.assert_allclose(found.displacement, expected.displacement, atol=1e-6)
        overlap = [found.amplitude(u, w) for u, w in zip(found.displacement, found.rotation, strict=True)]
        np.testing.assert_allclose(overlap, np.eye(len(found.value)), atol=1e-9)
    assert found.motion[-1] == SYMMETRY
    turned = found.displacement[-1] / np.cross([0, 0, 1], found.r)[len(found.s) // 2, :2].max()
    along = np.cross([0, 0, 1], found.r)
    factor = np.sum(turned * along) / np.sum(along * along)
    np.testing.assert_allclose(turned, factor * along, atol=1e-9)  # the whole rod turns about its axis


@pytest.mark.short
def test_ring() -> None:
    """A circle has four symmetry modes (rotations, turning of its sections) and no other eigenvalue near zero."""
    solver, x = state(classics.ring(), Discretization("reduced", 8, 6), 0.5)
    verdict, modes = ModeFinder(solver)(x, 3)
    assert (verdict.negative, verdict.zero, modes.motion.count(SYMMETRY)) == (0, 4, 4)
    assert modes.value[:3].min() > 0.1
    assert modes.error[:3].max() < 1e-6
    np.testing.assert_allclose(modes.displacement[:, 0], modes.displacement[:, -1], atol=1e-10)
    overlap = [modes.amplitude(u, w) for u, w in zip(modes.displacement, modes.rotation, strict=True)]
    np.testing.assert_allclose(overlap, np.eye(7), atol=1e-9)


def test_planar_rod_stays_in_its_plane() -> None:
    modes = modes_of(*state(classics.planar_column(), FINE, 6.0), 2)
    assert modes.value[0] == pytest.approx(np.pi**2 / 2 - 6.0, rel=1e-8)
    assert abs(modes.displacement[..., 1]).max() == abs(modes.rotation[..., [0, 2]]).max() == 0.0


# --- files ------------------------------------------------------------------------------------------
