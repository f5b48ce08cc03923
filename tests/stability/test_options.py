"""PETSc's and SLEPc's options reach each solver by its prefix, and overrule what is set for it."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from petsc4py import PETSc
from small_states import plain

from rodfem.errors import ConvergenceError
from rodfem.fem.system import System
from rodfem.kumar_healey.coordinates import Coordinates
from rodfem.kumar_healey.reduction import ReducedPencil
from rodfem.stability.assessment import Assessor, in_interval

ORDERING = 2
"""MUMPS's approximate minimum fill: not what rodfem asks for."""


@pytest.fixture
def options() -> Iterator[PETSc.Options]:
    """PETSc's options; what a test has set is taken back."""
    found = PETSc.Options()
    before = set(found.getAll())
    yield found
    for name in set(found.getAll()) - before:
        found.delValue(name)


def cord(factors: str = "chain") -> tuple[System, PETSc.Vec]:
    system, x = plain("cord", "reduced", 6, 3, 20.0)
    return System(system.scene, replace(system.fields.discretization, factors=factors)), x


def test_factors(options: PETSc.Options) -> None:
    options["rodfem_lu_mat_mumps_icntl_7"] = options["rodfem_cholesky_mat_mumps_icntl_7"] = ORDERING
    system, x = cord(factors="petsc")
    system.at(x).factor(system.load_axis())
    assessor = Assessor(system)
    assert assessor(x, "count").negative == 1
    for factors in (system.lu, assessor.inertia.factors):
        assert factors.factor.getMumpsIcntl(7) == ORDERING
    del options["rodfem_lu_mat_mumps_icntl_7"], options["rodfem_cholesky_mat_mumps_icntl_7"]


def test_symmetric_pencil(options: PETSc.Options) -> None:
    options["rodfem_eps_ncv"], options["rodfem_eps_tol"] = 17, 1e-7
    system, x = cord()
    assessor = Assessor(system)
    expected = assessor(x, "shift-invert", 3).values
    spectrum = assessor.symmetric
    solver = spectrum.at(x).eigensolver(3, spectrum.inertia.seed(1))
    assert (solver.getDimensions()[1], solver.getTolerances()[0]) == (17, 1e-7)
    options["rodfem_slicing_eps_tol"], options["rodfem_slicing_st_mat_mumps_icntl_7"] = 1e-8, ORDERING
    solver = in_interval(spectrum.matrix, spectrum.mass, -20.0, 30.0)
    solver.solve()
    assert solver.getTolerances()[0] == 1e-8
    assert solver.getKrylovSchurKSP().getPC().getFactorMatrix().getMumpsIcntl(7) == ORDERING
    np.testing.assert_allclose(sorted(solver.getEigenvalue(i).real for i in range(3)), expected, rtol=1e-8)


def test_reduced_pencil(options: PETSc.Options) -> None:
    system, x = cord()
    reduction = ReducedPencil(Coordinates(system).assemble(x))
    expected = reduction.nearest(3, -30.0).values
    options["rodfem_eps_tol"] = 1e-11
    np.testing.assert_allclose(reduction.nearest(3, -30.0).values, expected, rtol=1e-9)
    options["rodfem_eps_ncv"] = 3
    with pytest.raises(ConvergenceError, match="ncv"):
        reduction.nearest(3, -30.0)
