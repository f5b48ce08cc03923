r"""Frequencies between the loads of a sweep where two of them collide, for pictures: a chord would show a corner there.

The eigenvalues ``mu = s +- sqrt(D)`` have a square root at a flutter load; their mean ``s`` and
``D = ((mu1 - mu2)/2)^2`` have none (:mod:`rodfem.stability.cluster`).  Both are cubic splines through the rows on
either side and the flutter load itself, where ``D = 0``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from rodfem.continuation.kinds import FLUTTER

SIDE, DRAWN = 5, 3
"""Rows on each side of a flutter load that the splines pass through, and between which of them curves have points."""
SHARES = (np.arange(1, 9) / 8) ** 2
"""Where the step next to a flutter load has points, in parts of it from there."""
JUST = 1e-5
"""Imaginary part of a pair that has just met, relative to it: the place where the curve of a pair begins."""

Members = dict[int, dict[int, complex]]
"""Eigenvalues by the number of their curve, and by row."""


class Extra(NamedTuple):
    """Points between rows of one curve: load, nearest row and eigenvalue."""

    load: float
    row: int
    mu: complex


def between_rows(columns: Mapping[str, Any], special: Sequence[Mapping[str, Any]]) -> dict[int, list[Extra]]:
    """Points beside the flutter loads of a branch, by the number of the curve; that of the load itself among them.

    Parameters
    ----------
    columns
        Those of a branch of ``diagram.json``.
    special
        Its special points.

    Returns
    -------
    extra
        Empty where no eigenvalues are seen to meet, or too few rows are beside them.
    """
    found: dict[int, list[Extra]] = {}
    members: Members = {}
    for row, (pairs, numbers) in enumerate(zip(columns["omega2"], columns["curve"], strict=True)):
        for pair, number in zip(pairs, numbers, strict=True):
            members.setdefault(number, {})[row] = complex(*pair)
    rows = {point["row"] for point in special if point["kind"] == FLUTTER}
    for point in special:
        if point["kind"] == FLUTTER and point["omega2"] is not None:
            for number, extra in _beside(np.array(columns["load"]), members, point, rows).items():
                found.setdefault(number, []).extend(extra)
    return found


def _beside(
    loads: NDArray[np.float64], members: Members, point: Mapping[str, Any], others: set[int]
) -> dict[int, list[Extra]]:
    """Points beside one flutter load; ``others`` are the rows of all."""
    row, mean = int(point["row"]), float(point["omega2"])
    sides = {step: _alike(members, row, step, others - {row}) for step in (-1, 1)}
    for step, other in ((-1, 1), (1, -1)):
        met = {n for n, real in sides[step].items() if real} & {n for n, real in sides[other].items() if not real}
        rows = {at: _rows(members, met, row, at, real) for at, real in ((step, True), (other, False))}
        if len(met) < 2 or len(met) % 2 or min(map(len, rows.values())) < 2:
            continue
        used = np.array([*rows[step], row, *rows[other]])
        used = used[np.argsort(loads[used])]
        values = np.array([[members[n].get(i, mean) for n in met] for i in used])
        values[used == row] = mean
        centre = values.mean(axis=1)
        curves = CubicSpline(
            loads[used], np.array([centre.real, ((values - centre[:, None]) ** 2).mean(axis=1).real]).T
        )
        return {n: _points(loads, members[n], curves, row, rows, step) for n in met}
    return {}


def _alike(members: Members, row: int, step: int, others: set[int]) -> dict[int, bool]:
    """Whether each eigenvalue of the row beside is real; none beside another flutter load."""
    beside = row + step
    if beside in others:
        return {}
    return {n: not values[beside].imag for n, values in members.items() if beside in values and row in values}


def _rows(members: Members, met: set[int], row: int, step: int, real: bool) -> list[int]:
    """Rows on one side, the nearest first, on which all that ``met`` are real, or none is."""
    found: list[int] = []
    for i in range(row + step, row + step * (SIDE + 1), step):
        if not all(i in members[n] and (not members[n][i].imag) is real for n in met):
            break
        found.append(i)
    return found


def _points(
    loads: NDArray[np.float64],
    values: Mapping[int, complex],
    curves: CubicSpline,
    row: int,
    rows: Mapping[int, list[int]],
    real: int,
) -> list[Extra]:
    """Points of one curve on both sides; the side ``real`` is that of real eigenvalues."""
    mean = complex(curves(loads[row])[0])
    found = [Extra(float(loads[row]), row, mean)]
    for side, inside in rows.items():
        for i, (a, b) in enumerate(zip([row, *inside], inside[:DRAWN], strict=False)):
            shares = SHARES if i == 0 else SHARES**0.5
            for share in shares[:-1]:
                load = float(loads[a] + share * (loads[b] - loads[a]))
                centre, square = curves(load)
                root = np.sqrt(max(square if side == real else -square, 0.0))
                if side == real:
                    mu = complex(centre + np.copysign(root, values[b].real - float(curves(loads[b])[0])))
                else:
                    mu = complex(centre, np.copysign(root, values[b].imag))
                found.append(Extra(load, a if share < 0.5 else b, mu))
        if side != real and inside:
            sign = np.copysign(JUST, values[inside[0]].imag)
            found.append(Extra(float(np.nextafter(loads[row], loads[inside[0]])), row, mean * complex(1.0, sign)))
    return found
