"""Masses that depend on the load: what is negative, or vanishes, at a row ends the branch or the sweep with its reason.

A scene is tried at some loads of its range; these masses are positive there.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import pytest
import ufl
from classics import SUPPORTS, column

from rodfem import Discretization, Inertia, Plan, clamped, free, trace

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
