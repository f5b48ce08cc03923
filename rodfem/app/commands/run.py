"""Trace the rod of a file, with its constants as options."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from inspect import isfunction, signature
from pathlib import Path
from types import ModuleType
from typing import Any

from rodfem.app.main import Mesh
from rodfem.app.main import main as run_rod
from rodfem.app.persons_file import load
from rodfem.errors import InputError
from rodfem.problem.scene import Scene

USAGE = "rodfem run FILE.py [--scene NAME] [OPTIONS]"
HELP = f"""usage: {USAGE}

Trace the rod of a file: a Scene, or a function with '-> Scene' whose arguments have defaults and are the rod's
constants. Where the file has several, --scene names one. A function with '-> Discretization' of the same constants is
its mesh, where no option asks for another.

rodfem run FILE.py --help lists all options of the rod.
"""


def main(words: Sequence[str]) -> None:
    """Run it; raises :class:`~rodfem.errors.InputError` where the file has no rod, or does not run."""
    if not words or words[0] in ("-h", "--help"):
        print(HELP, end="")
        sys.exit(0)
    file, *rest = words
    name = None
    if rest[:1] == ["--scene"]:
        name, rest = (rest[1] if len(rest) > 1 else ""), rest[2:]
    module = load(Path(file))
    run_rod(rod_of(module, name), mesh_of(module), rest, f"rodfem run {file}")


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
