"""Constants and places as expressions: what a function of a scene meets in the equations, instead of plain numbers.

A function that branches by the value of a constant (``c.on == 1``, ``in``, ``if c.on``, a key of a dictionary) takes
one branch for numbers and may take another in the equations, where each constant stands for any number of its range.
There ``==`` compares how two expressions are written, and all are true.  A comparison is refused as it is made; what
else may differ, in the numbers that the expression and the function have at the same constants and state.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Container, Iterator
from contextlib import contextmanager
from functools import partial
from math import isfinite, isinf, isnan
from typing import TYPE_CHECKING, Any

import ufl

from rodfem.errors import SceneError
from rodfem.problem.kinds import number_of
from rodfem.problem.local_state import STATES, Constants, inside, some_places
from rodfem.problem.roles import Role, UnnamedError, derived, functions_of
from rodfem.problem.values import Values
from rodfem.tolerances import NEGLIGIBLE

if TYPE_CHECKING:
    from rodfem.problem.scene import Scene

SAME = 1e-9
"""Difference of two values of a function, over the larger one, below which they are equal."""
_Pair = tuple[float | None, float | None, Constants]
"""Values of an expression and of a function of numbers, None where it leaves a component free, at these constants."""


class Symbol(ufl.classes.Variable):  # type: ignore[misc]
    """An expression that stands for no number until it has a ``value``: ``math.cos`` refuses it.

    A person's function cannot compare it by ``==``, nor take it for true or false; UFL does so with all expressions.
    """

    __slots__ = ("name", "value")

    @classmethod
    def named(cls, name: str, value: float | None = None) -> Symbol:
        """Return what a person's function knows by this ``name``."""
        symbol = cls(ufl.as_ufl(0.0))
        symbol.name, symbol.value = name, value
        return symbol

    def evaluate(self, *_: Any, **__: Any) -> float:
        """Return the value; raises :class:`TypeError` where there is none."""
        if self.value is None:
            raise TypeError("a constant is an expression of UFL")
        return float(self.value)

    def __repr__(self) -> str:
        """Name, as a dictionary has it in its words on a key that it lacks."""
        return self.name

    __hash__ = ufl.classes.Variable.__hash__

    def __eq__(self, other: object) -> bool:
        """Whether both are the same expression; raises :class:`UnnamedError` in a person's function."""
        self._refuse("compares {} by ==, != or in", "ufl.eq({}, 1)")
        return bool(super().__eq__(other))

    def __ne__(self, other: object) -> bool:
        """Whether both are not the same expression; raises :class:`UnnamedError` in a person's function."""
        self._refuse("compares {} by ==, != or in", "ufl.eq({}, 1)")
        return not super().__eq__(other)

    def __bool__(self) -> bool:
        """Be true, as all expressions are; raises :class:`UnnamedError` in a person's function."""
        self._refuse("takes {} for true or false", "ufl.ne({}, 0)")
        return True

    def _refuse(self, does: str, condition: str) -> None:
        if _is_a_persons(3):
            raise UnnamedError(
                f"{does.format(self.name)}, which has no value yet where the equations are made: write "
                f"ufl.conditional({condition.format(self.name)}, ..., ...) instead of if."
            )


def _is_a_persons(depth: int) -> bool:
    """Whether the caller at a ``depth`` of the stack is a person's function, or what it calls, but UFL and rodfem."""
    frame: Any = sys._getframe(depth)
    if _package(frame) == "rodfem":
        return False
    while frame is not None and _package(frame) != "rodfem":
        if _package(frame) == "ufl":
            return False
        frame = frame.f_back
    return True


def _package(frame: Any) -> str:
    return str(frame.f_globals.get("__name__", "")).partition(".")[0]


@contextmanager
def _conditions_are_not_asked() -> Iterator[None]:
    """Have a person's function refused inside the block that takes ``ufl.eq`` for true or false.

    UFL answers by how the two sides are written; it refuses other conditions itself.
    """

    def refuse(usual: Callable[[Any], bool]) -> Callable[[Any], bool]:
        def asked(condition: Any) -> bool:
            if _is_a_persons(2):
                raise UnnamedError(
                    "takes ufl.eq or ufl.ne for true or false, which has no value yet where the equations are made: "
                    "write ufl.conditional(ufl.eq(..., ...), ..., ...) instead of if."
                )
            return usual(condition)

        return asked

    kinds = ufl.classes.EQ, ufl.classes.NE
    before = [kind.__bool__ for kind in kinds]
    for kind in kinds:
        kind.__bool__ = refuse(kind.__bool__)
    try:
        yield
    finally:
        for kind, usual in zip(kinds, before, strict=True):
            kind.__bool__ = usual


def symbols(scene: Scene, names: Container[str] | None = None) -> Constants:
    """Constants as a function of them meets them in the equations: those with the ``names`` (all) as expressions."""
    values = vars(scene.constants())
    return Constants(
        **{n: Symbol.named(f"c.{n}") if names is None or n in names else value for n, value in values.items()}
    )


def check_expressions(scene: Scene) -> None:
    """Raise :class:`SceneError` for a function with other values as an expression of symbols than as one of numbers."""
    for what, function, role in functions_of(scene):
        if role.call == "f(c)":
            check = _check_of_constants
        elif role.call in ("f(x, c)", "of(x, c)", "W(v, k, c)"):
            check = _check_of_places
        else:
            continue
        for s in _places(scene, function, role):
            with _conditions_are_not_asked():
                check(scene, what, function, role, s)


def _places(scene: Scene, function: Any, role: Role) -> list[float | None]:
    """Arclengths at which something acts, numbers in the equations too; None for what is a function of them."""
    if role.along or not role.placed or role.call == "W(v, k, c)":
        return [None]
    at = [x.s for x in scene.parts if x.s is not None and any(function is f for f in vars(x.of).values())]
    return [*dict.fromkeys(at)] or [None]


def _constants(scene: Scene, s: float | None) -> Constants:
    """Constants as the equations have them, at an arclength ``s`` or along the rod."""
    c = symbols(scene, None if s is None else scene.parameters)
    return c if s is None else Constants(**{**vars(c), "s": s})


def _give(c: Constants, there: Constants) -> None:
    """Let the symbols of constants have the numbers of others."""
    for name, symbol in vars(c).items():
        if isinstance(symbol, Symbol):
            symbol.value = vars(there)[name]


def _check_of_constants(scene: Scene, what: str, function: Callable[[Any], Any], role: Role, s: float | None) -> None:
    """Compare a function of the constants and its expression: at the scene's load, at others, and at arclengths."""
    c, expressions = derived(function, (role, s, *scene.parameters), lambda: _of_constants(scene, function, role, s))
    places = scene.samples() if role.along else []
    values: list[_Pair] = []
    for there in (
        scene.constants(s=s), *(scene.constants(x, s) for x in scene.loads()), *(scene.constants(s=x) for x in places),
    ):  # fmt: skip
        numbers = _listed(role, function(there))
        _give(c, there)
        values += [
            (e if e is None else e.at(), x if x is None else number_of(x), there)
            for e, x in zip(expressions, numbers, strict=True)
        ]
    _compare(scene, what, values)


def _of_constants(scene: Scene, function: Any, role: Role, s: float | None) -> tuple[Constants, list[Any]]:
    """Symbols of the constants, and what a function of them returns as expressions."""
    c = _constants(scene, s)
    return c, [e if e is None else Values(e) for e in _listed(role, function(c))]


def _of_place(scene: Scene, function: Any, role: Role, s: float | None, state: int) -> tuple[Constants, Values]:
    """The same of a function of a place, in a state."""
    c, energy = _constants(scene, s), role.call == "W(v, k, c)"
    names = ("q", "r", "v", "k") if energy else ("x.q", "x.r", "x.v", "x.k")
    x = some_places(scene, state, _named(names), c.s)[energy or role.along]
    return c, Values(function(x.v, x.k, c) if energy else function(x, c))


def _check_of_places(scene: Scene, what: str, function: Callable[..., Any], role: Role, s: float | None) -> None:
    """Compare a function of a place and its expression: in all of :data:`STATES`, and at loads in the first."""
    energy = role.call == "W(v, k, c)"
    at, along = inside(scene.interval)[0] if s is None else s, energy or role.along
    values: list[_Pair] = []
    for i in range(len(STATES)):
        key = (role, s, i, scene.length, *scene.parameters)
        c, expression = derived(function, key, partial(_of_place, scene, function, role, s, i))
        y = some_places(scene, i, s=at)[along]
        for load in [None] if i else [None, *scene.loads()]:
            there = scene.constants(load, at)
            _give(c, there)
            try:
                number = number_of(function(y.v, y.k, there) if energy else function(y, there))
            except SceneError:  # undefined: at a state that the rod need not take
                continue
            values.append((expression.at(), number, there))
    _compare(scene, what, values)


def _named(names: tuple[str, ...]) -> Callable[[Any], Any]:
    """Return what makes vectors of symbols, of these ``names`` in turn, with the values of other vectors."""
    following = iter(names)

    def symbolic(vector: Any) -> Any:
        name, size = next(following), vector.ufl_shape[0]
        return ufl.as_vector([Symbol.named(f"{name}[{i}]", float(vector[i])) for i in range(size)])

    return symbolic


def _listed(role: Role, values: Any) -> list[Any]:
    return list(values) if role.size else [values]


def _compare(scene: Scene, what: str, values: list[_Pair]) -> None:
    """Raise :class:`SceneError` for a value of an expression that is not the one of the function of numbers."""
    size = max((abs(x) for _, x, _ in values if x is not None and isfinite(x)), default=0.0)
    for symbolic, number, there in values:
        if symbolic is None and number is None:
            continue
        if symbolic is not None and number is not None:
            least = SAME * max(abs(number), min(abs(symbolic), size)) + NEGLIGIBLE * size
            if isnan(symbolic) or not isfinite(number) or abs(symbolic - number) <= least:
                continue
        name = next((x for x in scene.parameters if x != scene.load), scene.load)
        raise SceneError(
            f"The {what} is {_words(number)} as a function of numbers and {_words(symbolic)} as an expression of its "
            f"constants, at {scene.load} = {vars(there)[scene.load]:g}: do not compare constants by ==, in or if, nor "
            f"use them as keys; write ufl.conditional(ufl.eq(c.{name}, 1), ..., ...)."
        )


def _words(value: float | None) -> str:
    return "None" if value is None else "undefined" if isinf(value) else f"{value:.10g}"
