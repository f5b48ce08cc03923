"""Results of the functions of a scene: of the declared size, finite, real, and the same whenever they are called.

A function of the constants is called at the scene's own load and at several of its range, one along the rod at
several arclengths too; a function of a place at some states, of which it may be undefined at one or another.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from itertools import chain
from math import isfinite, nan
from reprlib import Repr
from typing import TYPE_CHECKING, Any

import numpy as np
import ufl
from ufl.classes import ComplexValue, ScalarValue
from ufl.corealg.traversal import unique_pre_traversal

from rodfem.errors import SceneError
from rodfem.problem.kinds import check_scalar, check_vector, number_of
from rodfem.problem.local_state import STATES, Constants, Place, inside, some_places
from rodfem.problem.roles import Role, functions_of
from rodfem.tolerances import NEGLIGIBLE

if TYPE_CHECKING:
    from rodfem.problem.scene import Scene


SHORT = Repr()


def check_results(scene: Scene) -> None:
    """Check what functions of the constants and of a place return, and the energy; raises :class:`SceneError`."""
    c = scene.constants()
    for what, function, role in functions_of(scene):
        if role.call == "f(c)" and role.size is not None:
            for there in _constants(scene, role):
                _check_numbers(what, role, function(there))
            check_same(what, *(_numbers(role, function(there)) for _ in range(2)))
        elif role.call == "f(x, c)":
            check_expression(what, function(some_places(scene, wrap=ufl.variable)[role.along], c))
            where = [x.s for x in scene.constraints if x.of is function and x.s is not None] or inside(scene.interval)
            states = _states_at(scene, role, where[0])
            numbers = [_at(function, *x) for x in states]
            check_same(what, numbers, [_at(function, *x) for x in states])
            if role.load is None:
                others = ([_at(function, *x) for x in _states_at(scene, role, s)] for s in where[1:])
                _check_equation(what, chain([numbers], others))
    x = some_places(scene)[True]
    check_same("stored energy", *([number_of(scene.energy(x.v, x.k, c))] for _ in range(2)))


def check_same(what: str, first: Any, second: Any) -> None:
    """Raise :class:`SceneError` where a function has returned different numbers for the same arguments."""
    if not np.array_equal(first, second, equal_nan=True):
        raise SceneError(
            f"The {what} returns other values each time it is called, {SHORT.repr(first)} and "
            f"{SHORT.repr(second)}: let them depend on its arguments alone, not on random numbers or a clock."
        )


def check_finite(what: str, value: Any) -> None:
    """Raise :class:`SceneError` unless a ``value`` of the constants alone is a finite real number."""
    if not isfinite(number_of(value)):
        raise SceneError(f"The {what} is {value}: return a finite real number.")


def _constants(scene: Scene, role: Role) -> Iterator[Constants]:
    """Constants at the load of the scene, of what acts along the rod at arclengths, and last at loads of its range."""
    yield scene.constants()
    yield from (scene.constants(s=s) for s in scene.samples() if role.along)
    yield from (scene.constants(load) for load in scene.loads())


def _check_numbers(what: str, role: Role, values: Any) -> None:
    if not role.size:
        check_scalar(what, values)
        check_finite(what, values)
        return
    check_vector(what, values, role.size)
    for i, value in enumerate(values):
        if value is not None or not role.gaps:
            check_finite(f"component {i + 1} of the {what}", value)


def _numbers(role: Role, values: Any) -> list[float]:
    return [nan if x is None else number_of(x) for x in (values if role.size else [values])]


def _at(function: Callable[..., Any], x: Place, c: Constants) -> float:
    """Value of a function of a place, nan where it is undefined: at a state that the rod need not take."""
    try:
        return number_of(function(x, c))
    except SceneError:
        return nan


def check_expression(what: str, expression: Any) -> None:
    """Raise :class:`SceneError` for what is no scalar, or has a number in it that is not finite, or complex."""
    check_scalar(what, expression)
    for part in unique_pre_traversal(ufl.as_ufl(expression)):
        if isinstance(part, ComplexValue) or (isinstance(part, ScalarValue) and not isfinite(part)):
            raise SceneError(f"The {what} has {part} in it: return an expression of finite real numbers.")


def _states_at(scene: Scene, role: Role, s: float) -> list[tuple[Place, Constants]]:
    """Arguments of a function of a place, in all of :data:`STATES`, at an arclength."""
    return [(some_places(scene, i, s=s)[role.along], scene.constants(s=s)) for i in range(len(STATES))]


def _check_equation(what: str, values: Iterable[list[float]]) -> None:
    """Raise :class:`SceneError` for an equation that says nothing of the state, by its values at several places.

    At one place or another one of the whole rod may say nothing: where a weight is zero.
    """
    for here in values:
        varies = max(here) - min(here) > NEGLIGIBLE * max(map(abs, here))
        if varies or not all(map(isfinite, here)):  # it says something of a state at which it is not defined
            return
    raise SceneError(f"The {what} is {here[0]:g} whatever the state: let it depend on x, the place.")
