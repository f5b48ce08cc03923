"""The program ``rodfem``, also ``python -m rodfem``: one of its commands, with the words after it."""

from __future__ import annotations

import ast
import signal
import sys
from collections.abc import Sequence
from difflib import get_close_matches
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType

import rodfem
from rodfem.app.cli import Parser, complain
from rodfem.app.commands import COMMANDS
from rodfem.app.commands import __name__ as HOME
from rodfem.errors import InputError

HELP = """usage: rodfem COMMAND [ARGUMENTS]

Equilibria of nonlinearly elastic rods: which are stable, and at which load stability is lost.

{commands}

rodfem COMMAND --help lists the arguments of a command.
"""


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command that ``arguments``, by default those of the shell, name; bad input ends with one sentence."""
    name, *words = list(sys.argv[1:] if arguments is None else arguments) or ["--help"]
    if name in ("-h", "--help", "help"):
        print(HELP.format(commands="\n".join(f"  {each:<10}{_words(each)}" for each in COMMANDS)), end="")
    elif name == "--version":
        print(_versions())
    elif name not in COMMANDS:
        near = get_close_matches(name, COMMANDS, n=1) or [" or ".join(COMMANDS)]
        Parser(prog="rodfem").error(f"unknown command {name!r}: choose {near[0]}")
    else:
        command = _module(name)
        if arguments is None:  # a reader, as head, may leave; PETSc, which a command may load, would complain
            signal.signal(signal.SIGPIPE, signal.SIG_DFL)
        try:
            command.main(words)
        except InputError as trouble:
            complain(str(trouble))


def _versions() -> str:
    """A line for the program, and one for each library that computes."""
    from rodfem.output.files import versions  # imports dolfinx, which takes a second

    found = {"rodfem": rodfem.__version__, **versions()}
    return "\n".join(f"{name:<8}{version}" for name, version in found.items())


def _module(name: str) -> ModuleType:
    return import_module(f"{HOME}.{name}")


def _words(name: str) -> str:
    """First line of the docstring of a command's module, which is not imported: that takes long."""
    spec = find_spec(f"{HOME}.{name}")
    assert spec is not None
    assert spec.origin is not None
    return (ast.get_docstring(ast.parse(Path(spec.origin).read_text())) or "").partition("\n")[0]
