"""Constants of a scene as options: arguments of the function that states it, with their defaults and words."""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable, Mapping
from functools import cache
from inspect import Parameter, cleandoc, getdoc, signature
from typing import Any, NamedTuple

from rodfem.errors import InputError
from rodfem.problem.scene import Scene

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
    kinds = {type(x) for x in (default if size else (default,))}
    kind = float if kinds == {int, float} or (kinds == {int} and "float" in str(argument.annotation)) else kinds.pop()
    if kind not in KINDS or (size is not None and kind not in (int, float)):
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
