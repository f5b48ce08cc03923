"""Which eigenvalue goes on from which: the assignment of least cost."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment

from rodfem.continuation.eigenvalue_curves import assignment


@pytest.mark.parametrize(("m", "k"), [(7, 7), (9, 5), (5, 9), (1, 3), (4, 0)])
@pytest.mark.parametrize("apart", [True, False])
def test_assignment_of_least_cost(m: int, k: int, apart: bool) -> None:
    """With the least entries in different places, and without."""
    rng = np.random.default_rng(4)
    for _ in range(50):
        cost = rng.random((m, k))
        if apart:
            fewer = min(m, k)
            cost[rng.permutation(m)[:fewer], rng.permutation(k)[:fewer]] *= 1e-3
        rows, columns = assignment(cost)
        assert len(set(rows.tolist())) == len(set(columns.tolist())) == min(m, k)
        assert cost[rows, columns].sum() == pytest.approx(cost[linear_sum_assignment(cost)].sum(), rel=1e-14)
