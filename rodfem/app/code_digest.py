"""A digest of functions by what they do: their code, constants, and the functions that they call; and of a scene.

What a scene states is in its fields, in the code of its functions, and in the values that these have at some states:
an object, a method or a partial function has the same code whatever numbers it holds.

Files that are used again tell by it whether an energy, or the work on a rod, has changed since.  Another version of
Python compiles to other code: then what could be used is computed anew.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from functools import partial
from inspect import unwrap
from types import CodeType, FunctionType, MethodType
from typing import Any

import numpy as np

from rodfem.errors import SceneError
from rodfem.problem.kinds import number_of
from rodfem.problem.local_state import STATES, some_places, trials
from rodfem.problem.roles import Role, functions_of
from rodfem.problem.scene import Scene

VALUES = (bool, int, float, complex, str, bytes, type(None))
"""Types of values that are part of what a function does; objects of others may change while it runs."""


def digest(functions: Iterable[Callable[..., Any]]) -> str:
    """Sixteen hexadecimal digits that are equal for functions of the same code, defaults and constants."""
    seen: set[int] = set()
    parts = [part for function in functions for part in _of(function, seen)]
    return hashlib.sha1("\n".join(parts).encode()).hexdigest()[:16]


def digest_of(scene: Scene) -> str:
    """Sixteen hexadecimal digits that are equal for scenes that state the same rod."""
    parts = [*_stated(scene), repr(_values(scene)), digest(function for _, function, _ in functions_of(scene))]
    return hashlib.sha1("\n".join(parts).encode()).hexdigest()[:16]


def _values(scene: Scene) -> list[tuple[str, list[float]]]:
    """Values of each function of a scene by its words: at some constants and states, nan where it is undefined."""
    return [(what, list(_numbers(scene, function, role))) for what, function, role in functions_of(scene)]


def _numbers(scene: Scene, function: Callable[..., Any], role: Role) -> Iterator[float]:
    if role.call == "f(c)":
        for c in trials(scene, function):
            values = function(c)
            yield from (np.nan if x is None else number_of(x) for x in (values if role.size else [values]))
        return
    for i, (q, r, *_) in enumerate(STATES):
        x, c = some_places(scene, i)[role.along or role.call == "W(v, k, c)"], scene.constants()
        try:
            if role.call == "W(v, k, c)":
                yield number_of(function(x.v, x.k, c))
            elif role.call == "of(r, q)":
                yield number_of(function(scene.length * np.array(r), np.array(q)))
            elif role.call == "start(s)":
                yield from np.ravel(function(np.array(scene.interval)))
            else:
                yield number_of(function(x, c))
        except SceneError:  # undefined there: a state that the rod need not take
            yield np.nan


def _stated(value: Any) -> Iterator[str]:
    """Fields of an object and of all that it is made of; of functions that there is one."""
    if is_dataclass(value) and not isinstance(value, type):
        yield type(value).__name__
        for field in fields(value):
            yield field.name
            yield from _stated(getattr(value, field.name))
    elif isinstance(value, Mapping):
        yield from (part for item in value.items() for part in _stated(item))
    elif isinstance(value, tuple | list):
        yield str(len(value))
        yield from (part for x in value for part in _stated(x))
    else:
        yield "function" if callable(value) else repr(value)


def _of(value: Any, seen: set[int]) -> Iterator[str]:
    """Parts of a function, each once, or of a value."""
    if isinstance(value, VALUES):
        yield repr(value)
    elif isinstance(value, np.ndarray):
        yield f"{value.dtype} {value.shape} {value.tobytes().hex()}"
    elif isinstance(value, (tuple, frozenset)):
        for x in sorted(value, key=repr) if isinstance(value, frozenset) else value:
            yield from _of(x, seen)
    elif isinstance(value, partial):
        for x in (value.func, *value.args, *value.keywords.items()):
            yield from _of(x, seen)
    elif isinstance(value, MethodType):
        yield from _of(value.__func__, seen)
    elif isinstance(value, CodeType):
        yield value.co_code.hex() + " ".join(value.co_names)
        for constant in value.co_consts[bool(value.co_consts and isinstance(value.co_consts[0], str)) :]:
            yield from _of(constant, seen)
    elif isinstance(function := unwrap(value) if callable(value) else value, FunctionType):
        if id(function) not in seen:
            seen.add(id(function))
            yield from _of_function(function, seen)


def _of_function(function: FunctionType, seen: set[int]) -> Iterator[str]:
    """Code, defaults, closure, and the functions and constants of its module that a function names."""
    yield from _of(function.__code__, seen)
    yield from _of(function.__defaults__, seen)
    for cell in function.__closure__ or ():
        yield from _of(cell.cell_contents, seen)
    known = (function.__globals__.get(name) for name in function.__code__.co_names)
    for value in known:
        if isinstance(value, (*VALUES, np.ndarray)) or (
            isinstance(value, FunctionType) and value.__module__ == function.__module__
        ):
            yield from _of(value, seen)
