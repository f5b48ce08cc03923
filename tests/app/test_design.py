"""Rods that are best, against what is known of the strongest columns, and fields that may be chosen."""

from dataclasses import replace
from itertools import product

import classics
import numpy as np
import pytest
from scipy.optimize import LinearConstraint, NonlinearConstraint

import rodfem
from rodfem import Discretization, Field, Ordinate, Scene, clamped, free
from rodfem.errors import InputError
from rodfem.forms.energy import bending_and_twist
from rodfem.problem.field import names, with_fields


def column(ends: str) -> Scene:
    """A column of similar cross-sections, of a stiffness EI: the volume is the mean of its root."""
    name, last = {"pinned": ("pinned-pinned", 45.0), "clamped": ("clamped-clamped", 110.0)}[ends]
    return classics.column(
        "column", classics.SUPPORTS[name], (5.0, last), constants={"P": 5.0, "A": 1.0}, planar="e1",
        energy=lambda v, k, c: bending_and_twist(k, (c.A**2, 1.0, 1.0)),
        ordinate=Ordinate("deflection", s=0.5, of=lambda r, q: r[1]),
    )  # fmt: skip


def test_strongest_column_between_clamps_is_bimodal() -> None:
    """52.3563 with two modes at once (Olhoff & Rasmussen 1977), where that of one mode alone is no optimum."""
    best = rodfem.design(column("clamped"), {"A": Field(17, bounds=(0.1, 3.0), mean=1.0, symmetric=True)})
    assert 0.999 < best.load / 52.3563 < 1.0
    assert best.loads[1] == pytest.approx(best.loads[0], rel=1e-5)


def test_tallest_heavy_column() -> None:
    """2.034 times the uniform height of one volume (Keller & Niordson, J. Math. Mech. 16 (1966) 433-446).

    The height goes as the load to the power 1/4, and the area falls as the cube of the distance from the tip: a root of
    it is the field.
    """
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


def shallow(pattern: np.ndarray) -> float:
    """Amplitude, over the root of the shortening, at which a shallow arch of a pattern without symmetry snaps.

    With the pattern's sines ``k_n`` and the thrust ``pi^2 P`` its shape has ``a_n = k_n mu / (pi^2 (P - n^2))``, and
    the shortening ``sum n^2 pi^2 a_n^2 / 4``: the fold is at the least of that over mu^2, for P from 1 to 4.
    """
    n, ends = np.arange(1, 61)[:, None], np.pi * np.linspace(0.0, 1.0, len(pattern) + 1)
    k = 2 * (np.cos(n * ends[:-1]) - np.cos(n * ends[1:])) @ pattern / (n[:, 0] * np.pi)
    parts = (n * k[:, None] / (n**2 - np.linspace(1.02, 3.98, 1500))) ** 2
    return float(2 * np.pi / np.sqrt(parts.sum(axis=0).min()))


def test_the_pattern_of_the_page_snaps_an_arch_at_least_amplitude() -> None:
    """docs/design.md finds 5.3357, and a change of sign at 3/8; without symmetry no pattern is better."""
    every = [signs for signs in product((-1.0, 1.0), repeat=8) if abs(sum(signs)) < 8 and signs != signs[::-1]]
    least, best = min((shallow(np.array(signs)), signs) for signs in every)
    assert least == pytest.approx(5.3357, abs=1e-3) and abs(best[3]) == 1.0 and sum(best) in (-2.0, 2.0)


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
