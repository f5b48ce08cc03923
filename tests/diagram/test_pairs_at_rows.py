"""Two branch points, of which one is at a row, the first and the last included, and the other in a step beside it."""

from __future__ import annotations

import pytest
from hard.ranges import pair_at_a_row

pytestmark = pytest.mark.alone


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("row", [0, 3, -1])
@pytest.mark.parametrize("off", [0.0, 1e-6, -1e-6])
def test_one_of_two_branch_points_is_at_a_row(row: int, side: float, sign: float, off: float) -> None:
    """The rod is stable between them, or unstable there alone: the row itself does not tell which of both."""
    found = pair_at_a_row(row, off, side, sign, error_bars=False)
    assert found.right, f"{found.error:.3g} {found.wrong} {found.said}"
