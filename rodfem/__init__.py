"""Stability of the equilibria of elastic rods: which are stable, and where they stop being so.

A person states a :class:`Scene` and calls :func:`run`, which traces the equilibria, decides the stability of each,
finds and classifies the points where it is lost, follows what branches off, and writes files and pictures::

    from math import hypot
    from rodfem.forms.energy import bending_and_twist
    from rodfem import Ordinate, Parameter, Scene, clamped, free, run, trace

    column = Scene(
        name="column",
        interval=(0.0, 1.0),
        rod="unshearable and inextensible",
        energy=lambda v, k, c: bending_and_twist(k, (c.EI, 2 * c.EI, 1.0)),
        parameters={"P": Parameter(0.0), "EI": Parameter(1.0)},
        load="P",
        ends=(clamped(), free(force=lambda c: (0.0, 0.0, -c.P))),
        ordinate=Ordinate("tip displacement", s=1.0, of=lambda r, q: hypot(r[0], r[1])),
        span=(0.0, 10.0),
    )
    run(column)                   # with files and pictures
    diagram = trace(column)       # without

A :class:`Scene` states a rod: any stored energy ``W(v, k, c)`` that returns a UFL expression of the strains, the
constants and the arclength ``c.s`` (:mod:`rodfem.forms.energy`, :mod:`section <rodfem.problem.section>`), ends,
attachments, constraints, loads, tables.  :func:`trace` returns a :class:`Diagram`: ``diagram["branch 1"]``,
``.special("fold")``, ``.at(40.0)``, ``.assess(point)``, ``.modes(point)``, ``.locus(special, "A", (-3, 0))``,
``.search(40.0)``, ``.show(point)``, ``.plot()``, ``.view()``, ``.save(folder)``; :func:`load` reads a saved one.
:func:`run` is the same with a terminal, files and pictures; :func:`many` shares a list of scenes among the ranks.  A
:class:`Solver` is a scene on a mesh, for one state at a time; a :class:`Point` has its shape, forces and reactions as
arrays.

This module loads nothing by itself, so that files can be drawn without MPI; its names are loaded when they are used.
``__init__.pyi`` says from where, here and to type checkers.
"""

from __future__ import annotations

import re
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

__version__ = "0.1.0"

_STUB = Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8")
_HOMES = {name: home for home, name in re.findall(r"^from rodfem\.([\w.]+) import (\w+) as", _STUB, re.MULTILINE)}
_NAMES = sorted(_HOMES)

__doc__ = f"{__doc__ or ''}\nPublic names, by module (``help(rodfem.Scene)`` describes one of them):\n\n" + "\n".join(
    f"* ``{home}``: {', '.join(name for name in _NAMES if _HOMES[name] == home)}" for home in sorted({*_HOMES.values()})
)


def __getattr__(name: str) -> Any:
    """Load a public name from its module at first use.

    ``help(rodfem)`` asks for ``__all__`` as ``from rodfem import *`` does, but gets none: it would print every class.
    """
    if name == "__all__" and sys._getframe(1).f_globals.get("__name__") != "pydoc":
        return _NAMES
    if name not in _HOMES:
        raise AttributeError(f"module 'rodfem' has no attribute {name!r}; it has {', '.join(_NAMES)}")
    if name == "section":
        return import_module("rodfem.problem.section")
    return getattr(import_module(f"rodfem.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return _NAMES
