"""The coupling of a null vector to the load, which tells folds from branch points, beside stiff strains."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import demo_cases
import pytest
from classics import deep_arch

from rodfem import Discretization, Plan, Scene, trace
from rodfem.continuation.kinds import BRANCH_POINT
from rodfem.forms.energy import bending_and_twist


def stiff(strains: float) -> Scene:
    """A deep arch with strains of this stiffness."""

    def energy(v: Any, k: Any, c: Any) -> Any:
        stretched = c.GA * (v[0] ** 2 + v[1] ** 2 + (v[2] - 1.0) ** 2) / 2
        return stretched + bending_and_twist((k[0], k[1] - 1.0, k[2]), (c.B1, c.B2, c.C))

    arch = deep_arch()
    return replace(arch, rod="flexible", energy=energy, parameters={**arch.parameters, "GA": strains}, span=(0.0, 9.5))


@pytest.mark.long
@pytest.mark.alone
def test_stiff_strains_do_not_hide_the_load() -> None:
    """The fold of an arch of DaDeppo & Schmidt is one however stiff its strains are, and at 8.97.

    Beside strains of 1e11 its load was taken for none: the coupling was zero, as at a branch point, and an arch that
    buckles sideways ended at "two branch points" that are one fold.
    """
    plan = Plan(depth=0, error_bars=False)
    found = [trace(stiff(GA), Discretization(elements=8, degree=4), plan).special("fold") for GA in (1e6, 1e11)]
    (soft,), (hard,) = found
    assert hard.point.load == pytest.approx(8.9731, abs=2e-4)
    assert soft.coupling > 1e-3
    assert hard.coupling == pytest.approx(soft.coupling, rel=1e-2)


@pytest.mark.long
@pytest.mark.alone
def test_a_branch_that_meets_its_mirror_image_turns_at_no_fold() -> None:
    """A cord as a figure eight: its ends stay together, so that the load does no work, and another branch crosses it.

    The load turns back there only because the branch goes on as its mirror image, and the index is that before.  On 18
    elements of degree 7 it is at 56.2198048707; 9 elements take it apart.
    """
    plan = Plan(depth=1, at=(40.0,), tries=24, error_bars=False)
    diagram = trace(demo_cases.scene("cord"), Discretization("auto", 12, 6), plan)
    found = [s for branch in diagram for s in branch.special if 56.0 < s.point.load < 57.0 and s.kind.singular]
    assert [s.kind for s in found] == [BRANCH_POINT]
    assert found[0].point.load == pytest.approx(56.2198048707, abs=2e-6)
    assert found[0].negative_before == found[0].negative_after
