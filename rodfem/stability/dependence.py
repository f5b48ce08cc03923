r"""Whether constraints depend on one another at a state, which is known to some digits only.

Where their gradients ``C`` lose rank multipliers are not unique, and no index is defined.  That is so

* where a constraint follows from others, at all states that fulfil them;
* at single states.  A rod that cannot stretch, between ends as far apart as it is long, is *taut*: turned by ``theta``
  across its axis it shortens by ``int theta^2 / 2``, to first order not at all.  A tension that is the same all along
  is in the kernel of ``C``, of the rod and on any mesh: any balances the straight rod.  At this one load a branch
  begins from each tension, a thrust, at which it buckles, and which of them Newton's method finds round-off decides.

The smallest singular value ``sigma`` of ``C`` is zero there, but Newton's method converges by halves to such a state
and ends some ``1e-8`` beside, where ``sigma`` is as small; so it is where factors without pivots are round-off.  With
the unit vectors ``C w = sigma u`` the derivative of ``sigma`` is ``H u``, where ``H`` is the second derivative of
``w . c``, the part of the Lagrangian's that belongs to the multipliers ``w``.  ``sigma / |H u|`` is, to first order,
the least distance of a state at which constraints depend, whatever their units and the mesh.  Where it is within the
accuracy of states, the constraints depend on one another.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import scipy.sparse as sp
from petsc4py import PETSc

from rodfem.errors import SceneError
from rodfem.fem.newton import STALLED
from rodfem.fem.shape import Shape
from rodfem.linalg.matrices import gathered
from rodfem.stability.blocks import Blocks, Pencil
from rodfem.stability.rank import REMEDY, dependent, greatest, norms, rank_of, smallest_singular, units

DOUBTFUL = 1e-5
"""A singular value above this, relative to the greatest column, is far from zero."""
ROUND = 1e-9
"""Distance from the scene's start, in the metric, below which a state is that start: Newton's tolerance."""
TAUT = 1e-9
"""Slack over length below which a rod may be taut, and the part of a direction that counts as none."""
SLACKEN = "the rod cannot stretch and is taut, any tension balances it; begin where it is slack, or let it stretch."
"""What to do about a taut rod."""


def require_independent_constraints(shape: Shape, x: PETSc.Vec, start: PETSc.Vec | None = None) -> None:
    """Raise :class:`SceneError` that names the constraints, if some at the state ``x`` follow from others.

    Where ``x`` is the scene's ``start`` but for round-off they are taken there, where gradients that vanish are zero.
    ``shape`` is that of the states of the system.
    """
    system = shape.system
    if start is not None and system.norm(start - x) < ROUND:
        x = start
    scalars = [u for u in system.fields.unknown_scalars if u.multiplier]
    words = [u.group.equation.format(u.component + 1) for u in scalars]
    remedy = SLACKEN if taut(shape, x) else REMEDY
    blocks = Blocks(system, "full")
    pencil = blocks.assemble(x)
    sigma = rank_of(pencil, words, system.scene.length, remedy)
    if np.isinf(sigma) or sigma > DOUBTFUL * greatest(gathered(pencil.C), 0):
        return
    for w in _doubtful(pencil, system.scene.length):
        if _distance(blocks, x, pencil, w) < STALLED:
            raise SceneError(dependent(pencil, words, w, sigma, remedy))


def may_depend(shape: Shape, x: PETSc.Vec) -> bool:
    """Whether constraints may depend on one another at the state ``x``: a scene has some, or the rod is taut.

    ``shape`` is that of the states of the system.
    """
    return bool(shape.system.scene.constraints) or taut(shape, x)


def taut(shape: Shape, x: PETSc.Vec) -> bool:
    """Whether a rod that cannot stretch is straight at the state ``x``, and both ends are held along it.

    ``shape`` is that of the states of the system.
    """
    scene = shape.system.scene
    if scene.closed or 2 in scene.free_strains:
        return False
    state = shape.system.at(x)
    left, right = (shape.place(state, s, shape.weights(s))[0] for s in scene.interval)
    chord = (right - left) / scene.length
    held = [float(((end.fixed(state.constants()) @ chord) ** 2).sum()) for end in scene.sides]
    return min(held) > 1.0 - TAUT


def _doubtful(pencil: Pencil, length: float) -> Iterator[np.ndarray]:
    """Multipliers (p,) along which the gradients nearly cancel, of columns as they are, and of unit ones.

    Parameters
    ----------
    pencil
        Blocks of the state.
    length
        Of the rod: positions are measured by it.
    """
    C = sp.diags(units(pencil, length)) @ gathered(pencil.C)
    for scale in (np.ones(C.shape[1]), 1.0 / norms(C, 0)):
        scaled = C @ sp.diags(scale)
        sigma, vector = smallest_singular(scaled)
        if sigma < DOUBTFUL * greatest(scaled, 0):
            yield scale * vector


def _distance(blocks: Blocks, x: PETSc.Vec, pencil: Pencil, w: np.ndarray) -> float:
    """Distance of the state ``x`` from one where the gradients cancel along multipliers ``w`` (p,), to first order.

    It is the root mean square over the unknowns, positions over the rod's length; ``pencil`` is that of the state, made
    by ``blocks``.
    """
    length = blocks.system.scene.length
    multipliers, change = pencil.C.createVecs()
    first, last = multipliers.getOwnershipRange()
    multipliers.array[:] = w[first:last]
    pencil.C.mult(multipliers, change)
    unit = units(pencil, length)[slice(*change.getOwnershipRange())]
    change.array[:] *= unit
    sigma = change.norm()
    change.array[:] *= unit / (sigma or 1.0)
    # the blocks are linear in the multipliers: of this many both parts have entries of one size
    many = pencil.K.norm() / (pencil.C.norm() * multipliers.norm()) or 1.0
    other = x.copy()
    other.array[blocks.columns - x.getOwnershipRange()[0]] += many * w[first:last]
    slope, before = change.duplicate(), change.duplicate()
    blocks.assemble(other).K.mult(change, slope)
    pencil.K.mult(change, before)
    slope.axpy(-1.0, before)
    slope.array[:] *= unit / many
    steepness = float(slope.norm() * np.sqrt(change.size))
    if not steepness:
        return np.inf if sigma else 0.0
    return sigma / steepness
