r"""A rod on a surface ``g(r) = 0`` whose sections do not shear: the tangent ``t = R v``, along a director, is in it.

With a pressure ``p`` as the multiplier of ``g(r) = 0`` along the rod the constraints depend on ``r' = R v``: together
they prescribe ``grad g . t = 0`` of rotations that are continuous, and held at clamps.  That is a constraint of its own
which no pressure in a space of functions balances: ``p`` has couples at the ends, derivatives of Dirac's delta, and its
inf-sup constant vanishes with the mesh.  With ``p = h / l - u'``

    int p g(r) ds = h / l int g ds + int u dg/ds ds - [u g],        dg/ds = grad g . R v + dg/ds at fixed r,

and ``u`` is the multiplier of that constraint of rotations: collocated at the nodes that no clamp holds it is as
independent of all others as the unit norm of the quaternion.  The scalar ``h`` keeps a rod on its surface that neither
end holds there; of one that both ends hold a constant ``u`` is no force, and one node follows from the others.
``grad g . t = 0`` makes the contact force ``n - u grad g`` for the multiplier ``n`` of ``r' = R v``.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import ufl

from rodfem.expressions import differentiated, evaluated
from rodfem.problem.contribution import Block, Constraint, Everywhere, Group, Motion, Site, Unknown
from rodfem.problem.functions import Constants, place, some_places

if TYPE_CHECKING:
    from rodfem.problem.scene import Scene

MEAN = Group("h", "mean pressure of surfaces", "surface {} of the scene", Motion.MIXED)


@dataclass(frozen=True)
class Surface(Everywhere):
    """A constraint of positions alone; ``floating`` where neither end is held on it, ``spare`` where one node is."""

    floating: bool = False
    spare: bool = False

    def unknowns(self, number: int, normal: int | None, centreline: bool) -> list[Unknown]:
        """Mean pressure, where no end holds the rod on the surface."""
        return [Unknown(MEAN, number)] if self.floating else []

    def blocks(self, number: int, degree: int) -> list[Block]:
        """Multiplier ``u`` of the tangent's constraint."""
        return [Block(f"u{number + 1}", 1, degree, True, True, True, turning=True, spare=self.spare)]

    def lagrangian(self, at: Site) -> Iterator[Any]:
        """Terms of both multipliers."""
        x, r, s = at.x, ufl.variable(at.x.r), ufl.variable(at.c.s)
        g = ufl.as_ufl(self.of(place(x.q, x.R, s, r, length=x.length), Constants(**vars(at.c) | {"s": s})))
        yield at.y[-1] * (ufl.dot(ufl.diff(g, r), x.tangent) + ufl.diff(g, s))
        if self.floating:
            yield at.y[0] * g / x.length


def acting(constraint: Constraint, scene: Scene) -> Constraint:
    """A constraint as it acts on the rod of a scene."""
    if not (isinstance(constraint, Everywhere) and constraint.nodal) or {0, 1} & {*scene.free_strains}:
        return constraint
    asked = [i for i in range(3) if _depends(constraint, scene, "r", i)]
    if not asked or any(_depends(constraint, scene, "q", i) for i in range(4)):
        return constraint
    held = [end.held(scene.constants()) for end in scene.sides]
    on_it = [all(i == scene.normal or side[i] is not None for i in asked) for side in held]
    return Surface(constraint.of, nodal=True, floating=not any(on_it), spare=scene.closed or all(on_it))


def _depends(constraint: Constraint, scene: Scene, name: str, i: int) -> bool:
    """Whether a constraint depends on component ``i`` of ``r`` or ``q``."""
    places = [some_places(scene, state, ufl.variable)[1] for state in range(2)]
    slopes = [ufl.diff(ufl.as_ufl(constraint.of(x, scene.constants())), getattr(x, name)) for x in places]
    return any(evaluated(differentiated(slope), (i,)) for slope in slopes)
