"""Rods that are best, against what is known of the strongest columns, and fields that may be chosen."""

from math import pi

import numpy as np
import pytest

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


@pytest.mark.long
def test_tallest_heavy_column() -> None:
    """2.034 times the uniform height of one volume (Keller & Niordson, J. Math. Mech. 16 (1966) 433-446).

    The height goes as the load to the power 1/4, and the area falls as the cube of the distance from the tip: a root of
    it is the field.  Finite elements of the linear problem, and ``A^3 ~ M^2 / (1 + int u^2)`` iterated, have 2.0338 on
    400 elements and 2.0328 on 200.
    """
    heavy = Scene(
        name="heavy column",
        interval=(0.0, 1.0),
        rod="unshearable and inextensible",
        energy=lambda v, k, c: bending_and_twist(k, (c.b**6, 1.0, 1.0)),
        parameters={"W": Parameter(0.0), "b": Parameter(1.0)},
        load="W",
        ends=(clamped(), free()),
        distributed=lambda c: (0.0, 0.0, -c.W * c.b**3),
        ordinate=Ordinate("deflection", s=1.0, of=lambda r, q: r[1]),
        span=(0.0, 150.0),
        planar="e1",
    )
    field = Field(9, bounds=(0.1, 8.0), mean=1.0, power=3.0)
    best = rodfem.design(heavy, {"b": field}, discretization=Discretization(elements=8))
    uniform = rodfem.trace(heavy, depth=0).special("branch point")[0].point.load
    assert uniform == pytest.approx(7.8373474)
    assert 0.95 < (best.load / uniform) ** 0.25 / 2.034 < 1.0


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
    with pytest.raises(InputError, match="choose one of A"):
        rodfem.design(column("pinned"), {"B": Field()})
    with pytest.raises(InputError, match="give 'first loss'"):
        rodfem.design(column("pinned"), {"A": Field()}, maximise="load")
