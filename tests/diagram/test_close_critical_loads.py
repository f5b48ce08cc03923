"""Critical loads of a sweep that are close to one another: in one step, in neighbouring ones, nearly equal.

Beck's column in space is two columns, one for each plane: all loads of the second one are those of the first one times
its stiffness B2.  What the load does may be any function of a parameter, so that flutter comes and goes where we like.
"""

from collections.abc import Sequence
from functools import cache
from itertools import pairwise
from math import sqrt
from typing import Any

import classics
import numpy as np
import pytest
from closed_forms import double
from hemitropic_cases import specials
from scipy.linalg import expm
from scipy.optimize import brentq, fsolve

from rodfem import Diagram, Discretization, Plan, Scene, clamped, free, trace

BECK = float(double(20.0, 120.0)[0])
MESH = Discretization("pointwise", 4, 6)
STEPS = {(18.0, 22.2): 0.3, (4.5, 18.0): 0.25, (10.0, 30.0): 2.0}
"""Distances of the rows of some spans."""
SHARE = 0.4
"""Of a thrust, which follows the tip: the column diverges, comes back, and flutters."""


@pytest.mark.ranks
def test_the_load_of_beck() -> None:
    assert pytest.approx(20.0509536189738, abs=1e-11) == BECK


def critical(branch: Any, kind: str = "flutter") -> list[tuple[float, float, int, int]]:
    """Loads in ascending order, with their bars, and the numbers of unstable eigenvalues before and after."""
    found = [(s.point.load, s.error_estimate, s.negative_before, s.negative_after) for s in specials(branch, kind)]
    return sorted(found)


def agree(found: Sequence[tuple[float, float, int, int]], exact: Sequence[float], within: float = 1e-9) -> None:
    assert len(found) == len(exact)
    for (load, bar, *_), expected in zip(found, sorted(exact), strict=True):
        assert abs(load - expected) <= bar <= within


def adds_up(diagram: Diagram, say: bool = False) -> None:
    """From row to row the number of unstable eigenvalues changes by what special points say, and nothing is left."""
    branch = diagram[0]
    at = {id(s.point): s for s in branch.special if not s.kind.request}
    number = branch.points[0].negative
    for p in branch.points:
        if (s := at.get(id(p))) is not None:
            assert s.negative_before == number
            number = s.negative_after
        else:
            assert p.negative == number
    assert not branch.unexplained
    assert bool(diagram.warnings) == say


def in_steps(step: float, scene: Scene, mesh: Discretization | None = MESH, *, error_bars: bool = True) -> Diagram:
    """A sweep with a row every ``step``: over a part of a range, the rows that a hundred steps over the whole have."""
    low, high = scene.span
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("rodfem.diagram.sweep.LOADS", 1 + round(abs(high - low) / step))
        return trace(scene, mesh, Plan(depth=0, error_bars=error_bars))


def swept(strong: float, span: tuple[float, float], share: float = 1.0) -> Diagram:
    """Rows every 0.3, 0.25 or 2 of some spans, as from 0 to 30, 25 or 200, and a hundred steps of the others."""
    scene = classics.partly_following(share, span, strong)
    low, high = sorted(span)
    return in_steps(STEPS.get((low, high), (high - low) / 100), scene)


columns = cache(swept)
"""The same, once for each set of arguments."""


def humped(strong: float, top: float, curvature: float, span: tuple[float, float]) -> Scene:
    """Beck's column whose thrust is ``BECK + top - curvature (p - 5.0371)^2``."""

    def push(c: Any) -> tuple[Any, ...]:
        return (0.0, 0.0, -(BECK + c.top - c.curvature * (c.p - 5.0371) ** 2))

    constants = {"p": span[0], "B2": strong, "top": top, "curvature": curvature}
    ends = clamped(), free(follower=push)
    return classics.column("humped", ends, span, load="p", inertia=classics.BEAM, constants=constants)


@pytest.mark.long
@pytest.mark.parametrize("span", [(4.0, 6.0), (6.0, 4.0)])
@pytest.mark.parametrize(
    ("top", "curvature"),
    [
        (1e-6, 1.0),
        (1e-3, 0.02),
        (-1e-6, -1.0),
    ],
)
def test_flutter_and_its_reverse_in_a_step(top: float, curvature: float, span: tuple[float, float]) -> None:
    """Rows every 0.1 show none of it, where it takes 0.002 or 0.06 of the parameter; nor of a range without flutter."""
    diagram = in_steps(0.1, humped(10.0, top, curvature, span))
    half = sqrt(top / curvature)
    agree(critical(diagram[0]), [5.0371 - half, 5.0371 + half], 1e-7)
    adds_up(diagram)


@pytest.mark.long
@pytest.mark.parametrize("top", [-1e-2, -1e-8])
def test_frequencies_that_nearly_meet(top: float) -> None:
    diagram = in_steps(0.1, humped(10.0, top, 1.0, (4.0, 6.0)), None)
    assert not specials(diagram[0], "flutter") and not diagram.warnings


def partly(P: float, mu: complex, share: float = SHARE) -> complex:
    """Zero at eigenvalues: ``w'''' + P w'' = mu w``, clamped, ``w'' = w''' + (1 - share) P w' = 0`` at the tip."""
    A = np.diag(np.ones(3, dtype=complex), 1)
    A[3, 0], A[3, 2] = mu, -P
    E = expm(A)
    rows = np.array([E[2, 2:], E[3, 2:] + (1 - share) * P * E[1, 2:]])
    return complex(np.linalg.det(rows))


DIVERGES, BACK = (brentq(lambda P: partly(P, 0.0).real, *near, xtol=1e-13) for near in ((5.0, 6.0), (15.0, 16.2)))
FLUTTERS = float(
    fsolve(
        lambda z: [partly(z[0], z[1]).real, partly(z[0], complex(z[1], 1e-20)).imag / 1e-20], [16.4, 21.5], xtol=1e-13
    )[0]
)


@pytest.mark.long
@pytest.mark.parametrize("span", [(4.5, 18.0), (18.0, 4.5)])
@pytest.mark.parametrize(
    "strong",
    [
        1.002,
        BACK / DIVERGES + 1e-3,
        FLUTTERS / DIVERGES,
    ],
)
def test_flutter_and_divergence(strong: float, span: tuple[float, float]) -> None:
    """In one step: of one plane flutter, or the end of divergence, and divergence of the other one."""
    diagram = columns(strong, span, SHARE)
    inside = [x for x in (DIVERGES, BACK, DIVERGES * strong, BACK * strong) if x < 18]
    agree(critical(diagram[0], "divergence"), inside)
    agree(critical(diagram[0]), [x for x in (FLUTTERS, FLUTTERS * strong) if x < 18])
    adds_up(diagram)
    for a, b in pairwise(critical(diagram[0])):
        assert a[0] < b[0]


FINE, COARSE = Discretization("pointwise", 4, 6), Discretization("pointwise", 2, 4)
