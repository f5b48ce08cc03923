"""Leading coefficients of a load and an ordinate in the amplitude of a branch, by its states on both sides of a point.

Values at the amplitudes ``a`` and ``-a`` tell the even part of a function from its odd one exactly.  Either is a power
of ``a`` times a series in ``a^2``, of which a polynomial through four amplitudes has the leading coefficient.  The
size of a displacement is not smooth: it is ``|a|`` times a series in ``a``, even to leading order.  Where neither is so
(a size plus a shortening) the series has all powers, and its leading coefficient is known less well.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

SEEN = 100
"""Ratio of a change of a load or an ordinate to the uncertainty of where it is measured from, for which it counts."""
CONSTANT = 1e-12
"""Leading coefficient of the ordinate, over its natural size, below which it does not change."""
SIZE, LINEAR, QUADRATIC = "size", "linear", "quadratic"
"""Leading terms of an ordinate: ``|a|``, ``a`` and ``a^2``."""
BETWEEN = 1.5
"""An even part that grows by a greater power of the amplitude than this, from the least one to the next, has no
``|a|``."""
SMOOTH = 1e-5
"""Ratio of a coefficient of ``|a|`` to that of ``a`` below which it is none."""


@dataclass(frozen=True)
class Leading:
    """Leading coefficient of a series: ``best`` by all amplitudes, ``rough`` by all but the largest.

    ``left`` is what the uncertainty of the values leaves of it.
    """

    best: float
    rough: float
    left: float

    @property
    def missed(self) -> float:
        """Uncertainty of the coefficient."""
        return abs(self.best - self.rough) + self.left

    def told(self, least: float = 0.0) -> bool:
        """Whether it is told from zero, and is more than ``least``."""
        return abs(self.best) > max(least, self.missed)

    def over(self, other: Leading, power: int) -> tuple[float, float]:
        """Ratio to a ``power`` of another coefficient, which is told from zero, and its uncertainty."""
        best, size = self.best / other.best**power, abs(other.best)
        left = (abs(self.best) + self.left) / (size - other.left) ** power - abs(self.best) / size**power
        return best, abs(best - self.rough / other.rough**power) + left


ONE = Leading(1.0, 1.0, 0.0)
"""Coefficient of the amplitude in itself."""


def parts(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Even and odd part, (m,) each, of ``values`` (2, m) at m amplitudes and at their opposites."""
    return (values[0] + values[1]) / 2, (values[0] - values[1]) / 2


def leading(amplitudes: np.ndarray, values: np.ndarray, power: int, left: float, step: int = 2) -> Leading:
    """Coefficient of a ``power`` of the amplitude, from which on powers rise by a ``step``.

    ``values`` (m,) at the ``amplitudes`` (m,), from the largest to the least, are each uncertain by ``left``.
    """
    best, rough = (_weights(amplitudes[skip:], power, step) for skip in (0, 1))
    return Leading(float(best @ values), float(rough @ values[1:]), left * float(np.abs(best).sum()))


def _weights(a: np.ndarray, power: int, step: int) -> np.ndarray:
    """Factors of values at the amplitudes ``a`` (m,) whose sum is the leading coefficient of the polynomial."""
    first = np.linalg.inv(np.vander(a**step, len(a), increasing=True))[0]
    return np.asarray(first / a**power)


def leading_term(amplitudes: np.ndarray, ordinates: np.ndarray, left: float) -> tuple[str, Leading, float] | None:
    """How an ordinate changes: its leading term, the coefficient, and the part of it that a lower term may hide in.

    None where it does not change to leading order, or not alike on both sides.  With ``x = o1 a + o2 a^2`` the linear
    term leads up to the amplitude ``o1/o2``: where the ordinate has not changed visibly there the quadratic one is
    taken, and what the other adds at the largest amplitude is the part.

    Parameters
    ----------
    amplitudes
        (m,), from the largest to the least.
    ordinates
        (2, m), changes at the amplitudes and at their opposites, over the natural size of the ordinate.
    left
        Uncertainty of each of them.
    """
    even, odd = parts(ordinates)
    if np.abs(ordinates).max() <= SEEN * left:
        return None
    linear, quadratic = leading(amplitudes, odd, 1, left), leading(amplitudes, even, 2, left)
    size = _size(amplitudes, even, left)
    if size is not None and size.told(max(CONSTANT, SMOOTH * abs(linear.best))):
        differs = leading(amplitudes, odd, 1, left, step=1).told(SMOOTH * abs(size.best))
        return None if differs else (SIZE, size, 0.0)
    turns = quadratic.told(CONSTANT)
    if linear.told(CONSTANT) and not (turns and linear.best**2 <= SEEN * left * abs(quadratic.best)):
        return LINEAR, linear, 0.0
    hidden = (abs(linear.best) + linear.missed) / amplitudes[0]
    return (QUADRATIC, quadratic, hidden / abs(quadratic.best)) if turns else None


def _size(amplitudes: np.ndarray, even: np.ndarray, left: float) -> Leading | None:
    """Coefficient of ``|a|`` in the ``even`` part (m,) of an ordinate; None where that has no such term."""
    if abs(even[-2]) > abs(even[-1]) * (amplitudes[-2] / amplitudes[-1]) ** BETWEEN:
        return None
    any_powers, odd_powers = (leading(amplitudes, even, 1, left, step) for step in (1, 2))
    agree = abs(odd_powers.best - any_powers.best) <= any_powers.missed
    return odd_powers if agree else any_powers
