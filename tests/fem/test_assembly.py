"""Compiled assembly against dolfinx's own, of every scene."""

import numpy as np
import pytest
from dolfinx import fem
from golden_cases import cases, distinct
from mpi4py import MPI
from petsc4py import PETSc

from rodfem import Discretization, Solver

EXACT = 1e-14
"""Relative difference of sums that are added up in another order."""


@pytest.mark.few(2)
@pytest.mark.parametrize("name", distinct())
def test_forms_of_every_scene(name: str) -> None:
    """Energy, equations, Jacobian with and without the load, and kinetic metric, at bent states of a graded mesh."""
    made = cases()[name]()
    a, b = made.interval
    cuts = np.sort(np.append(a + (b - a) * np.linspace(0, 1, 7) ** 1.1, made.joints))
    mesh = Discretization("auto", len(cuts) - 1, 6, vertices=tuple(cuts.tolist()))
    found = Solver(made, mesh, MPI.COMM_SELF).equilibria
    system, equations = found.system, found.system.equations
    state = system.at(found.start(0.7 * made.span[0] + 0.3 * made.span[1], 0.4))
    vector = state.evaluate(lambda: fem.assemble_vector(equations.residual.form).array.copy())  # takes the values
    assert abs(state.covector() - vector).max() <= EXACT * abs(vector).max()
    assert state.energy() == pytest.approx(fem.assemble_scalar(equations.energy.form), rel=EXACT, abs=EXACT)
    residual = system.new_vector()
    state.residual(residual)
    free = system.maps(load=False)[0]
    summed = np.bincount(free[free >= 0], vector[free >= 0], minlength=system.fields.unknowns)
    summed[system.drifts] = residual.array_r[system.drifts]
    assert abs(residual.array_r - summed).max() <= EXACT * abs(vector).max()
    for form, load, ours in (
        (equations.jacobian, True, system.state_matrix(load=True)),
        (equations.jacobian, False, system.state_matrix()),
        (equations.kinetic, False, system.metric_matrix()),
    ):
        state.assemble_into(ours, form, load=load)
        ours.assemble()
        theirs = PETSc.Mat().createAIJ(ours.size, nnz=ours.size[1], comm=PETSc.COMM_SELF)
        theirs.setLGMap(*ours.getLGMap())
        fem.petsc.assemble_matrix(theirs, form.form)
        theirs.assemble()
        size = theirs.norm(PETSc.NormType.INFINITY)
        theirs.axpy(-1.0, ours)
        assert theirs.norm(PETSc.NormType.INFINITY) <= EXACT * size
