r"""The rank of the constraints: the smallest singular value of their gradients ``C`` (m, p).

The index and all eigenvalues rest on ``C`` having full column rank.  ``sigma_min(C)`` says how far it is from losing
it; for pointwise constraints on linear elements it shrinks like the size h of an element, ``sigma_min / h`` tends to a
constant (Kumar & Healey 2010, Table 5).

``1 / sigma_min^2`` is the greatest eigenvalue of ``(C^t C)^-1``, found by Lanczos' method.  Products with it come from

    ( a I  C ) ( x )   (  0 )
    ( C^t  0 ) ( y ) = ( -b ),        y = a (C^t C)^-1 b:

the condition number of this sparse matrix is that of ``C``, where ``C^t C`` would square it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spl

from rodfem.errors import ConvergenceError, SceneError
from rodfem.linalg.matrices import gathered
from rodfem.linalg.orthogonal import generic
from rodfem.stability.blocks import Pencil
from rodfem.stability.projection import factored
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


def smallest_singular(C: sp.spmatrix) -> tuple[float, np.ndarray]:
    """Smallest singular value of ``C`` (m, p), p > 0, and its right vector (p,); zero where C is exactly singular."""
    C = sp.csr_matrix(C)
    m, p = C.shape
    if p <= SMALL or p > m:
        _, s, vt = np.linalg.svd(C.toarray(), full_matrices=p > m)
        return (float(s[-1]) if p <= m else 0.0), vt[-1]
    size = float(np.sqrt(np.asarray(C.multiply(C).sum(axis=0)).max()))
    try:
        solve = factored(sp.bmat([[size * sp.identity(m), C], [C.T, None]]).tocsr())
    except ConvergenceError:
        return 0.0, np.full(p, p**-0.5)

    def product(b: np.ndarray) -> np.ndarray:
        return solve(np.append(np.zeros(m), -b.ravel()))[m:] / size

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
    comm, found = pencil.K.comm.tompi4py(), np.ones(pencil.C.size[0])
    for name in ("r", "ends"):
        found[np.concatenate(comm.allgather(pencil.where.get(name, np.zeros(0, dtype=int)))).astype(int)] = length
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
    C = gathered(pencil.C)
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
    comm, vector = pencil.K.comm.tompi4py(), vector / np.linalg.norm(vector)
    shares = {}
    for name in NAMES:
        columns = np.concatenate(comm.allgather(pencil.where.get(name, np.zeros(0, dtype=int)))).astype(int)
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
