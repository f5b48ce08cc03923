"""Zeros of interpolants, against polynomials whose zeros are known."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hemitropic_cases import explored
from numpy.polynomial import chebyshev
from numpy.polynomial.polynomial import polyfromroots

from rodfem.continuation.flutter import locate_flutter
from rodfem.continuation.interpolant import NODES, in_doubt, left_out, real_root
from rodfem.continuation.kinds import FOLD
from rodfem.stability.cluster import Cluster, Measured

pytestmark = pytest.mark.alone


def test_the_zero_nearest_to_a_guess() -> None:
    """Of -0.7, 0.2 and 0.6; those far outside and the complex ones are none."""
    series = chebyshev.poly2cheb(polyfromroots([-0.7, 0.2, 0.6, 3.0, 0.5 + 0.1j, 0.5 - 0.1j]).real)
    for guess, expected in ((-1.0, -0.7), (0.0, 0.2), (0.35, 0.2), (0.45, 0.6), (2.5, 0.6)):
        assert real_root(series, guess) == pytest.approx(expected, abs=1e-12)
    assert real_root(series, 0.0, 0.5, 1.0) == pytest.approx(0.6, abs=1e-12)  # within bounds before a nearer one
    assert real_root(series, 0.3, 0.7, 0.9) == pytest.approx(0.2, abs=1e-12)  # none is within
    assert real_root(chebyshev.poly2cheb(np.array([1.0, 0.0, 1.0])), 0.0) is None


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


@pytest.mark.parametrize("f", [np.cos, np.exp, lambda t: np.cos(t) ** 2, lambda t: np.exp(t) * np.cos(2 * t)])
@pytest.mark.parametrize("half", [0.3, 0.1, 0.03])
def test_what_a_series_leaves_out(f: Callable[[np.ndarray], np.ndarray], half: float) -> None:
    """Of even functions, too, whose last coefficient is zero."""
    t, fine = chebyshev.chebpts1(NODES), np.linspace(-1.0, 1.0, 201)
    series = chebyshev.chebfit(t, f(half * t) - f(half * t[:1]), NODES - 1)
    error = abs(chebyshev.chebval(fine, series) + f(half * t[:1]) - f(half * fine)).max()
    assert error <= left_out(series) + 1e-15 <= 1e3 * error + 1e-14


@pytest.mark.parametrize("noise", [1e-6, 1e-3, 0.05])
def test_noise_is_no_sharp_zero(noise: float) -> None:
    """The last coefficient alone is less than the error in two cases of three, than a third of it in one of three."""
    t, errors = chebyshev.chebpts1(NODES), np.random.default_rng(1).normal(size=(1000, NODES)) * noise
    ratios = []
    for values in (t - 0.1) * (1.0 + 0.2 * (t - 0.1)) + errors:
        series = chebyshev.chebfit(t, values, NODES - 1)
        root = real_root(series, 0.1)
        assert root is not None
        slope = abs(chebyshev.chebval(root, chebyshev.chebder(series)))
        ratios.append(abs(root - 0.1) * slope / in_doubt(series))
    assert np.mean(np.array(ratios) > 1.0) < 0.04
    assert np.mean(np.array(ratios) > 3.0) < 0.02
    smooth = chebyshev.chebfit(t, np.expm1(0.05 * (t - 0.1)), NODES - 1)
    assert in_doubt(smooth) == abs(smooth[-1])


def test_a_fold_is_located_to_round_off() -> None:
    """The first nodes about it leave 5e-11: those nearer to it leave a fiftieth of that."""
    (fold,) = (s for branch in explored() for s in branch.special if s.kind == FOLD)
    assert fold.located_to < 5e-12
