"""The rod under a follower load against the frequency equation of Beck's column, solved in complex arithmetic."""

from functools import cache

import numpy as np
import pytest
from classics import BEAM, push
from classics import column as straight
from closed_forms import column, double
from demo_cases import scene
from hemitropic_cases import specials

from rodfem import Branch, Discretization, Ordinate, Solver, clamped, free, trace
from rodfem.forms.energy import bending_and_twist
from rodfem.stability.nonsymmetric import NonsymmetricPencil, NonsymmetricSolver


@cache
def vibration(P: float, elements: int = 8, degree: int = 6, **constants: object) -> NonsymmetricPencil:
    """The pencil of the demo at one load."""
    solver = Solver(scene("follower", **constants), Discretization("pointwise", elements, degree)).equilibria
    x, outcome = solver.at_load(solver.start(P), P)
    assert outcome.converged
    return NonsymmetricSolver(solver.system).at(x)


@cache
def swept(span: tuple[float, float], rotary_inertia: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Branch:
    rod = scene("follower", span=span, rotary_inertia=rotary_inertia)
    (branch,) = trace(rod, Discretization("pointwise", 4, 6))
    return branch


@pytest.mark.long
@pytest.mark.parametrize(("span", "J"), [((0.0, 25.0), 0.0), ((25.0, 15.0), 1e-3)])
def test_flutter(span: tuple[float, float], J: float) -> None:
    branch = swept(span, (J, 0.0, 0.0))
    (flutter,) = specials(branch, "flutter")
    load, mu = double(20.0, 120.0, J)
    assert abs(flutter.point.load - load) <= flutter.error_estimate <= 3e-10
    assert abs(flutter.omega2 - mu) <= flutter.omega2_error <= 3e-9
    assert sorted((flutter.negative_before, flutter.negative_after)) == [0, 2]
    for p in branch.points:
        if p is not flutter.point:
            assert p.negative == (2 if p.load > load else 0)
            for re, im in p.omega2[:2]:  # the two that meet, or the weak and the strong plane
                value = complex(re, im)
                assert np.nanmin([abs(column(value, p.load, *plane) - value) for plane in ((1, J), (10, 0))]) < 1e-6


@pytest.mark.usefixtures("few_loads")
def test_flutter_by_mumps() -> None:
    found = trace(scene("follower", span=(15.0, 25.0)), Discretization("pointwise", 4, 6, factors="petsc"))
    (flutter,) = found.special("flutter")
    assert abs(flutter.point.load - double(20.0, 120.0)[0]) <= flutter.error_estimate <= 1e-9


@pytest.mark.long
def test_ordinate_of_a_load_that_is_not_known_better() -> None:
    """A stretching column stays straight, and its length is ``1 - P/EA``: its bar is that of P over EA.

    Nothing is left of the constraints of this pencil once strains and forces are eliminated.
    """
    EA = 500.0
    rod = straight(
        "stretching", (clamped(), free(follower=push)), (15.0, 25.0), rod="unshearable", inertia=BEAM, planar="e1",
        constants={"P": 15.0, "EA": EA},
        energy=lambda v, k, c: 0.5 * c.EA * (v[2] - 1) ** 2 + bending_and_twist(k, (c.B1, c.B2, c.C)),
        ordinate=Ordinate("length", s=1.0, of=lambda r, q: r[2]),
    )  # fmt: skip
    coarse, fine = (trace(rod, Discretization("pointwise", *mesh)).special("flutter") for mesh in ((2, 4), (6, 6)))
    (s,), (t,) = coarse, fine
    assert s.point.ordinate == pytest.approx(1 - s.point.load / EA, abs=1e-12)
    assert 1e-8 < abs(s.point.load - t.point.load) <= s.error_estimate
    assert abs(s.point.ordinate - (1 - t.point.load / EA)) <= s.ordinate_error <= 1.01 * s.error_estimate / EA + 1e-11


@pytest.mark.few(1)
@pytest.mark.parametrize("P", [0.0, 10.0])
def test_two_planes(P: float) -> None:
    values = vibration(P).nearest(6, 1.0).values[:6]
    assert abs(values.imag).max() < 1e-7
    for v in values.real:
        weak, strong, scaled = column(v, P), column(v, P, EI=10), 10 * column(v / 10, P / 10)
        assert np.nanmin([abs(v - weak), abs(v - strong)]) < 1e-9 * v
        assert np.nanmin([abs(v - weak), abs(v - scaled)]) < 1e-9 * v
    if P == 10:
        for expected in (26.7885149853, 345.468944394):
            assert abs(values - expected).min() < 1e-9 * expected
            assert column(expected, P) == pytest.approx(expected, rel=1e-11)


def test_mass_and_inertia() -> None:
    heavy = vibration(10.0, mass=2.0).nearest(2, 10.0).values
    assert abs(heavy - 26.7885149853 / 2).min() < 1e-9
    twist = (np.pi / 2) ** 2 / 1e-3  # clamped and free, with B3 = 1
    assert abs(vibration(10.0, rotary_inertia=(0.0, 0.0, 1e-3)).nearest(2, 2400.0).values - twist).min() < 1e-9 * twist


@pytest.mark.short
def test_motions_have_names() -> None:
    """Bending about d1 is the weak plane, about d2 the strong one, and torsion has a closed form."""
    found = vibration(10.0, rotary_inertia=(1e-3, 1e-3, 2e-3)).near_zero(1)
    assert {"bending about d1", "bending about d2", "torsion"} == set(found.kinds)
    for mu, kind in zip(found.values, found.kinds, strict=True):
        EI = {"bending about d1": 1, "bending about d2": 10}.get(kind)
        torsion = (np.pi / 2 * np.arange(1, 10, 2)) ** 2 / 2e-3
        expected = torsion if EI is None else column(mu, 10.0, EI, 1e-3)
        assert np.min(abs(mu - expected)) < 1e-8 * abs(mu)


@pytest.mark.few(1)
@pytest.mark.parametrize(("elements", "degree"), [(2, 2), (2, 3), (8, 1), (4, 6)])
@pytest.mark.parametrize("P", [1.8, 30.0])
def test_no_spurious_eigenvalue_on_crude_meshes(elements: int, degree: int, P: float) -> None:
    """Infinite eigenvalues come in Jordan blocks, which round-off brings near: none is among those returned."""
    values = vibration(P, elements, degree).nearest(40, -1e-3).values
    assert len(values) <= 2 * elements * degree
    assert values.real.min() > -1e3
    assert abs(values).max() < 1e10
    if P < 20:  # beyond, the crude ones have not fluttered yet
        for mu in values[:2]:
            exact = [column(mu, P), column(mu, P, EI=10)]
            assert np.nanmin([abs(mu - e) for e in exact]) < (1e-6 if elements * degree > 8 else 0.1) * abs(mu)
