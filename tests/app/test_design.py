"""Rods that are best, against what is known of the strongest columns, and fields that may be chosen."""

from dataclasses import replace
from itertools import product
from math import pi

import classics
import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.optimize import LinearConstraint, NonlinearConstraint, brentq

import rodfem
from rodfem import Discretization, Field, Ordinate, Parameter, Scene, clamped, free, pinned, sliding
from rodfem.errors import InputError
from rodfem.forms.energy import bending_and_twist
from rodfem.problem.field import names, with_fields


def column(ends: str) -> Scene:
    """A column of similar cross-sections, of a stiffness EI: the volume is the mean of its root."""
    along = (lambda c: (0.0, 0.0, None), lambda c: (0.0, 0.0, -c.P))
    held = {
        "pinned": (pinned((0.0, 0.0, 0.0)), pinned(along[0], force=along[1])),
        "clamped": (clamped(), sliding(along[0], force=along[1])),
    }
    return Scene(
        name="column",
        interval=(0.0, 1.0),
        rod="unshearable and inextensible",
        energy=lambda v, k, c: bending_and_twist(k, (c.A**2, 1.0, 1.0)),
        parameters={"P": Parameter(5.0), "A": Parameter(1.0)},
        load="P",
        ends=held[ends],
        ordinate=Ordinate("deflection", s=0.5, of=lambda r, q: r[1]),
        span=(5.0, 45.0 if ends == "pinned" else 110.0),
        planar="e1",
    )


def test_strongest_column_between_pins() -> None:
    """4 pi^2 / 3 of all areas of one volume (Keller 1960): what nine numbers carry is a little less."""
    best = rodfem.design(column("pinned"), {"A": Field(9, bounds=(0.05, 3.0), mean=1.0, symmetric=True)})
    assert 0.996 < best.load / (4 * pi**2 / 3) < 1.0
    s = np.linspace(0.0, 1.0, 1001)
    assert best.along("A", s)[:-1].mean() == pytest.approx(1.0, abs=1e-3)
    assert best.diagram.special("branch point")[0].error_estimate < 1e-4


def test_strongest_column_between_clamps_is_bimodal() -> None:
    """52.3563 with two modes at once (Olhoff & Rasmussen 1977), where that of one mode alone is no optimum."""
    best = rodfem.design(column("clamped"), {"A": Field(17, bounds=(0.1, 3.0), mean=1.0, symmetric=True)})
    assert 0.999 < best.load / 52.3563 < 1.0
    assert best.loads[1] == pytest.approx(best.loads[0], rel=1e-5)


def tallest(elements: int) -> float:
    """Weight over stiffness of the tallest column of one volume, by finite elements without rodfem.

    ``(A^2 u')' + lam W u = 0`` with the weight ``W = int_s A`` above, clamped below; where ``lam`` is largest for the
    volume one ``2 M^2 / A^3 = mu + lam int_0^s u^2``, ``M = A^2 u'``, which is iterated.
    """
    s = 1.0 - (1.0 - np.linspace(0.0, 1.0, elements + 1)) ** 2
    h, A, i = np.diff(s), np.ones(elements), np.arange(elements)
    for _ in range(200):
        weight = np.append(np.cumsum((A * h)[::-1])[::-1], 0.0)
        a, b = weight[:-1], weight[1:]
        K, B = np.zeros((2, elements + 1, elements + 1))
        for matrix, parts in ((K, (A**2 / h, -(A**2) / h, A**2 / h)), (B, (3 * a + b, a + b, a + 3 * b))):
            scale = 1.0 if matrix is K else h / 12
            np.add.at(matrix, (i, i), parts[0] * scale)
            np.add.at(matrix, (i + 1, i + 1), parts[2] * scale)
            matrix[i, i + 1] = matrix[i + 1, i] = parts[1] * scale
        values, vectors = eigh(B[1:, 1:], K[1:, 1:], subset_by_index=[elements - 1] * 2)
        u, lam = np.append(0.0, vectors[:, 0]), 1.0 / values[0]
        squares = h * (u[:-1] ** 2 + u[:-1] * u[1:] + u[1:] ** 2) / 3
        under, moment = lam * (np.cumsum(squares) - squares / 2), A**2 * np.diff(u) / h

        def area(mu: float, m: np.ndarray = moment, under: np.ndarray = under) -> np.ndarray:
            return (2 * m**2 / (mu + under)) ** (1 / 3)

        new = area(brentq(lambda mu, area=area: area(mu) @ h - 1, 1e-9, 1e9))
        A, before = np.sqrt(A * new), A
        A /= A @ h
        if abs(A - before).max() < 1e-6:
            break
    return float(lam)


def test_tallest_heavy_column() -> None:
    """2.034 times the uniform height of one volume (Keller & Niordson, J. Math. Mech. 16 (1966) 433-446).

    The height goes as the load to the power 1/4, and the area falls as the cube of the distance from the tip: a root of
    it is the field.
    """
    one, two, four = map(tallest, (40, 80, 160))
    limit = four + (four - two) ** 2 / (2 * two - one - four)  # Aitken
    assert (limit / 7.8373474) ** 0.25 == pytest.approx(2.034, abs=1e-3)
    heavy = classics.column(
        "heavy column", (clamped(), free()), (0.0, 150.0), constants={"b": 1.0}, planar="e1",
        energy=lambda v, k, c: bending_and_twist(k, (c.b**6, 1.0, 1.0)),
        distributed=lambda c: (0.0, 0.0, -c.P * c.b**3), ordinate=Ordinate("deflection", s=1.0, of=lambda r, q: r[1]),
    )  # fmt: skip
    field = Field(9, bounds=(0.1, 8.0), mean=1.0, power=3.0)
    best = rodfem.design(heavy, {"b": field}, discretization=Discretization(elements=8))
    uniform = rodfem.trace(heavy, depth=0).special("branch point")[0].point.load
    assert uniform == pytest.approx(7.8373474)
    assert 0.95 < (best.load / uniform) ** 0.25 / 2.034 < 1.0


DEPTH, PIECES = 1e-3, 8
"""End shortening of a hinged arch of length one, and pieces of its natural curvature."""


def arch() -> Scene:
    """A hinged arch whose natural curvature is a pattern K times an amplitude mu, against the way that it is bent."""

    def bent(s: np.ndarray) -> np.ndarray:
        half = np.sqrt(DEPTH) * np.cos(np.pi * s)
        return np.column_stack([np.cos(half), np.sin(half), 0 * s, 0 * s])

    return classics.column(
        "arch", (pinned(), pinned((0.0, 0.0, 1.0 - DEPTH))), (0.0, 15.0 * DEPTH**0.5), load="mu", start=bent,
        energy=lambda v, k, c: bending_and_twist((k[0] - c.mu * c.K, k[1], k[2]), (1.0, 1.0, 1.0)), planar="e1",
        constants={"mu": 0.0, "K": 1.0}, ordinate=Ordinate("middle", s=0.5, of=lambda r, q: r[1]),
    )  # fmt: skip


def shallow(pattern: np.ndarray) -> float:
    """Amplitude, over the root of the shortening, at which a shallow arch of a pattern without symmetry snaps.

    With the pattern's sines ``k_n`` and the thrust ``pi^2 P`` its shape has ``a_n = k_n mu / (pi^2 (P - n^2))``, and
    the shortening ``sum n^2 pi^2 a_n^2 / 4``: the fold is at the least of that over mu^2, for P from 1 to 4.
    """
    n, ends = np.arange(1, 61)[:, None], np.pi * np.linspace(0.0, 1.0, len(pattern) + 1)
    k = 2 * (np.cos(n * ends[:-1]) - np.cos(n * ends[1:])) @ pattern / (n[:, 0] * np.pi)
    parts = (n * k[:, None] / (n**2 - np.linspace(1.02, 3.98, 1500))) ** 2
    return float(2 * np.pi / np.sqrt(parts.sum(axis=0).min()))


def test_pattern_that_snaps_an_arch_at_least_amplitude() -> None:
    """The best of 256 binary ones changes its sign at 3/8 (of optima that are binary see arXiv:2601.06598).

    It begins without symmetry: with it the arch would leave its branch at 4 pi, in a pitchfork.  A fold is to order.
    """
    every = [np.array(signs) for signs in product((-1.0, 1.0), repeat=PIECES) if abs(sum(signs)) < PIECES]
    lopsided = [signs for signs in every if (signs != signs[::-1]).any()]
    least, best = min((shallow(signs), tuple(signs)) for signs in lopsided)
    pattern = Field(PIECES, kind="constant", bounds=(-1.0, 1.0), first=(-0.5, -0.4, -0.3, 0.2, 0.3, 0.4, 0.5, 0.6))
    found = rodfem.design(arch(), {"K": pattern}, maximise=lambda mu: -mu[0])
    assert found.numbers["K"] == pytest.approx([-1.0] * 3 + [1.0] * 5, abs=1e-6)
    assert abs(best[3]) == 1.0 and sum(best) in (-2.0, 2.0)  # the same, or its mirror images
    assert found.load / DEPTH**0.5 == pytest.approx(least, rel=DEPTH)

    ordered = rodfem.design(arch(), {"K": pattern}, maximise=lambda mu: -((mu[0] - 7.0 * DEPTH**0.5) ** 2))
    assert ordered.diagram.special("fold")[0].point.load == pytest.approx(7.0 * DEPTH**0.5, rel=1e-5)
    assert shallow(ordered.numbers["K"]) == pytest.approx(7.0, rel=DEPTH)


def test_conditions_of_a_person() -> None:
    """scipy's on the numbers are what bounds are; one on the loads holds, and costs."""
    area = Field(5, bounds=(0.05, 3.0), mean=1.0, symmetric=True)
    thick = rodfem.design(column("pinned"), {"A": replace(area, bounds=(0.7, 3.0))})
    asked = rodfem.design(column("pinned"), {"A": area}, subject_to=[LinearConstraint(np.eye(3), 0.7, np.inf)])
    again = rodfem.design(column("pinned"), {"A": area}, subject_to=[NonlinearConstraint(min, 0.7, np.inf)])
    assert [asked.load, again.load] == pytest.approx([thick.load] * 2, rel=1e-5)
    free_of_it, wide = (
        rodfem.design(column("clamped"), {"A": area}, subject_to=conditions)
        for conditions in ((), [lambda P: P[1] - 1.5 * P[0]])
    )
    assert wide.loads[1] / wide.loads[0] == pytest.approx(1.5, rel=1e-4)
    assert free_of_it.loads[1] / free_of_it.loads[0] < 1.4 and wide.load < free_of_it.load


def test_fields_and_their_means() -> None:
    """A kind of field is its values, in UFL and as numbers; a mean is that of its power; a wrong one is refused."""
    s = np.linspace(0.0, 1.0, 100_001)
    for kind in ("linear", "constant", "sines"):
        field = Field(5, kind=kind, power=0.5)
        numbers = np.array([2.0, 0.3, -0.2, 0.1, 0.05]) if kind == "sines" else np.array([1.0, 2.0, 3.0, 1.5, 0.5])
        mean, slopes = field.volume(numbers)
        assert mean == pytest.approx(((field.table(s[::50]) @ numbers) ** 0.5).mean(), rel=1e-3)
        assert (field.volume(numbers + 1e-6 * slopes)[0] - mean) / 1e-6 == pytest.approx(slopes @ slopes, rel=1e-5)
        varying = with_fields(column("pinned"), {"A": field})
        rod = varying.varying(**dict(zip(names("A", field), numbers.tolist(), strict=True)))
        for place in (0.0, 0.2, 0.33, 1.0):
            assert rod.stiffness(place)[0, 0] == pytest.approx((field.table(np.array([place])) @ numbers)[0] ** 2)
    with pytest.raises(InputError, match="choose one of linear, constant, sines"):
        Field(5, kind="cubic")
    with pytest.raises(InputError, match="of 5 numbers begins with 2"):
        Field(5, first=(1.0, 2.0))
    with pytest.raises(InputError, match="choose one of A"):
        rodfem.design(column("pinned"), {"B": Field()})
    with pytest.raises(InputError, match="give 'first loss'"):
        rodfem.design(column("pinned"), {"A": Field()}, maximise="load")
