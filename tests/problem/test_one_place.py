"""What acts at an end does not vary along the rod, what acts at one place is one; a mass alone is a slender rod's."""

from math import pi, sqrt
from typing import Any

import pytest
import ufl
from classics import SUPPORTS, column

from rodfem import Attachment, Discretization, Inertia, Plan, Solver, integral, trace
from rodfem.errors import SceneError
from rodfem.problem.ends import End, clamped, free, pinned, sliding

pytestmark = pytest.mark.ranks


@pytest.mark.parametrize(
    "end",
    [
        lambda: free(lambda c: (0.0, 0.0, -c.P * c.s)),
        lambda: pinned(lambda c: (0.1 * c.s, 0.0, None)),
        lambda: sliding(lambda c: (0.0, 0.0, None), lambda c: (ufl.cos(c.s), 0.0, 0.0, ufl.sin(c.s))),
        lambda: End(moment=lambda c: (0.0, c.P * c.s, 0.0)),
        lambda: End(follower_moment=lambda c: (0.0, c.P * c.s, 0.0)),
        lambda: free(follower=lambda c: (0.0, 0.0, -c.P * c.s)),
    ],
)
def test_an_end_has_no_arclength(end: Any) -> None:
    """The reduced formulation took ``-c.P * c.s`` for a thrust that grows along the rod: 3.4766 for pi^2/4."""
    with pytest.raises(SceneError, match=r"on the right end asks for the arclength|of the right end asks for the arc"):
        column("end", (clamped(), end()), (0.0, 4.0))


def test_an_integral_is_one_number() -> None:
    with pytest.raises(SceneError, match="value of an integral constraint asks for the arclength"):
        column(
            "integral",
            SUPPORTS["clamped-free"],
            (0.0, 4.0),
            constraints=(integral(lambda x, c: x.r[0], lambda c: c.s),),
        )


@pytest.mark.long
def test_an_attachment_knows_its_place() -> None:
    """Twice ``c.s`` is one half-way along: Euler's load of half the length."""
    half = Attachment(0.5, force=lambda c: (0.0, 0.0, -2 * c.P * c.s))
    scene = column("half", (clamped(), free()), (0.0, 12.0), attachments=(half,))
    found = trace(scene, Discretization(elements=4, degree=6), Plan(depth=0)).special("branch point")[0]
    assert abs(found.point.load - 9.869604401089358) < found.error_estimate


@pytest.mark.long
def test_a_weight_that_vanishes_at_an_end() -> None:
    """Column with ``int r1 s ds = 0``: pi^2/4 and 9 pi^2/4 in the other plane, 25.585755 by Galerkin's method in this.

    The constraint was tried at s = 0 alone, and refused as one that is 0 whatever the state.
    """
    kept = integral(lambda x, c: x.r[0] * x.s)
    scene = column("weight", SUPPORTS["clamped-free"], (0.0, 30.0), constraints=(kept,))
    found = trace(scene, Discretization(elements=6, degree=6), Plan(depth=0)).special("branch point")
    assert [(x.negative_before, x.negative_after) for x in found] == [(0, 1), (1, 2), (2, 3)]
    for special, load in zip(found, (2.4674011003, 22.2066099025, 25.5857551650), strict=True):
        assert abs(special.point.load - load) < special.error_estimate + 1e-9
        assert special.error_estimate < 1e-5


@pytest.mark.long
@pytest.mark.parametrize(
    ("places", "breaks"), [((0.4, 0.4 + 1e-13), ()), ((0.1 + 0.3, 0.4), (0.4 - 1e-13,)), ((0.1 + 0.2,) * 2, (0.3,))]
)
def test_what_is_one_place_but_for_round_off(places: tuple[float, float], breaks: tuple[float, ...]) -> None:
    """Two halves of a thrust, and a break, at one place: Euler's load of the part below.

    An element of the length 1e-13 lay between, with eigenvalues within round-off.
    """
    halves = tuple(Attachment(s, force=lambda c: (0.0, 0.0, -c.P / 2)) for s in places)
    scene = column("one place", (clamped(), free()), (0.0, 30.0), attachments=halves, breaks=breaks)
    assert len(scene.joints) == 1
    found = trace(scene, Discretization(elements=4, degree=6), Plan(depth=0)).special("branch point")[0]
    assert abs(found.point.load - 2.4674011002723395 / places[0] ** 2) < found.error_estimate


@pytest.mark.long
@pytest.mark.short
def test_a_mass_alone_is_that_of_a_slender_rod() -> None:
    """Its frequency is that of the textbook; of torsion, with a rotary inertia about d3 alone, pi/2 over its root."""
    slender = Inertia(rho_A=lambda c: 1.0), 3.516015268
    for inertia, lowest in (slender, (Inertia(rho_A=lambda c: 1.0, rho_I=lambda c: (0.0, 0.0, 1.0)), pi / 2)):
        stiff = {"B2": 4.0, "C": 1.0}
        scene = column("mass", SUPPORTS["clamped-free"], (0.0, 1.0), inertia=inertia, constants=stiff)
        solver = Solver(scene, Discretization(elements=4))
        assert sqrt(solver.modes(solver.equilibrium(0.0), 1).value[0].real) == pytest.approx(lowest, rel=1e-6)
