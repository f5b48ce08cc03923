"""Modes at a few states of each branch as ``states.h5`` records them, in the group ``modes`` of the branch.

One state is a row of each array.  See :mod:`rodfem.modes.finder` for which states, and :mod:`rodfem.modes.modes` for
what modes are.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import h5py
import numpy as np

GROUP = "modes"
"""Name of the group."""


class Few(NamedTuple):
    """Some modes of a state, of unit kinetic energy; arrays are complex under loads without a potential.

    Eigenvalues ``value`` (K,), those of symmetries, zero, last; backward errors ``residual`` (K,), nan for symmetries;
    ``motion``, the name of each; ``displacement`` and ``rotation`` (K, m, 3) in the space frame.
    """

    value: np.ndarray
    residual: np.ndarray
    motion: tuple[str, ...]
    displacement: np.ndarray
    rotation: np.ndarray


@dataclass(frozen=True)
class Typical:
    """Modes ``found`` at the ``row`` of a branch; None where they were not, and why so is the ``trouble``."""

    row: int
    found: Few | None
    trouble: str = ""


def write(group: h5py.Group, typical: Sequence[Typical]) -> None:
    """Write modes into the ``group`` of a branch; nothing without any state."""
    if not typical:
        return
    own, text = group.create_group(GROUP), h5py.string_dtype()
    own["row"] = [each.row for each in typical]
    own.create_dataset("trouble", data=[each.trouble for each in typical], dtype=text)
    for name in Few._fields:
        rows = [each.found and getattr(each.found, name) for each in typical]
        if name == "motion":
            own.create_dataset(name, data=_stacked(rows, ""), dtype=text)
        else:
            own[name] = _stacked(rows, np.nan)


def _stacked(rows: Sequence[Any], nothing: Any) -> np.ndarray:
    """Arrays, some of them None, as the rows of one, filled up with ``nothing``."""
    given = [np.asarray(row) for row in rows if row is not None]
    if not given:
        return np.full((len(rows), 0), nothing, dtype=object if nothing == "" else float)
    shape = tuple(np.max([row.shape for row in given], axis=0).astype(int))
    dtype = object if nothing == "" else np.result_type(*given)
    out = np.full((len(rows), *shape), nothing, dtype=dtype)
    for place, row in zip(out, rows, strict=True):
        if row is not None:
            array = np.asarray(row)
            place[tuple(map(slice, array.shape))] = array
    return out


def read(group: Mapping[str, Any]) -> Iterator[Typical]:
    """Modes in the group of a branch, open or in memory: in order of their rows; none where the file has none."""
    if GROUP not in group:
        return
    own = group[GROUP]
    arrays = {name: own[name][()] for name in ("row", "trouble", *Few._fields)}
    for i, row in enumerate(arrays["row"]):
        trouble, value = _text(arrays["trouble"][i]), arrays["value"][i]
        count = int(np.isfinite(value).sum())
        if trouble:
            yield Typical(int(row), None, trouble)
            continue
        nodes = int(np.isfinite(arrays["rotation"][i][0, :, 0]).sum())
        moved = (arrays[name][i][:count, :nodes] for name in ("displacement", "rotation"))
        names = tuple(_text(name) for name in arrays["motion"][i][:count])
        yield Typical(int(row), Few(value[:count], arrays["residual"][i][:count], names, *moved))


def _text(value: Any) -> str:
    return value.decode() if isinstance(value, bytes) else str(value)
