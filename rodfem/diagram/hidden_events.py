"""Critical loads of a sweep that come and go between two rows, which do not show them.

Two real eigenvalues meet and part again, a complex pair becomes real and complex again, or one passes through zero and
comes back.  What is smooth there and vanishes at the critical loads, the square of half the difference of the two or
the eigenvalue itself, has a lowest value between the rows.  Where a parabola through it at three rows comes near zero
the lowest value is sought, by equilibria.  Eigenvalues that cross have a lowest value of zero, and are left alone: they
have vectors of their own there, where those of two that meet become one.

A mesh may miss a pair: two frequencies that come near one another and part again, or one that comes near zero, may
meet, or pass through it, on a mesh whose error is less.  No row of the sweep shows it, nor a special point; where they
are nearest a richer mesh tells whether they meet.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.branch import Branch
from rodfem.continuation.complex_pairs import upper
from rodfem.diagram.side import Side
from rodfem.errors import ConvergenceError
from rodfem.roots import lowest_between
from rodfem.stability.cluster import Cluster, Measured, cluster_of, measure
from rodfem.stability.cluster_noise import noise_of
from rodfem.stability.frequencies import ALIKE, REAL, Frequencies, groups

if TYPE_CHECKING:
    from rodfem.diagram.collisions import Measuring
    from rodfem.stability.nonsymmetric import NonsymmetricPencil

NEAR = 0.3
"""Part of the values at two rows below which the lowest one of a parabola is near zero."""
BESIDE = 0.2
"""Part of a step by which a parabola may be lowest beside it."""
WITHIN = 1e-6
"""Part of a step to which the lowest value is sought."""
DIP, CLOSE = 1 - 1e-6, 0.1
"""Ratio to the values at rows beside it below which a row's is a lowest one, and distance, relative, that is close."""
EDGE = 1e-5
"""Part of a step within which the lowest value is at its first or last row."""
ONE = 100.0
"""Square of a cluster's matrix over its discriminant above which the vectors are nearly one: 1 where some cross."""


class Approach(NamedTuple):
    """What may vanish at a load: the eigenvalues at these ``places``, with what ``sign``, and the ``value`` there."""

    places: list[int]
    sign: int
    value: float


@dataclass(frozen=True)
class Lowest:
    """The ``value`` of what approaches zero, of a ``cluster`` and a ``sign``, at the ``load`` at which it is lowest.

    It may be zero, for round-off, where it is ``open``.  Another mesh may have it on the other side of zero, unless
    eigenvalues of a ``crossing`` cluster pass one another: they have vectors of their own.  Beside a row of the sweep
    it is ``below`` that of the row.
    """

    load: float
    sign: int
    value: float
    cluster: Cluster
    open: bool
    crossing: bool = False
    below: float = 0.0

    def measured(self, here: Measured) -> float:
        """The same value of a cluster that was measured on another mesh."""
        return self.sign * (here.cluster.mean if here.cluster.size == 1 else here.discriminant)


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

    def __init__(self, measured: Callable[[PETSc.Vec], Measuring]) -> None:
        """Know how a cluster is ``measured`` near an equilibrium."""
        self.measured = measured
        self.near: list[Lowest] = []
        self._told: set[int] = set()  # of what approached in the last step, what was lowest in it

    def forget(self) -> None:
        """The next step does not follow the last one."""
        self._told = set()

    def between(self, third: Side, a: Side, b: Side) -> list[float]:
        """Loads between two sides at which something has happened that is undone at the other one, or may have.

        The ``third`` is another load nearby, all three with one :func:`signature`.  Raises
        :class:`~rodfem.errors.ConvergenceError` where eigenvalues are not followed.
        """
        out: list[float] = []
        before, self._told = self._told, set()
        for i, (here, *others) in enumerate(zip(*(approaches(s.found) for s in (a, third, b)), strict=True)):
            f = others[0].value, here.value, others[1].value
            sizes = [abs(s.found.values[one.places]).max() for s, one in ((a, here), (b, others[1]))]
            apart = [np.sqrt(value) / size for value, size in zip(f[1:], sizes, strict=True)]
            if len(here.places) > 1 and min(apart) < ALIKE:  # multiple at all loads, or they meet at a row
                meet = max(apart) > ALIKE > apart[1] and self._meet(b, others[1].places, here.sign)
                out += [b.load] if meet else []
                continue
            at, low = lowest_of_parabola((third.load, a.load, b.load), f)
            along = (at - a.load) / (b.load - a.load)
            # lower at the first row than at those beside it
            turns = i not in before and (third.load - a.load) * (b.load - a.load) < 0 and DIP * min(f[0], f[2]) > f[1]
            beside = min(f[0], f[2]) if turns and along < BESIDE else min(f[1], f[2])
            if -BESIDE < along < 1 + BESIDE and low < NEAR * beside:
                lowest = self.lowest(here, a, b, min(max(along, 0.1), 0.9))
                part = (lowest.load - a.load) / (b.load - a.load)
                if part > 1 - EDGE or (part < EDGE and not turns):
                    continue  # lower beyond a row: in the next step, or in one that has told of it
                self._told.add(i)
                out += [lowest.load] if self._open(lowest) else []
            elif turns and low > 0 and f[1] < (CLOSE * sizes[0] if len(here.places) == 1 else (CLOSE * sizes[0]) ** 2):
                self._open(replace(self._at(here, a), below=f[1] - min(low, f[1])))
        return out

    def at_row(self, row: Side, beside: Side) -> bool:
        """Whether something may happen at a ``row`` that is undone at once: a side ``beside`` it shows nothing of it.

        An eigenvalue is zero at the row, or two are equal there and have one vector.  Raises
        :class:`~rodfem.errors.ConvergenceError` where eigenvalues are not followed.
        """
        if signature(row.found)[1] > signature(beside.found)[1]:
            return True
        values, pairs = row.found.values, [(side.found.values.imag > 0).sum() for side in (row, beside)]
        real = [g for g in groups(values, row.found.far, ALIKE) if len(g) > 1 and not values[g].imag.any()]
        sign = -1 if pairs[0] < pairs[1] else 1
        return any([self._meet(row, group, sign) for group in real])

    def _meet(self, row: Side, places: list[int], sign: int) -> bool:
        """Whether eigenvalues that are equal at a ``row``, of these ``places``, may collide there.

        Beside it their discriminant has this ``sign``.
        """
        return self._open(self._at(Approach(places, sign, 0.0), row))

    def _at(self, approach: Approach, row: Side) -> Lowest:
        """What approaches zero at a ``row``."""
        pencil = self.measured(row.x).pencil(row.load)
        cluster = cluster_of(pencil, row.found, approach.places)
        if len(approach.places) == 1:
            return Lowest(row.load, approach.sign, approach.value, cluster, open=False)
        return _several(pencil, row.load, approach.sign, cluster)

    def _open(self, lowest: Lowest) -> bool:
        """Whether what is lowest may be zero; else it is kept, to be compared with another mesh."""
        self.near += [] if lowest.open or lowest.crossing else [lowest]
        return lowest.open

    def lowest(self, approach: Approach, a: Side, b: Side, along: float) -> Lowest:
        """Where an ``approach`` is lowest from ``a`` to ``b``; the search begins this part of the way ``along``.

        Raises :class:`~rodfem.errors.ConvergenceError` where the eigenvalues are not followed.
        """
        measured = self.measured(a.x)
        cluster = cluster_of(measured.pencil(a.load), a.found, approach.places)
        width, sign, single = b.load - a.load, approach.sign, len(approach.places) == 1
        noise = min(a.found.noise, REAL * a.found.one)

        def value(t: float) -> float:
            here = measured(a.load + t * width, cluster)
            if single:
                return sign * here.cluster.mean + max(noise, REAL * abs(here.cluster.mean))
            return sign * here.discriminant + float(REAL * abs(here.values).max()) ** 2

        t, lowest = lowest_between(value, 0.0, along, 1.0, WITHIN)
        load = a.load + t * width
        if single:
            return Lowest(load, sign, lowest - noise, cluster, lowest <= 2 * noise)
        return _several(measured.pencil(load), load, sign, cluster, below=lowest < 0)


def _several(pencil: NonsymmetricPencil, load: float, sign: int, cluster: Cluster, *, below: bool = False) -> Lowest:
    """Discriminant of a ``cluster`` of this ``sign`` at the ``load`` of a ``pencil``, and whether it may be zero.

    It may where it is ``below`` zero, or round-off as large.  Eigenvalues that cross have vectors of their own:
    round-off changes their discriminant in second order only.
    """
    here = measure(pencil, cluster)
    noise, value = noise_of(pencil, here), sign * here.discriminant
    equal = max(REAL * float(abs(here.values).max()), noise.of_mean) ** 2
    crossing = noise.square < ONE * max(abs(value), equal)
    hidden = value <= noise.of_discriminant and not crossing
    return Lowest(load, sign, value, here.cluster, below or hidden, crossing)


def missed_loads(
    branch: Branch, near: list[Lowest], richer: Callable[[PETSc.Vec, float, Cluster], Measured], name: str
) -> Iterator[str]:
    """Yield a sentence on each load of a sweep's ``branch`` at which critical loads may be missing.

    ``near`` are those at which something comes near zero.  On a ``richer`` mesh a cluster is measured near a state, at
    a load, which has a ``name``.
    """
    for lowest in near:
        row = min(branch.points, key=lambda p: abs(p.load - lowest.load))
        single, mine = lowest.cluster.size == 1, lowest.value - lowest.below
        try:
            again = lowest.measured(richer(row.x, lowest.load, lowest.cluster)) - lowest.below
            found = f"{mine:.2g} on this mesh, and {again:.2g} on a richer one"
            if again > 0.5 * mine:  # where less remains its sign is in doubt
                continue
        except ConvergenceError:
            found = f"{mine:.2g} on this mesh, and not found on a richer one"
        what = "an eigenvalue is nearest to zero" if single else "two frequencies are nearest to one another"
        measure = "its distance" if single else "the square of half the difference of their omega^2"
        yield (
            f"Near {name} = {lowest.load:.8g} {what}: {measure} is {found}. A pair of critical loads may be missing "
            "there, use more elements."
        )
