"""A light rod with a heavy tip under a follower load: infinite eigenvalues of its pencil lie among the finite ones.

Of a rod without mass the tip moves as the mass on a spring, with ``mu = P^(3/2) / (sin a - a cos a)``, ``a = P^(1/2)``,
for a mass of one: it is positive up to ``tan a = a``, P = 20.190728556, and passes there through infinity.  No load is
critical: the statics of a cantilever under a follower load is regular at every load (Beck 1952).
"""

from __future__ import annotations

from math import cos, hypot, pi, sin, sqrt

import numpy as np
import pytest
from mpi4py import MPI

from rodfem import Attachment, Discretization, Inertia, Ordinate, Parameter, Plan, Scene, Solver, clamped, free, trace
from rodfem.continuation.kinds import END
from rodfem.forms.energy import bending_and_twist
from rodfem.stability.nonsymmetric import NonsymmetricSolver, orthonormal
from rodfem.stability.spectrum import SHIFT

pytestmark = pytest.mark.alone
POLE = 20.190728556


def light(mass: float, span: tuple[float, float]) -> Scene:
    return Scene(
        name="light", interval=(0.0, 1.0), rod="unshearable and inextensible", planar="e1",
        energy=lambda v, k, c: bending_and_twist(k, (1.0, 3.0, 1.0)),
        parameters={"P": Parameter(0.0), "rho": Parameter(mass)}, load="P", span=span,
        ends=(clamped(), free(follower=lambda c: (0.0, 0.0, -c.P))),
        inertia=Inertia(rho_A=lambda c: c.rho, rho_I=lambda c: (0.0, 0.0, 0.0)),
        attachments=(Attachment(1.0, mass=lambda c: 1.0),),
        ordinate=Ordinate("deflection of the tip", s=1.0, of=lambda r, q: hypot(r[0], r[1])),
    )  # fmt: skip


def slowest(P: float) -> float:
    a = sqrt(P)
    return P * a / (sin(a) - a * cos(a))


@pytest.mark.long
@pytest.mark.parametrize(
    ("mass", "elements", "span"),
    [(1e-6, 12, (4.0, 6.0)), (1e-6, 6, (0.0, 0.05)), (1e-8, 6, (5.0, 5.1)), (1e-5, 20, (4.0, 6.0))],
)
def test_infinite_eigenvalues_make_no_rod_unstable(mass: float, elements: int, span: tuple[float, float]) -> None:
    """They came as complex pairs of 1e12, whose parts were taken for round-off of negative ones."""
    diagram = trace(light(mass, span), Discretization(elements=elements), Plan(depth=0, error_bars=False))
    (branch,) = diagram
    assert [special.kind for special in branch.special] == [END]
    assert {point.negative for point in branch.points} == {0}
    assert not branch.unexplained
    if span[0] > 0:
        found = min((real for real, _ in branch.points[0].omega2), key=abs)
        assert found == pytest.approx(slowest(span[0]), rel=10 * mass + 1e-7)


@pytest.mark.long
def test_a_sign_that_changes_through_infinity_is_no_divergence() -> None:
    diagram = trace(light(0.0, (0.0, 30.0)), Discretization(elements=6), Plan(depth=0, error_bars=False))
    (branch,) = diagram
    assert [special.kind for special in branch.special] == [END]
    assert all(point.negative == (point.load > POLE) for point in branch.points)
    (said,) = [w for w in diagram.warnings if "through infinity" in w]
    assert float(said.split("P = ")[1].split()[0]) == pytest.approx(POLE, abs=1e-5)


@pytest.mark.parametrize(("elements", "number", "target"), [(40, 10, SHIFT), (6, 8, 1e4)])
def test_each_finite_eigenvalue_once(elements: int, number: int, target: float) -> None:
    """Beside the tip, which hardly moves, those of a rod clamped and hinged: about ``((j + 1/4) pi)^4 / rho``.

    The thrust is small.  Of ten one is doubtful by its round-off; beside eight there is an infinite one among them.
    """
    solver = Solver(light(1e-4, (0.0, 30.0)), Discretization(elements=elements))
    pencil = NonsymmetricSolver(solver.equilibria.system).at(solver.equilibrium(1.0).x)
    lowest, *others = np.sort_complex(pencil.near(number, target).values)
    assert lowest == pytest.approx(slowest(1.0), rel=1e-3)
    waves = [((j + 0.25) * pi) ** 4 / 1e-4 for j in range(1, number)]
    np.testing.assert_allclose(others[: number - 1], waves, rtol=0.06)


def test_near_the_pole_no_other_is_finite() -> None:
    """A rod without mass has one finite eigenvalue, whichever number is asked for."""
    load = 20.19074
    solver = Solver(light(0.0, (0.0, 30.0)), Discretization(elements=6))
    pencil = NonsymmetricSolver(solver.equilibria.system).at(solver.equilibrium(load).x)
    for number in (1, 3, 6, 12):
        for target in (SHIFT, 1e4):
            (found,) = pencil.near(number, target).values
            assert found == pytest.approx(slowest(load), rel=0.02)


def test_what_has_no_mass_is_no_part_of_a_basis() -> None:
    vectors = np.eye(4, 2, dtype=complex)
    assert not orthonormal(MPI.COMM_WORLD, vectors, 0.0 * vectors).any()
    assert np.allclose(abs(orthonormal(MPI.COMM_WORLD, vectors, 4.0 * vectors)[:2]), np.eye(2) / 2)
