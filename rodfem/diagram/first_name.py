"""What the first branch is called where its scene does not say: straight only if it is."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from rodfem.continuation.branch import FIRST_BRANCH
from rodfem.fem.shape import Shape

STRAIGHT, RING = "straight", "ring"
BENT = 1e-6
"""Distance from the chord, relative to the rod's length, below which a centreline is straight."""
AHEAD = 0.1
"""Distance along the first tangent, in the metric, at which the centreline is looked at as well."""


def name_of_first(shape: Shape, states: Sequence[PETSc.Vec]) -> str:
    """Name of the first branch: that of the scene, or else what is true of the first ``states`` of it.

    A closed rod is a ring, ``straight`` has straight centrelines, and any other is the
    :data:`~rodfem.continuation.branch.FIRST_BRANCH`; ``shape`` evaluates them.  Collective.
    """
    scene = shape.system.scene
    if scene.states is not None:
        return scene.states
    if scene.closed:
        return RING
    return STRAIGHT if all(is_straight(shape.sample(x)["r"]) for x in states) else FIRST_BRANCH


def ahead(x: PETSc.Vec, tangent: PETSc.Vec) -> PETSc.Vec:
    """The state a little farther along the tangent at ``x``: straight where straight states go on being so.

    The rotations ``q`` that give d3 one direction are a linear space, so that the length of the step does not matter.
    """
    out = x.copy()
    out.axpy(AHEAD, tangent)
    return out


def is_straight(r: NDArray[np.float64]) -> bool:
    """Whether a centreline (n, 3) lies on the line through its ends, whatever its size."""
    chord, away = r[-1] - r[0], r - r[0]
    length = np.linalg.norm(np.diff(r, axis=0), axis=1).sum()
    across = np.linalg.norm(np.cross(away, chord), axis=1).max()
    return bool(across <= BENT * length * np.linalg.norm(chord))
