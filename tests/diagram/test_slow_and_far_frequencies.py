"""Frequencies far below those of bending, of stiff rods on soft supports, and unstable ones beyond dozens of others."""

from __future__ import annotations

from typing import Any

import classics
import pytest
from classics import column, push
from hard.thrusts import THIN

from rodfem import Diagram, Discretization, End, Inertia, Plan, Scene, clamped, free, trace
from rodfem.codim2.follow import NEAREST
from rodfem.forms import loads

pytestmark = pytest.mark.alone

MESH = Discretization("auto", 4, 6)
BECK = 20.0509536189738


def swept(scene: Scene, **plan: Any) -> Diagram:
    return trace(scene, MESH, Plan(depth=0, **plan))


@pytest.mark.long
@pytest.mark.usefixtures("few_loads")
def test_springs_that_soften_with_the_parameter() -> None:
    """The first state is not slow: springs ``k = 10^-p``, a thrust of ``0.05 p k`` with ``P = k/3`` at ``p = 20/3``."""
    k = lambda c: 10.0**-c.p  # noqa: E731
    foot = End(
        position=lambda c: (None, None, 0.0),
        energy=lambda x, c: loads.spring(x.r, (k(c), 3 * k(c), 0.0)) + loads.rotational_spring(x.q, (0.0, 0.0, 1.0)),
    )
    tip = End(
        follower=lambda c: (0.0, 0.0, -0.05 * c.p * k(c)),
        energy=lambda x, c: loads.spring(x.r, (0.5 * k(c), 1.5 * k(c), 0.0)),
    )
    constants = {"p": 2.0, "B2": 1.3}
    rod = column("softens", (foot, tip), (2.0, 8.0), load="p", inertia=THIN, constants=constants)
    diagram = swept(rod, error_bars=False)
    (flutter,) = diagram.special("flutter")
    assert flutter.point.load == pytest.approx(20 / 3, abs=1e-4) and not diagram.warnings
    found = diagram.locus(flutter, "B2", (1.2, 1.4))
    assert found.index.tolist() == [[0, 2]] * len(found.values)


@pytest.mark.long
@pytest.mark.usefixtures("few_loads")
def test_a_second_flutter_beyond_dozens_of_slow_motions() -> None:
    """Soft in torsion: two dozen slow motions hide the pair that flutters at 8.02, where another one did before."""
    inertia = Inertia(rho_A=lambda c: 1.0, rho_I=lambda c: (0.0, 0.0, 1.0))
    constants = {"P": 0.1, "B1": 0.1, "B2": 0.4, "C": 0.02}
    rod = column("soft", (clamped(), free(follower=push)), (0.1, 9.0), inertia=inertia, constants=constants)
    rod = rod.varying("P", (6.0, 8.6))
    found = swept(rod, error_bars=False)
    assert [s.point.load for s in found.special("flutter")] == pytest.approx([0.4 * BECK], rel=1e-8)
    assert [found[0].points[row].negative for row in (0, -1)] == [2, 4]


@pytest.mark.long
def test_flutter_that_comes_and_goes_beyond_dozens_of_slow_motions() -> None:
    """The greatest thrust is a little above Beck's load."""
    thrust = lambda c: (0.0, 0.0, -(BECK + 0.04 - (c.p - 5.25) ** 2))  # noqa: E731
    inertia, constants = (
        Inertia(rho_A=lambda c: 1.0, rho_I=lambda c: (0.0, 0.0, 1.0)),
        {"p": 0.0, "B2": 10.0, "C": 0.02},
    )
    ends = clamped(), free(follower=thrust)
    rod = column("peak", ends, (0.0, 10.0), load="p", inertia=inertia, constants=constants)
    found = swept(rod, error_bars=False)
    loads = [s.point.load for s in found.special("flutter")]
    assert loads == pytest.approx([5.05, 5.45], abs=1e-8) and not found.warnings


@pytest.mark.long
@pytest.mark.usefixtures("few_loads")
def test_the_index_of_a_locus_counts_all_eigenvalues() -> None:
    """The flutter of the strong plane of a ribbon, 60 times as stiff: five pairs of the weak one have fluttered."""
    strong = 60.0
    scene = classics.partly_following(1.0, (0.98 * strong * BECK, 1.02 * strong * BECK), strong)
    diagram = trace(scene, Discretization("auto", 8, 6), Plan(depth=0, spectrum=30, error_bars=False))
    flutter = min(diagram.special("flutter"), key=lambda s: abs(s.point.load / strong - BECK))
    numbers = [flutter.negative_before, flutter.negative_after]
    found = diagram.locus(flutter, "B2", (58.0, 62.0), (0.9 * strong * BECK, 1.1 * strong * BECK))
    assert numbers == [10, 12] and found.index.tolist() == [numbers] * len(found.values)
    assert diagram.assess(diagram[0].points[0], "dense").negative == 10
    assert not found.marks and NEAREST not in found.note
