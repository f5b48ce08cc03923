r"""Whether the constraints depend on one another at a state, which is known to some digits only.

The index and all eigenvalues rest on the constraints' gradients ``C`` (m, p) having full column rank.  Its smallest
singular value ``sigma`` says how far it is from losing it; for pointwise constraints on linear elements it shrinks like
the size h of an element, ``sigma / h`` tends to a constant (Kumar & Healey 2010, Table 5).  ``1 / sigma^2`` is the
greatest eigenvalue of ``(C^t C)^-1``, found by Lanczos' method.  Products with it come from

    ( a I  C ) ( x )   (  0 )
    ( C^t  0 ) ( y ) = ( -b ),        y = a (C^t C)^-1 b:

the condition number of this sparse matrix is that of ``C``, where ``C^t C`` would square it.

Where ``C`` loses rank multipliers are not unique, and no index is defined: if a constraint follows from others, or at
single states.  A rod that cannot stretch, between ends as far apart as it is long, is *taut*: turned by ``theta``
across its axis it shortens by ``int theta^2 / 2``, to first order not at all.  A tension that is the same all along is
in the kernel of ``C``, on any mesh: any balances the straight rod.  From each thrust at which it buckles a branch
begins there, and which of them Newton's method finds round-off decides.

Newton's method converges by halves to such a state and ends some ``1e-8`` away, where ``sigma`` is as small.  With
the unit vectors ``C w = sigma u`` the derivative of ``sigma`` is ``H u``, where ``H`` is the second derivative of
``w . c``, the part of the Lagrangian's that belongs to the multipliers ``w``.  ``sigma / |H u|`` is, to first order,
the least distance of a state at which constraints depend, whatever their units and the mesh.  Within the accuracy of
states the constraints depend on one another.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spl
from petsc4py import PETSc

from rodfem.errors import SceneError
from rodfem.fem.newton import STALLED
from rodfem.fem.shape import Shape
from rodfem.fem.system import System
from rodfem.linalg.orthogonal import generic
from rodfem.stability.pencil import Blocks, Pencil
from rodfem.tolerances import NEGLIGIBLE, SAME_LOAD

NAMES = {"eta": "unit length of q", "n": "kinematics r' = R v", "scalars": "position of the ends"}
TIGHT = "the rod cannot stretch and is taut, any tension balances it; begin where it is slack, or let it stretch."
DOUBTFUL = 1e-5
"""A singular value above this, relative to the greatest column, is far from zero."""
TAUT = 1e-9
"""Part of a direction, and distance of a state from the scene's start, in the metric, that is round-off."""


def require_independent_constraints(shape: Shape, x: PETSc.Vec, start: PETSc.Vec | None = None) -> None:
    """Raise :class:`SceneError` that names the constraints, if some at the state ``x`` follow from others.

    If ``x`` is the scene's ``start`` but for round-off they are taken there, where gradients that vanish are zero.
    ``shape`` is that of the states of the system.
    """
    system = shape.system
    if start is not None and system.norm(start - x) < TAUT:
        x = start
    blocks = Blocks(system)
    pencil = blocks.assemble(x)
    for sigma, w in weak_combinations(pencil, system.scene.length):
        if sigma > DOUBTFUL or (sigma > NEGLIGIBLE and _distance(blocks, x, pencil, w) > STALLED):
            continue
        names = dependent_equations(pencil, _equations(system), w)
        remedy = TIGHT if taut(shape, x) else "remove those that follow from the others."
        raise SceneError(f"Constraints depend on one another ({names}): {remedy}")


def _equations(system: System) -> list[str]:
    return [u.group.equation.format(u.component + 1) for u in system.fields.unknown_scalars if u.multiplier]


def may_depend(shape: Shape, x: PETSc.Vec) -> bool:
    """Whether constraints may depend on one another at the state ``x``: a scene has some, or the rod is taut."""
    return bool(shape.system.scene.constraints) or taut(shape, x)


def taut(shape: Shape, x: PETSc.Vec) -> bool:
    """Whether a rod that cannot stretch is straight at the state ``x``, and both ends are held along it."""
    scene = shape.system.scene
    if scene.closed or 2 in scene.free_strains:
        return False
    state = shape.system.at(x)
    left, right = (shape.place(state, s, shape.weights(s))[0] for s in scene.interval)
    chord = (right - left) / scene.length
    held = [float(((end.fixed(state.constants()) @ chord) ** 2).sum()) for end in scene.sides]
    return min(held) > 1.0 - TAUT


def taut_where_it_turns(shape: Shape, x: PETSc.Vec) -> str:
    """Sentence on a taut state ``x`` at which the load turns back through no special point; empty if it is not taut."""
    if not taut(shape, x):
        return ""
    scene, load = shape.system.scene, shape.system.scalar(x)
    bound = min(scene.span, key=lambda bound: abs(load - bound))
    at_end = abs(load - bound) < SAME_LOAD * abs(scene.span[1] - scene.span[0])
    where = f"The range ends at {scene.load} = {bound:.8g}, where" if at_end else f"At {scene.load} = {load:.8g}"
    return (
        f"{where} the rod is taut: it cannot stretch, and any tension balances it; the branch turns back there, "
        "through no special point, and what else leaves that state is not followed; end the range before it, or let "
        "the rod stretch."
    )


def weak_combinations(pencil: Pencil, length: float) -> Iterator[tuple[float, np.ndarray]]:
    """Yield what is left where gradients cancel best, over the greatest, and their multipliers (p,).

    Of unit gradients, and of gradients as they are: one that nearly vanishes is a unit one all the same, but it may be
    small for its unit alone, so that its size is at least :data:`NEGLIGIBLE`.  Positions are over the ``length``.
    """
    C = sp.diags(_units(pencil, length)) @ pencil.C
    norms = spl.norm(C, axis=0)
    if not len(norms):
        return
    scale = 1.0 / np.where(norms > 0.0, norms, 1.0)
    sigma, vector = smallest_singular(C @ sp.diags(scale))
    yield sigma, scale * vector
    sigma, vector = smallest_singular(C)
    yield max(sigma / norms.max(), NEGLIGIBLE), vector


def _distance(blocks: Blocks, x: PETSc.Vec, pencil: Pencil, w: np.ndarray) -> float:
    """Distance of the state ``x``, to first order, from one where the gradients cancel along multipliers ``w`` (p,)."""
    change, unit = pencil.C @ w, _units(pencil, blocks.system.scene.length)
    sigma = float(np.linalg.norm(unit * change))
    change *= unit**2 / (sigma or 1.0)
    # the blocks are linear in the multipliers: of this many both parts have entries of one size
    many = spl.norm(pencil.K) / (spl.norm(pencil.C) * np.linalg.norm(w)) or 1.0
    other, (mine, places) = x.copy(), blocks.own(blocks.columns)
    other.array[places] += many * w[mine]
    slope = unit * ((blocks.assemble(other).K - pencil.K) @ change) / many
    steepness = float(np.linalg.norm(slope) * np.sqrt(len(change)))
    if not steepness:
        return np.inf if sigma else 0.0
    return sigma / steepness


def _units(pencil: Pencil, length: float) -> np.ndarray:
    """Natural size of each row (m,) of a pencil: that of a position is the ``length`` of the rod."""
    found = np.ones(pencil.C.shape[0])
    for name in {"r", "ends"} & set(pencil.where):
        found[pencil.where[name]] = length
    return found


def smallest_singular(C: sp.spmatrix) -> tuple[float, np.ndarray]:
    """Smallest singular value of ``C`` (m, p), p > 0, and its right vector (p,); zero where C is exactly singular."""
    C = sp.csr_matrix(C)
    m, p = C.shape
    if p <= 300 or p > m:  # LAPACK takes no time
        _, s, vt = np.linalg.svd(C.toarray(), full_matrices=p > m)
        return (float(s[-1]) if p <= m else 0.0), vt[-1]
    size = float(spl.norm(C, axis=0).max())
    try:
        lu = spl.splu(sp.bmat([[size * sp.identity(m), C], [C.T, None]]).tocsc())
    except RuntimeError:
        return 0.0, np.full(p, p**-0.5)

    def product(b: np.ndarray) -> np.ndarray:
        return np.asarray(lu.solve(np.append(np.zeros(m), -b.ravel()))[m:] / size)

    start = product(product(generic(np.arange(p))))
    if not np.isfinite(start).all():
        return 0.0, np.full(p, p**-0.5)
    operator = spl.LinearOperator((p, p), matvec=product, dtype=float)
    start /= np.linalg.norm(start)
    _, vectors = spl.eigsh(operator, k=1, which="LM", v0=start, tol=1e-6)  # the vector shows sigma to all digits
    return float(np.linalg.norm(C @ vectors[:, 0])), vectors[:, 0]


def dependent_equations(pencil: Pencil, equations: Sequence[str], w: np.ndarray) -> str:
    """Constraints whose gradients cancel with multipliers ``w`` (p,); ``equations`` are words for the scalar ones."""
    w, words = abs(w) / np.linalg.norm(w), list[str]()
    fields = {name: f"constraint {name[1:]} along the rod" for name in pencil.where if name[1:].isdigit()}
    for name, what in (NAMES | fields).items():
        columns = pencil.where.get(name, np.zeros(0, dtype=int))
        if not (w[columns] ** 2).sum() > 0.01:
            continue
        if name == "scalars":
            words += [equations[i] for i in np.flatnonzero(w[columns] > 0.1)]
        else:
            words.append(f"{what} (most of all at s = {pencil.place[columns[np.argmax(w[columns])]]:.4g})")
    return " and ".join(words)
