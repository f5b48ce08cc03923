"""Options for PETSc and SLEPc after the lone ``--`` of a command line, of which PETSc ignores what it does not know."""

from __future__ import annotations

from collections.abc import Sequence

NOTED = ("-rodfem_", "-mat_", "-vec_", "-eps_", "-st_", "-ksp_", "-pc_")
"""Beginnings of options of solvers, all of which have the prefix ``rodfem_`` here, of matrices and of vectors."""


def unread(words: Sequence[str]) -> list[str]:
    """Options of solvers, matrices and vectors among ``words`` that nothing has read so far."""
    from cffi import FFI
    from petsc4py import PETSc

    ffi = FFI()
    ffi.cdef("int PetscOptionsUsed(void *options, const char *name, int *used);")
    library, used = ffi.dlopen(PETSc.__file__), ffi.new("int *")
    found = []
    for word in words:
        if word.startswith(NOTED):
            library.PetscOptionsUsed(ffi.NULL, word[1:].encode(), used)
            found += [] if used[0] else [word]
    return found
