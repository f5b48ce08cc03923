"""Branches that leave a double point: all of them, those to which Newton's method is not attracted, too.

A cantilever of equal bending stiffnesses with a quartic potential at its tip: the reduced potential is the quartic form
on the circle of directions, and branches leave where that is extremal.
"""

from math import degrees
from typing import Any

import numpy as np
import pytest
from classics import column, push

from rodfem import Discretization, Ordinate, Plan, clamped, free, trace

pytestmark = pytest.mark.ranks

FORMS = {
    "square": ((5.0, 0.0, 0.0, 0.0, 5.0), 90),  # by symmetry one branch stands for those at right angles, too
    "two lines": ((5.0, 3.0, 0.0, 2.0, 1.5), 180),
    "four lines": ((1.0, 0.0, -6.0, 0.5, 1.0), 180),
}


def quartic(form: tuple[float, ...], x: Any, y: Any) -> Any:
    """Sum of ``form[j] x^(4-j) y^j``."""
    return sum(a * x ** (4 - j) * y**j for j, a in enumerate(form))


def extremal(form: tuple[float, ...]) -> list[float]:
    """Angles, in degrees in [0, 180), at which the form has an extremum on the circle."""
    t = np.linspace(0.0, np.pi, 200_001)[:-1] + 1e-7
    slope = np.diff(quartic(form, np.cos(t), np.sin(t)), append=quartic(form, np.cos(t[0]), np.sin(t[0])))
    return np.degrees(t[np.sign(slope) != np.sign(np.roll(slope, 1))]).tolist()


def angle(r: Any, q: Any) -> float:
    """Direction in which the tip has moved, in degrees; zero where it has not."""
    return degrees(float(np.arctan2(r[1], r[0]))) % 180 if np.hypot(*r[:2]) > 1e-9 else 0.0


@pytest.mark.long
@pytest.mark.parametrize(
    ("form", "period"),
    [pytest.param(*x, id=name, marks=[pytest.mark.alone] * (name != "square")) for name, x in FORMS.items()],
)
def test_every_extremum_has_its_branch(form: tuple[float, ...], period: int) -> None:
    """Of ten random forms four lacked one or two branches, all of them maxima, without a word."""
    energy = lambda x, c: quartic(form, x.r[0], x.r[1])  # noqa: E731
    rod = column(
        "tip", (clamped(), free(push, energy=energy)), (0.0, 4.0), constants={"B2": 1.0, "C": 0.8},
        ordinate=Ordinate("angle", s=1.0, of=angle),
    )  # fmt: skip
    found = trace(rod, Discretization(elements=4, degree=4), Plan(depth=1, error_bars=False))
    traced = sorted(branch.points[1].ordinate for branch in found.branches[1:])
    exact = extremal(form)
    nearest = [min(abs((at - known + period / 2) % period - period / 2) for known in traced) for at in exact]
    assert max(nearest) < 0.5 and len(traced) == len(exact) * period // 180, (traced, exact)
