"""The command line of a rod: options of its constants, and those that all rods have."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rodfem.app.cli import Parser, complain, sentences, start_petsc
from rodfem.app.constants import Statement
from rodfem.app.options import add_options, mesh_of, plan_of
from rodfem.errors import InputError

if TYPE_CHECKING:
    from rodfem.fem.fields import Discretization
    from rodfem.problem.scene import Scene

Mesh = Callable[..., "Discretization"]
KEPT = "the branches that were finished are in"
"""What there is in the folder of a run that was interrupted."""
NOTED = ("-rodfem_", "-mat_", "-vec_", "-eps_", "-st_", "-ksp_", "-pc_")
"""Beginnings of options of solvers, all of which have the prefix ``rodfem_`` here, of matrices and of vectors."""


def main(
    rod: Callable[..., Scene] | Scene,
    mesh: Mesh | None = None,
    arguments: Sequence[str] | None = None,
    program: str | None = None,
) -> None:
    """Parse the command line, state the rod, run it; bad input ends with one sentence and status 2.

    An interrupt is raised as KeyboardInterrupt, with the sentence that the program ends with.

    Parameters
    ----------
    rod
        A scene, or a function of constants that returns one.  Each argument of the function has a default and is an
        option; its words are those of the section Parameters of the docstring.  Of a scene the parameters beside the
        load are options.
    mesh
        Function of the same constants that returns the discretisation where no option asks for another.
    arguments
        Replace those of the command line.
    program
        Name for the help, by default that of the script.
    """
    given = list(sys.argv[1:] if arguments is None else arguments)
    ours, petsc = (given[: given.index("--")], given[given.index("--") + 1 :]) if "--" in given else (given, [])
    try:
        statement = Statement(rod)
        usual = statement.scene()
        parser = parser_of(statement, usual, program or Path(sys.argv[0]).name)
    except InputError as trouble:
        complain(str(trouble))
    varied = f"--{usual.load}"
    if varied in [word.split("=")[0] for word in ours] and varied not in parser._option_string_actions:
        complain(f"{usual.load} is the load, which a run varies: give its range, {parser.option('span')} FROM TO.")
    options = parser.parse_args(ours)
    start_petsc(petsc)
    try:
        with sentences(parser):
            _run(statement, mesh, options, petsc, parser.in_options)
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"interrupted; {KEPT} {options.output}: rodfem.load reads them") from None
    except MemoryError:
        complain(f"Memory is exhausted: use fewer elements or a lower degree; {KEPT} {options.output}.")


def unread(words: Sequence[str]) -> list[str]:
    """Options of solvers, matrices and vectors among ``words``, of those after a lone ``--``, that nothing has read.

    PETSc ignores what it does not know.
    """
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


def parser_of(statement: Statement, usual: Scene, program: str) -> Parser:
    """Parser of all options of a rod; raises :class:`InputError` where a constant has the name of another option.

    ``usual`` is the scene with the usual constants, ``program`` the name for the help.
    """
    parser = Parser(
        prog=program,
        description=statement.words,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog="Options for PETSc and SLEPc go after a lone --, as in: -- -log_view",
    )
    add_options(parser, usual.load, Path("results") / usual.name)
    taken = {action.dest for action in parser._actions} | set(parser._option_string_actions)
    group = parser.add_argument_group("constants of the rod")
    for constant in statement.constants:
        if taken & {constant.name, constant.option}:
            raise InputError(f"The constant {constant.name} has the name of an option of all rods: choose another.")
        constant.declare(group)
    return parser


def _run(
    statement: Statement,
    mesh: Mesh | None,
    options: argparse.Namespace,
    petsc: Sequence[str],
    words: Callable[[str], str],
) -> None:
    """State the rod and run it.

    ``statement``, ``mesh`` and ``petsc`` are those of :func:`main`, ``words`` rewords what is said.
    """
    from petsc4py import PETSc

    from rodfem.app.run import run
    from rodfem.app.terminal import Report

    if petsc:  # once more, for a PETSc that was running already
        PETSc.Options().insertString(" ".join(petsc))
    constants = statement.values(options)
    scene, discretization, plan = statement.scene(**constants), _mesh(mesh, options, constants), plan_of(options)
    if plan.span is not None:
        scene = replace(scene, span=plan.span)
    run(scene, discretization, plan, options.output, figures=options.figures, words=words)
    if ignored := unread(petsc):
        Report().warn(f"PETSc did not read the option {', '.join(ignored)}: see whether it is spelled right.")


def _mesh(mesh: Mesh | None, options: argparse.Namespace, constants: Mapping[str, Any]) -> Discretization:
    return mesh_of(options, None if mesh is None else mesh(**constants))
