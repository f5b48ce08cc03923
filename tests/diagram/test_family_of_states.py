"""Sweeps of rods that may turn freely, and of masses that depend on the load; equilibria on one path, or none."""

from __future__ import annotations

import re
from collections.abc import Callable
from math import cos, sin
from typing import Any

import numpy as np
import pytest
import ufl
from classics import SUPPORTS, column

from rodfem import Discretization, Inertia, Ordinate, Plan, Scene, clamped, free, pinned, trace
from rodfem.diagram.diagram import Diagram


def swept(turned: float, second: float) -> Diagram:
    """A strip on a pin under a follower thrust, ``turned`` by an angle, on a foundation of stiffnesses 60 and another.

    The ``second`` one is that along e2.
    """
    half = np.array([cos(turned / 2), 0.0, 0.0, sin(turned / 2)])
    rod = Scene(
        "strip", (0.0, 1.0), "unshearable and inextensible",
        lambda v, k, c: (k[0] ** 2 + 2 * k[1] ** 2 + k[2] ** 2) / 2, {"P": 0.0}, "P",
        (pinned(), free(follower=lambda c: (0.0, 0.0, -c.P))), Ordinate("x", s=0.5, of=lambda r, q: r[0]),
        (0.0, 30.0), potential=lambda x, c: (60 * x.r[0] ** 2 + second * x.r[1] ** 2) / 2,
        inertia=Inertia(lambda c: 1.0, lambda c: [1e-3] * 3), start=lambda s: half + 0 * np.asarray(s)[:, None],
    )  # fmt: skip
    return trace(rod, Discretization(elements=4, degree=5), Plan(depth=0, error_bars=False))


@pytest.mark.long
@pytest.mark.alone
@pytest.mark.usefixtures("few_loads")
def test_loads_of_one_state_of_a_family_are_said_to_be_that() -> None:
    """By what angle the strip is turned decides at which load it flutters; on alike springs it does not."""
    straight, turned = swept(0.0, 20.0), swept(0.7, 20.0)
    assert abs(straight.special("flutter")[0].point.load - turned.special("flutter")[0].point.load) > 1.0
    for found in (straight, turned):
        assert "1 frequency stays zero that no symmetry of the scene explains (torsion)" in found.warnings[-1]
    straight, turned = swept(0.0, 60.0), swept(0.7, 60.0)
    loads = [found.special("flutter")[0].point.load for found in (straight, turned)]
    assert loads[0] == pytest.approx(loads[1], rel=1e-8)
    assert not [words for found in (straight, turned) for words in found.warnings if "no symmetry" in words]


MESH = Discretization("auto", 4, 4)


def dented(load: float, width: float) -> Callable[[Any], Any]:
    """One, but minus one nearer to a ``load`` than the ``width``."""
    return lambda c: 1 - 2 * ufl.conditional(ufl.lt(abs(c.P - load), width), 1.0, 0.0)


def slender(mass: Callable[[Any], Any]) -> Inertia:
    return Inertia(rho_A=mass, rho_I=lambda c: (0.0, 0.0, 0.0))


@pytest.mark.long
def test_a_sweep_ends_before_a_negative_mass() -> None:
    """It is from 0.39 to 0.41, and a row of the sweep is there."""
    ends = clamped(), free(follower=lambda c: (0.0, 0.0, -c.P))
    (branch,) = trace(column("sweep", ends, (0.0, 5.0), inertia=slender(dented(0.4, 0.01))), MESH, Plan())
    assert re.search(r"A mass or rotary inertia of -1 at P = 0\.4 is negative: give zero or more", branch.ended)
    assert branch.points[-1].load == pytest.approx(0.35)


@pytest.mark.long
@pytest.mark.parametrize(
    ("mass", "spectrum", "words"),
    [
        pytest.param(
            dented(2.4674, 0.1), 3, "A mass or rotary inertia of -1 at P = 2.* is negative", marks=pytest.mark.alone
        ),
        (lambda c: (c.P - 1.25) ** 2, 3, "no eigenvalues .*, and at P = 1.25 this one has none"),
        pytest.param(dented(2.4674, 0.1), 0, "end of range", marks=pytest.mark.alone),  # the index is none of the mass
    ],
)
def test_a_branch(mass: Callable[[Any], Any], spectrum: int, words: str) -> None:
    scene = column("branch", SUPPORTS["clamped-free"], (0.0, 5.0), inertia=slender(mass))
    diagram = trace(scene, MESH, Plan(spectrum=spectrum, at=(1.25,), depth=0, error_bars=False))
    assert re.search(words, diagram[0].ended)
    assert (diagram[0].points[-1].load < 2.4) == (spectrum > 0)
