"""Jumps along the rod that are inside of an element: found, and said, where no error bar holds."""

from __future__ import annotations

from math import cos, pi, sqrt
from typing import Any

import numpy as np
import pytest
import ufl
from classics import SUPPORTS, column
from scipy.linalg import expm
from scipy.optimize import brentq

from rodfem import Discretization, Plan, Scene, trace
from rodfem.problem.jumps import jumps
from rodfem.problem.values import Symbol, Values

K, END = 500.0, 0.43


def bed(x: Any, c: Any) -> Any:
    """A foundation that ends."""
    return 0.5 * K * ufl.conditional(ufl.lt(c.s, END), 1.0, 0.0) * (x.r[0] ** 2 + x.r[1] ** 2)


def propagated(P: float, k: float, length: float) -> np.ndarray:
    """Matrix that carries deflection, slope, moment and shear over a length, of a column of unit stiffness."""
    A = np.array([[0, 1, 0, 0], [0, 0, 1, 0], [0, -P, 0, -1], [k, 0, 0, 0]])
    return np.asarray(expm(A * length))


def scene(**more: Any) -> Scene:
    return column("bed", SUPPORTS["pinned-pinned"], (0.0, 40.0), potential=bed, constants={"B2": 9.0}, **more)


@pytest.mark.long
def test_a_foundation_that_ends_inside_an_element() -> None:
    """On 14 cubic elements, halved or not, all points of the quadrature are on the same side: 23.5588 +- 3e-7."""

    def determinant(P: float) -> float:
        T = propagated(P, 0.0, 1 - END) @ propagated(P, K, END)
        return float(np.linalg.det(T[np.ix_([0, 2], [1, 3])]))

    load = brentq(determinant, 23.0, 24.0, xtol=1e-10)
    mesh, plan = Discretization(elements=14, degree=3), Plan(depth=0)
    blind = trace(scene(), mesh, plan)
    found = blind.special("branch point")[0]
    assert abs(found.point.load - load) > 1e4 * found.error_estimate
    assert any("potential along the rod jumps" in said and "breaks=(0.43,)" in said for said in blind.warnings)
    seeing = trace(scene(breaks=(END,)), mesh, plan)
    found = seeing.special("branch point")[0]
    assert abs(found.point.load - load) < found.error_estimate + 1e-9 < 1e-4
    assert seeing.warnings == []


def test_where_functions_jump() -> None:
    """Comparisons of the arclength, of a place's as of the constants', in any function; no kink is a jump."""
    half = lambda s: ufl.conditional(ufl.And(ufl.gt(s, 1 / 3), ufl.le(s**2, 0.25)), 2.0, 1.0)  # noqa: E731
    bent = lambda v, k, c: (1 + half(c.s)) * k[0] ** 2 + (1 + abs(c.s - 0.6)) * k[1] ** 2 + k[2] ** 2  # noqa: E731
    push = lambda c: (0.0, 0.0, c.P * ufl.sign(c.s - 0.7))  # noqa: E731
    spring = lambda x, c: ufl.conditional(ufl.lt(x.s, sqrt(0.5)), 1.0, 2.0) * x.r[0] ** 2  # noqa: E731
    found = jumps(column("all", SUPPORTS["clamped-free"], (0.0, 1.0), energy=bent, distributed=push, potential=spring))
    assert found["stored energy"] == pytest.approx([1 / 3, 0.5], abs=1e-11)
    assert found["distributed force"] == pytest.approx([0.7], abs=1e-11)
    assert found["potential along the rod"] == pytest.approx([cos(pi / 4)], abs=1e-11)
    humps = lambda c: (0.0, 0.0, c.P * (1 - c.P) * ufl.sign(c.s - 0.7))  # noqa: E731
    found = jumps(column("none at an end", SUPPORTS["clamped-free"], (0.0, 1.0), distributed=humps))
    assert found["distributed force"] == pytest.approx([0.7], abs=1e-11)
    assert jumps(column("none", SUPPORTS["clamped-free"], (0.0, 1.0))) == {}


@pytest.mark.parametrize(
    "width", [pytest.param(4e-4, marks=pytest.mark.alone), 1e-5, pytest.param(1e-7, marks=pytest.mark.alone)]
)
@pytest.mark.parametrize(
    "notch",
    [
        lambda s, a, w: ufl.lt(abs(s - a), w),
        lambda s, a, w: ufl.lt((s - a - w) * (s - a + w), 0),
        lambda s, a, w: ufl.And(ufl.gt(s, a - w), ufl.lt(s, a + w)),
    ],
)
def test_a_narrow_notch(notch: Any, width: float) -> None:
    """A difference that changes its sign twice between two places is followed to its lowest value between them."""
    soft = lambda v, k, c: ufl.conditional(notch(c.s, 0.3015, width), 1e-3, 1.0) * ufl.dot(k, k)  # noqa: E731
    found = jumps(column("notch", SUPPORTS["clamped-free"], (0.0, 1.0), energy=soft))
    assert found["stored energy"] == pytest.approx([0.3015 - width, 0.3015 + width], abs=1e-11)


def test_values_at_many_places() -> None:
    """Arrays give what UFL gives at each place, for all functions that it has."""
    s, t = Symbol(), Symbol()
    names = ("sqrt", "exp", "ln", "cos", "sin", "tan", "cosh", "sinh", "tanh", "acos", "asin", "atan", "erf")
    terms = [getattr(ufl, name)(s) for name in names] + [ufl.bessel_J(1, s), ufl.bessel_K(0, s), ufl.sign(s - t) * s]
    terms += [ufl.max_value(s, t), ufl.min_value(s, t), abs(s - t), s**t / (s + 2), ufl.atan_2(s, t)]
    terms += [ufl.conditional(ufl.Or(ufl.Not(ufl.ge(s, t)), ufl.And(ufl.gt(s, 0.5), ufl.le(s, 0.7))), s, 2.0)]
    terms += [ufl.dot(ufl.as_vector([s, t]), ufl.as_vector([t, 3.0]))]
    x = np.linspace(0.05, 0.95, 7)
    for term in terms:
        many = Values(term)({s: x, t: 1.2 * x[::-1]})
        for i, (s.value, t.value) in enumerate(zip(x, 1.2 * x[::-1], strict=True)):
            assert many[i] == pytest.approx(float(term(())), rel=1e-13)
