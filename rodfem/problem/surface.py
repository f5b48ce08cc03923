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

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import ufl

from rodfem.expressions import differentiated, evaluated
from rodfem.forms.kinematics import UNDEFORMED
from rodfem.forms.rotation import IDENTITY
from rodfem.problem.arguments import number_of
from rodfem.problem.contribution import Block, Constraint, Everywhere, Group, Motion, Site, Unknown
from rodfem.problem.functions import STATES, inside, place, places_at
from rodfem.problem.quaternions import directors
from rodfem.problem.setting import AXIS, HELD
from rodfem.tolerances import SAME_PLACE

if TYPE_CHECKING:
    from rodfem.problem.scene import Scene

MEAN = Group("h", "mean pressure of surfaces", "surface {} of the scene", Motion.MIXED)


@dataclass(frozen=True)
class Surface(Everywhere):
    """A constraint of positions alone; ``floating`` where neither end is held on it, ``spare`` where one node is.

    ``tangent`` says of each end whether that is held in the surface.
    """

    floating: bool = False
    spare: bool = False
    tangent: tuple[bool, bool] = (False, False)

    def unknowns(self, number: int, normal: int | None, centreline: bool) -> list[Unknown]:
        """Mean pressure, where no end holds the rod on the surface."""
        return [Unknown(MEAN, number)] if self.floating else []

    def blocks(self, number: int, degree: int) -> list[Block]:
        """Multiplier ``u`` of the tangent's constraint."""
        return [Block(f"u{number + 1}", 1, degree, True, True, True, tangent=self.tangent, spare=self.spare)]

    def lagrangian(self, at: Site) -> Iterator[Any]:
        """Terms of both multipliers."""
        x, r = at.x, ufl.variable(at.x.r)
        g = ufl.as_ufl(self.of(place(x.q, x.R, x.s, r, length=x.length), at.c))
        yield at.y[-1] * (g.dx(0) + ufl.dot(ufl.diff(g, r), x.tangent - at.x.r.dx(0)))
        if self.floating:
            yield at.y[0] * g / x.length


def acting(constraint: Constraint, scene: Scene) -> Constraint:
    """A constraint as it acts on the rod of a scene."""
    if not (isinstance(constraint, Everywhere) and constraint.nodal) or {0, 1} & {*scene.free_strains}:
        return constraint
    turns, moves = (np.array([_slope(constraint, scene, x, y) for x in STATES[:2]]).any(axis=0) for y in ("q", "r"))
    if turns.any() or not moves.any():
        return constraint
    held = [[x is not None for x in end.held(scene.constants())] for end in scene.sides]
    on_it = (np.array(held) | (np.arange(3) == scene.normal) | ~moves).all(axis=1)
    tangent = _in_surface(constraint, scene, 0), _in_surface(constraint, scene, 1)
    spare = bool(scene.closed | on_it.all())
    return Surface(constraint.of, nodal=True, floating=not on_it.any(), spare=spare, tangent=tangent)


def _slope(constraint: Constraint, scene: Scene, state: Sequence[Any], name: str) -> np.ndarray:
    """Derivative of a constraint in ``r`` (3,) or ``q`` (4,) at one of :data:`STATES`."""
    x = places_at(scene.length, inside(scene.interval)[0], state, ufl.variable)[1]
    slope = differentiated(ufl.diff(ufl.as_ufl(constraint.of(x, scene.constants())), getattr(x, name)))
    return np.array([float(evaluated(slope, (i,))) for i in range(4 if name == "q" else 3)])


def _in_surface(constraint: Constraint, scene: Scene, side: int) -> bool:
    """Whether an end holds its tangent in the surface: by a clamp, or a hinge whose axis is across the surface."""
    end, c = scene.sides[side], scene.constants()
    if scene.closed or end.turning != AXIS:  # the right end of a ring has the tangent of the left one
        return end.turning == HELD or (scene.closed and side == 1)
    d = directors(np.array([number_of(x) for x in end.frame(c)]))
    r = [0.0 if x is None else number_of(x) / scene.length for x in end.held(c)]
    try:
        normal = _slope(constraint, scene, (IDENTITY, r, UNDEFORMED, (0.0, 0.0, 0.0)), "r")
    except ArithmeticError:  # at no place of the surface
        return True
    return abs(float(normal @ np.cross(d @ end.hinge, d[:, 2]))) <= SAME_PLACE * float(np.linalg.norm(normal))
