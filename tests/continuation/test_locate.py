"""Zeros of interpolants, against polynomials whose zeros are known."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hard.bifurcations import MESH, folds, opposite_other
from hard.case import Change, compare, run, said, singular
from hard.two_freedoms import scene
from hemitropic_cases import explored
from numpy.polynomial import chebyshev
from numpy.polynomial.polynomial import polyfromroots

from rodfem.continuation import locate, special_points
from rodfem.continuation.flutter import locate_flutter
from rodfem.continuation.interpolant import NODES, in_doubt, left_out, real_root
from rodfem.continuation.kinds import FOLD
from rodfem.continuation.special_points import _index_of
from rodfem.stability.cluster import Cluster, Measured
from rodfem.stability.inertia import Index
from rodfem.stability.round_off import Decision

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


@pytest.mark.few(1)
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


def test_a_fold_that_does_not_feel_the_load_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """By the slope and by its eigenvalue it is the same point, and there is no other."""
    monkeypatch.setattr(special_points, "coupling_of", lambda *given: 0.0)
    found = folds(1e-2)
    assert found.right and not found.said, found


@pytest.mark.few(1)
@pytest.mark.parametrize("apart", [3e-4, 1e-4])
def test_a_zero_beyond_a_row_is_none_of_the_step_to_it(apart: float) -> None:
    """Two eigenvalues pass zero, one just before a row and one just after it: neither is taken for the other."""
    found = opposite_other(apart)
    assert found.right and not found.said, found


@pytest.mark.parametrize("falling", [True, False])
def test_a_bracket_ends_where_the_eigenvalue_is_negative(falling: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Number 1 changes its sign at 0.3: beyond it, or before, it may have another number."""
    count = lambda s: 2 if (s > 0.3) == falling else 1  # noqa: E731
    monkeypatch.setattr(locate, "solve_beside", lambda solver, curve, s, h: (s, s))
    inertia = SimpleNamespace(at=lambda s: SimpleNamespace(below=lambda mu: count(s)), tolerance=1e-7)
    solver: Any = SimpleNamespace(inertia=inertia)
    curve: Any = None
    negative, positive = locate.bracket(solver, curve, (0.0, 1.0), 1, (), 1e-6)
    assert max(abs(negative - 0.3), abs(positive - 0.3)) < 1e-6 and (count(negative), count(positive)) == (2, 1)


@pytest.mark.parametrize("sign", [1, -1])
def test_a_crossing_beside_a_negative_eigenvalue_that_stays_near_zero(sign: int) -> None:
    """``-1e-6`` of a stretch all along: where the other one is negative, too, it is farther from zero, and is meant."""
    rod = scene(lambda u, f2, c: -5e-7 * u**2 + 0.1 * (u**4 + f2**2) + 0.5 * sign * (c.P - 0.1) * f2, (-0.31, 0.4))
    diagram = run(rod, MESH)
    index = (2, 1) if sign > 0 else (1, 2)
    found = compare(singular(diagram[0]), [Change(0.1, *index)], said(diagram))
    assert found.right and not found.said, found


def test_round_off_that_two_measures_differ_by() -> None:
    """A double eigenvalue is located to 5e-7 by solutions, and its quotients are 9e-7 (1e5 linear elements)."""
    found: Any = SimpleNamespace(drifts=1)
    located: Any = SimpleNamespace(along=5e-8, rate=-10.0, slope=0.2)
    quotients = np.array([-9e-7, 8e-7, 1e-5])
    index, missed = _index_of(Decision(Index(3, 1, 0.0, 0.0), 5e-5, quotients, quotients), found, located)
    assert (index.negative, index.zero) == (2, 3)
    assert missed == pytest.approx(2 * 9e-7 * 0.2 / 10)
    for decision in (Index(3, 2, 0.0, 0.0), 1), (Index(3, 1, 0.0, 0.0), 20):  # decided as zero; another eigenvalue
        index, missed = _index_of(Decision(decision[0], 5e-5, decision[1] * quotients, quotients), found, located)
        assert (index, missed) == (decision[0], 0.0)
