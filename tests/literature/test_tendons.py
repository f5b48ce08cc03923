"""A tendon that winds around a rod, and mistakes; straight ones, and one of given length, are in docs/trades."""

from collections.abc import Callable
from math import pi
from typing import Any

import numpy as np
import pytest
import ufl

import rodfem
from rodfem import Discretization, InputError, Ordinate, Scene, SceneError, clamped, free, tendon
from rodfem.forms.energy import bending_and_twist, shear_and_stretch

RADIUS, LENGTH = 0.7e-3, 0.4
E, G, AREA, INERTIA = 54e9, 54e9 / 2.6, pi * RADIUS**2, pi * RADIUS**4 / 4
STRAINS, BENDING = np.array([G, G, E]) * AREA, np.array([E, E, 2 * G]) * INERTIA
FIRST, E3 = (0.0, 0.01), (0.0, 0.0, 1.0)


def robot(force: Any, *tendons: Any) -> Scene:
    """The robot of the page, whose tensions and force grow in proportion to ``part``."""
    return Scene("robot", (0.0, LENGTH), "flexible",
                 lambda v, k, c: shear_and_stretch(v, STRAINS.tolist()) + bending_and_twist(k, BENDING.tolist()),
                 {"part": 0.0}, "part", (clamped(), free(lambda c: [c.part * x for x in force])),
                 Ordinate("height", s=LENGTH, of=lambda r, q: r[2]), (0.0, 1.0), constraints=tendons)  # fmt: skip


def test_a_tendon_that_winds_around_the_rod() -> None:
    """Its coordinates are functions of the arclength.  By shooting: the balances of ``W + T |v + k x d + d'|``."""
    turn = 2.0 / LENGTH
    wound = tendon(3.0, at=lambda c: (0.01 * ufl.cos(turn * c.s), 0.01 * ufl.sin(turn * c.s)))
    diagram = rodfem.trace(robot((0.2, 0.0, -0.1), wound), Discretization(elements=16), depth=0, error_bars=False)
    expected = 0.3131146673175764, 0.0638896213603961, 0.1355953015019670
    np.testing.assert_allclose(diagram[0].points[-1].r[-1], expected, rtol=1e-8)


@pytest.mark.parametrize(
    ("mistake", "words"),
    [
        (lambda: tendon(at=FIRST), "tension None and the length None: give one of the two"),
        (lambda: tendon(4.0, at=0.01), "at is 0.01: give 2 numbers"),
        (lambda: tendon(4.0, at=FIRST, interval=(0.2, 0.0)), "from s = 0.2 to 0: give the lesser"),
        (lambda: robot(E3, tendon(4.0, at=FIRST, interval=(0.0, 0.5))), "end of a tendon at s = 0.5 is not on"),
        (lambda: robot(E3, tendon(lambda c: c.pull, at=FIRST)), "tension of a tendon asks for a constant 'pull'"),
    ],
)
def test_mistakes(mistake: Callable[[], object], words: str) -> None:
    with pytest.raises((InputError, SceneError), match=words):
        mistake()
