"""What AUTO writes: accepted points in fort.7, labelled solutions in fort.8."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

NAMES = {1: "BP", 2: "LP", 3: "HB", 4: "UZ", 5: "LP", 6: "BP", 9: "EP", -4: "UZ", -9: "MX"}
"""AUTO's two letters for the numbers in fort.7."""


class AutoError(Exception):
    """AUTO is missing, or did not do what was asked; the message is one sentence."""


@dataclass(frozen=True)
class State:
    """A labelled solution: t in [0, 1], u by rows, parameters."""

    t: np.ndarray
    u: np.ndarray
    par: np.ndarray
    ncol: int


@dataclass(frozen=True)
class Row:
    """A line of fort.7."""

    kind: str
    label: int
    par: dict[int | None, float]


def rows(path: Path, icp: Sequence[int]) -> list[Row]:
    """The accepted points. Columns: branch, point, type, label, first parameter, norm, maxima, other parameters."""
    result = []
    for line in path.read_text().splitlines():
        words = line.split()
        if len(words) < 5 or words[0] == "0":
            continue
        type_, label = int(words[2]) % 10, int(words[3])
        type_ = int(words[2]) if int(words[2]) < 0 else type_
        numbers = [float(word) for word in words[4:]]
        maxima = len(numbers) - 1 - len(icp)
        others = numbers[2 + maxima :]
        result.append(Row(NAMES.get(type_, ""), label, dict(zip(icp, [numbers[0], *others], strict=True))))
    return result


def state(path: Path, label: int) -> State:
    """A labelled solution of fort.8: a header, rows (t, u), free parameters, directions, all parameters."""
    lines = path.read_text().splitlines()
    position = 0
    while position < len(lines):
        header = [int(word) for word in lines[position].split()]
        (found, points, width, length, _, ncol), npar = (header[i] for i in (3, 6, 7, 8, 9, 10)), header[11]
        if found == label:
            body = np.array(" ".join(lines[position + 1 : position + 1 + length]).split(), dtype=float)
            values, par = body[: points * width].reshape(points, width), body[-npar:]
            return State(values[:, 0], values[:, 1:], par, ncol)
        position += 1 + length
    raise AutoError(f"AUTO did not write the solution with label {label}.")
