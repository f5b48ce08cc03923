"""Options of a rod: of its constants, which the function that states it has as arguments; and those of all rods."""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from inspect import Parameter, cleandoc, getdoc, signature
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from rodfem.app.cli import Parser, folder
from rodfem.errors import InputError
from rodfem.problem.scene import Scene
from rodfem.stability.registry import AUTO, METHODS

if TYPE_CHECKING:
    from rodfem.diagram.plan import Plan
    from rodfem.fem.fields import Discretization

STEP = 0.1
"""Largest step along a branch, in radian, by default."""


def add_options(parser: Parser, load: str, output: Path) -> None:
    """Declare them; ``load`` is the name of the load, ``output`` the default folder."""
    from rodfem.fem import formulations

    words = {
        "--elements": "number of finite elements along the rod (default: the scene's own, or 8)",
        "--degree": "polynomial degree; the error falls as h^(2K) (default: the scene's own, or 6)",
        "--formulation": "; ".join(f"{made.name}: {made.words}" for made in formulations.FORMULATIONS.values())
        + f"; {formulations.AUTO}: the first that the scene allows (default {formulations.AUTO})",
        "--factors": "chain: compiled assembly and elimination along the rod, on one rank; petsc: the same numbers, "
        "slower, by dolfinx, PETSc and MUMPS, as always on several ranks (default chain)",
        "--accuracy": "instead of elements and degree: choose meshes on the way such that loads and ordinates are in "
        "error by less than EPS (relative to values greater than one)",
        "--range": f"start at {load} = A, stay between A and B (default: the scene's)",
        "--at": f"compute every branch also at exactly these values of {load}",
        "--step": f"largest step along a branch, in radian of rotation (root mean square; default {STEP})",
        "--depth": "follow what leaves from branch points of branches of a depth less than D; the first branch has "
        "depth 0, what leaves from it 1, and so on (default 2)",
        "--spectrum": "also compute the K left-most eigenvalues of every state with SLEPc",
        "--method": "judge the states at the loads of --at, and print all that is said, by "
        f"{', '.join((AUTO, *METHODS))}",
        "--modes": "find and draw the K left-most modes of the states at the loads of --at",
        "--search": "at each load of --at also look for equilibria that no branch has reached, with that many tries",
        "--locus": "follow every special point in the plane of the load and the constant NAME from LOW to HIGH",
        "--output": f"folder for files and pictures (default {output})",
        "--no-figures": "draw nothing",
    }
    groups: dict[str, dict[str, dict[str, Any]]] = {
        "discretisation": {
            "--elements": {"type": int, "metavar": "N"},
            "--degree": {"type": int, "metavar": "K"},
            "--formulation": {"metavar": f"{{{','.join(formulations.names())}}}"},
            "--factors": {"default": "chain", "metavar": "{chain,petsc}"},
            "--accuracy": {"type": float, "metavar": "EPS"},
        },
        "what to compute": {
            "--range": {"dest": "span", "type": float, "nargs": 2, "metavar": ("A", "B")},
            "--at": {"type": float, "nargs": "+", "default": [], "metavar": "LOAD"},
            "--step": {"dest": "largest", "type": float, "metavar": "S"},
            "--depth": {"type": int, "default": 2, "metavar": "D"},
            "--spectrum": {"type": int, "default": 0, "metavar": "K"},
            "--method": {"default": "", "metavar": "NAME"},
            "--modes": {"type": int, "default": 0, "metavar": "K"},
            "--search": {"dest": "tries", "type": int, "default": 0, "metavar": "TRIES"},
            "--locus": {"nargs": 3, "metavar": ("NAME", "LOW", "HIGH")},
        },
        "output": {
            "--output": {"type": folder, "default": output, "metavar": "DIR"},
            "--no-figures": {"dest": "figures", "action": "store_false"},
        },
    }
    for title, options in groups.items():
        group = parser.add_argument_group(title)
        for option, how in options.items():
            group.add_argument(option, help=words[option], **how)


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


def plan_of(options: argparse.Namespace) -> Plan:
    """Plan that the options ask for; raises :class:`InputError` for what is none."""
    from rodfem.continuation.step_control import StepControl
    from rodfem.diagram.plan import Plan

    return Plan(
        None if options.span is None else tuple(options.span),
        tuple(options.at),
        depth=options.depth,
        spectrum=options.spectrum,
        steps=StepControl(largest=STEP if options.largest is None else options.largest),
        tries=options.tries,
        locus=_pair(options.locus),
        method=options.method,
        modes=options.modes,
        accuracy=options.accuracy,
    )


def _pair(words: Sequence[str] | None) -> tuple[str, float, float] | None:
    """Name and interval of a second parameter; raises :class:`InputError` for what are no numbers."""
    if words is None:
        return None
    try:
        return words[0], float(words[1]), float(words[2])
    except ValueError:
        raise InputError(f"{words[1]} to {words[2]} is no interval: give two numbers after {words[0]}.") from None


KINDS = (bool, int, float, str)
"""Types of a constant; a tuple has numbers."""


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
        how: dict[str, Any] = {"dest": self.name, "default": self.default, "help": self._help()}
        if self.kind is bool:
            group.add_argument(self.option, action=argparse.BooleanOptionalAction, **how)
        else:
            how |= {} if self.size is None else {"nargs": self.size}
            group.add_argument(self.option, type=self.kind, metavar="X" if self.kind is float else "N", **how)

    def _help(self) -> str:
        shown = " ".join(f"{x:g}" for x in self.default) if self.size else self.default
        default = f"{shown:g}" if self.kind is float and not self.size else shown
        return f"{self.words} (default {default})".replace("%", "%%").strip()


class Statement:
    """A rod as a function of its constants, of a scene alone the parameters beside its load."""

    def __init__(self, of: Callable[..., Scene] | Scene) -> None:
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
        self.scene = cache(self._made)

    def _made(self, **values: Any) -> Scene:
        """The scene with these constants; raises :class:`InputError` where the function returns none."""
        scene = self._of(**values)
        if not isinstance(scene, Scene):
            raise InputError(f"{getattr(self._of, '__name__', 'it')} returns {scene!r}: let it return a Scene.")
        return scene

    def values(self, options: argparse.Namespace) -> dict[str, Any]:
        """Values of the constants among parsed options."""
        given = {c.name: getattr(options, c.name) for c in self.constants}
        return {name: tuple(value) if isinstance(value, list) else value for name, value in given.items()}


def _constant(owner: str, argument: Parameter, described: Mapping[str, str]) -> Constant:
    """Constant of an argument of the function ``owner``."""
    name, default = argument.name, argument.default
    if default is Parameter.empty:
        raise InputError(f"The argument {name} of {owner} has no default: give it one, which an option can replace.")
    size = len(default) if isinstance(default, tuple) else None
    kinds = set(map(type, default)) if size else {type(default)}
    number = kinds == {int} and "float" in str(argument.annotation)
    kind = float if number or kinds == {int, float} else kinds.pop()
    if kind not in (KINDS if size is None else (int, float)):
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
