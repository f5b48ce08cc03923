"""Laws of branch points in ordinates that are neither even nor odd in the amplitude.

Of the pinned elastica with the end slope A (Euler): ``P = pi^2 (1 + A^2/8 + ...)``; its end comes closer by
``A^2/4 + ...``, its middle moves by ``A/pi + ...`` across and by ``A^2/8 + ...`` along.
"""

from math import cos, pi
from typing import Any

import pytest
from classics import ON_AXIS, column, push
from hard.two_freedoms import scene as two_freedoms

import rodfem
from rodfem import Discretization, Ordinate, Plan, pinned
from rodfem.continuation.branch import NormalForm
from rodfem.forms.energy import bending_and_twist


def law_of(of: Any, s: float = 1.0, span: tuple[float, float] = (9.0, 10.5), cubic: float = 0.0) -> NormalForm:
    """Law of the pinned column in the ordinate ``of`` at s, on a foundation of energy ``cubic x^3`` per length."""
    energy = lambda v, k, c: bending_and_twist(k, (9.0, 1.0, 1.0))  # noqa: E731
    more = {"planar": "e2", "ordinate": Ordinate("mixed", s=s, of=of), "energy": energy, "constants": {"k": cubic}}
    scene = column("mixed", (pinned(), pinned(ON_AXIS, push)), span, potential=lambda x, c: c.k * x.r[0] ** 3, **more)
    (found,) = rodfem.trace(scene, plan=Plan(depth=1)).special("branch point", "straight")
    return found.law


def holds(law: NormalForm, truth: float, part: float) -> bool:
    return abs(law.coefficient - truth) <= law.uncertainty <= part * abs(truth)


def on_one_rank(*given: Any) -> list[Any]:
    """Parameters of tests that two ranks do without."""
    return [pytest.param(*one, marks=pytest.mark.alone) for one in given]


@pytest.mark.ranks
@pytest.mark.few(1)
@pytest.mark.parametrize("span", [(8.0, 11.0), *on_one_rank(((9.8, 9.9),))])
@pytest.mark.parametrize("eps", [0.01, *on_one_rank((1.0,), (1e-3,))])
def test_shortening_and_part_of_a_slope(eps: float, span: tuple[float, float]) -> None:
    """``x = A^2/4 + eps A``: the law is quadratic, ``pi^2/(8 eps^2) x^2``, however small eps is."""
    law = law_of(lambda r, q: 1 - r[2] + eps * 2 * q[2] * q[0], span=span)
    assert (law.kind, law.power, law.of) == ("supercritical pitchfork", 2, "ordinate")
    assert holds(law, pi**2 / 8 / eps**2, 1e-6)


@pytest.mark.few(1)
@pytest.mark.parametrize("part", [1.0, 1e-3])
def test_transcritical_point(part: float) -> None:
    """``8 beta/pi^3`` is the slope in the middle's displacement, of which the ordinate has a part."""
    law = law_of(lambda r, q: part * r[0] + r[2], s=0.5, cubic=0.3)
    assert (law.kind, law.of) == ("transcritical", "ordinate")
    assert holds(law, 8 * 0.3 / pi**3 / part, 1e-6)


@pytest.mark.long
def test_size_of_a_displacement_and_what_is_added_to_it() -> None:
    """``pi^4/8 x^2`` in the size, also beside a shortening; beside a displacement it differs on the two sides."""
    for of in (lambda r, q: abs(r[0]), lambda r, q: abs(r[0]) + 0.5 - r[2], lambda r, q: abs(r[0] + 0.5 - r[2])):
        law = law_of(of, s=0.5)
        assert law.power == 2 and holds(law, pi**4 / 8, 2e-5)
    assert law_of(lambda r, q: abs(r[0]) + 0.01 * r[0], s=0.5).of == "distance"


@pytest.mark.parametrize("a", [1.0, -1.0])
def test_side_of_a_transcritical_branch(a: float) -> None:
    """``u = a P``: the file has the sign of the load's change on the branch that begins with the first way."""
    model = two_freedoms(lambda u, f2, c: u**3 / 3 - c.a * c.P * u * u / 2 + 0.5 * f2, (-0.3, 0.3), a=a)
    diagram = rodfem.trace(model, Discretization("auto", 4, 3), Plan(depth=1))
    law, end = diagram.data["branches"][0]["special"][0]["law"], diagram["branch 1"].points[-1]
    assert (law["kind"], law["coefficient"]) == ("transcritical", pytest.approx(a, rel=1e-8))
    assert law["side"] == (1 if end.load > 0 else -1) == (a if end.ordinate > 0 else -a)


def test_a_slope_that_hides_in_a_pitchfork() -> None:
    """``P = u^2 + e u``: at the least amplitude, that of the last Chebyshev node, the slope is ``e/u`` of the first."""
    e, least = 1e-6, 0.12 * cos(7 * pi / 16)
    model = two_freedoms(lambda u, f2, c: u**4 / 4 + c.a * u**3 / 3 - c.P * u * u / 2 + 0.5 * f2, (-0.3, 0.3), a=e)
    (found,) = rodfem.trace(model, Discretization("auto", 4, 3), Plan(depth=1)).special("pitchfork")
    assert found.law is not None and found.law.coefficient == pytest.approx(1.0, rel=1e-8)
    assert found.law.uncertainty == pytest.approx(e / least, rel=1e-3)
