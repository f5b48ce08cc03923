"""Critical loads of a sweep that come and go between two rows, which do not show them.

Two real eigenvalues meet and part again, a complex pair becomes real and complex again, or one passes through zero and
comes back.  What is smooth there and vanishes at the critical loads, the square of half the difference of the two or
the eigenvalue itself, has a lowest value between the rows.  Where a parabola through it at three rows comes near zero
the lowest value is sought, by equilibria.  Eigenvalues that cross have a lowest value of zero, and are left alone.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.complex_pairs import upper
from rodfem.roots import lowest_between
from rodfem.stability.cluster import cluster_of
from rodfem.stability.frequencies import ALIKE, REAL, Frequencies, groups

if TYPE_CHECKING:
    from rodfem.diagram.collisions import Measuring, Side

NEAR = 0.3
"""Part of the values at two rows below which the lowest one of a parabola is near zero."""
BESIDE = 0.2
"""Part of a step by which a parabola may be lowest beside it."""
WITHIN = 1e-6
"""Part of a step to which the lowest value is sought."""


class Approach(NamedTuple):
    """What may vanish at a load: the eigenvalues at these ``places``, with what ``sign``, and the ``value`` there."""

    places: list[int]
    sign: int
    value: float


def approaches(found: Frequencies) -> list[Approach]:
    """Real eigenvalues next to one another, complex pairs, and the two next to zero, in an order of their own.

    Equal ones are one, all of them together.  Those that are zero but for noise, as of rigid motions, are left out.
    """
    values, noise = found.values, found.noise
    real = [int(i) for i in np.flatnonzero((values.imag == 0) & (abs(values.real) > noise))]
    real.sort(key=lambda i: values[i].real)
    equal = [[real[i] for i in group] for group in groups(values[real], found.far, ALIKE)]
    out = [Approach(both, 1, _variance(values[both].real.tolist())) for both in (a + b for a, b in pairwise(equal))]
    high = upper(found)
    for group in groups(values[high], found.far, ALIKE):
        both = [high[i] for i in group] + [int(np.argmin(abs(values - values[high[i]].conjugate()))) for i in group]
        out.append(Approach(both, -1, float(values[high[group[0]]].imag ** 2)))
    above, below = [i for i in real if values[i].real > noise], [i for i in real if values[i].real < -noise]
    out += [Approach([i], 1, float(values[i].real)) for i in above[:1]]
    return out + [Approach([i], -1, -float(values[i].real)) for i in below[-1:]]


def _variance(values: list[float]) -> float:
    """Mean square of the distances from the mean; numpy takes 30 times as long for two."""
    mean = sum(values) / len(values)
    return sum((value - mean) ** 2 for value in values) / len(values)


def signature(found: Frequencies) -> tuple[int, ...]:
    """Numbers of eigenvalues below and about zero, and sizes of what approaches: rows with the same are compared."""
    real = found.values[found.values.imag == 0].real
    about = int((abs(real) <= found.noise).sum())
    return len(found.negative()), about, *(one.sign * len(one.places) for one in approaches(found))


def lowest_of_parabola(loads: tuple[float, float, float], values: tuple[float, float, float]) -> tuple[float, float]:
    """Argument and value at which the parabola through ``values`` at three ``loads`` is lowest; nan without one."""
    (z, a, b), (fz, fa, fb) = loads, values
    first, second = (fa - fz) / (a - z), (fb - fa) / (b - a)
    curvature = (second - first) / (b - z)
    if curvature <= 0:
        return float("nan"), float("nan")
    at = 0.5 * (a + b) - 0.5 * second / curvature
    return at, fa + (at - a) * (second + curvature * (at - b))


class HiddenEvents:
    """Seeks loads of a step that show what its rows do not."""

    def __init__(self, measured: Callable[[PETSc.Vec], Measuring], one: float) -> None:
        """Know how a cluster is ``measured`` near an equilibrium, and the natural size, ``one``, of eigenvalues."""
        self.measured, self.one = measured, one

    def between(self, third: Side, a: Side, b: Side) -> list[float]:
        """Loads between two sides at which something has happened that is undone at the other one.

        The ``third`` is another load nearby, all three with one :func:`signature`.  Raises
        :class:`~rodfem.errors.ConvergenceError` where eigenvalues are not followed.
        """
        out: list[float] = []
        for here, *others in zip(approaches(a.found), approaches(third.found), approaches(b.found), strict=True):
            f = others[0].value, here.value, others[1].value
            sizes = [abs(s.found.values[one.places]).max() for s, one in ((a, here), (b, others[1]))]
            if len(here.places) > 1 and min(np.sqrt(f[1]) / sizes[0], np.sqrt(f[2]) / sizes[1]) < ALIKE:
                continue  # multiple at all loads, or they meet at a row
            at, low = lowest_of_parabola((third.load, a.load, b.load), f)
            along = (at - a.load) / (b.load - a.load)
            if -BESIDE < along < 1 + BESIDE and low < NEAR * min(f[1], f[2]):
                load, lowest = self._lowest(here, a, b, min(max(along, 0.1), 0.9))
                out += [load] if lowest < 0 else []
        return out

    def _lowest(self, approach: Approach, a: Side, b: Side, along: float) -> tuple[float, float]:
        """Load between two sides at which what approaches zero is lowest, and how far it is above that for sure."""
        measured = self.measured(a.x)
        cluster = cluster_of(measured.pencil(a.load), a.found, approach.places)
        width = b.load - a.load

        def value(t: float) -> float:
            here = measured(a.load + t * width, cluster)
            if len(approach.places) == 1:
                return approach.sign * here.cluster.mean + REAL * max(self.one, abs(here.cluster.mean))
            return approach.sign * here.discriminant + float(REAL * abs(here.values).max()) ** 2

        t, lowest = lowest_between(value, 0.0, along, 1.0, WITHIN)
        return a.load + t * width, lowest
