"""A rod that may turn about its axis between springs that are not alike around it: its states are a family."""

from __future__ import annotations

from math import cos, sin

import numpy as np
import pytest

from rodfem import Discretization, Inertia, Ordinate, Plan, Scene, free, pinned, trace
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
