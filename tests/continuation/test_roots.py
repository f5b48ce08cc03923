"""Zeros between two arguments, against closed forms."""

from __future__ import annotations

from collections.abc import Callable
from math import atan, cos, exp, log

import pytest

from rodfem.roots import zero_between

pytestmark = pytest.mark.alone

CASES: list[tuple[Callable[[float], float], float, float, float]] = [
    (lambda x: x**3 - 2 * x - 5, 2.0, 3.0, 2.0945514815423265),  # Wallis
    (lambda x: cos(x) - x, 1.0, 0.0, 0.7390851332151607),
    (lambda x: exp(-x) - 1e-3, 0.0, 20.0, log(1e3)),
    (lambda x: atan(50 * (x - 0.7)), 0.0, 1.0, 0.7),
    (lambda x: 1.0 if x > 0.3 else -1.0, 0.0, 1.0, 0.3),
    (lambda x: x, -1.0, 0.0, 0.0),
]


@pytest.mark.parametrize("within", [1e-13, 1e-6])
@pytest.mark.parametrize(("f", "a", "b", "zero"), CASES)
def test_zero_between(f: Callable[[float], float], a: float, b: float, zero: float, within: float) -> None:
    """Within the distance asked for, in no more values than bisection takes and few where the function is smooth."""
    asked: list[float] = []

    def counted(x: float) -> float:
        asked.append(x)
        return f(x)

    assert zero_between(counted, a, b, within) == pytest.approx(zero, rel=1e-15, abs=within)
    assert all(min(a, b) <= x <= max(a, b) for x in asked)
    assert len(asked) <= (48 if isinstance(f(a), float) and abs(f(a)) == abs(f(b)) == 1 else 14)


def test_no_change_of_sign() -> None:
    with pytest.raises(ValueError, match="one sign, -1, at both 0 and 1"):
        zero_between(lambda x: -1 - x, 0.0, 1.0, 1e-9)
