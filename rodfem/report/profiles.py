"""Strains, contact forces and moments of the states of a branch, as the page draws them along the rod."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rodfem.output.profiles import POINTS, PROFILES, profiles_of
from rodfem.report.packing import packed, plain

Floats = NDArray[np.float64]

BUDGET = 400_000
"""Points of all states together above which some are left out: about 28 MB of the page."""


def profiles_data(group: Any, states: int) -> dict[str, Any]:
    """Profiles of a branch, whose group of ``states.h5`` is given; ``states`` is the number of those of all branches.

    Where the file has them: ``profile`` (P, M, 13), arclength and the components of v, k, n and m along the directors
    at M points, nan beyond the last one of a coarser mesh; ``element`` (P,), how many of them an element has, which
    determine its polynomials, and 0 where some are left out; ``jumps`` (P,) of each of the four between elements.
    """
    found = [profiles_of(group, row) for row in range(len(group["load"]))]
    if None in found:
        return {"profile": None, "element": None, "jumps": None}
    most = group[POINTS][0].size
    kept = np.unique(np.linspace(0, most - 1, min(most, max(2, BUDGET // states))).round().astype(int))
    out = np.full((len(found), most, 1 + 3 * len(PROFILES)), np.nan)
    loaded = _loaded(group)
    jumps: dict[str, list[float]] = {symbol: [] for symbol in PROFILES}
    for place, one in zip(out, found, strict=True):
        assert one is not None
        count = one.points.size
        place[:count, 0] = one.points.ravel()
        for i, symbol in enumerate(PROFILES):
            place[:count, 3 * i + 1 : 3 * i + 4] = one.fields[symbol].reshape(count, 3)
            jumps[symbol].append(one.jump(symbol, loaded))
    element = [one.points.shape[1] if one is not None and len(kept) == most else 0 for one in found]
    jumped = {symbol: plain(column) for symbol, column in jumps.items()}
    return {"profile": packed(out[:, kept]), "element": element, "jumps": jumped}


def _loaded(group: Any) -> list[float]:
    """Arclengths at which something holds or loads the rod."""
    places: list[Mapping[str, Any]] = [*group.get("supports", {}).values(), *group.get("constraints", {}).values()]
    found = [float(place.attrs["s"]) for place in places]  # type: ignore[attr-defined]
    return [s for s in found if np.isfinite(s)]
