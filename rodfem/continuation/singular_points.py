r"""Folds and branch points of a branch: from a crossing to the solution of its singular system, with all that it tells.

With ``phi`` the null vector and ``F_lam`` the derivative of the equations in the load, ``phi . F_lam != 0`` at a fold and
``= 0`` at a branch point (Keller 1977).  Where that is nearly zero the systems of both are solved: a branch point whose
unfolding parameters are round-off is one, and one with others was taken apart by an imperfection.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.branch import SpecialPoint
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.crossings import Crossing, Node
from rodfem.continuation.kinds import BRANCH_POINT, FOLD
from rodfem.continuation.piece import Piece
from rodfem.continuation.singular import SingularState, SingularSystem
from rodfem.errors import SMALLER_STEPS
from rodfem.linalg.matrices import EPS
from rodfem.linalg.orthogonal import combine, orthonormalize
from rodfem.stability.inertia import Index
from rodfem.stability.reduced_stiffness import Condensation, ReducedStiffness
from rodfem.tolerances import round_off

COUPLED = 1e-5
"""A fold has a cosine between null vector and load derivative above this, a branch point below."""
CLEARLY = 1e-3
"""Above this the point is a fold before anything is solved for."""
LEVEL = 1e-3
"""Slope of the load, relative to its span, below which it is taken for zero."""
INSENSITIVE, ROUNDED = 1e-10, 10.0 * EPS
"""A derivative of the equations in the load smaller than this, relative to bending, or to the Jacobian, is zero."""
NEARBY = 1e-2
"""Eigenvalue, over the lowest bending one, of modes that the border of a singular system has beside the null vectors."""
ZERO = 1e-6
"""Eigenvalue, over the lowest bending one, that is zero where the load turns back and an eigenvalue touches zero."""
STRAYED = 0.3
"""Distance of a singular state from where it is expected, over the piece, at which it is another one."""


def coupling_of(solver: BranchSolver, x: PETSc.Vec, null_vector: PETSc.Vec) -> float:
    """Cosine between a null vector and ``F_lam``, the derivative of the equations in the load at ``x``."""
    system = solver.system
    matrix = system.at(x).jacobian(solver.axis)
    derivative = matrix * solver.axis
    system.set_load(derivative, 0.0)
    derivative, null_vector = system.in_units(derivative, 1), system.in_units(null_vector, -1)
    # by a load of natural size; of a trivial state the equations do not feel it
    least = max(INSENSITIVE * system.stiffness_scale, ROUNDED * system.matrix_in_units(matrix).norm())
    if derivative.norm() * solver.units.load < least:
        return 0.0
    return float(abs(derivative.dot(null_vector)) / (derivative.norm() * null_vector.norm()))


@dataclass(frozen=True, eq=False)
class Candidate:
    """Where a singular state is expected: ``x``, ``slope`` of the branch, modes near zero, and those that vanish.

    These are the combinations ``critical`` (m, k) of the ``modes``.  The index is ``before`` and ``after`` it,
    where ``negative`` eigenvalues are left, and ``still`` are zero all along, and ``length`` is that of the piece.  At a ``crossing`` eigenvalues pass zero;
    otherwise they touch it.
    """

    x: PETSc.Vec
    slope: PETSc.Vec
    modes: list[PETSc.Vec]
    critical: np.ndarray
    before: int
    after: int
    negative: int
    length: float
    still: int = 0
    crossing: bool = True

    @property
    def null(self) -> list[PETSc.Vec]:
        """The null vectors that are expected."""
        return [combine(self.modes, z) for z in self.critical.T]


def of_crossing(piece: Piece, crossing: Crossing) -> Candidate:
    """Candidate of a crossing."""
    p, q = crossing.piece
    x, slope = piece.curve(p, q, crossing.s)
    reduced = piece.condensation.at(x, _unit(piece.solver, slope), piece.phi)
    values, own = np.linalg.eigh(reduced.H)
    order, count = np.argsort(-np.linalg.norm((piece.moving @ crossing.vectors).T @ own, axis=0)), crossing.vectors.shape[1]
    near = [i for i in order[count:] if abs(values[i]) < NEARBY * piece.solver.inertia.scale]
    modes = _modes(piece.condensation, reduced, own[:, [*order[:count], *near]])
    critical = np.eye(len(modes))[:, :count]
    negative = crossing.before - (count + crossing.before - crossing.after) // 2
    return Candidate(x, slope, modes, critical, crossing.before, crossing.after, negative, q.s - p.s)


def of_turn(piece: Piece, p: Node, q: Node, s: float) -> Candidate:
    """Candidate where the load turns back between two nodes, and an eigenvalue may touch zero.

    The state may be one of more symmetry than its neighbours: its modes are its own.
    """
    condensation, (x, slope) = piece.condensation, piece.curve(p, q, s)
    reduced = condensation.at(x, _unit(piece.solver, slope), condensation.border(x))
    values, own = np.linalg.eigh(reduced.H)
    zero = abs(values) < ZERO * piece.solver.inertia.scale
    zero[abs(values).argmin()] = True
    negative = reduced.far + int((values[~zero] < 0).sum())
    modes = _modes(condensation, reduced, own[:, zero])
    return Candidate(x, slope, modes, np.eye(len(modes)), p.index, p.index, negative, q.s - p.s, crossing=False)


def _unit(solver: BranchSolver, direction: PETSc.Vec) -> PETSc.Vec:
    return direction * (1.0 / solver.system.norm(direction))


def _modes(condensation: Condensation, reduced: ReducedStiffness, vectors: np.ndarray) -> list[PETSc.Vec]:
    """Modes of vectors of H, orthonormal in the metric."""
    modes = [condensation.vector(reduced.W @ v) for v in vectors.T]
    orthonormalize(modes, condensation.inertia.metric)
    return modes


def solved(solver: BranchSolver, at: Candidate, *, fold: bool) -> SingularState | None:
    """The singular state of a candidate; None where there is none near by."""
    critical = at.critical
    if at.crossing and abs(at.after - at.before) < critical.shape[1]:  # opposite ones have no trace that vanishes
        critical = critical[:, :1]
    found = SingularSystem(solver, at.modes, critical, fold=fold).solve(at.x)
    if found is not None and solver.system.distance(found.x, at.x) > STRAYED * at.length:
        return None
    return found


def special_point(piece: Piece, at: Candidate, found: SingularState, *, fold: bool) -> SpecialPoint:
    """Special point at a singular state, with its index, null vectors and tangent."""
    solver, system = piece.solver, piece.solver.system
    x, null = found.x, found.vectors
    if len(at.critical.T) > len(null):
        null = at.null
        orthonormalize(null, solver.inertia.metric)
    count = len(null)
    tangent = _tangent(solver, at, found, fold=fold)
    system.set_phase(x)
    index = Index(at.negative, system.phase.count + count + at.still)
    point = solver.point(x, piece.begin + piece.place(x), tangent, index=index)
    matrix = solver.inertia.at(x)
    doubt = max(matrix.noise(v) for v in null)
    left = found.moved + (0.0 if fold else (doubt + found.spread) / abs(found.rate) if found.rate else 0.0)
    special = SpecialPoint(
        FOLD if fold else BRANCH_POINT,
        point,
        at.before,
        at.after,
        left + round_off(point.load, solver.units.load),
        null,
        max(coupling_of(solver, x, v) for v in null),
    )
    special.unfolding = float("nan") if fold else found.size
    special.test_function = "slope" if fold else "mu"
    return special


def _tangent(solver: BranchSolver, at: Candidate, found: SingularState, *, fold: bool) -> PETSc.Vec:
    """Unit tangent of the branch at a singular state, nearest to the slope that is expected."""
    system, row = solver.system, solver.row(at.slope)
    if fold and len(found.vectors) == 1:
        known = [found.vectors[0].copy()]
    elif found.directions:
        known = [max(found.directions, key=lambda d: abs(row.dot(d))).copy()]
    else:
        known = [found.response.copy(), *[v.copy() for v in found.vectors]]
        orthonormalize(known, system.metric)
    tangent = combine(known, np.array([(system.metric * v).dot(at.slope) for v in known]))
    tangent.scale(1.0 / system.norm(tangent))
    return tangent


def missing(a_load: float, b_load: float) -> str:
    """Sentence on a crossing between two loads that no singular state was found for."""
    return f"A special point between loads {a_load:.8g} and {b_load:.8g} is missing: no singular state; {SMALLER_STEPS}."


