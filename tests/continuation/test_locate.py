"""Zeros of interpolants, against polynomials whose zeros are known."""

from collections.abc import Callable
from math import atan, cos, exp, log

import numpy as np
import pytest
from numpy.polynomial import chebyshev

from rodfem.continuation.curves import zero_between
from rodfem.continuation.eigenvalue_curves import locate_flutter
from rodfem.stability.cluster import Cluster, Measured


@pytest.mark.parametrize("start", [0.0, 0.9])
def test_a_collision_is_not_extrapolated(start: float) -> None:
    """``D = 1.2 - P - 0.01 T6(P)``: on the first piece the nodes are zeros of T6, and say that D vanishes at 1.2."""
    series = np.array([1.2, -1.0, 0.0, 0.0, 0.0, 0.0, -0.01])
    (expected,) = (z.real for z in chebyshev.chebroots(series) if abs(z.imag) < 1e-9 and 0 < z.real < 1.2)
    assert expected < 1.15

    def at(load: float, cluster: Cluster) -> Measured:
        d = float(chebyshev.chebval(load, series))
        return Measured(d, np.emath.sqrt(d) * np.array([1.0, -1.0]) + 5.0, Cluster(np.zeros((1, 2)), 5.0))

    found = locate_flutter(at, Cluster(np.zeros((1, 2)), 5.0), start, 1.0)
    assert abs(found.load - expected) <= found.uncertainty + 1e-15
    assert found.uncertainty < 1e-9


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
