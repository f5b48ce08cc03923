"""A constant of a scene that varies along the rod, by a few numbers: what an optimiser, or a fit, may choose.

The field takes the place of the constant in all functions along the rod.  Its numbers are constants of another scene,
``A_0``, ``A_1``, ..., so that forms are compiled once, and derivatives in the numbers are those in any constant.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from math import inf, pi, sin
from numbers import Real
from typing import Any

import numpy as np
import ufl

from rodfem.errors import InputError
from rodfem.problem.arguments import a, convert, interval, optional, real, reals, whole, yes_or_no
from rodfem.problem.functions import Role, changes
from rodfem.problem.scene import Parameter, Scene

POINTS = 8  # of a rule for means, on each piece
KINDS = LINEAR, CONSTANT, SINES = "linear", "constant", "sines"
"""Values at equal distances with lines in between, values of equal parts, and a mean with amplitudes of sines."""


@dataclass(frozen=True)
class Field:
    """A constant that varies along the rod by ``numbers`` of them, of a ``kind``.

    ``linear``: values from end to end, with lines in between.  ``constant``: values of equal parts.  ``sines``: a value
    at both ends, and amplitudes of ``sin j pi s``.  A ``symmetric`` one is so about the middle of the rod.  Numbers are
    within the ``bounds``.  The ``mean`` along the rod of the field, or of its ``power``, is given, where there is one:
    a volume, of the first power of an area, and of the power 1/2 of the bending stiffness of similar cross-sections.
    The field begins with the numbers ``first``, else uniform.
    """

    numbers: int = 9
    kind: str = LINEAR
    bounds: tuple[float, float] = (-inf, inf)
    mean: float | None = None
    power: float = 1.0
    symmetric: bool = False
    first: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        """Raise :class:`InputError` for another kind."""
        word = a(str, f"one of {', '.join(KINDS)}")
        convert(self, numbers=whole(9, 2), kind=word, bounds=interval(0.1, 3.0, real))
        convert(self, mean=optional(real(1.0)), power=real(0.5), symmetric=yes_or_no)
        convert(self, first=lambda name, given: tuple(reals(name, given, (1.0, 0.5))))
        if self.kind not in KINDS:
            raise InputError(f"A field has the kind {self.kind!r}: choose one of {', '.join(KINDS)}.")
        count = len(self.functions(0.5))
        if len(self.first) not in (0, count):
            raise InputError(f"A field of {count} numbers begins with {len(self.first)}: give {count}, or none.")

    @property
    def pieces(self) -> int:
        """Equal parts of the rod on which the field is smooth."""
        return {LINEAR: self.numbers - 1, CONSTANT: self.numbers, SINES: 1}[self.kind]

    def functions(self, t: Any) -> list[Any]:
        """What each number multiplies at the part ``t`` of the rod, in UFL or as a number."""
        n = self.numbers
        if self.kind == SINES:
            waves = [(sin if isinstance(t, Real) else ufl.sin)(i * pi * t) for i in range(1, n)]
            return [1.0, *(waves[::2] if self.symmetric else waves)]
        each = [self._local(i, t) for i in range(n)]
        pairs = [each[i] + each[-1 - i] for i in range(n // 2)]
        return [*pairs, *each[n // 2 : n - n // 2]] if self.symmetric else each

    def _local(self, i: int, t: Any) -> Any:
        """What the value number ``i`` multiplies."""
        n, known = self.numbers, isinstance(t, Real)
        if self.kind == LINEAR:
            return (max if known else ufl.max_value)(0.0, 1.0 - abs((n - 1) * t - i))
        if known:
            return float(min(int(n * t), n - 1) == i)
        begun = [ufl.conditional(ufl.ge(n * t, j), 1.0, 0.0) if 0 < j < n else float(j == 0) for j in (i, i + 1)]
        return begun[0] - begun[1]

    def table(self, t: np.ndarray) -> np.ndarray:
        """The same at parts ``t`` (m,) of the rod, (m, numbers): times the numbers it is the field."""
        return np.array([self.functions(float(x)) for x in t])

    @cached_property
    def _rule(self) -> tuple[np.ndarray, np.ndarray]:
        """Functions at the points of Gauss's rule on pieces of the rod, and weights."""
        pieces = max(self.pieces, self.numbers)
        x, w = np.polynomial.legendre.leggauss(POINTS * (pieces // self.pieces))
        t = (np.arange(self.pieces)[:, None] + (1.0 + x) / 2.0) / self.pieces
        return self.table(t.ravel()), np.tile(w / 2.0 / self.pieces, self.pieces)

    def volume(self, numbers: np.ndarray) -> tuple[float, np.ndarray]:
        """Mean along the rod of the field, or of its ``power``, and its derivatives in the numbers."""
        table, weights = self._rule
        values = table @ numbers
        return float(weights @ values**self.power), self.power * (weights * values ** (self.power - 1)) @ table

    def parameters(self, name: str, constant: Parameter) -> dict[str, Parameter]:
        """First numbers of the field in the place of a ``constant``: uniform ones have the mean that is given."""
        value = constant.value if self.mean is None else self.mean ** (1.0 / self.power)
        waves, admissible = self.kind == SINES, (-inf, inf) if self.kind == SINES else constant.admissible
        own = names(name, self)
        first = self.first or [0.0 if i and waves else value for i in range(len(own))]
        return {n: Parameter(x, admissible=admissible) for n, x in zip(own, first, strict=True)}


def names(constant: str, field: Field) -> list[str]:
    """Names of the numbers of a field."""
    return [f"{constant}_{i}" for i in range(len(field.functions(0.5)))]


def with_fields(scene: Scene, fields: Mapping[str, Field]) -> Scene:
    """The scene with ``fields`` in the place of constants, which begin uniform; points keep the constant."""
    parameters, breaks = dict(scene.parameters), {*scene.breaks}
    for name, field in fields.items():
        scene.check_constant(name)
        parameters |= field.parameters(name, parameters[name])
        breaks |= {scene.interval[0] + i / field.pieces * scene.length for i in range(1, field.pieces)}

    def visit(words: str, function: Callable[..., Any], role: Role) -> Callable[..., Any]:
        if not (role.along or role.call == "W(v, k, c)") or not callable(function):
            return function
        return lambda *given: function(*given[:-1], _Varying(given[-1], scene, fields))

    return replace(scene, parameters=parameters, breaks=tuple(sorted(breaks)), **changes(scene, visit))


class _Varying:
    """Constants ``c`` of which some are fields."""

    def __init__(self, c: Any, scene: Scene, fields: Mapping[str, Field]) -> None:
        self._given = c, scene, fields

    def __getattr__(self, name: str) -> Any:
        """Constant, or the value of a field at ``c.s``."""
        c, scene, fields = self._given
        if name not in fields:
            return getattr(c, name)
        parts = fields[name].functions((c.s - scene.interval[0]) / scene.length)
        pairs = zip(names(name, fields[name]), parts, strict=True)
        return sum(getattr(c, n) * part for n, part in pairs if not (isinstance(part, Real) and part == 0.0))
