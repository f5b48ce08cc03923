"""Command lines: their parser, and how they end.

Importing this module checks the installation first: a script gets one sentence, and leaves with status 2, where a
module is missing.  From then on an interrupt is one sentence and status 130 (:mod:`rodfem.ranks`).
"""

from __future__ import annotations

import argparse
import os
import re
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from difflib import get_close_matches
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NoReturn

from rodfem.errors import ConvergenceError, InputError, SetupError
from rodfem.ranks import all_come, in_words, listen

NEEDED = ("ufl", "dolfinx", "petsc4py", "slepc4py", "mpi4py", "numpy", "scipy", "h5py", "matplotlib")

if missing := [name for name in NEEDED if find_spec(name) is None]:
    sys.stderr.write(
        f"error: {sys.executable} has no module {', '.join(missing)}: install what is missing by 'pip install "
        "\"rodfem[pip]\"' (Python 3.12 or newer), or on Debian by 'make setup', and use .venv/bin/python.\n"
    )
    sys.exit(2)
# Open MPI 4 starts a daemon otherwise, in 0.2 s, which needs a home folder; a file with a rod may start MPI when read
os.environ.setdefault("OMPI_MCA_ess_singleton_isolated", "1")
os.environ["PETSC_OPTIONS"] = f"{os.environ.get('PETSC_OPTIONS', '')} -no_signal_handler"  # a closed pipe is no error
listen()

ARGUMENT = re.compile(r"\b(?:Discretization|Plan|StepControl|run)\((\w+)=([^()]*)\)")
"""An argument in a sentence: its name and its value."""
NEGATIVE = re.compile(r"-(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?$|-(inf|nan)$")
"""A negative number, which is the value of an option and none itself; argparse knows those without exponent."""


class Parser(argparse.ArgumentParser):
    """Argument parser whose complaints are one sentence; the destination of an option is the argument that it sets."""

    def __init__(self, *arguments: Any, **named: Any) -> None:
        """As for any parser, with numbers like -1e6 as values."""
        super().__init__(*arguments, **named)
        self._negative_number_matcher = NEGATIVE

    def option(self, name: str) -> str:
        """Option for an argument."""
        return next(action.option_strings[0] for action in self._actions if action.dest == name)

    def in_options(self, text: str) -> str:
        """Text in which options stand for arguments of Python that have one: ``--depth 1`` for ``Plan(depth=1)``."""
        known = {action.dest for action in self._actions}

        def option(found: re.Match[str]) -> str:
            if found[1] not in known:
                return found[0]
            return self.option(found[1]) + ("" if found[2] == "..." else " " + found[2].strip("'"))

        return ARGUMENT.sub(option, text)

    def error(self, message: str) -> NoReturn:
        """Print ``message``, of an unknown option with the nearest one there is, and leave with status 2."""
        unknown = re.findall(r"(?<!\S)--[\w-]+", message.partition("unrecognized")[2])
        if near := [x for word in unknown for x in get_close_matches(word, self._option_string_actions, 1, 0.65)]:
            message += f" (did you mean {', '.join(near)}?)"
        complain(f"{message[:1].upper()}{message[1:]}; see {self.prog} --help.")


def folder(text: str) -> Path:
    """Value of an option that names a folder; raises :class:`argparse.ArgumentTypeError` for none."""
    if not text.strip():
        raise argparse.ArgumentTypeError("the name of the folder is empty: give one, as in results/rod")
    return Path(text)


def run_folder(text: str) -> Path:
    """Folder of a run, which a file in it may name."""
    named = folder(text)
    return named.parent if named.is_file() else named


@contextmanager
def sentences(parser: Parser) -> Iterator[None]:
    """Bad input, and what fails for a reason that is known, ends with one sentence and status 2."""
    from petsc4py import PETSc

    try:
        yield
    except (InputError, SetupError, ConvergenceError) as trouble:
        complain(parser.in_options(str(trouble)))
    except (PETSc.Error, MemoryError) as trouble:
        complain(in_words(trouble))


def start_petsc(options: Sequence[str]) -> None:
    """Load PETSc with its options, some of which it reads then."""
    import_module("petsc4py").init(["rodfem", *options])


def complain(sentence: str) -> NoReturn:
    """Print one sentence on rank 0 and leave with status 2 on every rank; one that complains alone ends the others."""
    from mpi4py import MPI

    comm = MPI.COMM_WORLD

    def write() -> None:
        sys.stderr.write(f"error: {sentence}\n")
        sys.stderr.flush()

    if comm.rank == 0:
        write()
    if not all_come(comm):
        if comm.rank:
            write()
        comm.Abort(2)
    sys.exit(2)
