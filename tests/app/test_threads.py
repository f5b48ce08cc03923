"""Several threads, as those of a notebook or a server: their work is done one after another."""

from concurrent.futures import ThreadPoolExecutor
from math import pi

import pytest

from rodfem import Discretization, Ordinate, Plan, Scene, clamped, free, trace


def first_load(stiffness: float) -> float:
    """Load of Euler's column of a bending stiffness, which is ``pi^2/4`` times it."""
    column = Scene(
        f"column of {stiffness}", (0.0, 1.0), "unshearable and inextensible",
        lambda v, k, c: (stiffness * k[0] ** 2 + 2 * k[1] ** 2 + k[2] ** 2) / 2, {"P": 0.0}, "P",
        (clamped(), free(lambda c: (0.0, 0.0, -c.P))), Ordinate("y", s=1.0, of=lambda r, q: r[1]), (0.0, 4.0),
    )  # fmt: skip
    (branch,) = trace(column, Discretization(elements=4, degree=4), Plan(depth=0))
    return branch.special[0].point.load


@pytest.mark.long
def test_three_threads_at_once() -> None:
    stiffnesses = [1.0, 1.1, 1.2]
    with ThreadPoolExecutor(3) as threads:
        found = list(threads.map(first_load, stiffnesses))
    assert found == pytest.approx([pi**2 / 4 * B for B in stiffnesses], rel=1e-7)
