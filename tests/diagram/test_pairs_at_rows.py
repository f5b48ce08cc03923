"""Two branch points of which one is at a row, also the first or the last one, or which have a third one beside them."""

from __future__ import annotations

import pytest
from hard.ranges import beside_a_pair, pair_at_a_row

pytestmark = pytest.mark.alone


@pytest.mark.few(2)
@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("row", [0, 3, -1])
@pytest.mark.parametrize("off", [0.0, 1e-6, -1e-6])
def test_one_of_two_branch_points_is_at_a_row(row: int, side: float, sign: float, off: float) -> None:
    """The rod is stable between them, or unstable there alone: the row itself does not tell which of both."""
    found = pair_at_a_row(row, off, side, sign, error_bars=False)
    assert found.right, f"{found.error:.3g} {found.wrong} {found.said}"


@pytest.mark.few(2)
@pytest.mark.parametrize(
    "given",
    [
        (1.24, 0.002),  # all three in one step
        (2.05, -0.05, -0.3),  # the last one is found first, by the number of its eigenvalue
        (1.9, 0.02, -0.3),  # the third one just after the row after the pair
        (1.24, -0.2, 0.3, 3.0),  # an eigenvalue that becomes more negative hides the pair
        (1.9, 0.002, 0.3, 3.0),
        (1.86881199, 0.1025835, -0.3, 3.0, 0.0088552963, 2.026),  # the nearest eigenvalue is a negative one
        (1.193937, -0.123893, 0.3, 3.0, 0.011294364, 3.63),  # the third one just before the three rows
    ],
)
def test_two_branch_points_beside_a_third_one(given: tuple[float, ...]) -> None:
    found = beside_a_pair(*given, error_bars=False)
    assert found.right, f"{found.error:.3g} {found.wrong} {found.said}"
