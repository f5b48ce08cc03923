r"""Branch points, perfect or not: their equations with unfolding parameters.

A branch point is a singular equilibrium at which the load does no work on the null vectors, ``phi_i . F_lam = 0``.  An
imperfection, however small, takes it apart: of ``f = A xi^3 + B lam xi + eps = 0`` no point is singular *and* has
``f_lam = 0``, and a step of continuation longer than ``(eps/A)^(1/3)`` jumps the gap between its two pieces.  With an
unfolding parameter for each null vector (Moore, SIAM J. Numer. Anal. 17 (1980) 567-576)

    F(x, lam) + sum_i beta_i psi_i = 0,     tr G(x, lam) = 0,     phi_i . F_lam = 0,       psi_i = M phi_i,

the point is regular again, and ``beta`` measures the imperfection: zero at a branch point, ``-eps`` above.  ``G`` is
that of the bordered matrix of :mod:`rodfem.codim2.singular`,

    ( S       psi )  ( V   w   s )     ( 0   -F_lam   -F )
    ( psi^t   0   )  ( G   b   c )  =  ( I    0        0 ),      so that   b_i = -V_i . F_lam,

and Newton's step is ``dx = s + dlam w + sum_j xi_j V_j`` with

    b_i = s.r_i + dlam q_i + sum_j xi_j V_j.r_i,        tr G = sum_i (s.y_i + dlam V_i.r_i + sum_j xi_j V_j.y_i),
    r_i = d/dt S(x + t w, lam + t) V_i,   y_i = d/dt S(x + t V_i, lam) V_i,   q_i = V_i . d^2/dt^2 F(x + t w, lam + t),

the derivatives by central differences, whose errors do not enter the converged result.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.branch import SpecialPoint
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.errors import ConvergenceError
from rodfem.fem.newton import TOLERANCE
from rodfem.fem.system import System
from rodfem.linalg.matrices import rounding
from rodfem.linalg.orthogonal import combine
from rodfem.stability.bordered import Bordered
from rodfem.tolerances import TINY

DIFFERENCE = 1e-4
"""Step of the differences, in the metric."""
MOST = 10
"""Newton steps."""
STALLED = 1e-7
"""Below this, in the metric, a step that no longer shrinks is round-off."""
FARTHEST = 0.5
"""A point farther than this from where it is expected, in the metric, is another one."""
NOISE = 100.0
"""Times the rounding errors of ``phi . F``, independent and as large as those of ``phi . S x``, up to which ``beta`` is
round-off."""
LEAST = 1e-15
"""Round-off of ``beta`` where all of these vanish, over the lowest bending eigenvalue."""


@dataclass(frozen=True)
class Unfolded:
    """A singular state without coupling to the load, the unfolding parameters that make it one, and their round-off.

    Relative to the metric, as eigenvalues are: ``beta`` (k,) is an eigenvalue times an amplitude in radian.
    ``directions`` are those of the two branches that would cross there, unit vectors, for one null vector.  ``x`` and
    ``load`` are the state, ``noise`` is the round-off of the size of ``beta``.
    """

    x: PETSc.Vec
    load: float
    beta: np.ndarray
    noise: float
    directions: list[PETSc.Vec]

    @property
    def size(self) -> float:
        """Size of the unfolding parameters."""
        return float(np.linalg.norm(self.beta))


def unfold(solver: BranchSolver, special: SpecialPoint) -> Unfolded | None:
    """Solve for a branch point with unfolding parameters; None where there is none near the ``special`` point."""
    system, inertia = solver.system, solver.inertia
    k, x = len(special.null_vectors), special.point.x.copy()
    bordered = Bordered(system, inertia.at(x).matrix, k, inertia.constraints)
    psi = [inertia.metric * v for v in special.null_vectors]
    equations = system.new_vector()
    moved, before = 0.0, np.inf
    for _ in range(MOST):
        system.at(x).residual(equations)
        try:
            step, beta, v, directions = _step(solver, bordered, psi, x, equations)
        except (ConvergenceError, np.linalg.LinAlgError):
            return None
        size = system.norm(step)
        moved += size
        if not np.isfinite(size) or moved > FARTHEST:
            return None
        x.axpy(1.0, step)
        if size < TOLERANCE or (size < STALLED and size > 0.5 * before):
            matrix = inertia.at(x).matrix
            noise = NOISE * max(rounding(matrix, w, x) for w in v)
            return Unfolded(x, system.scalar(x), beta, noise + LEAST * inertia.scale, directions)
        before = size
    return None


def _step(
    solver: BranchSolver, bordered: Bordered, psi: list[PETSc.Vec], x: PETSc.Vec, equations: PETSc.Vec
) -> tuple[PETSc.Vec, np.ndarray, list[PETSc.Vec], list[PETSc.Vec]]:
    """Newton's step, the unfolding parameters after it, null vectors and directions."""
    system, found, k = solver.system, solver.inertia.at(x), len(psi)
    bordered.factor(found.matrix, psi)
    s, c = bordered.solve(-equations, np.zeros(k))
    w, b = bordered.solve(-found.border, np.zeros(k))
    solved = [bordered.solve(None, e) for e in np.eye(k)]
    v, G = [vector for vector, _ in solved], np.array([row for _, row in solved])
    system.set_load(w, 1.0)
    h = DIFFERENCE / system.norm(w)
    r, bend = _differences(solver, x, w, h, v, equations)
    y = [_differences(solver, x, vector, DIFFERENCE, [vector])[0][0] for vector in v]
    table, known = np.zeros((k + 1, k + 1)), np.zeros(k + 1)
    for i in range(k):
        known[i] = b[i] - s.dot(r[i])
        table[i] = [bend.dot(v[i]), *(u.dot(r[i]) for u in v)]
    known[k] = np.trace(G) - sum(s.dot(image) for image in y)
    table[k] = [sum(u.dot(image) for u, image in zip(v, r, strict=True)), *(sum(u.dot(z) for z in y) for u in v)]
    size = np.maximum(abs(table).max(axis=1), TINY)
    share = np.linalg.solve(table / size[:, None], known / size)
    step = combine([s, w, *v], np.array([1.0, *share]))
    return step, c + share[0] * b + G.T @ share[1:], v, _crossing_directions(system, w, v, table) if k == 1 else []


def _crossing_directions(system: System, w: PETSc.Vec, v: list[PETSc.Vec], table: np.ndarray) -> list[PETSc.Vec]:
    """Unit directions ``xi V + dlam (w, 1)`` with ``a xi^2 + 2 b xi dlam + c dlam^2 = 0``, the reduced equation."""
    (c, b), (_, a) = table
    root = np.sqrt(max(b * b - a * c, 0.0))
    pivot = -(b + np.copysign(root, b))
    out = []
    for xi, dlam in ((pivot, a), (c, pivot)):  # no cancellation: the two roots xi/dlam have the product c/a
        if xi or dlam:
            d = combine([*v, w], np.array([xi, dlam]))
            out.append(d / system.norm(d))
    return out


def _differences(
    solver: BranchSolver,
    x: PETSc.Vec,
    direction: PETSc.Vec,
    h: float,
    vectors: list[PETSc.Vec],
    equations: PETSc.Vec | None = None,
) -> tuple[list[PETSc.Vec], PETSc.Vec]:
    """Derivatives of ``S v`` along a direction at ``x``, and the second one of ``F`` (from ``F``, if given)."""
    system, inertia = solver.system, solver.inertia
    out, bend = [system.new_vector() for _ in vectors], system.new_vector()
    there = system.new_vector()
    for sign in (1.0, -1.0):
        beside = x + direction * (sign * h)
        matrix = inertia.at(beside).matrix
        for image, v in zip(out, vectors, strict=True):
            image.axpy(sign / (2 * h), matrix * v)
        if equations is not None:
            system.at(beside).residual(there)
            bend.axpy(1.0 / h**2, there)
            bend.axpy(-1.0 / h**2, equations)
    return out, bend
