"""Options for PETSc and SLEPc after the lone ``--`` of a command line: refused where nothing would read them.

PETSc itself ignores what it does not know.  The solvers of rodfem read options with the prefix ``rodfem_``; the others
that are read are those of PETSc as a whole, of its matrices and of its vectors.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

from rodfem.errors import InputError

OURS = "rodfem_"
"""Prefix of the options of all solvers."""
SOLVERS = ("eps_", "st_", "ksp_", "pc_", "bv_", "ds_", "snes_", "ts_", "svd_", "pep_", "nep_")
"""Beginnings of options that only solvers read."""
READ = (
    *(OURS, "mat_", "vec_", "log_", "info", "malloc", "memory_view", "objects_dump", "options_", "help", "version"),
    *("on_error_", "error_output", "fp_trap", "check_pointer", "no_signal_handler", "citations", "get_total_flops"),
    *("start_in_debugger", "debugger_", "debug_terminal", "stop_for_debugger", "prefix_push", "prefix_pop", "x_"),
)
"""Beginnings of options that something reads."""
OPTION = re.compile(r"-[A-Za-z]\w*(:\S*)?$")


def check(words: Sequence[str]) -> None:
    """Raise :class:`InputError` for words that are no options of PETSc, or such that nothing reads."""
    value = False
    for word, file in pairwise(words):
        if word == "-options_file" and not Path(file).is_file():
            raise InputError(f"There is no file {file} of options for PETSc: give one that exists.")
    for word in words:
        option = OPTION.match(word) is not None
        if option:
            _check_name(word[1:])
        elif not value:
            raise InputError(
                f"{word!r} after the lone -- is no option of PETSc: put options of the rod before it, and give PETSc's "
                "with one dash, as in -- -log_view."
            )
        value = option


def _check_name(name: str) -> None:
    if name.startswith(SOLVERS):
        raise InputError(
            f"Nothing reads the option -{name}: those of rodfem's solvers have a prefix, as in -- -{OURS}{name}."
        )
    if not name.startswith(READ):
        raise InputError(f"PETSc does not know the option -{name}: leave it out, or see PETSc's -- -help.")


def unread(words: Sequence[str]) -> list[str]:
    """Options of solvers, matrices and vectors among ``words`` that nothing has read so far."""
    from cffi import FFI
    from petsc4py import PETSc

    ffi = FFI()
    ffi.cdef("int PetscOptionsUsed(void *options, const char *name, int *used);")
    library, used = ffi.dlopen(PETSc.__file__), ffi.new("int *")
    found = []
    for word in words:
        if word.startswith((f"-{OURS}", "-mat_", "-vec_")):
            library.PetscOptionsUsed(ffi.NULL, word[1:].encode(), used)
            found += [] if used[0] else [word]
    return found
