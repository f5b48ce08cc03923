r"""Folds and branch points of a branch: from a crossing to the solution of its singular system, with all that it tells.

With ``phi`` the null vector and ``F_lam`` the derivative of the equations in the load, ``phi . F_lam != 0`` at a fold
and ``= 0`` at a branch point (Keller 1977).  Where that is nearly zero the systems of both are solved: a branch point
whose unfolding parameters are round-off is one, and one with others was taken apart by an imperfection.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.arc import STRAYED, Piece
from rodfem.continuation.branch import SpecialPoint
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.crossings import Crossing, Node, cubic_value
from rodfem.continuation.kinds import BRANCH_POINT, FOLD
from rodfem.continuation.singular import SingularState, SingularSystem, load_uncertainty
from rodfem.linalg.matrices import EPS
from rodfem.linalg.orthogonal import combine, complement, orthonormalize
from rodfem.stability.inertia import Index
from rodfem.stability.reduced_stiffness import NEARLY_ZERO
from rodfem.tolerances import round_off

COUPLED = 1e-5
"""A fold has a cosine between null vector and load derivative above this, a branch point below."""
CLEARLY, FELT = 1e-3, 1e-6
"""Above these, of the cosine and of the product in natural units, the point is a fold before anything is solved for."""
LEVEL = 1e-3
"""Slope of the load, relative to its span, below which it is taken for zero."""
INSENSITIVE, ROUNDED = 1e-10, 10.0 * EPS
"""A derivative of the equations in the load smaller than this, relative to bending, or to the Jacobian, is zero."""


def coupling_of(solver: BranchSolver, x: PETSc.Vec, null_vector: PETSc.Vec) -> float:
    """Cosine between a null vector and ``F_lam``, the derivative in the load at ``x``, the same in all units."""
    system, found = solver.system, solver.inertia.at(x)
    derivative = found.border.copy()
    # by a load of natural size; of a trivial state the equations do not feel it
    least = max(INSENSITIVE * system.stiffness_scale, ROUNDED * system.matrix_in_units(found.matrix).norm())
    if system.in_units(derivative, 1).norm() * solver.units.load < least:
        return 0.0
    force, motion = derivative.duplicate(), null_vector.duplicate()
    force.pointwiseMult(derivative, system.own_sizes)
    motion.pointwiseDivide(null_vector, system.own_sizes)
    return float(abs(force.dot(motion)) / (force.norm() * motion.norm()))


def is_fold(solver: BranchSolver, x: PETSc.Vec, null: list[PETSc.Vec]) -> bool:
    """Whether the load clearly does work on one of the null vectors."""
    force = solver.inertia.at(x).border.copy()
    work = max(abs(force.dot(v)) for v in null) * solver.units.load
    return work > FELT * solver.inertia.scale and max(coupling_of(solver, x, v) for v in null) > CLEARLY


@dataclass(frozen=True, eq=False)
class Candidate:
    """Where a singular state is expected."""

    x: PETSc.Vec
    slope: PETSc.Vec  # of the branch
    modes: list[PETSc.Vec]  # near zero: first those that vanish
    count: int  # number of these
    before: int  # the index before it, after it, and at it
    after: int
    negative: int
    length: float  # of the piece
    uneven: float = 1.0  # mean rate of these over the slowest

    @property
    def null(self) -> list[PETSc.Vec]:
        """The null vectors that are expected."""
        return self.modes[: self.count]


def of_crossing(piece: Piece, crossing: Crossing) -> Candidate:
    """Candidate of a crossing."""
    p, q = crossing.piece
    x, slope = piece.curve(p, q, crossing.s)
    values, own, W = _interpolated(piece, p, q, crossing.s)
    order = np.argsort(-np.linalg.norm((piece.moving @ crossing.vectors).T @ own, axis=0))
    before, after, count = crossing.before, crossing.after, crossing.vectors.shape[1]
    near = [i for i in order[count:] if abs(values[i]) < 0.01 * piece.solver.inertia.scale]
    modes = _modes(piece, W, own[:, [*order[:count], *near]])
    return Candidate(x, slope, modes, count, before, after, crossing.rest, q.s - p.s, crossing.uneven)


def of_turn(piece: Piece, p: Node, q: Node, s: float) -> Candidate:
    """Candidate at the place ``s`` where the load turns back: the state may have more symmetry than others."""
    x, slope = piece.curve(p, q, s)
    solver = piece.solver
    if solver.system.active_drifts(x) == solver.system.active_drifts(p.kept.x):
        far, (values, own, W) = p.far, _interpolated(piece, p, q, s)
    else:
        tangent = slope * (1.0 / solver.system.norm(slope))
        reduced = piece.condensation.at(x, tangent, piece.condensation.border(x))
        far, W, (values, own) = reduced.far, reduced.W, np.linalg.eigh(reduced.H)
    zero = abs(values) < NEARLY_ZERO * solver.inertia.scale
    zero[abs(values).argmin()] = True
    negative, modes = far + int((values[~zero] < 0).sum()), _modes(piece, W, own[:, zero])
    return Candidate(x, slope, modes, len(modes), p.index, p.index, negative, q.s - p.s)


def _interpolated(piece: Piece, p: Node, q: Node, s: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Eigenvalues and vectors of H, and W, between two nodes: modes near those of the state there."""
    t, (a, b) = (s - p.s) / (q.s - p.s), (node.kept.reduced for node in (p, q))
    values, own = np.linalg.eigh(cubic_value(piece.whole(p), piece.whole(q), t))
    return values, own, (1 - t) * a.W + t * b.W


def of_miss(piece: Piece, node: Node) -> Candidate:
    """Candidate near a state at which an eigenvalue is least, and not zero."""
    knot, index = node.kept, node.index
    values, own = np.linalg.eigh(knot.reduced.H)
    modes = _modes(piece, knot.reduced.W, own[:, [abs(values).argmin()]])
    return Candidate(knot.x, knot.slope, modes, 1, index, index, index, piece.length)


def _modes(piece: Piece, W: np.ndarray, vectors: np.ndarray) -> list[PETSc.Vec]:
    """Modes ``W v`` of vectors of H, orthonormal in the metric."""
    inertia = piece.solver.inertia
    modes = inertia.system.vectors(W @ vectors)
    orthonormalize(modes, inertia.metric)
    return modes


def solved(solver: BranchSolver, at: Candidate, *, fold: bool) -> SingularState | None:
    """The singular state of a candidate; None where there is none near by."""
    found = SingularSystem(solver, at.modes, at.count, fold=fold).solve(at.x)
    if found is not None and solver.system.distance(found.x, at.x) > STRAYED * at.length:
        return None
    return found


def special_point(piece: Piece, at: Candidate, found: SingularState, *, fold: bool) -> SpecialPoint:
    """Special point, a ``fold`` or a branch point, at the state ``found`` for the candidate ``at`` in a ``piece``."""
    solver, system, x, null = piece.solver, piece.solver.system, found.x, found.vectors
    tangent = _tangent(solver, at.slope, found, fold=fold)
    system.set_phase(x)
    index = Index(at.negative, system.phase.count + len(null) + piece.omissions)
    point = solver.point(x, piece.begin + piece.place(x), tangent, index=index)
    left = (0.0 if fold else at.uneven * load_uncertainty(solver, found)) + round_off(point.load, solver.units.load)
    coupling = max(coupling_of(solver, x, v) for v in null)
    nearby = complement(solver.inertia.metric, found.modes, null)
    special = SpecialPoint(FOLD if fold else BRANCH_POINT, point, at.before, at.after, left, null, nearby, coupling)
    special.unfolding = float("nan") if fold else found.size
    special.test_function = "slope" if fold else "mu"
    return special


def _tangent(solver: BranchSolver, slope: PETSc.Vec, found: SingularState, *, fold: bool) -> PETSc.Vec:
    """Unit tangent of the branch at a singular state, nearest to the slope that is expected."""
    system, row = solver.system, solver.row(slope)
    if fold and len(found.vectors) == 1:
        known = [found.vectors[0].copy()]
    elif found.directions:
        known = [max(found.directions, key=lambda d: abs(row.dot(d))).copy()]
    else:
        known = [found.response.copy(), *[v.copy() for v in found.vectors]]
        orthonormalize(known, system.metric)
    tangent = combine(known, np.array([(system.metric * v).dot(slope) for v in known]))
    tangent.scale(1.0 / system.norm(tangent))
    return tangent
