"""Pitchforks whose leading coefficient nearly vanishes: super- or subcritical by its sign, and the fold beside it.

The branch of the rod with ``V = -P f2/2 + eps f2^2/4 + f2^3/6``, where ``f2 = 2 - 2 cos f`` and f is the twist of its
end, is ``P = f/sin f - 1 + eps f2 + f2^2``: in f it begins with ``(eps + 1/6) f^2``.
"""

from __future__ import annotations

from math import cos, sin

import pytest
from hard.two_freedoms import scene
from scipy.optimize import minimize_scalar

from rodfem import Diagram, Discretization, Plan, trace
from rodfem.continuation.kinds import BRANCH_POINT, FOLD


def pitchfork(beside: float) -> Diagram:
    """Diagram with ``eps = -1/6 + beside``."""
    eps = -1 / 6 + beside
    model = scene(
        lambda u, f2, c: 0.5 * c.a * u * u - 0.5 * c.P * f2 + 0.25 * c.b * f2**2 + f2**3 / 6, (-0.3, 0.3), a=1.0, b=eps
    )
    return trace(model, Discretization("auto", 4, 3), Plan(depth=1))


def load(f: float, beside: float) -> float:
    f2 = 2 - 2 * cos(f)
    return float(f / sin(f) - 1 + (-1 / 6 + beside) * f2 + f2**2)


@pytest.mark.parametrize("beside", [-1e-2, -2e-3, -1e-3])
def test_a_fold_beside_a_subcritical_pitchfork(beside: float) -> None:
    """Beyond the fold the branch is stable, and at loads above: there the pitchfork is none that is supercritical."""
    diagram = pitchfork(beside)
    (special,) = diagram.special(BRANCH_POINT)
    law = special.law
    assert law is not None
    assert (law.kind, law.side) == ("subcritical pitchfork", -1)
    assert law.coefficient == pytest.approx(3 * beside, rel=1e-5, abs=2 * law.uncertainty)
    fold = diagram.special(FOLD)[0]
    true = minimize_scalar(load, bounds=(1e-9, 3 * (-beside) ** 0.5), args=(beside,), method="bounded")
    assert abs(fold.point.load - true.fun) <= max(fold.error_estimate, 1e-13)
    assert {(p.negative, p.slope < 0) for p in diagram[1].points[1:] if p is not fold.point} == {(1, True), (0, False)}


def test_a_fold_that_is_not_located_is_said_to_be_missing() -> None:
    """It is 6e-8 beside the branch point in load: the index tells that there is one."""
    diagram = pitchfork(-5e-4)
    assert diagram.special(FOLD) or any("no special point was found that says why" in w for w in diagram.warnings)
    assert diagram[1].points[1].negative == 1


@pytest.mark.parametrize(("beside", "kind"), [(-1e-6, "subcritical"), (1e-6, "supercritical"), (1e-2, "supercritical")])
def test_the_sign_of_the_coefficient_names_the_pitchfork(beside: float, kind: str) -> None:
    """Also where the fold is as near to the branch point as the uncertainty of that, which a note says."""
    diagram = pitchfork(beside)
    (special,) = diagram.special(BRANCH_POINT)
    assert special.law is not None
    assert special.law.kind == f"{kind} pitchfork"
    assert ("turns back in a fold" in special.note) == (beside < 0)


def test_a_coefficient_that_is_not_told_from_zero() -> None:
    diagram = pitchfork(0.0)
    (special,) = diagram.special(BRANCH_POINT)
    assert special.law is not None
    assert (special.law.kind, special.law.side) == ("pitchfork", 0)
    assert abs(special.law.coefficient) <= special.law.uncertainty
    assert "undetermined form" in diagram.in_words()
