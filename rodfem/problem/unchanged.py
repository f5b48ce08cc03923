"""Functions of a scene that have become others since it was made: they use a variable that was given another value.

Python looks a variable up when a function is called.  Scenes that are made in a loop and traced behind it all have the
value that the variable has in the end, also in their equations, where nothing shows it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from rodfem.errors import SceneError
from rodfem.problem.kinds import number_of
from rodfem.problem.local_state import STATES, some_places, trials
from rodfem.problem.roles import Role, functions_of

if TYPE_CHECKING:
    from rodfem.problem.scene import Scene


def numbers_of(scene: Scene) -> list[tuple[str, list[float]]]:
    """Values of each function of a scene by its words: at some constants and states, nan where it is undefined."""
    return [(what, list(_numbers(scene, function, role))) for what, function, role in functions_of(scene)]


def check_unchanged(scene: Scene) -> None:
    """Raise :class:`SceneError` for a function with other values than those when the scene was made."""
    for (what, before), (_, now) in zip(scene.numbers, numbers_of(scene), strict=True):
        if not np.array_equal(before, now, equal_nan=True):
            a, b = next((a, b) for a, b in zip(before, now, strict=True) if a != b and (a == a or b == b))
            raise SceneError(
                f"The {what} was {a:.10g} when the scene {scene.name!r} was made and is {b:.10g} now: it uses a "
                "variable that has changed, as that of a loop does. Make it a parameter, or keep its value, as K in "
                "lambda v, k, c, K=K: ..."
            )


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
