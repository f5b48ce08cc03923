"""Choice of the factors for a matrix: along the rod on one rank, or MUMPS's."""

from __future__ import annotations

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from rodfem.errors import InputError
from rodfem.linalg.chain import Chain
from rodfem.linalg.factorization import Factors, Mumps, Sizes

CHAIN, MUMPS = "chain", "mumps"
"""Names of what factors."""


def package(prefix: str) -> str:
    """Name of what factors a rod's matrices: PETSc's option with the prefix, or what is best.

    Raises :class:`InputError` for another name.
    """
    best = MUMPS if np.issubdtype(PETSc.ScalarType, np.complexfloating) else CHAIN
    name = str(PETSc.Options(prefix).getString("pc_factor_mat_solver_type", best))
    if name not in (CHAIN, MUMPS):
        raise InputError(f"Nothing factors matrices by the name {name!r}: choose {CHAIN} or {MUMPS}.")
    return name


def factors_of(
    kind: str,
    comm: MPI.Comm,
    unknowns: int,
    scalars: int,
    controls: dict[int, int],
    thresholds: dict[int, float] | None = None,
    prefix: str = "",
    sizes: Sizes | None = None,
) -> Factors:
    """Factors for matrices of ``unknowns`` rows along a rod on a communicator, the last ``scalars`` of which are dense.

    Those of another matrix, of 0 unknowns, and on several ranks are MUMPS's, which is the last resort of the others.
    ``controls`` are its ICNTL, ``thresholds`` its CNTL; PETSc's options begin with ``rodfem_lu_`` or
    ``rodfem_cholesky_``, or with another ``prefix``.  ``kind`` is ``lu`` or ``cholesky`` (LDL^t), ``comm`` that of the
    matrices.  ``sizes`` are those of the unknowns, where they are not one.
    """
    prefix = prefix or f"rodfem_{kind}_"
    mumps = Mumps(kind, controls, thresholds, prefix, sizes)
    if not unknowns or package(prefix) == MUMPS or comm.size > 1:
        return mumps
    return Chain(kind, scalars, mumps, sizes)
