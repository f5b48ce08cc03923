"""Where a rod begins without a start of its own: at rest if that fits its ends, or turned as they are."""

from math import cos, sin
from typing import Any

import numpy as np
import pytest
import ufl
from classics import column
from demo_cases import scene

from rodfem import Attachment, Discretization, Ordinate, Scene, Solver, clamped, free, pinned, sliding, trace
from rodfem.continuation.natural_shape import misfit, natural_shape

HALF, LENGTH = 0.6, 1.0
RADIUS = LENGTH / (2 * HALF)


def arch(ends: tuple[Any, Any], natural: Any = lambda c: 1 / RADIUS, **more: Any) -> Scene:
    """A strip of natural curvature about e2, as it is for a newcomer: pinned at its chord."""
    given: dict[str, Any] = {
        "energy": lambda v, k, c: 0.5 * (2 * k[0] ** 2 + (k[1] - natural(c)) ** 2 + 0.3 * k[2] ** 2),
        "span": (0.0, 5.0),
        "attachments": (Attachment(LENGTH / 2, force=lambda c: (c.P, 0.0, 0.0)),),
    }
    rise = Ordinate("rise", s=LENGTH / 2, of=lambda r, q: r[0])
    return column("arch", ends, ordinate=rise, **given | more)


@pytest.mark.parametrize("chord", [None, 2 * RADIUS * sin(HALF)])
@pytest.mark.parametrize("planar", [None, "e2"])
def test_an_arch_between_pins_begins_at_rest(planar: str | None, chord: float | None) -> None:
    ends = pinned(), pinned(lambda c: (0.0, 0.0, chord))
    point = Solver(arch(ends, planar=planar)).equilibrium(0.0)
    assert point.energy < 1e-16 and point.negative == 0  # in space it turns about its chord, at no cost
    assert abs(point.ordinate) == pytest.approx(RADIUS * (1 - cos(HALF)), rel=1e-9)


def test_a_cantilever_with_a_curvature_that_varies() -> None:
    """``theta = int k0 ds`` at the end of the rod at rest."""
    point = Solver(arch((clamped(), free()), lambda c: 1 + 3 * c.s**2, attachments=(), span=(0, 1),
                        distributed=lambda c: (c.P, 0.0, 0.0))).equilibrium(0.0)  # fmt: skip
    assert point.energy < 1e-9
    assert np.allclose(point.directors[-1, 2], [sin(2.0), 0.0, cos(2.0)], atol=1e-5)


def test_what_does_not_fit_its_ends_begins_straight() -> None:
    cord = scene("cord")
    assert natural_shape(cord, cord.span[0]) is None
    ends = clamped(), clamped(lambda c: (0.0, 0.0, 1.0))
    assert natural_shape(arch(ends), 0.0) is None
    slack = clamped(), clamped(lambda c: (0.0, 0.0, 0.9))
    notes = trace(arch(slack, span=(0.0, 0.1)), Discretization(elements=4, degree=3), depth=0, error_bars=False).notes
    assert any("the rod at rest, in its natural shape, does not fit its ends" in note for note in notes)
    assert not misfit(arch((clamped(), free())), 0.0) and not misfit(scene("ruler"), 0.0)
    assert natural_shape(scene("ruler"), 0.0) is None  # its natural shape is straight


def test_a_straight_rod_is_turned_as_its_clamps_are() -> None:
    """A law of twist that grows as cosh: all of the turn in one element leads nowhere."""
    half = 0.2
    rod = arch(
        (clamped(), sliding(lambda c: (0.0, 0.0, None), (cos(half), 0.0, 0.0, sin(half)), lambda c: (0.0, 0.0, -c.P))),
        energy=lambda v, k, c: 0.5 * (k[0] ** 2 + k[1] ** 2) + ufl.cosh(k[2]),
        attachments=(),
    )
    point = Solver(rod).equilibrium(0.0)
    assert np.allclose(point.curvature, [0.0, 0.0, 2 * half], atol=1e-9)
