"""What a scene is made of as functions of parameters alone: at some states, and at places along the rod.

Of a function of the state its first and second derivatives count: they are what loads and stiffnesses are made of.  In
its value one term hides another, and a constant hides both.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import combinations_with_replacement
from typing import TYPE_CHECKING, Any

import numpy as np
import ufl
from ufl.classes import Zero
from ufl.corealg.traversal import unique_pre_traversal

from rodfem.errors import SceneError
from rodfem.problem.enclosure import refined
from rodfem.problem.gradients import derivative, is_polynomial
from rodfem.problem.kinds import plain
from rodfem.problem.local_state import STATES, Constants, OfConstants, some_places, watched
from rodfem.problem.pointwise import LocalState, pointwise
from rodfem.problem.roles import functions_of
from rodfem.problem.values import Symbol, Values, scalar
from rodfem.tolerances import TINY

if TYPE_CHECKING:
    from rodfem.problem.scene import Scene

LEAST = 1e-12
"""Value of what is made of an energy, over the natural one, below which it is none."""
ALONG = 33
"""Places along the rod, at equal distances, besides both sides of all breaks."""


@dataclass
class Part:
    """An expression by its ``values``, where it has the same ones in several states that ``fixed`` symbols tell apart.

    ``state`` (k,) has the number of the first of each ``group`` of such states, which is (number of states,).
    """

    values: Values
    state: np.ndarray
    group: np.ndarray

    @classmethod
    def of(cls, values: Values, fixed: dict[Symbol, np.ndarray], states: int) -> Part:
        """Tell states apart by those symbols that the expression has."""
        asked = [each for symbol, each in fixed.items() if symbol in values.symbols]
        if not asked:
            return cls(values, np.zeros(1, dtype=int), np.zeros(states, dtype=int))
        _, state, group = np.unique(np.array(asked).T, axis=0, return_index=True, return_inverse=True)
        return cls(values, state, group.ravel())


class ParameterFunction:
    """Numbers that depend on the parameters of some ``symbols``, by ``expressions`` of these and of ``fixed`` ones.

    Each expression is a number in each of as many ``states`` as the fixed symbols have values, where they differ.
    Those that are no polynomials of the parameters may be ``narrow`` peaks.  Values below the ``least`` one are none.
    Of two parameters they are ``joint`` where they are no sum of a function of each.
    """

    least = TINY

    def __init__(
        self, symbols: list[Symbol], expressions: list[Values], fixed: dict[Symbol, np.ndarray] | None = None
    ) -> None:
        """Keep what the numbers are made of."""
        self.symbols, self.expressions, self.fixed = symbols, expressions, fixed or {}
        self.states = min((len(values) for values in self.fixed.values()), default=1)
        self.parts = [Part.of(values, self.fixed, self.states) for values in expressions]
        self.narrow = [part for part in self.parts if not is_polynomial(part.values.expression, symbols)]

    @cached_property
    def joint(self) -> bool:
        """Whether a mixed derivative does not vanish."""
        x, y = self.symbols
        return any(not isinstance(derivative(derivative(of.expression, x), y), Zero) for of in self.expressions)

    def __call__(self, places: np.ndarray) -> np.ndarray:
        """Numbers (n, m) for ``places`` (n, number of parameters); nan for what is not defined."""
        return np.concatenate([self._of(part, places) for part in self.parts], axis=1)

    def _of(self, part: Part, places: np.ndarray) -> np.ndarray:
        """Numbers (n, k) of one expression."""
        at = {symbol: np.repeat(x, len(part.state)) for symbol, x in zip(self.symbols, places.T, strict=True)}
        at |= {symbol: np.tile(each[part.state], len(places)) for symbol, each in self.fixed.items()}
        return part.values(at).reshape(len(places), len(part.state))

    def sizes(self, numbers: np.ndarray) -> np.ndarray:
        """Of each of some ``numbers`` (n, m) the largest one in its state, of any expression: (m,).

        That of the least such state, where a number is that of several.
        """
        ends = np.cumsum([len(part.state) for part in self.parts])[:-1]
        each = zip(self.parts, np.split(_largest(numbers), ends), strict=True)
        sizes, found = np.max([of[part.group] for part, of in each], axis=0), list[np.ndarray]()
        for part in self.parts:
            found.append(np.full(len(part.state), np.inf))
            np.minimum.at(found[-1], part.group, sizes)
        return np.concatenate(found)

    def places(self, seen: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Where on the line of parameters ``a + t (b - a)`` numbers have to be looked at: ``t`` (n,), ascending.

        Those in ``seen`` are among them; ``a`` and ``b`` are of shape (number of parameters,).
        """
        places, t = seen, Symbol()
        lines = {symbol: (float(p), float(q - p)) for symbol, p, q in zip(self.symbols, a, b, strict=True)}
        for part in self.narrow:
            size = np.maximum(_largest(self._of(part, a + places[:, None] * (b - a))), self.least)
            fixed = {symbol: (each[part.state, None], 0.0) for symbol, each in self.fixed.items()}
            places = refined(part.values.expression, t, places, size[:, None], {**fixed, **lines})
        return places

    def halves(self) -> list[ParameterFunction]:
        """The same in one half of the states, and in the other."""
        found, half = list[ParameterFunction](), self.states // 2
        for some in (slice(half), slice(half, None)):
            fixed = {symbol: each[some] for symbol, each in self.fixed.items()}
            found.append(ParameterFunction(self.symbols, self.expressions, fixed))
            found[-1].least = self.least
        return found


class Numerical(ParameterFunction):
    """The same of a ``function`` of constants that needs numbers, as one that compares a parameter in Python does."""

    def __init__(self, function: OfConstants, known: dict[str, Any], names: tuple[str, ...]) -> None:
        """Call it with the ``known`` values but for the parameters with these ``names``."""
        super().__init__([Symbol() for _ in names], [])
        self.joint = True
        self.function, self.known, self.names = function, known, names

    def __call__(self, places: np.ndarray) -> np.ndarray:
        """Numbers (n, m) for ``places`` (n, number of parameters); nan for what is not defined."""
        rows = [self._at(place) for place in places.tolist()]
        wide = max(map(len, rows), default=1)
        return np.array([row if len(row) == wide else [float("nan")] * wide for row in rows])

    def sizes(self, numbers: np.ndarray) -> np.ndarray:
        """Of each of some ``numbers`` (n, m) the largest one of them all: (m,)."""
        return np.full(numbers.shape[1], _largest(numbers).max(initial=0.0))

    def _at(self, place: list[float]) -> list[float]:
        try:
            values = self.function(Constants(**{**self.known, **dict(zip(self.names, place, strict=True))}))
        except SceneError:
            return [float("nan")]
        return [_number(x) for x in (values if isinstance(values, (tuple, list)) else [values])]


def parameter_functions(
    scene: Scene, names: tuple[str, ...], **values: float
) -> Iterator[tuple[str, ParameterFunction]]:
    """Functions that depend on all parameters with these ``names``, in words.

    Other parameters have the ``values`` that are given, or those of the ``scene``.
    """
    yield from _of_constants(scene, names, values)
    try:
        found = list(_of_states(scene, names, values))
    except Exception:  # of UFL's own, and of what compares a parameter in Python
        found = list(_of_states_in_numbers(scene, names, values))
    yield from found


def _of_constants(
    scene: Scene, names: tuple[str, ...], values: dict[str, float]
) -> Iterator[tuple[str, ParameterFunction]]:
    for what, function, role in functions_of(scene):
        if role.call != "f(c)":
            continue
        for s in _arclengths(scene) if role.along else [None]:
            known = {**vars(scene.constants(s=s)), **values}
            c, asked = watched(Constants(**known))
            try:
                function(c)
            except SceneError:
                break
            if asked.issuperset(names):
                yield what, _function(function, known, names)
            if "s" not in asked:
                break


def _function(function: OfConstants, known: dict[str, Any], names: tuple[str, ...]) -> ParameterFunction:
    symbols = [Symbol() for _ in names]
    try:
        values = function(Constants(**{**known, **dict(zip(names, symbols, strict=True))}))
        parts = values if isinstance(values, (tuple, list)) else [values]
        return ParameterFunction(symbols, [Values(ufl.as_ufl(0.0 if x is None else x)) for x in parts])
    except Exception:  # of UFL's own, too
        return Numerical(function, known, names)


def _of_states(
    scene: Scene, names: tuple[str, ...], values: dict[str, float]
) -> Iterator[tuple[str, ParameterFunction]]:
    """Functions of the state at a place, with their derivatives, at :data:`STATES`."""
    at = LocalState(scene)
    symbols, known = [at.parameters[name] for name in names], {**vars(scene.constants()), **values}
    fixed = {symbol: float(known[name]) for name, symbol in at.parameters.items() if name not in names}
    for place in pointwise(scene, at):
        parts = [part for part in _derivatives(scalar(place.function), at) if _asks(part, symbols)]
        expressions = [Values(part) for part in parts]
        if not parts:
            continue
        varies = place.s is None and any(at.s in unique_pre_traversal(part) for part in parts)
        arclengths = _arclengths(scene) if varies else [_arclengths(scene)[0] if place.s is None else place.s]
        points = [_at(scene, at, state, s) for s in arclengths for state in STATES]
        every = {symbol: np.full(len(points), value) for symbol, value in fixed.items()}
        every |= {symbol: np.array([point[symbol] for point in points]) for symbol in points[0]}
        found = ParameterFunction(symbols, expressions, every)
        found.least = LEAST * scene.units.energy
        yield place.what, found


def _derivatives(function: Any, at: LocalState) -> Iterator[Any]:
    """A function, and its first and second derivatives, all in its own units."""
    yield function
    symbols = [symbol for symbol in at.units if symbol in unique_pre_traversal(function)]
    first = {symbol: scalar(derivative(function, symbol)) for symbol in symbols}
    yield from (at.units[symbol] * part for symbol, part in first.items())
    for x, y in combinations_with_replacement(symbols, 2):
        if y in unique_pre_traversal(first[x]):
            yield at.units[x] * at.units[y] * scalar(derivative(first[x], y))


def _asks(part: Any, symbols: list[Symbol]) -> bool:
    nodes = set(unique_pre_traversal(part))
    return all(symbol in nodes for symbol in symbols)


def _at(scene: Scene, at: LocalState, state: Any, s: float) -> dict[Symbol, float]:
    """Values of the symbols of a place in one of the :data:`STATES`."""
    q, r, v, k = state
    strains = [v[i] for i in scene.free_strains] if at.v else []
    named = [(at.q, q), (at.r, [scene.length * x for x in r]), (at.v, strains), (at.k, [x / scene.length for x in k])]
    return {at.s: s} | {symbol: float(x) for symbols, x in named for symbol, x in zip(symbols, x, strict=True)}


def _of_states_in_numbers(
    scene: Scene, names: tuple[str, ...], values: dict[str, float]
) -> Iterator[tuple[str, ParameterFunction]]:
    """Values of functions of the state that compare a parameter in Python."""
    for state in range(len(STATES)):
        point, rod = some_places(scene, state)
        known = {**vars(scene.constants(s=point.s)), **values}
        found: list[tuple[str, OfConstants]] = [("stored energy", partial(scene.energy, rod.v, rod.k))]
        for what, function, role in functions_of(scene):
            if role.call == "f(x, c)":
                found.append((what, partial(function, rod if role.along else point)))
        for what, of in found:
            c, asked = watched(Constants(**known))
            of(c)
            if asked.issuperset(names):
                yield what, Numerical(of, known, names)


def _arclengths(scene: Scene) -> list[float]:
    """Places along the rod: some inside first, then both sides of all breaks."""
    a, b = scene.interval
    inside = np.linspace(a, b, ALONG + 2)[1:-1].tolist()
    return [*inside, *scene.samples()]


def _largest(numbers: np.ndarray) -> np.ndarray:
    """Largest size of the ``numbers`` (n, m) that are defined, in each column; zero without one."""
    return np.asarray(np.where(np.isfinite(numbers), abs(numbers), 0.0).max(axis=0, initial=0.0))


def _number(value: object) -> float:
    try:
        return plain(value(()) if callable(value) else value)
    except Exception:  # of UFL's own, too
        return float("nan")
