"""Right answers of the course whose numbers are not written as closed forms, computed once more."""

from __future__ import annotations

from collections.abc import Callable
from math import pi

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import ellipk, jv

from lesson.answers import answers

pytestmark = pytest.mark.alone


def shot(slopes: Callable[[float, np.ndarray], list[float]], start: list[float]) -> np.ndarray:
    return np.asarray(solve_ivp(slopes, (0, 1), start, method="DOP853", rtol=1e-12, atol=1e-14).y[:, -1])


def elastica() -> float:
    m = brentq(lambda m: ellipk(m) ** 2 - 1.5 * pi**2 / 4, 0.1, 0.9, xtol=1e-15)
    return 2 * m**0.5 / ellipk(m)


def transverse() -> float:
    def end(curvature: float) -> np.ndarray:
        return shot(lambda s, y: [y[1], -np.cos(y[0]), np.sin(y[0])], [0.0, curvature, 0.0])

    return float(end(brentq(lambda k: end(k)[1], 0.5, 1.5, xtol=1e-14))[2])


def on_a_spring() -> float:
    return brentq(lambda w: w * np.tan(w) - 4, 0.1, 1.5, xtol=1e-14) ** 2


def heavy() -> float:
    return 9 / 4 * brentq(lambda x: jv(-1 / 3, x), 1.5, 2.2, xtol=1e-14) ** 2


def tangent() -> float:
    return brentq(lambda w: np.tan(w) - w, 4.4, 4.6, xtol=1e-14)


def heavy_and_bent() -> float:
    """From the tip, at three small angles; the error of each is even in the angle (Richardson)."""

    def curvature(a: float) -> float:
        q = brentq(lambda q: shot(lambda t, y: [y[1], -q * t * np.sin(y[0])], [a, 0.0])[0], 7, 9, xtol=1e-13)
        return (q / heavy() - 1) / a**2

    one, half, quarter = map(curvature, (0.2, 0.1, 0.05))
    return (64 * quarter - 20 * half + one) / 45


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("1", elastica),
        ("1.2", transverse),
        ("1.3", on_a_spring),
        ("2.2", heavy),
        ("3", lambda: 4 * tangent() ** 2),
        ("3.1", lambda: tangent() ** 2),
        ("5.3", heavy_and_bent),
    ],
)
def test_a_number_is_right(name: str, value: Callable[[], float]) -> None:
    assert answers()[name].value == pytest.approx(value(), rel=1e-7)
