"""Strains, contact forces and moments along saved states: polynomials of each element, which jump between elements.

``states.h5`` has them at equal places of each element, ends included where there is more than one: see
:mod:`rodfem.fem.shape`.  Where nothing acts at the end of an element the jump there is the error of the mesh.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rodfem.tolerances import same_place

Floats = NDArray[np.float64]

PROFILES = {"v": "strain", "k": "curvature", "n": "force", "m": "moment"}
"""Symbols of the fields, components along the directors, and their names in ``states.h5``."""


POINTS = "points"
"""Name of their arclengths there."""


@dataclass(frozen=True)
class Profiles:
    """Fields along one state: E elements with p points each.

    Attributes
    ----------
    points
        Arclengths (E, p), from end to end of each element where there is more than one.
    fields
        Components along the directors (E, p, 3) by symbol, those of :data:`PROFILES`: strain ``v``, nondimensional,
        curvature ``k``, one over length, contact force ``n`` and moment ``m``.
    """

    points: Floats
    fields: dict[str, Floats]

    def at_nodes(self, symbol: str, s: Floats) -> Floats:
        """Values (m, 3) at the arclengths ``s`` (m,) of the nodes, at ends that elements share the mean of the two."""
        values, degree = self.fields[symbol], (len(s) - 1) // len(self.points)
        places = degree * np.arange(len(values))[:, None] + np.arange(degree + 1)
        own, wanted = self.points[0] - s[0], s[: degree + 1] - s[0]  # alike in all elements, relative to their lengths
        orders = np.arange(len(own))
        weights = (wanted[:, None] / wanted[-1]) ** orders @ np.linalg.inv((own[:, None] / wanted[-1]) ** orders)
        out, count = np.zeros((len(s), 3)), np.zeros((len(s), 1))
        np.add.at(out, places, weights @ values)
        np.add.at(count, places, 1.0)
        return out / count

    def jump(self, symbol: str, loaded: Sequence[float] = ()) -> float:
        """Largest jump of a component between elements, where nothing acts: not at the ``loaded`` arclengths."""
        values, inside = self.fields[symbol], self.points[1:, 0]
        there = np.zeros(len(inside), dtype=bool)
        for s in loaded:
            there |= same_place(inside, s, float(np.ptp(self.points)))
        jumps = abs(values[1:, 0] - values[:-1, -1])[~there]
        return float(jumps.max(initial=0.0))


def profiles_of(group: Mapping[str, Any], row: int) -> Profiles | None:
    """Fields along the state in a row of the group of a branch; None of a file that was written without them."""
    if any(name not in group for name in (POINTS, *PROFILES.values())):
        return None
    points = np.asarray(group[POINTS][row])
    rows, columns = np.isfinite(points[:, 0]), np.isfinite(points[0])  # those of a coarser mesh end in nan
    fields = {symbol: np.asarray(group[name][row])[rows][:, columns] for symbol, name in PROFILES.items()}
    return Profiles(points[rows][:, columns], fields)
