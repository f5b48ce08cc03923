"""Numbers in the functions of a scene are values of its compiled forms, not part of their text."""

from math import pi
from typing import Any

import numpy as np
import pytest
import ufl
from dolfinx import fem
from mpi4py import MPI

from rodfem import Discretization, Ordinate, Parameter, Plan, Scene, Solver, clamped, compat, free, trace
from rodfem.fem import form_compiler
from rodfem.fem.known import readable

COMM = MPI.COMM_WORLD


def column(stiffness: float, weight: float) -> Scene:
    """Euler's column of that bending stiffness, whose dead load is ``weight`` times the parameter."""
    return Scene(
        name="column",
        interval=(0.0, 1.0),
        rod="unshearable and inextensible",
        energy=lambda v, k, c: 0.5 * stiffness * (k[0] ** 2 + 2.6 * k[1] ** 2 + k[2] ** 2),
        parameters={"P": 0.0},
        load="P",
        ends=(clamped(), free(lambda c: (0.0, 0.0, -weight * c.P))),
        ordinate=Ordinate("tip", s=1.0, of=lambda r, q: r[0]),
        span=(0.0, 1.2 * stiffness / weight * pi**2 / 4),
    )


@pytest.mark.long
def test_another_number_compiles_nothing() -> None:
    """And each column buckles at Euler's load of its own numbers."""
    said: list[str] = []
    for stiffness, weight in ((1.234, 0.7), (2.345, 1.7)):
        with form_compiler.announce_compilation(lambda: said.append("compiling")):
            diagram = trace(column(stiffness, weight), Discretization("reduced", 4, 4), Plan(depth=0, error_bars=False))
        (buckling,) = [s for s in diagram["straight"].special if s.kind == "branch point"]
        assert buckling.point.load == pytest.approx(pi**2 / 4 * stiffness / weight, rel=1e-9)
        if stiffness == 1.234:
            said.clear()
    assert COMM.allreduce(said, op=MPI.SUM) == []


@pytest.mark.long
def test_values_are_those_of_the_numbers() -> None:
    """Also in conditions and in the base of a power; exponents, integers and the numbers of formulas stay."""
    mesh = compat.interval_mesh(MPI.COMM_SELF, 8, 0.0, 1.0)
    x = ufl.SpatialCoordinate(mesh)[0]
    dx = ufl.dx(domain=mesh, metadata={"quadrature_degree": 8})
    form = (0.5 * (x + 1.7) ** 2.5 + ufl.conditional(ufl.lt(x, 0.375), 3.3 * x, 7 * x) + ufl.bessel_J(1, 2.9 * x)) * dx
    mapped = readable(form, mesh)
    assert sorted(float(c.value) for c in mapped.constants()) == [0.375, 1.7, 2.9, 3.3]
    values = [fem.assemble_scalar(f) for f in form_compiler.compile_forms([form, mapped])]
    assert values[1] == pytest.approx(values[0], rel=1e-14)
    for nothing in (0, 0.5 * x * dx, 7 * x**1.5 * dx):
        assert not getattr(readable(nothing, mesh), "constants", list)()


def by_number(v: Any, k: Any, c: Any) -> Any:
    return (k[0] ** 2 + 1.3 * (k[1] - 0.3) ** 2 + 1.5 * k[2] ** 2) / 2 + 0.1 * k[0] ** 4


def by_parameter(v: Any, k: Any, c: Any) -> Any:
    return (k[0] ** 2 + 1.3 * (k[1] - c.n) ** 2 + 1.5 * k[2] ** 2) / 2 + 0.1 * k[0] ** 4


def linear(v: Any, k: Any, c: Any) -> Any:
    return 5.1 * k[2] + (k[0] ** 2 + 1.3 * k[1] ** 2 + 1.5 * k[2] ** 2) / 2 + 0.1 * k[0] ** 4


def rod(energy: Any) -> Scene:
    return Scene(
        "rod", (0.0, 1.0), "unshearable and inextensible", energy, {"p": Parameter(0.0), "n": Parameter(0.3)}, "p",
        (clamped(), free(lambda c: (c.p, 0.0, 0.0))), Ordinate("tip", s=1.0, of=lambda r, q: r[0]), (0.0, 12.0),
    )  # fmt: skip


@pytest.mark.long
@pytest.mark.parametrize("energy", [by_number, by_parameter, linear])
def test_a_number_that_vanishes_shifts_no_other(energy: Any) -> None:
    """diag(1, -0.3, 1.5) was computed for diag(1, 1.3, 1.5)."""
    solver = Solver(rod(energy), Discretization(elements=2, degree=3)).equilibria
    convexity = solver.convexity
    assert convexity is not None
    matrices = convexity._matrices(solver.start(0.0))  # the straight rod
    np.testing.assert_allclose(matrices, np.broadcast_to(np.diag([1.0, 1.3, 1.5]), matrices.shape), atol=1e-12)
