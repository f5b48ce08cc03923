"""All frequencies of the mesh, at every load: against QZ on the full pencil, and where the first ones do not tell."""

from collections.abc import Callable
from dataclasses import replace

import classics
import numpy as np
import pytest
from golden_cases import NOT_CONSERVATIVE, cases
from literature.test_free_rods import thrust
from scipy.linalg import eigvals

from rodfem import ConvergenceError, Discretization, Inertia, Parameter, Plan, Scene, Solver, clamped, free, trace
from rodfem.continuation.first_equilibrium import first_equilibrium
from rodfem.diagram.equilibria import at_load
from rodfem.forms.energy import bending_and_twist
from rodfem.linalg.matrices import gathered
from rodfem.stability.nonsymmetric import NonsymmetricSolver

BECK = 20.0509536189738
SCENES: dict[str, Callable[[], Scene]] = {
    "turned": lambda: replace(
        classics.beck(),
        ends=(clamped(rotation=(0.7, 0.1, -0.5, 0.5)), free(follower=classics.push)),
        inertia=Inertia(rho_A=lambda c: 1.0, rho_I=lambda c: (1.0, 1.0, 1e-4)),
    ),
    **{name: cases()[name] for name in NOT_CONSERVATIVE},
    "torque": lambda: replace(classics.torque("follower_moment"), span=(0.0, 9.0)),
    "floating": lambda: thrust((0.0, 130.0)),
}


def dense(pencil: object, number: int) -> np.ndarray:
    """The ``number`` eigenvalues of the full pencil nearest to -10 by QZ, whose infinite ones are far."""
    S, M = (gathered(a).toarray() for a in (pencil.matrix, pencil.mass))  # type: ignore[attr-defined]
    nu = eigvals(M, S + 10.0 * M)
    return -10.0 + 1.0 / nu[np.argsort(-abs(nu))[:number]]


@pytest.mark.few(3)
@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("part", [0.3, 0.9])
def test_against_qz(name: str, part: float) -> None:
    """Twenty frequencies, by what they are from the shift: 1e-9 of the greatest inverse."""
    scene = SCENES[name]()
    solver = Solver(scene, Discretization("pointwise", 3, 5)).equilibria
    low, high = scene.span
    x = at_load(solver, first_equilibrium(solver, low)[0], low + part * (high - low))
    pencil = NonsymmetricSolver(solver.system).at(x)
    found, exact = pencil.spectrum.values[:20], dense(pencil, 20)
    for one, other in ((found, exact), (exact, found)):
        nu, all_others = 1.0 / (one[:18] + 10.0), 1.0 / (other + 10.0)
        assert abs(nu[:, None] - all_others).min(axis=1).max() < 1e-9 * abs(nu).max()


def test_two_beyond_the_fortieth_meet_first() -> None:
    """Soft in torsion, with dozens of motions below the first that bends: no pair nearer to zero ever meets."""
    inertia = Inertia(rho_A=lambda c: 1.0, rho_I=lambda c: (0.0, 0.0, 1.0))
    column = replace(
        classics.beck(span=(19.0, 21.0)),
        parameters={**classics.beck().parameters, "C": Parameter(1e-3)},
        energy=lambda v, k, c: bending_and_twist(k, (1.0, 10.0, c.C)), inertia=inertia,
    )  # fmt: skip
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("rodfem.diagram.sweep.LOADS", 5)
        diagram = trace(column, Discretization("pointwise", 8, 6), Plan(error_bars=False))
    (flutter,) = diagram.special("flutter")
    assert flutter.point.load == pytest.approx(BECK, rel=1e-9) and not diagram.warnings
    assert [diagram[0].points[row].negative for row in (0, -1)] == [0, 2]
    pencil = NonsymmetricSolver(diagram.solvers[0].system).at(diagram[0].points[0].x)
    values = np.sort(pencil.spectrum.values.real)
    assert (values < flutter.omega2).sum() >= 39  # of those that meet one is below, the other above


def test_planes_that_pass_one_another_never_meet(monkeypatch: pytest.MonkeyPatch) -> None:
    """A dead thrust beside one that follows: frequencies of two planes cross, and nothing more is computed for that."""
    at, computed = NonsymmetricSolver.at, list[object]()
    monkeypatch.setattr("rodfem.diagram.sweep.LOADS", 21)
    monkeypatch.setattr(NonsymmetricSolver, "at", lambda *given: (computed.append(given), at(*given))[1])
    scene, plan = classics.partly_following(1.0, (0.0, 19.0), 1.9), Plan(error_bars=False)
    diagram = trace(scene, Discretization("pointwise", 4, 6), plan)
    assert not diagram.special("flutter") and not diagram.warnings
    assert len(computed) == len(diagram[0].points) + 1 == 22  # the first one twice


def test_slepc_may_give_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """At times it cannot sort equal complex eigenvalues: up to a rank of a thousand LAPACK finds them."""

    def giving_up(*_: object) -> None:
        raise ConvergenceError("SLEPc cannot sort.")

    solver = Solver(classics.beck(), Discretization("pointwise", 8, 6)).equilibria
    spectrum = NonsymmetricSolver(solver.system).at(at_load(solver, solver.start(10.0), 10.0)).spectrum
    expected = spectrum.greatest(5).nu
    monkeypatch.setattr("rodfem.stability.spectrum.krylov", giving_up)
    np.testing.assert_allclose(spectrum.greatest(5).nu, expected, rtol=1e-9)
