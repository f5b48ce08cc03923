"""The command ``rodfem run``: the rod of a file, with options of its constants and those that all rods have."""

from __future__ import annotations

import argparse
import csv
import re
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, replace
from functools import cache, partial
from hashlib import sha256
from inspect import Parameter, cleandoc, getdoc, isfunction, signature
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any, NamedTuple

from rodfem.app.cli import Parser, complain, folder, sentences, start_petsc
from rodfem.app.persons_file import RUN, as_sentence, load
from rodfem.errors import InputError
from rodfem.problem.scene import Scene
from rodfem.stability import AUTO, METHODS

if TYPE_CHECKING:
    from rodfem.diagram.plan import Plan
    from rodfem.fem.fields import Discretization

Mesh = Callable[..., "Discretization"]
Asked = tuple[Scene, "Discretization", "Plan"]
HELP = """usage: rodfem run FILE.py [--scene NAME] [OPTIONS]

Trace the rod of a file: a Scene, or a function with '-> Scene' whose arguments have defaults and are the rod's
constants. Where the file has several, --scene names one. A function with '-> Discretization' of the same constants is
its mesh, where no option asks for another. Options that are left out are those of the file's own Discretization and
Plan: with which it runs its rod itself, or the only ones in it.

rodfem run FILE.py --help lists all options of the rod. Both execute the file, as far as a run of its own.
"""


def main(words: Sequence[str]) -> None:
    """State the rod of a file and run it; raises KeyboardInterrupt with the sentence that the program ends with."""
    if not words or words[0] in ("-h", "--help"):
        print(HELP, end="")
        sys.exit(0)
    file, *rest = words
    name = None
    if "--scene" in rest:
        i = rest.index("--scene")
        name, rest = " ".join(rest[i + 1 : i + 2]), rest[:i] + rest[i + 2 :]
    statement = Statement.of(load(Path(file)), name)
    end = rest.index("--") if "--" in rest else len(rest)
    ours, petsc = rest[:end], rest[end + 1 :]
    usual = statement.scene()
    parser, option = parser_of(statement, usual, f"rodfem run {file}"), f"--{usual.load}"
    if option in {word.split("=")[0] for word in ours} - parser._option_string_actions.keys():
        complain(f"{usual.load} is the load, which a run varies: give its range, {parser.option('span')} FROM TO.")
    options = parser.parse_args(ours)
    start_petsc(petsc)
    earlier = _written(options.output)

    try:
        with sentences(parser):
            _run(statement, options, petsc, parser.in_options)
    except KeyboardInterrupt:
        done = _written(options.output) != earlier
        kept = f"the branches that were finished are in {options.output}" if done else "no branch was finished"
        raise KeyboardInterrupt(f"interrupted; {kept}") from None


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


def _written(output: Path) -> int:
    """When the diagram in a folder was written, 0 without one."""
    file = output / "diagram.json"
    return file.stat().st_mtime_ns if file.is_file() else 0


COLUMNS = "a column is a constant, an option of rodfem run without its dashes (elements), or a field of Plan (steps)"


def many_main(words: Sequence[str]) -> None:
    """Trace the rods of a table, all stated before any is traced, and write the table of what is special of them."""
    parser = Parser(prog="rodfem many", description="Trace a rod of a file once for each line of a table.")
    parser.add_argument("file", type=Path, help="as rodfem run has it")
    parser.add_argument("table", type=Path, help=f"CSV with a line for each rod; {COLUMNS}")
    parser.add_argument("--scene", metavar="NAME", help="of several in the file")
    parser.add_argument("--output", type=folder, default=Path("results/many"), metavar="DIR", help="for all files")
    given = parser.parse_args(words)
    statement = Statement.of(load(given.file), given.scene)
    options = parser_of(statement, statement.scene(), f"rodfem run {given.file}")
    start_petsc([])
    with sentences(options):
        rows = _rows(given.table, options)
        _trace(given, rows, [_asked(row, statement, options, f"{given.table}, rod {i}") for i, row in enumerate(rows)])


def _column_options(options: Parser) -> dict[str, argparse.Action]:
    """Options by the names that a column may have."""
    found = {action.dest: action for action in options._actions if action.dest not in ("help", "output")}
    return found | {x.option_strings[0][2:]: x for x in found.values()} | {"steps": found["largest"]}


def _rows(table: Path, options: Parser) -> list[dict[str, str]]:
    """Lines of a table; raises :class:`InputError` for one without lines, or with a column that no rod has."""
    try:
        rows = list(csv.DictReader(table.read_text(encoding="utf-8-sig").splitlines()))
    except (OSError, ValueError) as trouble:
        raise InputError(f"{table} cannot be read ({trouble}): give a table of text.") from trouble
    if unknown := [name for name in (rows or [{"": ""}])[0] if name not in _column_options(options)]:
        what = f"has a column {unknown[0]!r}" if rows else "has no line of a rod"
        raise InputError(f"{table} {what}: {COLUMNS}; {options.prog} --help lists them.")
    return rows


def _asked(row: Mapping[str, str], statement: Statement, options: Parser, where: str) -> Asked:
    """Scene, mesh and plan of a line, of which an empty cell is the default; raises :class:`InputError` with it."""
    words = list[str]()
    for name, cell in row.items():
        action, values = _column_options(options)[name], (cell or "").split()
        if isinstance(action, argparse.BooleanOptionalAction) and cell.lower() in ("true", "false"):
            words.append(action.option_strings[cell.lower() == "false"])
        elif values:
            words += [action.option_strings[0], *values]
    try:
        scene, discretization, plan = statement.asked(options.parse_args(words))
        plan.check(scene, discretization)
    except InputError as trouble:
        raise InputError(f"{where}: {trouble}") from None
    return scene, discretization, plan


def _trace(given: argparse.Namespace, rows: Sequence[dict[str, str]], asked: Sequence[Asked]) -> None:
    """Trace all rods that have not been traced, and write the table of their special points; collective."""
    from mpi4py import MPI

    from rodfem.app.many import key_of, shared
    from rodfem.diagram.diagram import trace
    from rodfem.output.states import as_csv
    from rodfem.ranks import on_first
    from rodfem.whole_files import write_whole

    def work(number: int) -> dict[str, Any]:
        diagram = trace(*asked[number], comm=MPI.COMM_SELF)
        diagram.save(given.output / f"rod-{number:05d}")
        return {"special": [{"branch": b["name"]} | s for b in diagram.data["branches"] for s in b["special"]]}

    target, text, comm = given.output / "many.csv", sha256(given.file.read_bytes()).hexdigest(), MPI.COMM_WORLD
    keys = [key_of(scene) | {"row": row, "file": text} for (scene, *_), row in zip(asked, rows, strict=True)]
    results = shared(keys, [partial(work, i) for i in range(len(rows))], given.output, comm, lambda done, whole: None)
    found = [(row | {"rod": i}, r.get("special") or [r]) for i, (row, r) in enumerate(zip(rows, results, strict=True))]
    on_first(comm, lambda: write_whole({target: as_csv([rod | entry for rod, each in found for entry in each])}))
    if comm.rank == 0:
        print(target)


def _run(statement: Statement, options: argparse.Namespace, petsc: Sequence[str], words: Callable[[str], str]) -> None:
    """State the rod and run it; ``words`` rewords what is said."""
    from petsc4py import PETSc

    from rodfem.app.run import run

    if petsc:  # once more, for a PETSc that was running already; what it does not read it lists at the end
        PETSc.Options().insertString(" ".join([*petsc, "-options_left"]))
    scene, discretization, plan = statement.asked(options)
    if plan.span is not None:
        scene = replace(scene, span=plan.span)
    run(scene, discretization, plan, options.output, figures=options.figures, verbose=options.verbose, words=words)


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


def own_of(module: ModuleType, kind: str) -> Callable[..., Any] | None:
    """What a module has of a class of rodfem, of the constants; raises :class:`InputError` if there are several.

    A function that returns one comes before the one of its own run, and that before one with a name.
    """
    run = dict(enumerate(vars(module).get(RUN, ())))
    found = _returning(module, kind) or _of_kind(run, kind) or _of_kind(vars(module), kind)
    if len(found) > 1:
        raise InputError(
            f"{module.__file__} has more than one {kind} ({', '.join(map(str, found))}): keep one of them."
        )
    (one,) = found.values() or (None,)
    return one if one is None or isfunction(one) else lambda **_: one


def _of_kind(named: Mapping[Any, Any], kind: str) -> dict[Any, Any]:
    return {name: x for name, x in named.items() if type(x).__name__ == kind}


def _returning(module: ModuleType, kind: str) -> dict[str, Callable[..., Any]]:
    """Functions of a module, by name, that are annotated to return a class of rodfem."""
    found: dict[str, Callable[..., Any]] = {}
    for name, x in vars(module).items():
        if isfunction(x) and x.__module__ == module.__name__ and not name.startswith("_"):
            returned = signature(x).return_annotation
            word = returned if isinstance(returned, str) else getattr(returned, "__name__", "")
            if word.rpartition(".")[2].strip("'\"") == kind:
                found[name] = as_sentence(Path(str(module.__file__)), f"correct {name}, or choose other constants")(x)
    return found


def add_options(parser: Parser, load: str, output: Path) -> None:
    """Declare them; ``load`` is the name of the load, ``output`` the default folder."""
    from rodfem.fem import formulations

    made = "; ".join(f"{each.name}: {each.words}" for each in formulations.FORMULATIONS.values())
    auto = f"{formulations.AUTO}: the first that the scene allows (default {formulations.AUTO})"
    known = f"{{{','.join(formulations.NAMES)}}}"
    add = parser.add_argument_group("discretisation").add_argument
    words = "number of finite elements along the rod (default: the scene's own, or 8)"
    add("--elements", type=int, metavar="N", help=words)
    words = "polynomial degree; the error falls as h^(2K) (default: the scene's own, or 6)"
    add("--degree", type=int, metavar="K", help=words)
    add("--formulation", metavar=known, help=f"{made}; {auto}")
    words = "chain: compiled assembly and elimination along the rod, on one rank; petsc: the same numbers, slower, by "
    words += "dolfinx, PETSc and MUMPS, as always on several ranks (default chain)"
    add("--factors", default="chain", metavar="{chain,petsc}", help=words)
    words = "instead of elements and degree: choose meshes on the way such that loads and ordinates are in error by "
    words += "less than EPS (relative to values greater than one)"
    add("--accuracy", type=float, metavar="EPS", help=words)

    add = parser.add_argument_group("what to compute").add_argument
    words = f"start at {load} = A, stay between A and B (default: the scene's)"
    add("--range", dest="span", type=float, nargs=2, metavar=("A", "B"), help=words)
    words = f"compute every branch also at exactly these values of {load}"
    add("--at", type=float, nargs="+", metavar="LOAD", help=words)
    words = "largest step along a branch, in radian of rotation (root mean square; default: the file's own, or 0.15)"
    add("--step", dest="largest", type=float, metavar="S", help=words)
    words = "follow what leaves from branch points of branches of a depth less than D; the first branch has depth 0, "
    words += "what leaves from it 1, and so on (default: the file's own, or 2)"
    add("--depth", type=int, metavar="D", help=words)
    words = "follow nothing more from branch points once there are N branches; 0: no limit (default)"
    add("--most-branches", type=int, metavar="N", help=words)
    words = "bound the errors by a second computation on a richer mesh (default)"
    add("--error-bars", action=argparse.BooleanOptionalAction, default=None, help=words)
    words = "also compute the K left-most eigenvalues of every state with SLEPc"
    add("--spectrum", type=int, metavar="K", help=words)
    words = "judge the states at the loads of --at, and print all that is said, by "
    add("--method", metavar="NAME", help=words + ", ".join((AUTO, *METHODS)))
    words = "find and draw the K left-most modes of the states at the loads of --at"
    add("--modes", type=int, metavar="K", help=words)
    words = "at each load of --at also look for equilibria that no branch has reached, with that many tries"
    add("--search", dest="tries", type=int, metavar="TRIES", help=words)
    words = "follow every special point in the plane of the load and the constant NAME from LOW to HIGH"
    add("--locus", nargs=3, metavar=("NAME", "LOW", "HIGH"), help=words)
    words = "compute how fast the load of each special point changes with each constant"
    add("--sensitivity", action="store_true", default=None, help=words)

    add = parser.add_argument_group("output").add_argument
    words = f"folder for files and pictures (default {output})"
    add("--output", type=folder, default=output, metavar="DIR", help=words)
    add("--no-figures", dest="figures", action="store_false", help="draw nothing")
    words = "print what is technical, too: meshes, special points as they are found, times, methods"
    add("--verbose", action="store_true", help=words)


def discretization_of(options: argparse.Namespace, own: Discretization | None) -> Discretization:
    """Discretisation that the options ask for, or the scene's ``own``; raises :class:`InputError` for what is none."""
    from rodfem.fem.fields import Discretization

    chosen = {name: getattr(options, name) for name in ("formulation", "elements", "degree")}
    given = {name: value for name, value in chosen.items() if value is not None}
    for name in ("elements", "degree"):
        if options.accuracy is not None and name in given:
            raise InputError(f"--accuracy chooses elements and degree itself: leave out --{name}, or --accuracy.")
    own = own or Discretization()
    if options.accuracy is not None and own.vertices is None:
        own = replace(own, elements=Discretization.elements, degree=Discretization.degree)
    return replace(own, factors=options.factors, **given)


def plan_of(options: argparse.Namespace, own: Plan | None) -> Plan:
    """Plan that the options ask for, or the file's ``own``; raises :class:`InputError` for what is none."""
    from rodfem.diagram.plan import Plan

    own, locus = own or Plan(), options.locus
    if locus is not None:
        try:
            locus = locus[0], float(locus[1]), float(locus[2])
        except ValueError:
            what = f"{locus[1]} to {locus[2]} is no interval"
            raise InputError(f"{what}: give two numbers after {locus[0]}.") from None
    same = {x.name for x in fields(Plan)} - {"steps", "events"}
    chosen = {name: getattr(options, name) for name in same} | {"locus": locus}
    if options.largest is not None:
        own = replace(own, steps=replace(own.steps, largest=options.largest))
    return replace(own, **{name: value for name, value in chosen.items() if value is not None})


class Constant(NamedTuple):
    """An argument with its ``name``, ``default``, type ``kind`` and ``words``; ``size`` of a tuple, None of others."""

    name: str
    default: Any
    kind: type
    size: int | None
    words: str

    @property
    def option(self) -> str:
        """As on the command line."""
        return f"--{self.name.replace('_', '-')}"

    def declare(self, group: Any) -> None:
        """Declare the option in a group of options of :mod:`argparse`."""
        shown = " ".join(f"{x:g}" for x in self.default) if self.size else self.default
        default = f"{shown:g}" if self.kind is float and not self.size else shown
        words = f"{self.words} (default {default})".replace("%", "%%").strip()
        how: dict[str, Any] = {"dest": self.name, "default": self.default, "help": words}
        if self.kind is bool:
            group.add_argument(self.option, action=argparse.BooleanOptionalAction, **how)
        else:
            how |= {} if self.size is None else {"nargs": self.size}
            group.add_argument(self.option, type=self.kind, metavar="X" if self.kind is float else "N", **how)


class Statement:
    """A rod as a function of its constants, of a scene alone the parameters apart from its load."""

    def __init__(
        self, of: Callable[..., Scene] | Scene, mesh: Mesh | None = None, plan: Callable[..., Plan] | None = None
    ) -> None:
        """Read the constants; raises :class:`InputError` for one without a default, or of no type that has options."""
        if isinstance(of, Scene):
            scene, self.words = of, of.title
            others = [(name, p.value) for name, p in scene.parameters.items() if name != scene.load]
            self.constants = [Constant(name, value, float, None, "") for name, value in others]
            self._of: Callable[..., Scene] = scene.varying
        else:
            self.words = cleandoc(of.__doc__ or "")
            described = descriptions(getdoc(of) or "")
            self.constants = [_constant(of.__name__, p, described) for p in signature(of).parameters.values()]
            self._of = of
        self._made, self.mesh, self.plan = cache(self._stated), mesh, plan

    def scene(self, **values: Any) -> Scene:
        """The scene with these constants, else their defaults; raises :class:`InputError` where there is none."""
        return self._made(**({c.name: c.default for c in self.constants} | values))

    def _stated(self, **values: Any) -> Scene:
        scene = self._of(**values)
        if not isinstance(scene, Scene):
            raise InputError(f"{getattr(self._of, '__name__', 'it')} returns {scene!r}: let it return a Scene.")
        return scene

    @classmethod
    def of(cls, module: ModuleType, name: str | None) -> Statement:
        """The rod of a module, by its name if there are several, with the mesh and the plan of the module."""
        return cls(rod_of(module, name), own_of(module, "Discretization"), own_of(module, "Plan"))

    def asked(self, options: argparse.Namespace) -> Asked:
        """Scene, mesh and plan of parsed options: what these leave out is the file's own."""
        constants = self.values(options)
        mesh, plan = self.mesh and self.mesh(**constants), self.plan and self.plan(**constants)
        return self.scene(**constants), discretization_of(options, mesh), plan_of(options, plan)

    def values(self, options: argparse.Namespace) -> dict[str, Any]:
        """Values of the constants among parsed options."""
        given = {c.name: getattr(options, c.name) for c in self.constants}
        return {name: tuple(value) if isinstance(value, list) else value for name, value in given.items()}


def _constant(owner: str, argument: Parameter, described: Mapping[str, str]) -> Constant:
    name, default = argument.name, argument.default
    if default is Parameter.empty:
        raise InputError(f"The argument {name} of {owner} has no default: give it one, which an option can replace.")
    size = len(default) if isinstance(default, tuple) else None
    kinds = set(map(type, default)) if size else {type(default)}
    number = kinds == {int} and "float" in str(argument.annotation)
    kind = float if number or kinds == {int, float} else kinds.pop()
    if kind not in ((bool, int, float, str) if size is None else (int, float)):
        raise InputError(
            f"The argument {name} of {owner} has the default {default!r}: give a number, a word, or a tuple of numbers."
        )
    return Constant(name, default, kind, size, described.get(name, ""))


def descriptions(text: str) -> dict[str, str]:
    """Words on each argument, from the section Parameters of a docstring in the style of numpy."""
    _, _, section = text.partition("Parameters\n----------\n")
    found: dict[str, str] = {}
    for name, words in re.findall(r"^(\w+)[^\n]*\n((?:[ \t]+[^\n]+\n?)+)", section, re.MULTILINE):
        found[name] = " ".join(words.split()).removesuffix(".")
    return found
