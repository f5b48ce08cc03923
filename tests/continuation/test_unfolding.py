"""Branch points that an imperfection takes apart, against the elastica in closed form."""

from dataclasses import replace
from math import pi
from typing import Any

import classics
import numpy as np
import pytest
from classics import ON_AXIS, SUPPORTS, Found, column, deep_arch, push, turned
from closed_forms import elastica
from scipy.optimize import brentq, minimize_scalar
from scipy.special import ellipk, ellipkinc

from rodfem import Attachment, Discretization, Ordinate, Plan, Scene, Solver, StepControl, trace
from rodfem.continuation.branch import SpecialPoint
from rodfem.continuation.kinds import BRANCH_POINT, FOLD, IMPERFECT
from rodfem.continuation.singular import SingularSystem
from rodfem.continuation.singular_points import COUPLED
from rodfem.forms.energy import bending_and_twist
from rodfem.problem.ends import clamped, free, pinned, sliding

EULER = pi**2 / 4


def cantilever(lateral: float) -> Scene:
    """A column that bends in the plane of e2, under a dead load -P along e3 and a small one along e2."""
    ends = (clamped(), free(lambda c: (0.0, c.e, -c.P)))
    return column(
        "cantilever", ends, (0.0, 4.0), constants={"e": lateral},
        ordinate=Ordinate("tip", s=1.0, of=lambda r, q: r[1]),
    )  # fmt: skip


def diagram(scene: Scene, depth: int = 1, mesh: Discretization | None = None, **plan: Any) -> Found:
    """Branches of a scene and their solver, with the default steps."""
    return Found(trace(scene, mesh or Discretization("reduced", 8, 6), Plan(depth=depth, error_bars=False, **plan)))


def load_of(k: float, lateral: float, side: float) -> float:
    """Load P at which an elastica of modulus ``k`` is in equilibrium with the lateral load.

    The resultant R = (P^2 + e^2)^(1/2) makes the angle d = atan(e/P) with the axis.  The angle of the rod from R obeys
    a'' = -R sin a, is d at the clamp and sin(a/2) = k at the tip: sqrt(R) = K(k) - side F(asin(sin(d/2)/k), k), with
    ``side`` 1 where the rod bends to the side of the lateral load and -1 where it bends against it.
    """

    def misfit(P: float) -> float:
        d = np.arctan2(lateral, P)
        amplitude = np.arcsin(min(np.sin(d / 2) / k, 1.0))
        return np.hypot(P, lateral) - (ellipk(k * k) - side * ellipkinc(amplitude, k * k)) ** 2

    return float(brentq(misfit, 0.5, 20.0, xtol=1e-15, rtol=1e-15))


def fold_of(lateral: float) -> float:
    """Least load of the branch that bends against the lateral load."""
    expected = np.log((lateral / EULER) ** (1 / 3))
    found = minimize_scalar(
        lambda x: load_of(np.exp(x), lateral, -1.0), bracket=(expected - 0.7, expected, expected + 0.7), tol=1e-9
    )
    return float(found.fun)


def test_a_jump_at_which_nothing_can_be_located_is_one_across_a_gap(lateral: float = 2e-4) -> None:
    """Long steps end on the other branch, and shorter ones after them do not: the gap is known from the first."""
    found = diagram(cantilever(lateral), steps=StepControl(first=0.05, largest=0.3))
    first, detached = found.branches
    assert {p.negative for p in first.points} == {0}
    (fold,) = [s for s in detached.special if s.kind == FOLD]
    assert fold.point.load == pytest.approx(fold_of(lateral), abs=2e-11)


@pytest.mark.parametrize("largest", [0.1, 0.4])
def test_the_other_side_of_a_fold(largest: float, lateral: float = 1e-2, k: float = 0.5) -> None:
    """From the branch with the fold the one without it is found, whatever the steps."""

    def start(s: np.ndarray) -> np.ndarray:  # to the side against the lateral load
        half = 0.6 * np.sin(pi * s / 2)
        return np.stack([np.cos(half), np.sin(half), 0 * s, 0 * s], axis=1)

    P = load_of(k, lateral, 1.0)
    rod = replace(cantilever(lateral), start=start, span=(4.0, 1.0))
    against, detached = diagram(rod, at=(P,), steps=StepControl(largest=largest)).branches
    assert min(p.load for p in against.points) == pytest.approx(fold_of(lateral), abs=1e-4)
    (point,) = [p for p in detached.points if p.load == P]
    assert point.directors[-1, 2, 1] == pytest.approx(np.sin(2 * np.arcsin(k) - np.arctan2(lateral, P)), abs=1e-6)
    assert {p.negative for p in detached.points} == {0}


def test_unfolding_is_the_work_of_the_imperfection() -> None:
    """``beta`` is minus the work of the lateral load on the null vector, sin(pi s / 2) sqrt(2) of unit size."""
    values = []
    for lateral in (0.0, 1e-6):
        straight = diagram(cantilever(0.0), depth=0)
        special = straight.special()[0]
        solver = Solver(cantilever(lateral), Discretization("reduced", 8, 6)).equilibria
        found = SingularSystem(solver, special.null_vectors, special.multiplicity, fold=False).solve(special.point.x)
        assert found.load == pytest.approx(EULER, abs=1e-11)
        values.append(found)
    assert values[0].size <= values[0].noise
    work = 1e-6 * np.sqrt(2) * 2 / pi  # of the lateral load on r2(1) = int theta ds
    assert values[1].size == pytest.approx(work, rel=1e-6)
    assert values[1].size > values[1].noise


def test_a_branch_point_that_the_mesh_unfolds_ends_no_branch() -> None:
    """A strut on a softening foundation: branch 1, of 13 half-waves, passes a branch point at P = 1.859970217.

    48 and 96 elements agree on that to 1e-9.  On 24 an equilibrium of the mesh is beside it only, by as much as its
    unfolding parameter.
    """
    strut = column(
        "strut", SUPPORTS["pinned-pinned"], (1.85, 2.05), interval=(0.0, 40.0), constants={"P": 1.85, "B2": 1.0},
        ordinate=Ordinate("deflection", s=20.0, of=lambda r, q: r[0]), planar="e2",
        potential=lambda x, c: 0.5 * x.r[0] ** 2 - 0.25 * x.r[0] ** 4,
    )  # fmt: skip
    branch = trace(strut, Discretization(elements=24), Plan(depth=1, most_branches=2))["branch 1"]
    assert branch.ended == "end of range" and branch.points[-1].load == 1.85
    (point,) = (s for s in branch.special if abs(s.point.load - 1.86) < 5e-3)
    assert 1e-12 < point.unfolding < 1e-6
    assert abs(point.point.load - 1.859970217) <= 1.5 * point.error_estimate < 2e-8


@pytest.mark.long
def test_a_mesh_without_the_symmetry_of_the_rod() -> None:
    """Unequal elements take a pitchfork apart that the reversal of the rod makes: a richer mesh tells."""
    ends = (pinned(), pinned(ON_AXIS, push))
    scene = column(
        "arch", ends, (0.0, 12.0), constants={"B2": 3.0}, ordinate=Ordinate("middle", s=0.5, of=lambda r, q: r[1]),
        energy=lambda v, k, c: 0.5 * ((k[0] - 0.3) ** 2 + c.B2 * k[1] ** 2 + c.C * k[2] ** 2),
    )  # fmt: skip
    graded = Discretization("reduced", 4, 4, (0.0, 0.1, 0.35, 0.8, 1.0))
    kinds = {s.kind for b in diagram(scene, 0, graded).branches for s in b.special}
    assert IMPERFECT not in kinds


def test_what_steps_do_not_resolve_is_called_imperfect() -> None:
    """The bend of 5e-14 is sharper than the least step: the point is recorded with the size of its unfolding."""
    found = diagram(cantilever(5e-14), depth=0, steps=StepControl(largest=0.05))
    (special,) = [s for s in found.branches[0].special if s.kind != "end"]
    assert special.kind == IMPERFECT
    assert special.note == "imperfect, unfolding 5e-14"
    assert special.unfolding == pytest.approx(5e-14 * np.sqrt(2) * 2 / pi, rel=1e-2)


def test_a_load_beside_a_branch_point() -> None:
    """The branch that leaves there has its row at that load, and goes on: sqrt(P) = K(k), tip 2 k / sqrt(P)."""
    scene = column("beside", SUPPORTS["clamped-free"], (0.0, 4.0), ordinate=cantilever(0.0).ordinate)
    buckled = diagram(scene, at=(load := EULER + 1e-11,)).branches[1]
    assert buckled.ended == "end of range"
    (row,) = [s.point for s in buckled.special if s.kind == "user"]
    assert row.load == load and abs(row.ordinate) == pytest.approx(elastica(load)[1], rel=4e-4)  # by round-off of P


@pytest.mark.long
def test_folds_that_are_nearly_uncoupled_from_the_load() -> None:
    """Past a turn of 2 pi the null vector of a clamped rod is nearly orthogonal to the load derivative, also at a fold.

    The rod bends almost alike in all planes: a load ``e`` across takes a subcritical pitchfork apart, and the fold of
    the first branch lies below it by the e^(2/3) of Koiter (1945).
    """

    def special(e: float) -> SpecialPoint:
        scene = column(
            "turned", (clamped(), sliding(ON_AXIS, turned)), (12.5, 13.2), load="phi",
            constants={"phi": 12.5, "B2": 1.02, "C": 0.7, "e": e}, distributed=lambda c: (c.e, 0.3 * c.e, 0.0),
            start=lambda s: np.stack([np.cos(6.25 * s), 0 * s, 0 * s, np.sin(6.25 * s)], axis=1),
        )  # fmt: skip
        first = diagram(scene, 0, Discretization("pointwise", 6, 5)).branches[0]
        return first.special[0]

    perfect = special(0.0)
    assert perfect.kind == BRANCH_POINT
    below = []
    for e in (8e-6, 1e-6, 1e-7):
        fold = special(e)
        assert (fold.kind, fold.negative_before, fold.negative_after) == (FOLD, 0, 1)
        below.append(perfect.point.load - fold.point.load)
    assert below[0] / below[1] == pytest.approx(4.0, rel=1e-3)
    assert below[1] / below[2] == pytest.approx(10 ** (2 / 3), rel=1e-3)


def test_the_other_sides_are_found_with_long_steps() -> None:
    """A column with a lateral force at a spring: its rows resolve the bends, and an eigenvalue turns back near zero."""
    rod = classics.column(
        "imperfect", classics.SUPPORTS["clamped-clamped"], (0.0, 70.0), constants={"h": 0.05, "B2": 1.3},
        attachments=(Attachment(0.35, force=lambda c: (c.h, 0.7 * c.h, 0.0), energy=lambda x, c: 10.0 * x.r[0] ** 2),),
        ordinate=Ordinate("mid", s=0.5, of=lambda r, q: float(np.hypot(r[0], r[1]))),
    )  # fmt: skip
    steps = StepControl(first=0.03, largest=0.15)
    found = trace(rod, Discretization("auto", 8, 6), Plan(depth=1, steps=steps, error_bars=False))
    folds = [s.point.load for branch in found for s in branch.special if s.kind == FOLD]
    for expected in (5.37, 63.67, 66.86, 39.70):
        assert min(abs(np.array(folds) - expected)) < 5e-3
    assert len(found) == 7


def stiff(strains: float) -> Scene:
    """A deep arch with strains of this stiffness."""

    def energy(v: Any, k: Any, c: Any) -> Any:
        stretched = c.GA * (v[0] ** 2 + v[1] ** 2 + (v[2] - 1.0) ** 2) / 2
        return stretched + bending_and_twist((k[0], k[1] - 1.0, k[2]), (c.B1, c.B2, c.C))

    arch = deep_arch()
    return replace(arch, rod="flexible", energy=energy, parameters={**arch.parameters, "GA": strains}, span=(0.0, 9.5))


@pytest.mark.long
def test_stiff_strains_do_not_hide_the_load() -> None:
    """The fold of an arch of DaDeppo & Schmidt is one however stiff its strains are, and at 8.97.

    Beside strains of 1e11 its load was taken for none: the coupling was zero, as at a branch point, and an arch that
    buckles sideways ended at "two branch points" that are one fold.
    """
    plan = Plan(depth=0, error_bars=False)
    found = [trace(stiff(GA), Discretization(elements=8, degree=4), plan).special("fold") for GA in (1e6, 1e11)]
    (soft,), (hard,) = found
    assert hard.point.load == pytest.approx(8.9731, abs=2e-4)
    assert soft.coupling > 10 * COUPLED
    assert hard.coupling == pytest.approx(soft.coupling, rel=1e-2)
