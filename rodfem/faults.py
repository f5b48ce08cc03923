"""Faults of numerical libraries: a step in which one happens has failed, as one that does not converge has."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from rodfem.errors import ConvergenceError
from rodfem.ranks import all_come

FAULTS = (PETSc.Error, MemoryError, np.linalg.LinAlgError, ArithmeticError)
"""What PETSc, SLEPc, numpy and Python raise where numbers or memory do not allow an answer."""
PETSC_ERR_MEM = 55
"""PETSc's error code for memory that is exhausted."""


@contextmanager
def as_failure(comm: MPI.Comm) -> Iterator[None]:
    """Raise :class:`ConvergenceError`, with the reason, for a fault that all ranks of ``comm`` have.

    One that a rank has alone stays what it is: nobody goes on without that rank.
    """
    try:
        yield
    except FAULTS as fault:
        if comm.size > 1 and not all_come(comm):
            raise
        raise ConvergenceError(in_words(fault)) from fault


@contextmanager
def without(what: str, comm: MPI.Comm, warn: Callable[[str], None]) -> Iterator[None]:
    """Go on where the block fails, on all ranks of ``comm``, and ``warn`` of ``what`` did not happen and why."""
    try:
        with as_failure(comm):
            yield
    except ConvergenceError as trouble:
        warn(f"{what}: {trouble}")


def in_words(fault: BaseException) -> str:
    """Sentence for a fault."""
    if isinstance(fault, MemoryError) or (isinstance(fault, PETSc.Error) and fault.ierr == PETSC_ERR_MEM):
        return "Memory is exhausted: use fewer elements or a lower degree."
    if isinstance(fault, PETSc.Error):
        return f"PETSc gave up ({str(fault).splitlines()[0]}): use smaller steps or another discretisation."
    return f"Numbers allow no answer ({fault}): use smaller steps or another discretisation."
