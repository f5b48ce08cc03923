"""The pencil of a state, and SLEPc set up to find its eigenvalues near a shift."""

from __future__ import annotations

from petsc4py import PETSc
from slepc4py import SLEPc

from rodfem.system import DENSE_ROWS, System, prefer_options


def assemble_pencil(system: System, x: PETSc.Vec, matrix: PETSc.Mat, mass: PETSc.Mat) -> None:
    """Assemble tangent matrix and kinetic metric at the state ``x``, without the symmetries' phase conditions."""
    system.bring(x)
    for target, form in ((matrix, system.equations.jacobian), (mass, system.equations.kinetic)):
        target.zeroEntries()
        system.assemble_into(target, form)
    if system.has_scalars:
        for index in (system.load_index, *system.drifts):  # no part of the pencil: an infinite eigenvalue each
            matrix.setValue(index, index, 1.0, addv=True)
    matrix.assemble()
    mass.assemble()


def shift_invert(matrix: PETSc.Mat, mass: PETSc.Mat, number: int, target: complex, *, symmetric: bool) -> SLEPc.EPS:
    """Set up Krylov-Schur with shift-invert (MUMPS) for the ``number`` eigenvalues nearest to ``target``."""
    solver = SLEPc.EPS().create(matrix.comm)
    solver.setOptionsPrefix("rodfem_")
    solver.setOperators(matrix, mass)
    solver.setProblemType(SLEPc.EPS.ProblemType.GHEP if symmetric else SLEPc.EPS.ProblemType.GNHEP)
    solver.setWhichEigenpairs(SLEPc.EPS.Which.TARGET_MAGNITUDE)
    solver.setTarget(target)
    solver.setTolerances(tol=1e-12 if symmetric else 1e-13, max_it=300)
    solver.setDimensions(number, 2 * number + 20)
    transform = solver.getST()
    transform.setType(SLEPc.ST.Type.SINVERT)
    ksp = transform.getKSP()
    ksp.setType("preonly")
    ksp.getPC().setType("lu")
    ksp.getPC().setFactorSolverType("mumps")
    prefer_options("rodfem_st_", DENSE_ROWS)
    solver.setFromOptions()
    return solver
