"""PETSc's options reach each solver by its prefix, and overrule what is set for it."""

from collections.abc import Iterator
from dataclasses import replace

import pytest
from petsc4py import PETSc
from small_states import plain

from rodfem.fem.system import System
from rodfem.stability.assessment import Assessor
from rodfem.stability.nonsymmetric import NonsymmetricSolver

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


def test_nothing_is_left_in_the_database(options: PETSc.Options) -> None:
    before = options.getAll()
    system, x = cord()
    system.at(x).factor(system.load_axis())
    assessor = Assessor(system)
    for method in ("count", "shift-invert", "slicing"):
        assessor(x, method, 2)
    system, x = plain("follower", "pointwise", 6, 3, 10.0)
    vibration = NonsymmetricSolver(system).at(x)
    vibration.nearest(2, 0.0)
    assert options.getAll() == before


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
