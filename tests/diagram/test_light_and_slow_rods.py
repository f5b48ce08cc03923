"""Frequencies far below those of bending, and infinite ones among the finite ones of light rods.

Of a rod without mass the tip moves as the mass on a spring, with ``mu = P^(3/2) / (sin a - a cos a)``, ``a = P^(1/2)``,
for a mass of one: it is positive up to ``tan a = a``, P = 20.190728556, and passes there through infinity.  No load is
critical: the statics of a cantilever under a follower load is regular at every load (Beck 1952).
"""

from dataclasses import replace
from math import cos, pi, sin, sqrt
from typing import Any

import classics
import numpy as np
import pytest
from classics import column
from hard.sweeps import THIN
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from rodfem import Attachment, Diagram, Discretization, End, Inertia, Ordinate, Plan, Scene, clamped, free, trace
from rodfem.codim2.follow import NEAREST
from rodfem.continuation.kinds import END
from rodfem.forms import loads
from rodfem.forms.energy import bending_and_twist

POLE = 20.190728556


def light(mass: float, span: tuple[float, float]) -> Scene:
    return column(
        "light", (clamped(), free(follower=classics.push)), span, planar="e1", constants={"B2": 3.0, "rho": mass},
        inertia=Inertia(rho_A=lambda c: c.rho, rho_I=lambda c: (0.0, 0.0, 0.0)),
        attachments=(Attachment(1.0, mass=lambda c: 1.0),),
    )  # fmt: skip


def slowest(P: float) -> float:
    a = sqrt(P)
    return P * a / (sin(a) - a * cos(a))


@pytest.mark.long
@pytest.mark.parametrize(
    ("mass", "elements", "span"),
    [(1e-6, 12, (4.0, 6.0)), (1e-6, 6, (0.0, 0.05)), (1e-8, 6, (5.0, 5.1)), (1e-5, 20, (4.0, 6.0))],
)
def test_infinite_eigenvalues_make_no_rod_unstable(mass: float, elements: int, span: tuple[float, float]) -> None:
    """They came as complex pairs of 1e12, whose parts were taken for round-off of negative ones."""
    diagram = trace(light(mass, span), Discretization(elements=elements), Plan(depth=0, error_bars=False))
    (branch,) = diagram
    assert [special.kind for special in branch.special] == [END]
    assert {point.negative for point in branch.points} == {0}
    assert not branch.unexplained
    if span[0] > 0:
        found = min((real for real, _ in branch.points[0].omega2), key=abs)
        assert found == pytest.approx(slowest(span[0]), rel=10 * mass + 1e-7)


@pytest.mark.usefixtures("few_loads")
@pytest.mark.parametrize("span", [(16.0, 25.0), (25.0, 16.0)])
def test_a_sign_that_changes_through_infinity_is_no_divergence(span: tuple[float, float]) -> None:
    """Two motions are unstable beyond the pole, as with a mass of 1e-3 along the rod: of the tip, and of the rod."""
    diagram = trace(light(0.0, span), Discretization(elements=6), Plan(depth=0, error_bars=False))
    (branch,) = diagram
    assert [special.kind for special in branch.special] == [END] and not branch.unexplained
    assert all(point.negative == 2 * (point.load > POLE) for point in branch.points)
    (said,) = diagram.warnings
    assert float(said.split("P = ")[1].split()[0]) == pytest.approx(POLE, abs=1e-5)


@pytest.mark.usefixtures("few_loads")
@pytest.mark.parametrize("span", [(18.0, 24.0), (24.0, 18.0)])
def test_what_passes_through_minus_infinity_stays_unstable(span: tuple[float, float]) -> None:
    """Tip under a dead load: ``mu = P a / (tan a - a)`` is positive from the pole to ``a = 3 pi/2``, the index is 1."""
    end = End(force=lambda c: (0.0, 0.0, -c.P), follower=lambda c: (0.0, 0.0, 0.0))
    scene = replace(light(0.0, span), ends=(clamped(), end))
    (branch,) = diagram = trace(scene, Discretization(elements=6), Plan(depth=0, error_bars=False))
    assert [x.point.load for x in branch.special[:-1]] == [pytest.approx((1.5 * pi) ** 2)] and len(
        diagram.warnings
    ) == 1
    assert diagram.assess(branch.points[10]).negative == branch.points[10].negative
    assert {(p.load > (1.5 * pi) ** 2, p.negative + p.zero) for p in branch.points} == {(False, 1), (True, 2)}


@pytest.mark.usefixtures("few_loads")
def test_a_torsion_without_inertia_that_passes_through_infinity() -> None:
    """An arch under a pressure that follows: at the pole ``C a'' = B k k0 a``, with k of the arch, has a solution."""

    def spin(P: float) -> float:  # angle, curvature, spin and its rate, force, from the tip to the clamp
        def rates(_: float, y: np.ndarray) -> list[float]:
            theta, k, a, da, across, along = y
            shear = cos(theta) * across - sin(theta) * along
            return [-k, shear, -da, -k * a / 0.1, P * cos(theta), -P * sin(theta)]

        return float(solve_ivp(rates, (0, 1), [0, 1, 1, 0, 0, 0], rtol=1e-11, atol=1e-12).y[2, -1])

    arch = column(
        "arch", (clamped(), free()), (-10.0, -12.0), follower=lambda c: (c.P, 0.0, 0.0),
        energy=lambda v, k, c: bending_and_twist((k[0], k[1] - 1.0, k[2]), (1.0, 1.0, 0.1)),
        ordinate=Ordinate("tip", s=1.0, of=lambda r, q: r[0]), inertia=Inertia(rho_A=lambda c: 1.0),
    )  # fmt: skip
    (branch,) = diagram = trace(arch, Discretization(elements=6), Plan(depth=0, error_bars=False))
    assert {p.negative for p in branch.points} == {2} and not branch.unexplained  # as with a little rotary inertia
    (said,) = diagram.warnings
    assert float(said.split("P = ")[1].split()[0]) == pytest.approx(brentq(spin, -11.0, -10.0), abs=1e-3)


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
