"""The command line that all demos share.

Importing this module checks the installation first: a script gets one sentence, and leaves with status 2, where a
module is missing.  From then on an interrupt is one sentence and status 130 (:mod:`rodfem.app.interrupts`).
"""

from __future__ import annotations

import argparse
import os
import re
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NoReturn

from rodfem.app import petsc_options
from rodfem.app.interrupts import listen
from rodfem.errors import ConvergenceError, InputError, SetupError
from rodfem.stability.methods import AUTO, METHODS

NEEDED = ("ufl", "dolfinx", "petsc4py", "slepc4py", "mpi4py", "numpy", "scipy", "h5py", "matplotlib")


def check_installation() -> None:
    """Leave with one sentence and status 2 where this Python lacks a module."""
    missing = [name for name in NEEDED if find_spec(name) is None]
    if missing:
        sys.stderr.write(
            f"error: {sys.executable} has no module {', '.join(missing)}: run 'make setup', which installs what is "
            "missing, and use .venv/bin/python (or any Python that sees Debian's python3-dolfinx).\n"
        )
        sys.exit(2)


check_installation()
listen()


ARGUMENT = re.compile(r"\b(?:Discretization|Plan|StepControl|run)\((\w+)=([^()]*)\)")
"""An :class:`~rodfem.errors.Argument` in a sentence: its name and its value."""


NEGATIVE = re.compile(r"-(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?$|-(inf|nan)$")
"""A negative number, which is the value of an option and none itself; argparse knows those without exponent."""


class Parser(argparse.ArgumentParser):
    """Argument parser whose complaints are one sentence, printed once under MPI.

    The destination of an option is the name of the argument that it is for.
    """

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

    def gives(self, name: str, words: Sequence[str]) -> bool:
        """Whether the command line sets an option, by an abbreviation maybe."""
        full = self.option(name)
        return any(word.split("=")[0] in [full[:end] for end in range(3, len(full) + 1)] for word in words)

    def error(self, message: str) -> NoReturn:
        """Print ``message`` and leave with status 2."""
        complain(f"{message[:1].upper()}{message[1:]}; see {self.prog} --help.")


def folder(text: str) -> Path:
    """Value of an option that names a folder; raises :class:`argparse.ArgumentTypeError` for none."""
    if not text.strip():
        raise argparse.ArgumentTypeError("the name of the folder is empty: give one, as in results/rod")
    return Path(text)


@contextmanager
def sentences(parser: Parser) -> Iterator[None]:
    """Bad input, and what fails for a reason that is known, ends with one sentence and status 2."""
    from petsc4py import PETSc

    try:
        yield
    except (InputError, SetupError, ConvergenceError) as trouble:
        complain(parser.in_options(str(trouble)))
    except PETSc.Error as trouble:
        complain(f"PETSc gave up ({str(trouble).splitlines()[0]}): try other constants or another discretisation.")


def start_petsc(options: Sequence[str]) -> None:
    """Load PETSc with its options, some of which it reads then; those that it refuses end with a sentence."""
    try:
        petsc_options.check(options)
        petsc4py = import_module("petsc4py")
        petsc4py.init(["rodfem", *options])
    except InputError as trouble:
        complain(str(trouble))
    except Exception as trouble:  # petsc4py has no class of its own for errors until PETSc is loaded
        words = str(trouble).splitlines()[0]
        complain(f"PETSc does not start with the options {' '.join(options)} ({words}): see whether files are missing.")


def complain(sentence: str) -> NoReturn:
    """Print one sentence on rank 0 and leave with status 2 on every rank; one that complains alone ends the others."""
    from mpi4py import MPI

    from rodfem.ranks import all_come

    comm = MPI.COMM_WORLD
    if comm.rank == 0:
        sys.stderr.write(f"error: {sentence}\n")
        sys.stderr.flush()
    if not all_come(comm):
        if comm.rank:
            sys.stderr.write(f"error: {sentence}\n")
            sys.stderr.flush()
        comm.Abort(2)
    sys.exit(2)


def parser_for(
    name: str,
    description: str,
    load: str,
    span: tuple[float, float],
    elements: int,
    degree: int,
    formulation: str = "auto",
) -> Parser:
    """Return the options that every demo has; a demo adds its own constants.

    ``name`` and ``description`` head the help; ``load`` names the load, of range ``span``; ``elements``, ``degree`` and
    ``formulation`` are the defaults of the discretisation.
    """
    from rodfem.fem import formulations

    parser = Parser(
        prog=f"{name}.py",
        description=description,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog="Options for PETSc and SLEPc go after a lone --, as in: -- -log_view",
    )
    words = {
        "--elements": f"number of finite elements along the rod (default {elements})",
        "--degree": f"polynomial degree; the error falls as h^(2K) (default {degree})",
        "--formulation": "; ".join(f"{made.name}: {made.words}" for made in formulations.FORMULATIONS.values())
        + f"; {formulations.AUTO}: the first that the scene allows (default {formulation})",
        "--factors": "chain: compiled assembly and elimination along the rod; petsc: the same numbers, slower, by "
        "dolfinx, PETSc and MUMPS (default chain)",
        "--accuracy": "instead of elements and degree: choose meshes on the way such that loads and ordinates are in "
        "error by less than EPS (relative to values greater than one)",
        "--range": f"start at {load} = A, stay between A and B (default {span[0]:g} {span[1]:g})",
        "--at": f"compute every branch also at exactly these values of {load}",
        "--step": "largest step along a branch, in radian of rotation (root mean square; default 0.05)",
        "--depth": "follow what leaves from branch points of branches of a depth less than D; the first branch has "
        "depth 0, what leaves from it 1, and so on (default 2)",
        "--spectrum": "also compute the K left-most eigenvalues of every state with SLEPc",
        "--method": "judge the states at the loads of --at, and print all that is said, by "
        f"{', '.join((AUTO, *METHODS))}",
        "--modes": "find and draw the K left-most modes of the states at the loads of --at",
        "--search": "at each load of --at also look for equilibria that no branch has reached, with that many tries",
        "--locus": "follow every special point in the plane of the load and the constant NAME from LOW to HIGH",
        "--output": f"folder for files and pictures (default results/{name})",
        "--no-figures": "draw nothing",
    }
    groups: dict[str, dict[str, dict[str, Any]]] = {
        "discretisation": {
            "--elements": {"type": int, "default": elements, "metavar": "N"},
            "--degree": {"type": int, "default": degree, "metavar": "K"},
            "--formulation": {"default": formulation, "metavar": f"{{{','.join(formulations.names())}}}"},
            "--factors": {"default": "chain", "metavar": "{chain,petsc}"},
            "--accuracy": {"type": float, "metavar": "EPS"},
        },
        "what to compute": {
            "--range": {"dest": "span", "type": float, "nargs": 2, "default": span, "metavar": ("A", "B")},
            "--at": {"type": float, "nargs": "+", "default": [], "metavar": "LOAD"},
            "--step": {"dest": "largest", "type": float, "default": 0.05, "metavar": "S"},
            "--depth": {"type": int, "default": 2, "metavar": "D"},
            "--spectrum": {"type": int, "default": 0, "metavar": "K"},
            "--method": {"default": "", "metavar": "NAME"},
            "--modes": {"type": int, "default": 0, "metavar": "K"},
            "--search": {"dest": "tries", "type": int, "default": 0, "metavar": "TRIES"},
            "--locus": {"nargs": 3, "metavar": ("NAME", "LOW", "HIGH")},
        },
        "output": {
            "--output": {"type": folder, "default": Path("results") / name, "metavar": "DIR"},
            "--no-figures": {"dest": "figures", "action": "store_false"},
        },
    }
    for title, options in groups.items():
        group = parser.add_argument_group(title)
        for option, how in options.items():
            group.add_argument(option, help=words[option], **how)
    return parser


def pair(words: Sequence[str] | None) -> tuple[str, float, float] | None:
    """Name and interval of a second parameter; raises :class:`InputError` for what are no numbers."""
    if words is None:
        return None
    try:
        return words[0], float(words[1]), float(words[2])
    except ValueError:
        raise InputError(f"{words[1]} to {words[2]} is no interval: give two numbers after {words[0]}.") from None


def main(
    parser: Parser,
    scene_of: Callable[[argparse.Namespace], Any],
    defaults: Callable[[argparse.Namespace], Mapping[str, Any]] | None = None,
    arguments: Sequence[str] | None = None,
) -> None:
    """Parse the command line, build the scene, run it; bad input ends with one sentence and status 2.

    ``defaults`` gives values that the other options call for, by name, for options that the user does not give.
    ``parser`` is that of :func:`parser_for`, ``scene_of`` makes the scene from the parsed options, and ``arguments``
    replace those of the command line.  Bad input is an :class:`~rodfem.errors.InputError`; an interrupt is raised as
    KeyboardInterrupt, with the sentence that the program ends with.
    """
    os.environ.setdefault("OMPI_MCA_ess_singleton_isolated", "1")  # Open MPI 4 starts a daemon otherwise, 0.2 s
    given = list(sys.argv[1:] if arguments is None else arguments)
    ours, petsc = (given[: given.index("--")], given[given.index("--") + 1 :]) if "--" in given else (given, [])
    options = parser.parse_args(ours)
    for name, value in defaults(options).items() if defaults else ():
        if not parser.gives(name, ours):
            setattr(options, name, value)
    start_petsc(petsc)
    try:
        with sentences(parser):
            _run(parser, options, ours, scene_of, petsc)
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"interrupted; the branches that were finished are in {options.output}") from None
    except MemoryError:
        complain(
            "Memory is exhausted: use fewer elements or a lower degree; the branches that were finished are in "
            f"{options.output}."
        )


def _run(
    parser: Parser,
    options: argparse.Namespace,
    ours: Sequence[str],
    scene_of: Callable[[argparse.Namespace], Any],
    petsc: Sequence[str],
) -> None:
    """Build and run the scene.

    ``parser``, ``scene_of`` and ``options`` are those of :func:`main`, ``ours`` and ``petsc`` the words before and
    after the lone ``--``.
    """
    from petsc4py import PETSc

    from rodfem.app.run import run
    from rodfem.app.terminal import Report
    from rodfem.continuation.step_control import StepControl
    from rodfem.diagram.plan import Plan
    from rodfem.fem.fields import Discretization

    if petsc:  # once more, for a PETSc that was running already
        PETSc.Options().insertString(" ".join(petsc))
    if options.accuracy is not None:
        for name in ("elements", "degree"):
            if parser.gives(name, ours):
                raise InputError(f"--accuracy chooses elements and degree itself: leave out --{name}, or --accuracy.")
    discretization = Discretization(options.formulation, options.elements, options.degree, factors=options.factors)
    scene = scene_of(options)
    span = tuple(options.span)
    steps = StepControl(largest=options.largest)
    at = tuple(options.at)
    plan = Plan(
        span,
        at,
        depth=options.depth,
        spectrum=options.spectrum,
        steps=steps,
        tries=options.tries,
        locus=pair(options.locus),
        method=options.method,
        modes=options.modes,
        accuracy=options.accuracy,
    )
    run(scene, discretization, plan, options.output, figures=options.figures, words=parser.in_options)
    if unread := petsc_options.unread(petsc):
        Report().warn(f"PETSc did not read the option {', '.join(unread)}: see whether it is spelled right.")
