"""Error bars of events that are sums over nodes hold, against shooting."""

from functools import cache

import pytest
from classics import ON_AXIS, column, push
from scipy.integrate import simpson, trapezoid

import rodfem
from rodfem import Diagram, Discretization, Event, Ordinate, Plan, Scene, clamped, pinned

pytestmark = pytest.mark.ranks

MESHES = [(5, 3), *(pytest.param(mesh, marks=pytest.mark.alone) for mesh in [(8, 6), (3, 4), (7, 2)])]
EVENTS = {
    "area": (lambda st: trapezoid(st.r[:, 0], st.r[:, 2]) - 0.04, 14.847291091853617, 0.04999462082954527),
    "by Simpson": (lambda st: simpson(st.r[:, 0] ** 2, x=st.s) - 0.002, 14.506957907347475, 0.04733160899918994),
    "mean of nodes": (lambda st: st.r[:, 0].mean() - 0.04, 14.781977335235007, 0.049461675093018374),
}
"""Sums over nodes; loads at which the integrals along the rod itself vanish, and the ordinates there.

With the angle ``a``, moment ``m``, deflection ``x`` and height ``z``: ``a' = m``, ``x' = sin a``, ``z' = cos a``,
``m' = -(n cos a + P sin a)``, ``n' = -(2 + 3 s)``; ``a`` and ``x`` vanish at the clamp, ``x`` and ``m`` at the pin.  By
shooting in ``m`` and ``n`` at the clamp, with tolerances of 1e-12, and quadrature of ``x cos a``, ``x^2`` and ``x``.
"""


def rod() -> Scene:
    """A planar column, clamped and pinned, under a load across it that grows along it."""
    return column(
        "column across which the wind blows", (clamped(), pinned(ON_AXIS, push)), (0.0, 20.0), planar="e2",
        constants={"B2": 1.0}, distributed=lambda c: (2.0 + 3 * c.s, 0.0, 0.0),
        ordinate=Ordinate("aside", s=0.37, of=lambda r, q: r[0]),
    )  # fmt: skip


@cache
def traced(mesh: tuple[int, int]) -> Diagram:
    """The branch with all events."""
    events = tuple(Event(name, of=of) for name, (of, *_) in EVENTS.items())
    return rodfem.trace(rod(), Discretization("auto", *mesh), Plan(depth=0, events=events))


@pytest.mark.long
@pytest.mark.parametrize("name", [pytest.param(x, marks=[pytest.mark.alone] * (x != "area")) for x in EVENTS])
@pytest.mark.parametrize("mesh", MESHES)
def test_bars_have_what_nodes_miss_of_the_rod(mesh: tuple[int, int], name: str) -> None:
    """The same function of the rod itself, by shooting, vanishes within the bar."""
    (event,) = [s for s in traced(mesh).special(name) if s.event is not None]
    _, load, ordinate = EVENTS[name]
    assert abs(event.point.load - load) <= event.error_estimate
    assert abs(event.point.ordinate - ordinate) <= event.ordinate_error
