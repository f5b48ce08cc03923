r"""The rank of the constraints, and whether they depend on one another at a state, which is known to some digits only.

The index and all eigenvalues rest on the constraints' gradients ``C`` (m, p) having full column rank.  Its smallest
singular value ``sigma`` says how far it is from losing it; for pointwise constraints on linear elements it shrinks like
the size h of an element, ``sigma / h`` tends to a constant (Kumar & Healey 2010, Table 5).  ``1 / sigma^2`` is the
greatest eigenvalue of ``(C^t C)^-1``, found by Lanczos' method.  Products with it come from

    ( a I  C ) ( x )   (  0 )
    ( C^t  0 ) ( y ) = ( -b ),        y = a (C^t C)^-1 b:

the condition number of this sparse matrix is that of ``C``, where ``C^t C`` would square it.

Where ``C`` loses rank multipliers are not unique, and no index is defined.  That is so

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

from collections.abc import Iterator, Sequence

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spl
from petsc4py import PETSc

from rodfem.errors import SceneError
from rodfem.fem.newton import STALLED
from rodfem.fem.shape import Shape
from rodfem.linalg.orthogonal import generic
from rodfem.stability.pencil import Blocks, Pencil
from rodfem.tolerances import NEGLIGIBLE

DIRECTION = 1e-6
"""Relative tolerance of ARPACK for the vector of the least singular value."""
PASSES = 8
"""Number of times that rows and columns are scaled by the roots of their norms: each halves what is left in digits."""
SMALL = 300
"""Number of columns up to which the singular values are computed by LAPACK."""
REMEDY = "remove those that follow from the others."
"""What to do about constraints that depend on one another."""
NAMES = {"eta": "unit length of q", "n": "kinematics r' = R v", "scalars": "position of the ends"}
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
    words = [u.group.equation.format(u.component + 1) for u in system.fields.unknown_scalars if u.multiplier]
    remedy = SLACKEN if taut(shape, x) else REMEDY
    blocks = Blocks(system)
    pencil = blocks.assemble(x)
    sigma = rank_of(pencil, words, system.scene.length, remedy)
    if np.isinf(sigma) or sigma > DOUBTFUL * greatest(pencil.C, 0):
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
    C = sp.diags(units(pencil, length)) @ pencil.C
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
    change, unit = pencil.C @ w, units(pencil, blocks.system.scene.length)
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


def smallest_singular(C: sp.spmatrix) -> tuple[float, np.ndarray]:
    """Smallest singular value of ``C`` (m, p), p > 0, and its right vector (p,); zero where C is exactly singular."""
    C = sp.csr_matrix(C)
    m, p = C.shape
    if p <= SMALL or p > m:
        _, s, vt = np.linalg.svd(C.toarray(), full_matrices=p > m)
        return (float(s[-1]) if p <= m else 0.0), vt[-1]
    size = float(np.sqrt(np.asarray(C.multiply(C).sum(axis=0)).max()))
    try:
        lu = spl.splu(sp.bmat([[size * sp.identity(m), C], [C.T, None]]).tocsc())
    except RuntimeError:
        return 0.0, np.full(p, p**-0.5)

    def product(b: np.ndarray) -> np.ndarray:
        return np.asarray(lu.solve(np.append(np.zeros(m), -b.ravel()))[m:] / size)

    start = generic(np.arange(p))
    start = product(product(start))
    if not np.isfinite(start).all():
        return 0.0, np.full(p, p**-0.5)
    start /= np.linalg.norm(start)
    operator = spl.LinearOperator((p, p), matvec=product, dtype=float)
    _, vectors = spl.eigsh(operator, k=1, which="LM", v0=start, tol=DIRECTION, ncv=min(20, p - 1))
    vector = vectors[:, 0] / np.linalg.norm(vectors[:, 0])
    return float(np.linalg.norm(C @ vector)), vector


def norms(C: sp.spmatrix, axis: int) -> np.ndarray:
    """Norms of columns (``axis`` 0) or rows; one for those that are zero."""
    squares = np.asarray(C.multiply(C).sum(axis=axis)).ravel()
    return np.asarray(np.sqrt(np.where(squares > 0, squares, 1.0)))


def greatest(C: sp.spmatrix, axis: int) -> float:
    """Greatest norm of columns (``axis`` 0) or rows."""
    return float(norms(C, axis).max())


def _equilibrated(C: sp.spmatrix) -> sp.spmatrix:
    """Matrix of the same rank whose rows and columns have norms near one (D. Ruiz, RAL-TR-2001-034)."""
    for _ in range(PASSES):
        rows, columns = (1 / np.sqrt(norms(C, axis)) for axis in (1, 0))
        C = sp.diags(rows) @ C @ sp.diags(columns)
    return C


def units(pencil: Pencil, length: float) -> np.ndarray:
    """Natural size of each row (m,) of a pencil: that of a position is the ``length`` of the rod."""
    found = np.ones(pencil.C.shape[0])
    for name in {"r", "ends"} & set(pencil.where):
        found[pencil.where[name]] = length
    return found


def _without_noise(pencil: Pencil, C: sp.spmatrix, length: float) -> sp.spmatrix:
    """``C`` without the entries that are round-off beside the largest one of their column.

    A row of nothing else would be one of norm one when it is equilibrated.  Derivatives in a position are those in
    ``length``, so that none of the two kinds of entries is small for its unit.
    """
    C = sp.csc_matrix(sp.diags(units(pencil, length)) @ C)
    largest = np.asarray(abs(C).max(axis=0).todense()).ravel()
    C.data[abs(C.data) <= NEGLIGIBLE * np.repeat(largest, np.diff(C.indptr))] = 0.0
    C.eliminate_zeros()
    return C


def rank_of(pencil: Pencil, scalars: Sequence[str] = (), length: float = 1.0, remedy: str = REMEDY) -> float:
    """``sigma_min(C)`` of a pencil; infinite without constraints.

    Parameters
    ----------
    pencil
        Blocks of a state.
    scalars
        Words for its scalar multipliers.
    length
        Of the rod: positions are measured by it where units must not count.
    remedy
        What to do about constraints that depend on one another.

    Raises :class:`SceneError` that names the constraints which depend on one another.
    """
    C = pencil.C
    if not C.shape[1]:
        return np.inf
    sigma, vector = smallest_singular(C)
    if sigma > NEGLIGIBLE * greatest(C, 0):
        return sigma
    # in metres and newtons of a molecule, say, columns are of very different sizes
    equal = _equilibrated(_without_noise(pencil, C, length))
    least, vector = smallest_singular(equal)
    if least > NEGLIGIBLE * greatest(equal, 0):
        return sigma
    raise SceneError(dependent(pencil, scalars, vector, sigma, remedy))


def dependent(pencil: Pencil, scalars: Sequence[str], vector: np.ndarray, sigma: float, remedy: str) -> str:
    """Sentence on constraints whose gradients cancel.

    Parameters
    ----------
    pencil
        Blocks of the state.
    scalars
        Words for its scalar multipliers.
    vector
        Multipliers (p,) with which they cancel.
    sigma
        Smallest singular value of ``C``.
    remedy
        What to do about them.
    """
    vector, shares = vector / np.linalg.norm(vector), {}
    for name in NAMES:
        columns = pencil.where.get(name, np.zeros(0, dtype=int))
        shares[name] = (float((vector[columns] ** 2).sum()), columns)
    blocks = [name for name, (share, _) in shares.items() if share > 0.01]
    words = []
    for name in blocks or list(NAMES)[:1]:
        columns = shares[name][1]
        if name == "scalars":
            which = np.flatnonzero(abs(vector[columns]) > 0.1)
            words += [scalars[i] if i < len(scalars) else f"{NAMES[name]}, component {i + 1}" for i in which]
        else:
            place = pencil.place[columns[np.argmax(abs(vector[columns]))]] if len(columns) else np.nan
            words.append(f"{NAMES[name]} (most of all at s = {place:.4g})")
    return f"Constraints depend on one another ({' and '.join(words)}; smallest singular value {sigma:.1e}): {remedy}"
