"""Supports and loads of all states as a few bodies, each placed by affine maps.

A support that moves with its state is the same body elsewhere.  So each solid of a picture is compared with the bodies
known so far: where one of them takes its place by an affine map, the map is kept and the solid is not.  A map stands
for a spring that is stretched, too, up to a small part of the rod's radius.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rodfem.output.solids import Solid

Floats = NDArray[np.float64]

CLOSE = 0.2
"""Distance, in radii of the rod, by which a placed body may miss the solid that it stands for."""
RECENT = 4
"""Bodies of one kind, the newest ones, with which a solid is compared."""
FLAT = 12
"""Corners up to which a body has sharp edges: a box has ten."""


@dataclass(frozen=True)
class Body:
    """A solid and the matrix (4, n) that takes the corners of another one to the affine map between them."""

    solid: Solid
    inverse: Floats


@dataclass
class Shelf:
    """Bodies met so far, for rods of this mean ``radius`` in the picture."""

    radius: float
    bodies: list[Body] = field(default_factory=list)
    kinds: dict[tuple[str, bytes], list[int]] = field(default_factory=dict)

    def place(self, solid: Solid) -> tuple[int, Floats]:
        """Number of the body that a solid is, and the map (4, 3) that places it: ``(x, 1) @ map``."""
        known = self.kinds.setdefault((solid.color, solid.triangles.tobytes()), [])
        for number in known[: -RECENT - 1 : -1]:
            body = self.bodies[number]
            if body.solid.points.shape == solid.points.shape:
                placed = body.inverse @ solid.points
                if np.abs(_extended(body.solid.points) @ placed - solid.points).max() <= CLOSE * self.radius:
                    return number, placed
        known.append(len(self.bodies))
        self.bodies.append(Body(solid, np.linalg.pinv(_extended(solid.points))))
        return known[-1], np.eye(4)[:, :3]

    def fitted(self, number: int, solid: Solid) -> Floats:
        """Map (4, 3) that brings a body nearest to a solid; where it stands if the two are of different kinds."""
        body = self.bodies[number]
        same = body.solid.points.shape == solid.points.shape
        return body.inverse @ solid.points if same else np.eye(4)[:, :3]

    def place_all(self, solids: Sequence[Solid]) -> tuple[list[int], list[Floats]]:
        """Numbers and maps of the solids of one picture."""
        found = [self.place(solid) for solid in solids]
        return [number for number, _ in found], [placed for _, placed in found]


def _extended(points: Floats) -> Floats:
    return np.column_stack([points, np.ones(len(points))])
