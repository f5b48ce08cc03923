r"""Whether the constraints depend on one another at a state, which is known to some digits only.

The index and all eigenvalues rest on the constraints' gradients ``C`` (m, p) having full column rank.  Its smallest
singular value ``sigma`` says how far it is from losing it; for pointwise constraints on linear elements it shrinks like
the size h of an element, ``sigma / h`` tends to a constant (Kumar & Healey 2010, Table 5).

Where ``C`` loses rank multipliers are not unique, and no index is defined: if a constraint follows from others, or at
single states.  A rod that cannot stretch, between ends as far apart as it is long, is *taut*: turned by ``theta``
across its axis it shortens by ``int theta^2 / 2``, to first order not at all.  A tension that is the same all along is
in the kernel of ``C``, on any mesh: any balances the straight rod.  From each thrust at which it buckles a branch
begins there, and which of them Newton's method finds round-off decides.  It converges by halves to such a state and
ends some ``1e-8`` away, where ``sigma`` is as small.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spl
from petsc4py import PETSc

from rodfem.errors import SceneError
from rodfem.fem.formulations import CONTACT_FORCE
from rodfem.fem.shape import Shape
from rodfem.linalg.matrices import EPS
from rodfem.linalg.orthogonal import generic
from rodfem.stability.pencil import Blocks, Pencil
from rodfem.tolerances import SAME_LOAD

NAMES = {"eta": "unit length of q", "n": "kinematics r' = R v", "scalars": "position of the ends"}
TIGHT = "the rod cannot stretch and is taut, any tension balances it; begin where it is slack, or let it stretch."
WEAK = 1e-7
"""Part of unit gradients that is left where they cancel, below which constraints depend on one another."""
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
    pencil = Blocks(system).assemble(x)
    scalars = [u for u in system.fields.unknown_scalars if u.multiplier]
    reach = pencil.where["scalars"][[u.group.name == CONTACT_FORCE for u in scalars]]
    found = weakest(pencil, np.append(pencil.where.get(CONTACT_FORCE, reach[:0]), reach), system.scene.length)
    if found and found[0] <= WEAK:
        names = dependent_equations(pencil, [u.group.equation.format(u.component + 1) for u in scalars], found[1])
        remedy = TIGHT if taut(shape, x) else "remove those that follow from the others."
        raise SceneError(f"Constraints depend on one another ({names}): {remedy}")


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


def weakest(pencil: Pencil, reach: np.ndarray, length: float) -> tuple[float, np.ndarray] | None:
    """Smallest singular value of the gradients, each over its norm, and their multipliers (p,); None without any.

    Those of positions, at the places ``reach``, are over the ``length`` of the rod at least: where it is taut one
    vanishes.
    """
    if not pencil.C.shape[1]:
        return None
    units = np.ones(pencil.C.shape[0])
    units[[i for name in ("r", "ends") for i in pencil.where.get(name, ())]] = length
    C = sp.diags(units) @ pencil.C
    norms = spl.norm(C, axis=0)
    norms[reach] = np.maximum(norms[reach], length)
    scale = 1.0 / np.where(norms > 0.0, norms, 1.0)
    sigma, vector = smallest_singular(C @ sp.diags(scale))
    return sigma, scale * vector


def smallest_singular(C: sp.spmatrix) -> tuple[float, np.ndarray]:
    """Smallest singular value of ``C`` (m, p), p > 0, and its right vector (p,)."""
    C = sp.csr_matrix(C)
    m, p = C.shape
    if p <= 300 or p > m:  # LAPACK takes no time
        _, s, vt = np.linalg.svd(C.toarray(), full_matrices=p > m)
        return (float(s[-1]) if p <= m else 0.0), vt[-1]
    gram, start = (C.T @ C).tocsc(), generic(np.arange(p))
    tolerance = 1e-6  # of the vector, which shows sigma to all digits
    _, vectors = spl.eigsh(gram, 1, sigma=-EPS * gram.diagonal().max(), v0=start, tol=tolerance)
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
