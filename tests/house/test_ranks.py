"""The same results on any number of ranks: each rank computes the whole problem once more by itself."""

import numpy as np
import pytest
from hemitropic_cases import explored, follower, scene
from mpi4py import MPI

from rodfem import Discretization, Plan, trace

pytestmark = pytest.mark.skipif(MPI.COMM_WORLD.size == 1, reason="compares several ranks with one")


@pytest.mark.ranks
@pytest.mark.versions
@pytest.mark.parametrize("formulation", [pytest.param("reduced", marks=pytest.mark.short), "pointwise"])
def test_ranks_change_nothing(formulation: str) -> None:
    together = explored(formulation, 7, 3)
    shared = follower(formulation, 7, 3)
    by_itself = trace(scene(), Discretization(formulation, 7, 3), Plan(error_bars=False), comm=MPI.COMM_SELF)
    alone = by_itself.solvers[0]
    assert shared.system.fields.unknowns == alone.system.fields.unknowns
    assert [len(b.points) for b in together] == [len(b.points) for b in by_itself]
    for a, b in zip(together, by_itself, strict=True):
        assert (a.name, a.parent, a.ended) == (b.name, b.parent, b.ended)
        for name in ("load", "ordinate", "energy", "stretch", "arclength"):
            one, other = ([getattr(p, name) for p in branch.points] for branch in (a, b))
            np.testing.assert_allclose(one, other, rtol=0, atol=1e-6, err_msg=name)
        for name in ("negative", "zero"):
            assert [getattr(p, name) for p in a.points] == [getattr(p, name) for p in b.points]
        for s, t in zip(a.special, b.special, strict=True):
            assert (s.kind, s.row, s.multiplicity) == (t.kind, t.row, t.multiplicity)
            assert s.point.load == pytest.approx(t.point.load, abs=1e-9)
            assert s.coupling == pytest.approx(t.coupling, rel=1e-8, abs=1e-12)
        mine, own = shared.shape.sample(a.points[-1].x), alone.shape.sample(b.points[-1].x)
        for name in ("s", "v", "r", "q"):  # of a circle of states the same one
            np.testing.assert_allclose(mine[name], own[name], rtol=0, atol=1e-5, err_msg=name)
