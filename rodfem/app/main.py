"""The command ``rodfem run``: the rod of a file, with its constants, and what all rods have, as options."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from inspect import isfunction, signature
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from rodfem.app.cli import Parser, complain, sentences, start_petsc
from rodfem.app.options import Statement, add_options, discretization_of, plan_of
from rodfem.app.persons_file import load
from rodfem.errors import InputError
from rodfem.problem.scene import Scene

if TYPE_CHECKING:
    from rodfem.fem.fields import Discretization

Mesh = Callable[..., "Discretization"]
KEPT = "the branches that were finished are in"
"""What there is in the folder of a run that was interrupted."""
NOTED = ("-rodfem_", "-mat_", "-vec_", "-eps_", "-st_", "-ksp_", "-pc_")
"""Beginnings of options of solvers, all of which have the prefix ``rodfem_`` here, of matrices and of vectors."""
HELP = """usage: rodfem run FILE.py [--scene NAME] [OPTIONS]

Trace the rod of a file: a Scene, or a function with '-> Scene' whose arguments have defaults and are the rod's
constants. Where the file has several, --scene names one. A function with '-> Discretization' of the same constants is
its mesh, where no option asks for another.

rodfem run FILE.py --help lists all options of the rod.
"""


def main(words: Sequence[str]) -> None:
    """State the rod of a file and run it; raises KeyboardInterrupt with the sentence that the program ends with."""
    if not words or words[0] in ("-h", "--help"):
        print(HELP, end="")
        sys.exit(0)
    file, *rest = words
    name = None
    if rest[:1] == ["--scene"]:
        name, rest = (rest[1] if len(rest) > 1 else ""), rest[2:]
    module = load(Path(file))
    statement, mesh = Statement(rod_of(module, name)), mesh_of(module)
    ours, petsc = (rest[: rest.index("--")], rest[rest.index("--") + 1 :]) if "--" in rest else (rest, [])
    parser = parser_of(statement, statement.scene(), f"rodfem run {file}")
    _refuse_the_load(statement.scene().load, ours, parser)
    options = parser.parse_args(ours)
    start_petsc(petsc)
    try:
        with sentences(parser):
            _run(statement, mesh, options, petsc, parser.in_options)
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"interrupted; {KEPT} {options.output}: rodfem.load reads them") from None
    except MemoryError:
        complain(f"Memory is exhausted: use fewer elements or a lower degree; {KEPT} {options.output}.")


def _refuse_the_load(load: str, words: Sequence[str], parser: Parser) -> None:
    """Complain of the load among the options, unless a constant has its name: a run varies it."""
    option = f"--{load}"
    if option in [word.split("=")[0] for word in words] and option not in parser._option_string_actions:
        complain(f"{load} is the load, which a run varies: give its range, {parser.option('span')} FROM TO.")


def unread(words: Sequence[str]) -> list[str]:
    """Options among ``words`` that belong to solvers, matrices and vectors, and that PETSc has not read."""
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
    """Parser of all options of a rod; raises :class:`InputError` for a constant with the name of another option."""
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
    """State the rod and run it; ``words`` rewords what is said."""
    from petsc4py import PETSc

    from rodfem.app.run import run
    from rodfem.app.terminal import Report

    if petsc:  # once more, for a PETSc that was running already
        PETSc.Options().insertString(" ".join(petsc))
    constants = statement.values(options)
    own = None if mesh is None else mesh(**constants)
    scene, discretization, plan = statement.scene(**constants), discretization_of(options, own), plan_of(options)
    if plan.span is not None:
        scene = replace(scene, span=plan.span)
    run(scene, discretization, plan, options.output, figures=options.figures, words=words)
    if ignored := unread(petsc):
        Report().warn(f"PETSc did not read the option {', '.join(ignored)}: see whether it is spelled right.")


def rod_of(module: ModuleType, name: str | None) -> Callable[..., Scene] | Scene:
    """Scene of a module, or the function that states it; raises :class:`InputError` unless there is one to choose."""
    scenes = {n: x for n, x in vars(module).items() if isinstance(x, Scene)} | _returning(module, "Scene")
    choice = ", ".join(scenes)
    if name is not None:
        if name not in scenes:
            raise InputError(f"{module.__file__} has no scene {name!r}: choose one of {choice or 'those you add'}.")
        return scenes[name]
    if not scenes:
        raise InputError(f"{module.__file__} states no rod: give it a Scene, or a function with '-> Scene'.")
    if len(scenes) > 1:
        raise InputError(f"{module.__file__} has the scenes {choice}: choose one by --scene NAME.")
    return next(iter(scenes.values()))


def mesh_of(module: ModuleType) -> Mesh | None:
    """Function of a module that returns a discretisation, if it has one; raises :class:`InputError` for several."""
    found = _returning(module, "Discretization")
    if len(found) > 1:
        raise InputError(f"{module.__file__} has the meshes {', '.join(found)}: keep one function with that result.")
    return next(iter(found.values()), None)


def _returning(module: ModuleType, kind: str) -> dict[str, Callable[..., Any]]:
    """Functions of a module, by name, that are annotated to return a class of rodfem."""
    found: dict[str, Callable[..., Any]] = {}
    for name, x in vars(module).items():
        if isfunction(x) and x.__module__ == module.__name__ and not name.startswith("_"):
            returned = signature(x).return_annotation
            word = returned if isinstance(returned, str) else getattr(returned, "__name__", "")
            if word.rpartition(".")[2].strip("'\"") == kind:
                found[name] = x
    return found
