"""Natural sizes of a rod's numbers in the units in which its scene is stated: what is small is so relative to them.

They are one for a scene whose numbers are not far from order one.  In metres and newtons the load of a DNA molecule is
1e-12: then all sizes are the rod's own, as only together they make its equations those of a rod of order one.
"""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import ufl

from rodfem.errors import SceneError
from rodfem.problem.functions import STATES, some_places

if TYPE_CHECKING:
    from rodfem.problem.scene import Scene
    from rodfem.problem.unknowns import Block, Unknown


class Units(NamedTuple):
    """Natural sizes: ``length, force, moment, energy`` of the rod, its ``load, ordinate``, and ``omega2``."""

    length: float
    force: float
    moment: float
    energy: float
    load: float
    ordinate: float
    omega2: float

    def of_field(self, block: Block) -> float:
        """Natural size of the values of a field."""
        return self.force if block.multiplier else self.length if block.name == "r" else 1.0

    def of_scalar(self, unknown: Unknown) -> float:
        """Natural size of a scalar unknown."""
        if not unknown.multiplier:
            return self.length
        return self.moment if unknown.group.moment else self.force

    @property
    def ordinary(self) -> bool:
        """Whether all of them are one."""
        return all(x == 1.0 for x in self)


ONES = Units(*[1.0] * len(Units._fields))


def units_of(scene: Scene) -> Units:
    """Natural sizes of a scene: all one, unless one of its own is far from that."""
    own = own_units(scene)
    return ONES if all(size(x) == 1.0 for x in own) else own._replace(ordinate=size(_of_ordinate(scene)))


def own_units(scene: Scene) -> Units:
    """Sizes by a scene's length, bending stiffness, masses and range of loads; that of the ordinate is one."""
    least, middle, _ = map(float, np.linalg.eigvalsh(scene.stiffness()[-3:, -3:]))
    length, stiffness = scene.length, (least * middle) ** 0.5  # a rod may be soft in one way only, as in torsion
    mass = _mass(scene, length)
    omega2 = stiffness / (mass * length**4) if mass > 0 else 1.0
    sizes = length, stiffness / length**2, stiffness / length, stiffness / length, max(map(abs, scene.span)), omega2
    length, force, moment, energy, load, omega2 = (1.0 if x == 0 or not isfinite(x) else float(x) for x in sizes)
    return Units(length, force, moment, energy, load, 1.0, omega2)


def _mass(scene: Scene, length: float) -> float:
    """Natural mass per length, between that of fast motions of a light rod and that of slow ones of bodies on it."""
    c = scene.constants()
    own = max(float(scene.inertia.rho_A(c)), *(float(x) / length**2 for x in scene.inertia.rho_I(c)))
    rotary = [i for x in scene.attachments if x.rotary_inertia for i in x.rotary_inertia(c)]
    attached = sum(float(x.mass(c)) for x in scene.attachments if x.mass) / length
    carried = max(attached, own, *(float(i) / length**3 for i in rotary))
    return float((own * carried) ** 0.5 if own > 0 else carried)


def size(value: float) -> float:
    """Natural size of numbers like ``value``: one, unless that is far from it."""
    ordinary = value == 0 or not isfinite(value) or 1e-3 <= value <= 1e3  # in between they count as one
    return 1.0 if ordinary else float(value)


def _of_ordinate(scene: Scene) -> float:
    """Largest size of the ordinate in some states; one where that cannot be told."""
    try:
        if scene.ordinate.places:
            values = [scene.ordinate.of(np.array(r) * scene.length, np.array(q)) for q, r, *_ in STATES]
        else:
            integrand = ufl.as_ufl(scene.ordinate.of(some_places(scene)[1], scene.constants()))
            values = [float(integrand(())) * scene.length]
    except SceneError:  # of the person's own function, at a state where it need not be defined
        return 1.0
    return max((abs(x) for x in values if isfinite(x)), default=1.0)
