"""A diagram does not depend on the units in which its scene is stated."""

from dataclasses import replace

import classics
import demo_cases
import hemitropic_cases
import numpy as np
import pytest
from golden_cases import cases, trace
from rescaled import DNA, STEEL, differences, rescaled

import rodfem
from rodfem import Discretization, Inertia, Ordinate, Plan, Scene, clamped, free
from rodfem.forms.energy import bending_and_twist
from rodfem.linalg.matrices import gathered
from rodfem.stability.nonsymmetric import NonsymmetricSolver


@pytest.mark.ranks
@pytest.mark.long
@pytest.mark.parametrize("units", [(1.0, 1e-35), (1e4, 1e-21)])
def test_index_where_the_stiffness_is_lost_beside_the_constraints(units: tuple[float, float]) -> None:
    """A rod of natural curvature, held straight between clamps that slide, buckles at 4 pi^2 B/L^2, as one without.

    Its stiffness is 1e-25 and less of the constraints that are next to it in the matrix, on every row of which these
    are the largest entries.
    """
    length, stiffness = units
    force = stiffness / length**2
    rod = classics.column(
        "held straight", classics.SUPPORTS["clamped-clamped"], (0.0, 60 * force), interval=(0.0, length),
        energy=lambda v, k, c: bending_and_twist(
            (k[0] - 0.3 / length, k[1], k[2]), tuple(stiffness * x for x in (1, 2, 0.8))
        ),
        ordinate=Ordinate("middle", s=length / 2, of=lambda r, q: r[0]),
    )  # fmt: skip
    solver = rodfem.Solver(rod, Discretization("pointwise", elements=8, degree=6))
    for beside in (1e-2, 1e-3, 1e-4, 1e-5):
        loads = (4 * np.pi**2 * (1 + sign * beside) * force for sign in (-1, 1))
        assert [solver.equilibrium(load).negative for load in loads] == [0, 1]


def pushed(length: float, stiffness: float, mass: float) -> Scene:
    """Rod under a follower load."""
    return classics.column(
        "pushed", (clamped(), free(follower=classics.push)), (0.0, 24 * stiffness / length**2), interval=(0.0, length),
        energy=lambda v, k, c: bending_and_twist(k, (c.EI, 1.3 * c.EI, 0.8 * c.EI)), constants={"EI": stiffness},
        inertia=Inertia(rho_A=lambda c: mass, rho_I=lambda c: (0.0, 0.0, 0.0)),
        ordinate=Ordinate("tip", s=length, of=lambda r, q: r[0]),
    )  # fmt: skip


@pytest.mark.few(1)
@pytest.mark.parametrize(("length", "force"), [(1e-9, 1e-12), (1e4, 1e9)])
@pytest.mark.parametrize("elements", [2, 8])
def test_frequencies_of_a_cantilever(length: float, force: float, elements: int) -> None:
    """By dense matrices on a coarse mesh: where the load was a number about one a molecule had no inertia there.

    It had no asymmetry on any mesh.  In each of two planes the thrust is coupled to the rotation and the place of the
    tip.
    """
    scene = rescaled(pushed(1.0, 1.0, 1.0), length, force)
    solver = rodfem.Solver(scene, Discretization("pointwise", elements, 4))
    pencil = NonsymmetricSolver(solver.equilibria.system).at(solver.equilibrium(1e-3).x)
    omega2 = pencil.near_zero(4).values.real[:2] * length**2 / force
    np.testing.assert_allclose(omega2, 1.875104068711961**4 * np.array([1.0, 1.3]), rtol=1e-3)
    matrix = gathered(pencil.matrix).toarray() * np.outer(*[solver.equilibria.system.sizes.array_r] * 2)
    assert np.linalg.matrix_rank(matrix - matrix.T, tol=1e-12 * np.linalg.norm(matrix)) == 4


@pytest.mark.ranks
@pytest.mark.few(1)
@pytest.mark.parametrize(("name", "units"), [("cord", (1e-8, 1e12)), ("cord", (7.0, 1e6)), ("hemitropic", (1e-3, 1e6))])
def test_mumps_counts_in_any_units(name: str, units: tuple[float, float]) -> None:
    """Off natural units its pivots do not tell a singular state from others: branch points are missed."""
    scene, buckling = {
        "cord": (demo_cases.scene("cord"), [49.34802200545, 8.063525384098]),
        "hemitropic": (replace(hemitropic_cases.scene(), span=(0.0, 0.3)), [0.11430421452]),
    }[name]
    plan = Plan(depth=0, error_bars=False)
    diagram = rodfem.trace(rescaled(scene, *units), Discretization("pointwise", 7, 5, factors="petsc"), plan)
    assert [s.point.load for s in diagram.special("branch point")] == pytest.approx(buckling, rel=1e-7)
    assert not diagram.warnings


MOLECULE = [
    *("demo hemitropic", "demo ruler", "demo follower", "classic haringx", "classic heavy", "classic greenhill"),
    *("classic semi-tangential", "classic pressed ring", "docs on_a_plane", "docs pflueger"),
]
BAR = ["classic haringx", "classic bow", "classic Beck"]


@pytest.mark.few(1)
@pytest.mark.parametrize(
    ("name", "units"),
    [
        *((name, DNA) for name in MOLECULE),
        *((name, STEEL) for name in BAR),
        ("classic pressed arch", (*STEEL[:2], 1e13)),
    ],
)
def test_recorded_scenes(name: str, units: tuple[float, ...]) -> None:
    """Ends, loads and constraints of all kinds in metres and newtons of a molecule: the diagrams that are recorded.

    What mixes units takes a fold for a branch point, loses symmetries, and finds others that are none.  A bar of steel
    has loads of 1e7; an arch a unit of 1e-13, in which the load is as small as equations that do not feel it.
    """
    assert not differences(name, *units)


def test_a_fold_feels_a_load_of_any_unit() -> None:
    """In a unit of 1e-13 the derivative in the load is as small as that of equations that do not feel it."""
    arch = cases()["classic pressed arch"]()
    units = (1.0, 1.0, 1e-13), (1.0, 1.0, 1e13), (1.0, 1.0, 1.0), (5.0, 7.0, 3.0)
    folds = [trace(rescaled(arch, *unit), error_bars=False).special("fold")[0] for unit in units]
    assert [fold.coupling for fold in folds[1:]] == pytest.approx([folds[0].coupling] * 3, rel=1e-6)
    assert folds[0].coupling > 1e-3
