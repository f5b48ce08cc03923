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
from rodfem.problem.arguments import a, convert, interval, optional, real, whole, yes_or_no
from rodfem.problem.functions import Role, changes
from rodfem.problem.scene import Parameter, Scene

LINEAR, CONSTANT, SINES = "linear", "constant", "sines"
POINTS = 8  # of a rule for means, on each piece
KINDS = (LINEAR, CONSTANT, SINES)
"""Values at equal distances with lines in between, values of equal parts, and a mean with amplitudes of sines."""


@dataclass(frozen=True)
class Field:
    """A constant that varies along the rod by ``numbers`` of them, of a ``kind``.

    ``linear``: values from end to end, with lines in between.  ``constant``: values of equal parts.  ``sines``: a value
    at both ends, and amplitudes of ``sin j pi s``.  A ``symmetric`` one is so about the middle of the rod.  Numbers are
    within the ``bounds``.  The ``mean`` along the rod of the field, or of its ``power``, is given, where there is one:
    a volume, of the first power of an area, and of the power 1/2 of the bending stiffness of similar cross-sections.
    """

    numbers: int = 9
    kind: str = LINEAR
    bounds: tuple[float, float] = (-inf, inf)
    mean: float | None = None
    power: float = 1.0
    symmetric: bool = False

    def __post_init__(self) -> None:
        """Raise :class:`InputError` for another kind."""
        convert(
            self,
            numbers=whole(9, 2),
            kind=a(str, f"one of {', '.join(KINDS)}"),
            bounds=interval(0.1, 3.0, real),
            mean=optional(real(1.0)),
            power=real(0.5),
            symmetric=yes_or_no,
        )
        if self.kind not in KINDS:
            raise InputError(f"A field has the kind {self.kind!r}: choose one of {', '.join(KINDS)}.")

    @property
    def breaks(self) -> np.ndarray:
        """Places inside the rod, in parts of its length, at which the field has a corner or a jump."""
        pieces = {LINEAR: self.numbers - 1, CONSTANT: self.numbers, SINES: 1}[self.kind]
        return np.arange(1, pieces) / pieces

    @property
    def groups(self) -> list[list[int]]:
        """Functions that share a number."""
        n = self.numbers
        if not self.symmetric:
            return [[i] for i in range(n)]
        if self.kind == SINES:
            return [[i] for i in range(n) if not i or i % 2]
        return [sorted({i, n - 1 - i}) for i in range((n + 1) // 2)]

    def function(self, i: int, t: Any) -> Any:
        """Function number ``i`` at the part ``t`` of the rod, in UFL or as a number."""
        known = isinstance(t, Real)
        if self.kind == SINES:
            return (sin if known else ufl.sin)(i * pi * t) if i else 1.0
        if self.kind == LINEAR:
            return (max if known else ufl.max_value)(0.0, 1.0 - abs((self.numbers - 1) * t - i))
        if known:
            return float(min(int(self.numbers * t), self.numbers - 1) == i)
        return ufl.conditional(ufl.lt(abs(self.numbers * t - i - 0.5), 0.5), 1.0, 0.0)

    @cached_property
    def _rule(self) -> tuple[np.ndarray, np.ndarray]:
        """Functions at the points of Gauss's rule on pieces of the rod (m, numbers), and weights (m,)."""
        ends = np.linspace(0.0, 1.0, (self.numbers - 1 if self.kind == LINEAR else self.numbers) + 1)
        x, w = np.polynomial.legendre.leggauss(POINTS)
        half, middle = np.diff(ends) / 2, (ends[1:] + ends[:-1]) / 2
        t = (middle[:, None] + half[:, None] * x).ravel()
        return self._table(t), (half[:, None] * w).ravel()

    def _table(self, t: np.ndarray) -> np.ndarray:
        """What each number multiplies at parts ``t`` (m,) of the rod."""
        return np.array([[sum(self.function(i, float(x)) for i in group) for group in self.groups] for x in t])

    def volume(self, numbers: np.ndarray) -> tuple[float, np.ndarray]:
        """Mean along the rod of the field, or of its ``power``, and its derivatives in the numbers."""
        table, weights = self._rule
        values = table @ numbers
        return float(weights @ values**self.power), self.power * (weights * values ** (self.power - 1)) @ table

    def uniform(self, value: float) -> np.ndarray:
        """Numbers of a field that is the same all along."""
        return np.where([self.kind != SINES or not group[0] for group in self.groups], value, 0.0)

    def at(self, numbers: np.ndarray, t: np.ndarray) -> np.ndarray:
        """The field at parts ``t`` (m,) of the rod."""
        return np.asarray(self._table(t) @ numbers)


def names(constant: str, field: Field) -> list[str]:
    """Names of the numbers of a field."""
    return [f"{constant}_{i}" for i in range(len(field.groups))]


def with_fields(scene: Scene, fields: Mapping[str, Field]) -> Scene:
    """The scene with ``fields`` in the place of constants, which begin uniform; points keep the constant."""
    parameters, breaks = dict(scene.parameters), {*scene.breaks}
    for name, field in fields.items():
        if name not in parameters or name == scene.load:
            known = ", ".join(other for other in parameters if other != scene.load)
            raise InputError(f"{name!r} is no constant that could vary along the rod: choose one of {known}.")
        value = parameters[name].value if field.mean is None else field.mean ** (1.0 / field.power)
        begin = field.uniform(value)
        inner = parameters[name].admissible if field.kind != SINES else (-inf, inf)
        parameters |= {n: Parameter(float(x), admissible=inner) for n, x in zip(names(name, field), begin, strict=True)}
        breaks |= {scene.interval[0] + float(t) * scene.length for t in field.breaks}

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
        field, t = fields[name], (c.s - scene.interval[0]) / scene.length
        parts = (sum(field.function(i, t) for i in group) for group in field.groups)
        own = [(n, part) for n, part in zip(names(name, field), parts, strict=True) if not is_zero(part)]
        return sum(getattr(c, n) * part for n, part in own)


def is_zero(part: Any) -> bool:
    """Whether a number, or an expression of UFL, is zero by itself."""
    return isinstance(part, Real) and part == 0.0
