"""Continuity of the start of a scene: rotations of a rod do not jump, and from a jump no mesh leads to an equilibrium.

Of a jump every mesh makes a twist within one element, which Newton's method may take for a state of the rod.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rodfem.errors import SceneError

if TYPE_CHECKING:
    from rodfem.problem.scene import Scene

PLACES = 1001
"""Arclengths at which a start is evaluated."""
TURNED = 0.3
"""Angle, in radian, between neighbours that may be a jump."""
HALVINGS = 32
"""How many times the interval with the larger angle is halved: a continuous start turns by nothing in what is left."""


def check_continuity(scene: Scene) -> None:
    """Raise :class:`SceneError` for a start that jumps; two quaternions of opposite signs are one rotation."""
    if scene.start is None:
        return
    s = np.linspace(*scene.interval, PLACES)
    angles = _angles(scene.start(s))
    for i in np.flatnonzero(angles > TURNED).tolist():
        low, high = float(s[i]), float(s[i + 1])
        for _ in range(HALVINGS):
            middle = (low + high) / 2
            first, second = _angles(scene.start(np.array([low, middle, high])))
            low, high = (low, middle) if first > second else (middle, high)
        left = float(_angles(scene.start(np.array([low, high])))[0])
        if left > TURNED / 2:
            raise SceneError(
                f"The start jumps by {left:.3g} radian at s = {low:.6g}: let it be continuous, as rotations are."
            )


def _angles(q: np.ndarray) -> np.ndarray:
    """Angles between rotations (m, 4) that are neighbours, (m - 1,)."""
    q = q / np.linalg.norm(q, axis=1)[:, None]
    apart = np.minimum(np.linalg.norm(q[1:] - q[:-1], axis=1), np.linalg.norm(q[1:] + q[:-1], axis=1))
    return np.asarray(4 * np.arcsin(np.minimum(apart / 2, 1.0)))
