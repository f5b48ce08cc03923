"""The functions of a scene, tried before any computation: with numbers, and as expressions of UFL.

What a function returns has the declared size, and is finite and real.  In the equations each constant is an expression
that stands for any number of its range.  A function that branches by the value of a constant (``c.on == 1``, ``in``,
``if c.on``, a key of a dictionary) takes one branch for numbers and may take another there, where ``==`` compares how
two expressions are written, and all are true.  So the function and its expression are compared at the same constants
and states.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Iterator, Sized
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import chain
from math import inf, isfinite, isnan, nan
from numbers import Real
from typing import TYPE_CHECKING, Any

import ufl

from rodfem.errors import SceneError
from rodfem.expressions import EQ, NE, ComplexValue, ScalarValue, Variable, differentiated, evaluated, parts
from rodfem.problem.arguments import check_scalar, check_vector, number_of, plain, takes
from rodfem.problem.local_state import STATES, Constants, inside, some_places
from rodfem.problem.roles import LOG_OF_UFL, Role, UnnamedError, derived, functions_of
from rodfem.tolerances import NEGLIGIBLE

if TYPE_CHECKING:
    from rodfem.problem.scene import Scene

SAME = 1e-9
"""Difference of two values of a function, over the larger one, below which they are equal."""
OF_PLACES = {"f(x, c)": ("x.q", "x.r", "x.v", "x.k"), "of(x, c)": ("x.q", "x.r", "x.v", "x.k")}
OF_PLACES["W(v, k, c)"] = ("q", "r", "v", "k")
"""Calls of functions of a place, with the names that its quaternion, position and strains have there."""
Pair = tuple[float, float, Constants]
"""Values of an expression and of a function of numbers at these constants; nan if UFL has none, inf if undefined."""


class Symbol(Variable):  # type: ignore[misc]
    """An expression that stands for no number until it has a ``value``: ``math.cos`` refuses it."""

    __slots__ = ("name", "value")

    @classmethod
    def named(cls, name: str, value: float | None = None) -> Symbol:
        """Return what a person's function knows by this ``name``."""
        symbol = cls(ufl.as_ufl(0.0))
        symbol.name, symbol.value = name, value
        return symbol

    def evaluate(self, *_: Any, **__: Any) -> float:
        """Return the value; raises :class:`TypeError` if there is none."""
        if self.value is None:
            raise TypeError("a constant is an expression of UFL")
        return float(self.value)

    def __repr__(self) -> str:
        """Name, as a dictionary has it in its words on a key that it lacks."""
        return self.name


@contextmanager
def _no_truth() -> Iterator[None]:
    """Have ``ufl.eq`` refused for true or false, which UFL answers by how its sides are written."""

    def refuse(condition: Any) -> bool:
        raise UnnamedError("takes ufl.eq or ufl.ne for true or false: write ufl.conditional(ufl.eq(a, b), ..., ...).")

    usual = EQ.__bool__, NE.__bool__
    EQ.__bool__ = NE.__bool__ = refuse
    try:
        yield
    finally:
        EQ.__bool__, NE.__bool__ = usual


def symbols(scene: Scene, names: Container[str] | None = None) -> Constants:
    """Constants as a function of them meets them in the equations: those with the ``names`` (all) as expressions."""
    values = vars(scene.constants())
    return Constants(
        **{n: Symbol.named(f"c.{n}") if names is None or n in names else value for n, value in values.items()}
    )


def check_function(what: str, function: Any, role: Role) -> None:
    """Raise :class:`SceneError` for what is no function of its arguments, nor a constant in the place of one."""
    if not callable(function):
        if role.call == "f(c)" and (isinstance(function, Real) if role.size == 0 else isinstance(function, Sized)):
            return
        method = ", as section.energy(rod) is" if callable(getattr(function, "energy", None)) else ""
        raise SceneError(f"The {what} is {function!r}: give a function {role.call}{method}.")
    if not takes(function, role.arguments):
        meanings = f", where {role.meanings}" if role.meanings else ""
        raise SceneError(f"The {what} is no function of {role.arguments} argument(s): give {role.call}{meanings}.")


def check_functions(scene: Scene) -> None:
    """Raise :class:`SceneError` for a function of a scene that is wrong with numbers, or another as an expression."""
    for trial in _trials(scene):
        trial.compare()


def expressions_of(scene: Scene) -> Iterator[Any]:
    """What functions of a scene return for symbols of its constants."""
    for trial in sorted(_trials(scene), key=lambda trial: trial.of_place):
        yield from (e for e in trial.expressions(0)[1] if e is not None)


def _trials(scene: Scene) -> Iterator[_Trial]:
    for what, function, role in functions_of(scene):
        if role.call in OF_PLACES or (role.call == "f(c)" and role.size is not None):
            yield from (_Trial(scene, what, function, role, s) for s in _places(scene, function, role))


def _places(scene: Scene, function: Any, role: Role) -> list[float | None]:
    """Arclengths at which something acts, numbers in the equations too; None for what is a function of them."""
    if role.along or not role.placed or role.call == "W(v, k, c)":
        return [None]
    at = [x.s for x in scene.parts if x.s is not None and any(function is f for f in vars(x.of).values())]
    return [*dict.fromkeys(at)] or [None]


@dataclass(frozen=True)
class _Trial:
    """A function of a scene, ``what`` it is in words, and the arclength at which it acts, None along the rod."""

    scene: Scene
    what: str
    function: Callable[..., Any]
    role: Role
    s: float | None

    def compare(self) -> None:
        """Raise :class:`SceneError` for a value of the expression that is not the one of the function of numbers."""
        values, scene = list(self._pairs()), self.scene
        size = max((abs(x) for _, x, _ in values if isfinite(x)), default=0.0)
        for symbolic, number, there in values:
            least = SAME * max(abs(number), min(abs(symbolic), size)) + NEGLIGIBLE * size
            if isnan(symbolic) or not isfinite(number) or abs(symbolic - number) <= least:
                continue
            name = next((x for x in scene.parameters if x != scene.load), scene.load)
            raise SceneError(
                f"The {self.what} is {number:.10g} as a function of numbers and {symbolic:.10g} as an expression of "
                f"its constants, at {scene.load} = {vars(there)[scene.load]:g}: do not compare constants by ==, in or "
                f"if, nor use them as keys; write ufl.conditional(ufl.eq(c.{name}, 1), ..., ...)."
            )

    def _pairs(self) -> Iterator[Pair]:
        """Values of both: in all :data:`STATES`, and at loads and arclengths in the first."""
        for state in range(len(STATES) if self.of_place else 1):
            if self.of_place:
                self.expressions(state)  # what it raises is no matter of the state
            for there in self._constants(state):
                numbers = self._numbers(there, state)
                c, expressions = self.expressions(state) if numbers else (there, [])
                for name, symbol in vars(c).items():
                    if isinstance(symbol, Symbol):
                        symbol.value = vars(there)[name]
                yield from ((*_pair(e, x), there) for e, x in zip(expressions, numbers, strict=True))

    def _numbers(self, there: Constants, state: int) -> list[Any]:
        """Numbers that the function returns; none if it is undefined: the rod need not take the state."""
        try:
            values = self._called(there, state)
        except SceneError:
            if self.of_place:
                return []
            raise
        self._check(values)
        return values

    @property
    def of_place(self) -> bool:
        """Whether it is a function of a place."""
        return self.role.call in OF_PLACES

    def _constants(self, state: int) -> Iterator[Constants]:
        """Constants at which the function is tried."""
        scene = self.scene
        s = inside(scene.interval)[0] if self.s is None and self.of_place else self.s
        yield scene.constants(s=s)
        if state == 0:
            yield from (scene.constants(load, s) for load in scene.loads())
        if self.role.along and not self.of_place:
            yield from (scene.constants(s=place) for place in scene.samples())

    def _called(self, c: Constants, state: int, wrap: Callable[[Any], Any] | None = None) -> list[Any]:
        """Components of what the function returns for constants and a state, whose vectors pass through ``wrap``."""
        if self.role.call == "f(c)":
            values = self.function(c)
            if self.role.size:
                check_vector(self.what, values, self.role.size)
            return list(values) if self.role.size else [values]
        energy = self.role.call == "W(v, k, c)"
        x = some_places(self.scene, state, wrap, c.s)[energy or self.role.along]
        return [self.function(x.v, x.k, c) if energy else self.function(x, c)]

    def _check(self, values: list[Any]) -> None:
        """Check kinds, and that constants are finite."""
        for i, value in enumerate(values):
            what = f"component {i + 1} of the {self.what}" if self.role.size else self.what
            if value is None and self.role.gaps:
                continue
            if not self.role.size:
                check_scalar(what, value)
            if not self.of_place and not isfinite(number_of(value)):
                raise SceneError(f"The {what} is {value}: return a finite real number.")

    def expressions(self, state: int) -> tuple[Constants, list[Any]]:
        """Constants as the equations have them, and what the function makes of them; derived once."""
        key = (self.role, self.s, state, self.scene.length, *self.scene.parameters)
        return derived(self.function, key, lambda: self._symbolic(state))

    def _symbolic(self, state: int) -> tuple[Constants, list[Any]]:
        c = symbols(self.scene, None if self.s is None else self.scene.parameters)
        if self.s is not None:
            c.s = self.s
        with _no_truth():
            found = self._called(c, state, _named(OF_PLACES.get(self.role.call, ())))
        if self.of_place:
            self._check(found)
        for part in chain.from_iterable(parts(e) for e in found if e is not None):
            if isinstance(part, ComplexValue) or (isinstance(part, ScalarValue) and not isfinite(part)):
                raise SceneError(f"The {self.what} has {part} in it: return an expression of finite real numbers.")
        return c, [e if e is None else differentiated(ufl.as_ufl(e)) for e in found]


def _named(names: tuple[str, ...]) -> Callable[[Any], Any]:
    """Return what makes vectors of symbols, of these ``names`` in turn, with the values of other vectors."""
    following = iter(names)

    def symbolic(vector: Any) -> Any:
        name, size = next(following), vector.ufl_shape[0]
        return ufl.as_vector([Symbol.named(f"{name}[{i}]", float(vector[i])) for i in range(size)])

    return symbolic


def _pair(expression: Any, value: Any) -> tuple[float, float]:
    """Values of an expression and of a function; of two that are None nan, of one that is None none that agree."""
    if expression is None or value is None:
        return (nan, nan) if expression is value else (inf, 0.0)
    return _value(expression), number_of(value)


def _value(expression: Any) -> float:
    """Value of an expression at the numbers that its symbols have: inf if undefined, nan if UFL has none."""
    silent, LOG_OF_UFL.disabled = LOG_OF_UFL.disabled, True
    try:
        return plain(evaluated(expression))
    except (ArithmeticError, ValueError):
        return inf
    except Exception:  # of UFL's own, too, for a function that it does not evaluate
        return nan
    finally:
        LOG_OF_UFL.disabled = silent
