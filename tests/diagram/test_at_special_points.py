"""What a diagram says at the states of folds and branch points: the eigenvalue that vanishes there is zero, not stable.

A richer mesh has its special points at other loads: there its state at the load may be another one far away, or beside
the special point, whose eigenvalue at a fold is as large as the square root of the difference of loads.
"""

from functools import cache
from pathlib import Path

import classics
import numpy as np
import pytest
from classics import pressed_ring

from rodfem import Diagram, Discretization, Ordinate, Plan, Scene, SpecialPoint, load, trace

MESH = Discretization("auto", 4, 4)
ROUND_OFF = 1e-8
"""Of an eigenvalue in a metric in which the lowest one of bending is ten or so."""


def bedded(out_of_plane: float | None = None) -> Scene:
    """A column on a foundation that is stiffer on one side: branches turn, and cross, where no symmetry has them.

    It is in the plane, or in space, where its stiffness of bending ``out_of_plane`` is given, and that in it is 1.
    """
    planar = out_of_plane is None
    return classics.column(
        "bedded column", classics.SUPPORTS["pinned-pinned"], (0.0, 45.0 if planar else 20.5),
        planar="e2" if planar else None, constants={"B1": 1.3 if planar else out_of_plane, "B2": 1.0},
        ordinate=Ordinate("m", s=0.5, of=lambda r, q: r[0]),
        potential=lambda x, c: 100 * (x.r[0] ** 2 / 2 + x.r[0] ** 3 / 3) + 300 * x.r[1] ** 2,
    )  # fmt: skip


@cache
def column() -> Diagram:
    return trace(bedded(), MESH, Plan(depth=1))


def singular(diagram: Diagram) -> list[SpecialPoint]:
    return [s for s in diagram.special() if s.kind.singular]


def is_undecided(diagram: Diagram, special: SpecialPoint) -> bool:
    """Whether the eigenvalue is zero, all that is left open of the index is its sign, and rows there say the same."""
    indices = special.negative_before, special.negative_after
    first = [b.points[0] for b in diagram if b.parent and diagram[b.parent[0]].special[b.parent[1]] is special]
    for given in (special, special.point, *first):
        verdict = diagram.assess(given)
        (mode,) = verdict.soft
        if not abs(mode.value) <= mode.uncertainty < ROUND_OFF or verdict.stable is True:
            return False
        if {verdict.negative, verdict.negative + verdict.undecided} != {*indices}:
            return False
    return True


@pytest.mark.long
def test_what_vanishes_at_a_special_point_is_zero() -> None:
    found = singular(column())
    assert len(found) == 7 and sum(s.kind == "fold" for s in found) == 3
    assert all(is_undecided(column(), s) for s in found)


def test_a_branch_of_a_file_begins_at_its_branch_point(tmp_path: Path) -> None:
    """Its first state is read apart from that of the branch point, and is the same."""
    again = load(column().save(tmp_path), bedded())
    assert all(is_undecided(again, again[b.parent[0]].special[b.parent[1]]) for b in again.branches if b.parent)


def test_a_state_far_away_on_the_richer_mesh_is_not_taken() -> None:
    """By its state alone a fold is not known as one.  Newton's method goes from there to a state with mu = -0.56."""
    diagram = column()
    for fold in diagram.special("fold"):
        verdict = diagram.solver(fold).assess(fold.point.x)
        (mode,) = verdict.soft
        assert verdict.undecided == 1 and abs(mode.value) < ROUND_OFF and not np.isfinite(mode.uncertainty)


def test_equilibria_at_the_load_of_a_special_point() -> None:
    """Beside a fold there are two more or two fewer of them, there one."""
    diagram = column()
    for special in singular(diagram):
        lam = special.point.load
        found = diagram.at(lam)
        (same,) = [p for p in found if p.x is special.point.x]
        assert (same.load, same.undecided) == (lam, 1)
        assert len({round(p.ordinate, 6) for p in found}) == len(found)
        if special.kind == "fold":
            below, above = (len(diagram.at(lam + d)) for d in (-1e-3, 1e-3))
            assert abs(below - above) == 2 and len(found) == (below + above) / 2


@pytest.mark.long
def test_a_ring_at_its_critical_pressure() -> None:
    """At P = 3 it is neutral in two directions.  At this mesh's load, 2e-5 less, a richer mesh's ring is stable."""
    diagram = trace(pressed_ring(), Discretization("auto", 8, 4), Plan(depth=0))
    point = diagram.special("branch point")[0]
    assert 0 < abs(point.point.load - 3) < point.error_estimate
    (here,) = diagram.at(point.point.load)
    for found in (diagram.assess(point), here, diagram.solver(point).assess(point.point.x)):
        assert (found.negative, found.undecided, found.stable) == (0, 2, None)
        assert all(abs(m.value) <= m.uncertainty for m in found.soft)
    assert all(m.uncertainty < ROUND_OFF for m in here.soft)


@pytest.mark.long
def test_a_second_soft_mode_at_a_fold() -> None:
    """Ends that let the sections turn: by an angle a that costs ``(B1 - B2)/2 sin(a)^2`` times the curvature squared.

    That is twice the energy of bending times ``B1 - B2``, with ``B2 = 1``.  On richer meshes the eigenvalue that
    vanishes is farther from zero.
    """
    diagram = trace(bedded(1.0 + 1e-6), MESH, Plan(depth=1, most_branches=3))
    folds = [s for s in diagram.special("fold") if s.multiplicity == 1]
    assert len(folds) == 1 and folds[0].negative_before == 1
    verdict = diagram.assess(folds[0])
    assert (verdict.negative, verdict.undecided) == (0, 1)
    (turning,) = [m for m in verdict.soft if m.name == "turning of the cross-sections about d3"]
    assert abs(turning.value - 2e-6 * folds[0].point.energy) < turning.uncertainty < ROUND_OFF
