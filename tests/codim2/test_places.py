"""Where along a locus it turns, or ends: within bars of closed forms, in 30 digits, that are not too wide."""

from functools import cache
from math import pi

import classics
import numpy as np
import pytest
import rescaled
from hard.two_freedoms import scene

from rodfem import Diagram, Discretization, Locus, Plan, trace
from rodfem.continuation.kinds import BRANCH_POINT, DIVERGENCE, FLUTTER, FOLD
from rodfem.forms.energy import bending_and_twist

TURNS_IN_LOAD, TURNS_IN_SHARE = (16.052461577163431, 0.5), (19.422070332597733, 0.32112652696656004)
DIVERGES = pi**2, 0.5
"""Load and share of a thrust that follows, of the column of two flutter loads and a divergence load."""
DOUBLE_ZERO = 17.0695747744975, 0.3543133021536


@cache
def column(elements: int, degree: int) -> Diagram:
    """Frequencies of a column under a thrust, of which 0.4 follows it: it diverges, and flutters twice."""
    scene = classics.partly_following(0.4, (15.0, 30.0))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("rodfem.diagram.sweep.LOADS", 31)
        return trace(scene, Discretization("pointwise", elements, degree), Plan(depth=0))


def of_column(kind: str, number: int, elements: int = 4, degree: int = 6) -> Locus:
    return located(kind, number, elements, degree)  # a default and the same number given are two keys of a cache


@cache
def located(kind: str, number: int, elements: int, degree: int) -> Locus:
    diagram = column(elements, degree)
    return diagram.locus(diagram.special(kind)[number], "share", (0.0, 1.2), (0.0, 40.0))


def marked(found: Locus, kind: str, near: tuple[float, float]) -> int:
    """The one row that is marked so ``near`` these values."""
    rows = [m.row for m in found.marks if m.kind.startswith(kind)]
    (row,) = (r for r in rows if np.allclose(found.values[r], near, rtol=1e-3, atol=1e-3))
    return row


def check(found: Locus, kind: str, exact: tuple[float, float]) -> None:
    """The row that is marked so: its values within their bars, bars below 1e-8 of the bounds."""
    row = marked(found, kind, exact)
    assert np.all(abs(found.values[row] - exact) <= found.located_to[row])  # the mesh adds less
    assert np.all(found.located_to[row] <= found.error[row])
    assert np.all(found.error[row] <= 1e-8 * np.diff(found.bounds)[:, 0])


@pytest.mark.long
@pytest.mark.parametrize(
    ("kind", "number", "mark", "exact"),
    [
        (FLUTTER, 0, "turns in P", TURNS_IN_LOAD),
        (FLUTTER, 1, "turns in share", TURNS_IN_SHARE),
        (DIVERGENCE, 0, "turns in share", DIVERGES),
        (FLUTTER, 0, "the double eigenvalue vanishes", DOUBLE_ZERO),
        (FLUTTER, 1, "the double eigenvalue vanishes", DOUBLE_ZERO),
    ],
)
def test_column_whose_load_follows_in_part(kind: str, number: int, mark: str, exact: tuple[float, float]) -> None:
    check(of_column(kind, number), mark, exact)


@pytest.mark.long
@pytest.mark.usefixtures("few_loads")
def test_the_same_column_in_units_of_a_molecule() -> None:
    """Pairs at and next to the double zero: one of the end and one of a row beside it were 1e-7, and 0.1, off."""
    small = rescaled.rescaled(classics.partly_following(0.4, (15.0, 30.0)), 1e-9, 1e-12)
    diagram = trace(small, Discretization("pointwise", 4, 6), Plan(depth=0))
    found = diagram.locus(diagram.special(FLUTTER)[0], "share", (0.0, 1.2), (0.0, 40.0))
    check(found, "turns in P", TURNS_IN_LOAD)
    check(found, "the double eigenvalue vanishes", DOUBLE_ZERO)


@pytest.mark.long
@pytest.mark.usefixtures("few_loads")
@pytest.mark.parametrize(("number", "index"), [(0, [0, 2]), (1, [2, 2])])
def test_a_double_zero_counts_as_the_row_before_it(number: int, index: list[int]) -> None:
    """The end is found, though left vectors beside it are not always; the double eigenvalue there is -1e-8."""
    plan = Plan(depth=0, error_bars=False)
    diagram = trace(classics.partly_following(0.4, (15.0, 30.0)), Discretization("pointwise", 4, 6), plan)
    found = diagram.locus(diagram.special(FLUTTER)[number], "share", (0.0, 1.2), (0.0, 40.0))
    (end,) = (m.row for m in found.marks if "vanishes" in m.kind)
    assert end == 0 and abs(found.omega2[end]) < 1e-5
    assert found.index[:3].tolist() == [index] * 3


@pytest.mark.long
def test_a_coarse_mesh_displaces_turning_points_along_the_curve() -> None:
    """The bar is the difference from a finer mesh, whose own error is some 1e-5 of that and may be 1/32."""
    found = of_column(FLUTTER, 0, 2, 4)
    row = marked(found, "turns in P", TURNS_IN_LOAD)
    assert abs(found.values[row] - TURNS_IN_LOAD) == pytest.approx((1 - 1 / 32) * found.error[row], rel=1e-3)


@pytest.mark.long
def test_stiffness_with_a_minimum() -> None:
    """``P = (1 + (b - 0.3)^2) pi^2/4``."""
    rod = classics.column(
        "column", classics.SUPPORTS["clamped-free"], (0.0, 4.0), planar="e2", constants={"b": 0.0},
        energy=lambda v, k, c: (1 + (c.b - 0.3) ** 2) * bending_and_twist(k, (5.0, 1.0, 3.0)),
    )  # fmt: skip
    diagram = trace(rod, Discretization("auto", 4, 6), Plan(depth=0))
    check(diagram.locus(diagram.special(BRANCH_POINT)[0], "b", (0.0, 1.0), (0.0, 5.0)), "turns in P", (pi**2 / 4, 0.3))


@pytest.mark.long
def test_fold_that_ends_on_a_branch_point() -> None:
    """The branch ``P = f/sin f - 1 + b f2 + f2^2``, ``f2 = 2 - 2 cos f``, begins with ``(b + 1/6) f^2``."""
    potential = lambda u, f2, c: 0.5 * c.a * u * u - 0.5 * c.P * f2 + 0.25 * c.b * f2**2 + f2**3 / 6  # noqa: E731
    diagram = trace(scene(potential, (-0.3, 0.3), a=1.0, b=-1 / 6 - 1e-2), Discretization("auto", 4, 3), Plan(depth=1))
    found = diagram.locus(diagram.special(FOLD)[0], "b", (-0.3, 0.1), (-0.3, 0.3))
    check(found, "the fold ends on a branch point", (0.0, -1 / 6))
    assert any("or turns back within 1e-05 of the bounds from one" in why for why in found.ended)
