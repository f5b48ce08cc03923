"""What ranks do together: a check on the first one that all hear of."""

from __future__ import annotations

from collections.abc import Callable

from mpi4py import MPI

from rodfem.errors import InputError


def on_first(comm: MPI.Comm, check: Callable[[], object]) -> None:
    """Do something on the first rank, and raise its :class:`InputError` on every rank."""
    trouble: InputError | None = None
    if comm.rank == 0:
        try:
            check()
        except InputError as error:
            trouble = error
    trouble = comm.bcast(trouble)
    if trouble is not None:
        raise trouble
