"""Several threads, as those of a notebook or a server: their work is done one after another."""

from concurrent.futures import ThreadPoolExecutor
from math import pi

import pytest
from classics import SUPPORTS, column

from rodfem import Discretization, Plan, trace


def first_load(stiffness: float) -> float:
    """Load of Euler's column of a bending stiffness, which is ``pi^2/4`` times it."""

    rod = column("column", SUPPORTS["clamped-free"], (0.0, 4.0), constants={"B1": stiffness})
    (branch,) = trace(rod, Discretization(elements=4, degree=4), Plan(depth=0))
    return branch.special[0].point.load


@pytest.mark.long
def test_three_threads_at_once() -> None:
    stiffnesses = [1.0, 1.1, 1.2]
    with ThreadPoolExecutor(3) as threads:
        found = list(threads.map(first_load, stiffnesses))
    assert found == pytest.approx([pi**2 / 4 * B for B in stiffnesses], rel=1e-7)
