"""Choice of the factors for a matrix: KLU's or MUMPS's, and on several ranks whole on each or piece by piece."""

from __future__ import annotations

from mpi4py import MPI

from rodfem.linalg.factorization import Factors, Klu, Mumps, is_cut, lu_package
from rodfem.linalg.replicated import Copied
from rodfem.linalg.substructured import SubstructuredFactors


def factors_of(
    kind: str,
    comm: MPI.Comm,
    unknowns: int,
    scalars: int,
    controls: dict[int, int],
    thresholds: dict[int, float] | None = None,
    prefix: str = "",
) -> Factors:
    """Factors for matrices of ``unknowns`` rows on a communicator, the last ``scalars`` of which may be dense.

    ``controls`` are MUMPS's ICNTL, ``thresholds`` its CNTL; PETSc's options begin with ``rodfem_lu_`` or
    ``rodfem_cholesky_``, or with another ``prefix``.  ``kind`` is ``lu`` or ``cholesky`` (LDL^t), ``comm`` that of the
    matrices.
    """
    prefix = prefix or f"rodfem_{kind}_"
    lu = kind == "lu" and lu_package(MPI.COMM_SELF, prefix) != "mumps"
    factors = Klu(prefix, scalars) if lu else Mumps(kind, controls, thresholds, prefix)
    if comm.size == 1:
        return factors
    return SubstructuredFactors(scalars, factors) if is_cut(comm, unknowns) else Copied(factors)


def solving(counting: Factors, comm: MPI.Comm, unknowns: int, scalars: int) -> Factors:
    """The fastest factors for solutions with a symmetric matrix: its LDL^t factors ``counting``, or LU factors.

    The matrix has ``unknowns`` rows on ``comm``, the last ``scalars`` of which may be dense.
    """
    same = lu_package(MPI.COMM_SELF, "rodfem_lu_") == "mumps"
    return counting if same else factors_of("lu", comm, unknowns, scalars, {})
