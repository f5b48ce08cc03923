r"""Reactions: the forces and moments by which its supports, and what is attached, act on a rod in equilibrium.

With ``V`` the potential energy of rod and loads the support of an end does the work ``dV`` in a motion of that end: a
force ``dV/dr``, a moment ``dV/dtheta``.  Multipliers of hinges and guides act for the support, and are left out of
``V``.  These are rows of the discrete equations that are not solved, because the end is held: they are as accurate as
those that are (:mod:`rodfem.fem.resultants`).  Loads at the end, springs there too, are part of ``V``.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from petsc4py import PETSc

from rodfem.fem.resultants import Resultants, turns
from rodfem.fem.shape import Shape
from rodfem.fem.state import Evaluation
from rodfem.problem.end import LETTERS
from rodfem.problem.quaternions import product
from rodfem.tolerances import SAME_PLACE

SUPPORTS = ("m", "f")
"""Letters of the multipliers that act for the support of an end: moments of a hinge, forces of a guide."""


class Reaction(NamedTuple):
    """Force and moment on the rod, components in space, both (3,)."""

    force: np.ndarray
    moment: np.ndarray


class Reactions(NamedTuple):
    """Reactions of the supports of the ``left`` and ``right`` end, and of what is attached inside, from left to right.

    A closed rod has no supports: zero.
    """

    left: Reaction
    right: Reaction
    attached: tuple[Reaction, ...]


def reactions(resultants: Resultants, x: PETSc.Vec) -> Reactions:
    """All reactions at the equilibrium ``x``; collective."""
    scene, starts = resultants.shape.system.scene, resultants.shape.from_left(resultants.shape.start)
    s = np.array(scene.interval)
    ends = resultants.on_elements(x, s, np.array([[0, len(starts) - 1]]))
    contact = np.array([[-1.0], [1.0]]) * np.stack([ends.force_in_space, ends.moment_in_space])  # (2, side, 3)
    left, right = (_of_support(resultants, x, i, contact[:, i]) for i in range(2))
    places = np.array(sorted({a.s for a in scene.attachments if scene.is_inside(a.s)}))
    after = np.searchsorted(starts, places - SAME_PLACE * scene.length)
    below, above = (resultants.on_elements(x, places, after[None] - back) for back in (1, 0))
    jumps = (below.force_in_space - above.force_in_space, below.moment_in_space - above.moment_in_space)
    return Reactions(left, right, tuple(map(Reaction, *jumps)))


def _of_support(resultants: Resultants, x: PETSc.Vec, side: int, contact: np.ndarray) -> Reaction:
    """Force and moment of the support of an end; what no row of the equations tells is that of the ``contact`` (2, 3).

    Without a centreline the position of an end is a scalar unknown where it moves under more than dead forces.
    """
    shape = resultants.shape
    system, fields, scene = shape.system, shape.system.fields, shape.system.scene
    if scene.closed:
        return Reaction(np.zeros(3), np.zeros(3))
    state, local, (force, moment) = system.at(x), system.at(x).local.copy(), contact.copy()
    for unknown, copies in zip(fields.unknown_scalars, fields.copies.T, strict=False):
        if unknown.group.name in {letter + LETTERS[side] for letter in SUPPORTS}:
            local[copies] = 0.0
    work = Evaluation(state.equations, local, state.line).covector()
    cell, node = int((shape.start if side == 0 else -shape.start).argmin()), shape.order[-side]
    mine = np.isclose(shape.start[cell] + side * shape.size[cell], scene.interval[side])
    turned = fields.dofs[fields.turning.name][cell, node]
    q, weights = fields.turning.quaternion(local[turned]), fields.turning.functional(local[turned], work[turned])
    known = slice(None) if scene.normal is None else scene.normal
    moment[known] = _sum(shape, mine * product(turns(), q) @ weights / 2)[known]
    if "r" in fields.dofs:
        return Reaction(_sum(shape, mine * work[fields.dofs["r"][cell, node]]), moment)
    rows = dict(zip(fields.scalars, fields.copies.T, strict=False))
    for i in (i for i, held in enumerate(scene.sides[side].held(state.constants())) if held is None):
        force[i] = _sum(shape, work[rows.get(f"{LETTERS[side]}{i + 1}", [])].sum())
    return Reaction(force, moment)


def _sum(shape: Shape, mine: Any) -> Any:
    """Sum over the ranks."""
    return shape.gather(np.asarray(mine)[None]).sum(axis=0)
