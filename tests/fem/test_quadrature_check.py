"""Functions that the rule of the elements does not integrate: said, and right on the mesh that is asked for."""

from collections.abc import Callable
from math import isfinite, isnan, pi, sqrt, tan
from typing import Any

import pytest
import ufl
from classics import SUPPORTS, column
from scipy.optimize import brentq

from rodfem import Diagram, Discretization, Inertia, Ordinate, Plan, Scene, Solver, clamped, free, trace
from rodfem.fem.checks import QuadratureCheck

STEEP, WIDTH = 0.786, 1e-3
NOT = "does not integrate the equations about s = "


def scene(stiffness: Callable[[Any], Any], **more: Any) -> Scene:
    """A cantilever under a thrust whose bending stiffness is a function of the arclength."""
    return column(
        "uneven", SUPPORTS["clamped-free"], (0.0, 6.0), energy=lambda v, k, c: 0.5 * (
            stiffness(c.s) * (k[0] ** 2 + 9 * k[1] ** 2) + k[2] ** 2
        ), **more,
    )  # fmt: skip


def checked(rod: Scene, *mesh: int) -> str:
    """What the check says of the straight state of a rod."""
    solver = Solver(rod, Discretization("auto", *mesh))
    return QuadratureCheck(solver.equilibria.system)(solver.equilibrium(1.0).x)


def test_a_jump_asks_for_a_break() -> None:
    """``tan(p a) tan(q b) = q/p``, ``p^2 = P``, ``q^2 = P/2``: beyond a = 0.43 the column is twice as stiff."""
    load = brentq(lambda P: tan(sqrt(P) * 0.43) * tan(sqrt(P / 2) * 0.57) - sqrt(1 / 2), 2.0, 4.0, xtol=1e-14)
    jump = lambda s: ufl.conditional(ufl.lt(s, 0.43), 1.0, 2.0)  # noqa: E731
    blind, seeing = (trace(scene(jump, breaks=breaks), plan=Plan(depth=0)) for breaks in ((), (0.43,)))
    (first,), (second,) = (d.special("branch point")[:1] for d in (blind, seeing))
    (said,) = blind.warnings
    assert f"{NOT}0.43" in said and "breaks=" in said
    assert isnan(first.error_estimate) and "not estimated" in first.note and abs(first.point.load - load) > 1e-4
    assert seeing.warnings == [] and abs(second.point.load - load) <= second.error_estimate < 1e-7


DEFLECTIONS = {1.2: -0.34591553521704, 1.5: -0.38883745768149, 2.0: -0.43294978717367, 3.0: -0.48681865453805}
"""Of the tip of the rod below by its load, by shooting: ``a' = -k``, ``M'(k) k' = P cos a``, ``y' = -sin a``."""


def kinked(mesh: tuple[int, int], *at: float) -> Diagram:
    """A cantilever under a force across: ``M = k`` below the curvature 1 and ``M = k + 4 (k - 1)`` beyond."""
    kink = lambda k: 0.5 * k**2 + 2 * ufl.max_value(k - 1, 0.0) ** 2  # noqa: E731
    rod = column(
        "kinked", (clamped(), free(lambda c: (0.0, -c.P, 0.0))), (0.0, 3.5),
        energy=lambda v, k, c: kink(k[0]) + 5 * k[1] ** 2 + k[2] ** 2,
        ordinate=Ordinate("y", s=1.0, of=lambda r, q: r[1]),
    )  # fmt: skip
    return trace(rod, Discretization("auto", *mesh), Plan(depth=0, at=at))


@pytest.mark.long
def test_a_kink_of_an_energy_asks_for_shorter_elements() -> None:
    """Where it is moves with the load."""
    coarse, fine = (kinked(mesh, *DEFLECTIONS) for mesh in ((8, 6), (128, 3)))
    assert any(NOT in said and "shorter elements" in said for said in coarse.warnings)
    for one, other in zip(coarse.special("user"), fine.special("user"), strict=True):
        exact = DEFLECTIONS[one.point.load]
        assert isnan(one.ordinate_error)
        assert abs(other.point.ordinate - exact) < min(1e-6, abs(one.point.ordinate - exact))
    below = kinked((8, 6), 0.5)[0].special[0]
    assert below.point.load == 0.5 and isfinite(below.ordinate_error)  # the curvature is below 1 everywhere


@pytest.mark.few(3)
@pytest.mark.parametrize(
    ("f", "mesh", "said"),
    [
        (lambda s: 1 - 0.4 * s**3, (2, 6), False),
        (lambda s: 1 + 0.5 * ufl.cos(2 * pi * s), (5, 6), False),
        *((lambda s: 1 + 0.5 * ufl.cos(2 * pi * s), (8, k), False) for k in (1, 2, 3, 4, 8)),
        (lambda s: 1 + 0.5 * ufl.tanh((s - STEEP) / 0.1), (8, 6), False),
        (lambda s: 1 + 0.5 * ufl.tanh((s - STEEP) / 1e-3), (8, 6), True),
        (lambda s: 1 + 0.5 * ufl.tanh((s - STEEP) / 1e-3), (400, 6), False),
        *((lambda s: ufl.conditional(ufl.lt(s, STEEP), 1.0, 2.0), (8, k), True) for k in (2, 3, 4, 6, 8)),
        (lambda s: ufl.conditional(ufl.lt(s, 0.73), 1.0, 2.0), (8, 2), True),  # halves agree with it by accident
        (lambda s: 1 + abs(s - STEEP), (8, 6), True),
        (lambda s: 1 + 0 * abs(s - STEEP) + s**2, (8, 6), False),
        (lambda s: 1 + ufl.exp(-(((s - STEEP) / 5e-4) ** 2)), (8, 6), True),
        (lambda s: 1 + ufl.exp(-(((s - STEEP) / 5e-4) ** 2)), (2000, 2), False),
    ],
)  # fmt: skip
def test_a_straight_rod_shows_its_stiffness(f: Callable[[Any], Any], mesh: tuple[int, int], said: bool) -> None:
    sentence = checked(scene(f), *mesh)
    assert bool(sentence) == said
    assert not said or f"{NOT}0.7" in sentence


@pytest.mark.few(2)
@pytest.mark.parametrize(
    "jumping",
    [
        lambda of: {"distributed": lambda c: (0.0, 0.0, -c.P * of(c.s))},
        lambda of: {"potential": lambda x, c: of(x.s) * x.r[0] ** 2},
        lambda of: {"inertia": Inertia(rho_A=lambda c: of(c.s))},
        lambda of: {"inertia": Inertia(rho_A=lambda c: 1.0, rho_I=lambda c: (of(c.s), 1.0, 1.0))},
        lambda of: {"potential": lambda x, c: of(x.r[2]) * x.r[0] ** 2},
    ],
)
def test_loads_and_masses_that_jump(jumping: Callable[[Any], dict[str, Any]]) -> None:
    """Where they jump at the end of an element there is nothing to say."""
    for at, elements in ((0.43, 8), (0.5, 8)):
        rod = scene(lambda s: 1.0, **jumping(lambda s, at=at: ufl.conditional(ufl.lt(s, at), 1.0, 3.0)))
        assert (f"{NOT}0.43" in checked(rod, elements, 6)) == (at == 0.43)
