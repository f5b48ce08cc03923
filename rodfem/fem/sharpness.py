"""Whether the elements of a system see what changes along the rod: a material, a load, a mass."""

from __future__ import annotations

import numpy as np

from rodfem.fem.system import System
from rodfem.fem.transfer import halved
from rodfem.problem.scene import Scene
from rodfem.problem.smoothness import Rules, unresolved
from rodfem.tolerances import SAME_PLACE, same_place


def sharp_along(scene: Scene, system: System) -> str:
    """Sentence on what changes too steeply along the rod of a ``scene`` for the elements of a ``system``, or empty.

    The scene is that of the system, perhaps with other values of its parameters.
    """
    k, ends = system.fields.discretization.degree, np.sort(system.fields.vertices.reshape(-1, 2), axis=1)
    own, richer = (system.equations.quadrature_degree(degree) // 2 + 1 for degree in (k, k + 1))

    def elements(s: float) -> list[tuple[float, float]]:
        mine = [(float(a), float(b)) for a, b in ends[(ends[:, 0] <= s) & (s <= ends[:, 1])]]
        return sorted({element for part in system.comm.allgather(mine) for element in part})

    return unresolved(scene, elements, Rules(own, richer, halved(k), strains=(k - 1, k)))


def inside_element(scene: Scene, system: System, s: float, *, adaptive: bool = False) -> bool:
    """Whether an arclength ``s`` of a ``scene`` is inside of an element of a ``system``.

    Of ``adaptive`` meshes only joints are vertices.
    """
    if adaptive:
        return not any(same_place(joint, s, scene.length) for joint in scene.joints)
    ends, close = np.sort(system.fields.vertices.reshape(-1, 2), axis=1), SAME_PLACE * scene.length
    mine = bool(((ends[:, 0] + close < s) & (s < ends[:, 1] - close)).any())
    return any(system.comm.allgather(mine))
