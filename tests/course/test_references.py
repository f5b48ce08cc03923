"""Right answers of the course whose numbers are not written as closed forms, computed once more."""

from collections.abc import Callable
from math import acos, pi, sqrt

import closed_form_hemitropic
import closed_forms
import numpy as np
import pytest
from closed_forms import HEAVY, TORQUE, elastica
from literature.test_classics import CRITICAL
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import brentq, fsolve, minimize_scalar

from lesson.answers import answers


def shot(slopes: Callable[[float, np.ndarray], list[float]], start: list[float]) -> np.ndarray:
    return np.asarray(solve_ivp(slopes, (0, 1), start, method="DOP853", rtol=1e-12, atol=1e-14).y[:, -1])


def transverse() -> float:
    def end(curvature: float) -> np.ndarray:
        return shot(lambda s, y: [y[1], -np.cos(y[0]), np.sin(y[0])], [0.0, curvature, 0.0])

    return float(end(brentq(lambda k: end(k)[1], 0.5, 1.5, xtol=1e-14))[2])


def on_a_spring() -> float:
    return brentq(lambda w: w * np.tan(w) - 4, 0.1, 1.5, xtol=1e-14) ** 2


def heavy_and_bent() -> float:
    """From the tip, at three small angles; the error of each is even in the angle (Richardson)."""

    def curvature(a: float) -> float:
        q = brentq(lambda q: shot(lambda t, y: [y[1], -q * t * np.sin(y[0])], [a, 0.0])[0], 7, 9, xtol=1e-13)
        return (q / HEAVY - 1) / a**2

    one, half, quarter = map(curvature, (0.2, 0.1, 0.05))
    return (64 * quarter - 20 * half + one) / 45


def greenhill(tension: float = 0.0) -> float:
    """Spin of mean zero between clamps under the moment M: ``theta'' = i M theta' + T theta + constant``."""

    def determinant(M: float) -> complex:
        """Of the end's spin and of the mean, in the first slope and the constant: real but for the phase i M/2."""
        flow = expm(np.array([[0, 1, 0, 0], [tension, 1j * M, 0, 1], [1, 0, 0, 0], [0, 0, 0, 0]]))
        return complex(np.linalg.det(flow[np.ix_([0, 2], [1, 3])]) * np.exp(-0.5j * M))

    return brentq(lambda M: determinant(M).real, 8.0, 11.0, xtol=1e-14)


def coupling() -> float:
    return brentq(lambda A: closed_form_hemitropic.buckling(0.12, A, 1.0, 1.0, 3.0), 1.0, 3.0, xtol=1e-14)


def localised() -> float:
    """Tension of the infinite rod: ends closer by 0.03, turned by 27 turns."""

    def equations(x: np.ndarray) -> list[float]:
        m = x[1] / (2 * sqrt(x[0]))
        return [4 * sqrt(1 - m * m) / sqrt(x[0]) - 0.03, x[1] * 1.345 / 0.789 + 4 * acos(m) - 54 * pi]

    return float(fsolve(equations, [2900.0, 98.5], xtol=1e-14)[0])


def tapered() -> float:
    """Areas A from 1 + t to 1 - t: theta = A^(-1/2) sin(w ln((1 + t)/A)), P = t^2 (1 + 4 w^2), no moment at the tip."""

    def load(t: float) -> float:
        length = np.log((1 + t) / (1 - t))
        ends = (np.pi / 2 + 1e-9) / length, np.pi / length
        return t**2 * (1 + 4 * brentq(lambda w: np.tan(w * length) + 2 * w, *ends, xtol=1e-14) ** 2)

    return -float(minimize_scalar(lambda t: -load(t), bounds=(0.05, 0.9), method="bounded").fun)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("1", lambda: elastica(1.5 * pi**2 / 4)[1]),
        ("1.2", transverse),
        ("1.3", on_a_spring),
        ("2.2", lambda: HEAVY),
        ("3", lambda: TORQUE**2),
        ("3.1", lambda: TORQUE**2 / 4),
        ("5.3", heavy_and_bent),
        ("6", greenhill),
        ("6.2", lambda: greenhill(10.0)),
        ("8.1", lambda: closed_form_hemitropic.loads(0.0, 1.0, 1.0, 3.0)[0]),
        ("8.2", lambda: closed_forms.tensions(1.5)[1]),
        ("8.3", coupling),
        ("9", lambda: closed_forms.double(20.0, 121.0)[0]),
        ("9.3", lambda: 40.0537365149),  # Leipholz (1962), by Galerkin's method
        ("10", localised),
        ("10.2", lambda: CRITICAL["stepped"][3][0]),
        ("11.2", tapered),
    ],
)
def test_a_number_is_right(name: str, value: Callable[[], float]) -> None:
    assert answers()[name].value == pytest.approx(value(), rel=1e-7 if name == "5.3" else 1e-9)
