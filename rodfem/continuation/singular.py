r"""The singular system: folds and branch points, perfect or not, as regular solutions of one set of equations.

Near a singular state ``m`` modes ``psi = M V`` of the saddle matrix S vanish, or nearly.  With them as a border,

    ( S       psi )  ( V   w   s )     ( 0   -F_lam   -F )
    ( psi^t   0   )  ( G   b   c )  =  ( I    0        0 ),      so that   b_i = -V_i . F_lam,

G (m, m) is minus the reduced stiffness matrix of :mod:`rodfem.stability.reduced_stiffness`.  Columns Z (m, k) span the
k modes that are to vanish together, and N the others, which are near by.  What is solved for is

    tr Z^t G Z = 0        an eigenvalue is zero, or k of them are,
    N^t beta = 0          the state is an equilibrium but for forces beta_i psi_i,
    Z^t beta = 0          at a fold,
    Z^t b = 0             at a branch point, where the load does no work on the null vectors, and beta is left over.

An imperfection, however small, takes a branch point apart: of ``A xi^3 + B lam xi + eps = 0`` no point is singular
*and* has a derivative in the load that vanishes.  With the unfolding parameters ``beta`` (Moore, SIAM J. Numer. Anal.
17 (1980) 567-576) it is regular again, and they measure the imperfection: ``-eps`` above, round-off at a branch point.

Newton's step is ``dx = s + dlam w + sum_j xi_j V_j``, which changes

    beta = c + dlam b + G xi,
    b_z      by    -(s.r_z + dlam q_z + sum_j xi_j V_j.r_z),
    G_zz     by    -(s.y_z + dlam V_z.r_z + sum_j xi_j V_j.y_z),

    r_z = d/dt S(x + t w, lam + t) V_z,   y_z = d/dt S(x + t V_z, lam) V_z,   q_z = V_z . d^2/dt^2 F(x + t w, lam + t),

the derivatives by central differences, whose errors do not enter the converged result.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.branch_solver import BranchSolver
from rodfem.errors import ConvergenceError
from rodfem.fem.newton import STALLED, TOLERANCE
from rodfem.linalg.matrices import rounding
from rodfem.linalg.orthogonal import combine, orthonormalize
from rodfem.stability.bordered import Bordered
from rodfem.stability.reduced_stiffness import DIFFERENCE
from rodfem.tolerances import TINY

ITERATIONS = 10
"""Newton steps."""
FARTHEST = 0.5
"""A point farther than this from where it is expected, in the metric, is another one."""
NOISE = 100.0
"""Times the rounding errors of ``phi . F``, independent and as large as those of ``phi . S x``, up to which ``beta`` is
round-off."""
LEAST = 1e-15
"""Round-off of ``beta`` where all of these vanish, over the lowest bending eigenvalue."""
FREE = 1e-8
"""Part of the equations, relative to the largest, below which they do not determine an unknown."""


@dataclass(frozen=True)
class SingularState:
    """A solution of the singular system: state ``x``, ``load``, and the null ``vectors``, of metric norm 1.

    Relative to the metric, as eigenvalues are: the unfolding parameters ``beta`` (k,) are an eigenvalue times an
    amplitude in radian, ``noise`` is the round-off of their size.  ``directions`` are those of the two branches that
    cross at a branch point with one null vector, unit vectors.  ``response`` is the change of state with the load, the
    null vectors left out, ``rate`` the derivative of the eigenvalue along it, and ``spread`` what several eigenvalues,
    whose mean vanishes, differ from that.  ``modes`` are all of the border, relaxed, ``others`` the
    eigenvalues of those that do not vanish; ``last`` is what Newton's
    method leaves of the state.
    """

    x: PETSc.Vec
    load: float
    vectors: list[PETSc.Vec]
    response: PETSc.Vec
    beta: np.ndarray
    noise: float
    directions: list[PETSc.Vec]
    rate: float
    spread: float
    modes: list[PETSc.Vec]
    others: np.ndarray
    last: PETSc.Vec

    @property
    def size(self) -> float:
        """Size of the unfolding parameters."""
        return float(np.linalg.norm(self.beta))


@dataclass(frozen=True)
class _Made:
    """What a Newton step finds on its way: as in :class:`SingularState`, and the ``table`` of the reduced equation."""

    null: list[PETSc.Vec]
    response: PETSc.Vec
    beta: np.ndarray
    table: np.ndarray
    rate: float
    spread: float
    others: np.ndarray


class SingularSystem:
    """The singular system of one mesh, with a border of so many modes."""

    def __init__(self, solver: BranchSolver, modes: list[PETSc.Vec], critical: np.ndarray, *, fold: bool) -> None:
        """Border with M-orthonormal ``modes``, of which the combinations ``critical`` (m, k) are to vanish.

        At a ``fold``, or at a branch point; the ``solver`` has the mesh.
        """
        self.solver, self.system, self.inertia = solver, solver.system, solver.inertia
        self.fold, self.Z = fold, critical
        self.psi = [self.inertia.metric * v for v in modes]
        self._bordered: Bordered | None = None

    def solve(self, x: PETSc.Vec) -> SingularState | None:
        """Newton's method from a state; None where there is no solution near by."""
        system, x = self.system, x.copy()
        moved, before = 0.0, np.inf
        for _ in range(ITERATIONS):
            try:
                step, made = self._step(x)
            except (ConvergenceError, np.linalg.LinAlgError):
                return None
            size = system.norm(step)
            moved += size
            if not np.isfinite(size) or moved > FARTHEST:
                return None
            x.axpy(1.0, step)
            if size < TOLERANCE or (size > 0.5 * before and (size < STALLED or self._lost(x, step, made))):
                step.scale(size if size < TOLERANCE else 1.0)  # what quadratic convergence leaves, or round-off
                return self._state(x, step, made)
            before = size
        return None

    def _lost(self, x: PETSc.Vec, step: PETSc.Vec, made: _Made) -> bool:
        """Whether round-off of the eigenvalue at ``x`` moves the load by as much as a ``step`` to a branch point."""
        found = self.inertia.at(x)
        noise = max(found.noise(v) for v in made.null)
        return not self.fold and abs(self.system.scalar(step) * made.rate) <= noise

    def _step(self, x: PETSc.Vec) -> tuple[PETSc.Vec, _Made]:
        """Newton's step, and what else is known then."""
        system, m = self.system, len(self.psi)
        found = self.inertia.at(x)
        if self._bordered is None:
            self._bordered = Bordered(system, found.matrix, m, self.inertia.constraints)
        bordered = self._bordered
        bordered.factor(found.matrix, self.psi)
        border = found.border.copy()
        equations = system.new_vector()
        system.at(x).residual(equations)
        s, c = bordered.solve(-equations, np.zeros(m))
        w, b = bordered.solve(-border, np.zeros(m))
        solved = [bordered.solve(None, e) for e in np.eye(m)]
        V, G = [vector for vector, _ in solved], np.array([row for _, row in solved])
        system.set_load(w, 1.0)
        Z, N = self._split(G)
        null = [combine(V, z) for z in Z.T]
        r, bend = self._differences(x, w, DIFFERENCE / system.norm(w), null)
        y = [self._differences(x, v, DIFFERENCE, [v])[0][0] for v in null]
        rows, right = [], []
        for n in np.eye(m) if self.fold else N.T:
            rows.append([n @ b, *(n @ G)])
            right.append(-(n @ c))
        for z, v, image in () if self.fold else zip(Z.T, null, r, strict=True):
            rows.append([bend.dot(v), *(u.dot(image) for u in V)])
            right.append(z @ b - s.dot(image))
        rate = sum(v.dot(image) for v, image in zip(null, r, strict=True))
        rows.append([rate, *(sum(u.dot(image) for image in y) for u in V)])
        right.append(np.trace(Z.T @ G @ Z) - sum(s.dot(image) for image in y))
        # in natural units of eigenvalues and loads: what these do not determine, a free motion, stays as it is
        one, scale = self.solver.units.load, self.inertia.scale
        units = np.array([one, *np.ones(m)])
        size = np.full(m + 1, scale)
        size[m if self.fold else m - Z.shape[1] : m] /= one
        size = np.maximum(size, abs(np.array(rows) * units).max(axis=1))
        table, known = np.array(rows) * units / size[:, None], np.array(right) / size
        share = units * np.linalg.lstsq(table, known, rcond=FREE)[0]
        step = combine([s, w, *V], np.array([1.0, *share]))
        inner = Z.T @ G @ Z
        made = _Made(
            null,
            combine([w, *V], np.array([1.0, *(N @ _relaxed(N.T @ G @ N, -(N.T @ b)))])),
            Z.T @ (c + share[0] * b + G @ share[1:]),
            np.array([[bend.dot(null[0]), null[0].dot(r[0])], [null[0].dot(r[0]), null[0].dot(y[0])]]),
            rate / len(null),
            float(np.linalg.norm(inner - np.trace(inner) / len(null) * np.eye(len(null)), 2)),
            np.linalg.eigvalsh(N.T @ (G + G.T) @ N) / 2,
        )
        self.Z = Z
        return step, made

    def _split(self, G: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The modes that are to vanish, and the others: eigenvectors of G, by what they have of the last ones."""
        m, k = self.Z.shape
        if k == m:
            return np.eye(m), np.zeros((m, 0))
        _, vectors = np.linalg.eigh((G + G.T) / 2)
        order = np.argsort(-np.linalg.norm(self.Z.T @ vectors, axis=0))
        return vectors[:, order[:k]], vectors[:, order[k:]]

    def _state(self, x: PETSc.Vec, step: PETSc.Vec, made: _Made) -> SingularState:
        matrix, bordered = self.inertia.at(x).matrix, self._bordered
        assert bordered is not None
        bordered.factor(matrix, self.psi)
        modes = [bordered.solve(None, e)[0] for e in np.eye(len(self.psi))]  # of this very state
        null = [combine(modes, z) for z in self.Z.T]
        noise = NOISE * max(rounding(matrix, v, x) for v in null) + LEAST * self.inertia.scale
        simple = len(null) == 1 and not self.fold
        directions = self._directions(made.response, null[0], made.table) if simple else []
        orthonormalize(null, self.inertia.metric)
        seed = self.inertia.seed(0)
        for v in null:  # of its two directions always the same
            v.scale(1.0 if seed.dot(v) >= 0 else -1.0)
        load = self.system.scalar(x)
        rest = made.rate, made.spread, modes, made.others, step
        return SingularState(x, load, null, made.response, made.beta, noise, directions, *rest)

    def _directions(self, w: PETSc.Vec, v: PETSc.Vec, table: np.ndarray) -> list[PETSc.Vec]:
        """Unit directions ``xi V + dlam (w, 1)`` with ``a xi^2 + 2 b xi dlam + c dlam^2 = 0``, the reduced equation."""
        (c, b), (_, a) = table
        root = np.sqrt(max(b * b - a * c, 0.0))
        pivot = -(b + np.copysign(root, b))
        out = []
        for xi, dlam in ((pivot, a), (c, pivot)):  # no cancellation: the two roots xi/dlam have the product c/a
            if xi or dlam:
                d = combine([v, w], np.array([xi, dlam]))
                out.append(d / self.system.norm(d))
        return out

    def _differences(
        self, x: PETSc.Vec, direction: PETSc.Vec, h: float, vectors: list[PETSc.Vec]
    ) -> tuple[list[PETSc.Vec], PETSc.Vec]:
        """Derivatives of ``S v``, and of ``S w + F_lam`` with that direction w itself, along it at ``x``."""
        system, inertia = self.system, self.inertia
        out, bend = [system.new_vector() for _ in vectors], system.new_vector()
        for sign in (1.0, -1.0):
            beside = inertia.at(x + direction * (sign * h))
            for image, v in zip(out, vectors, strict=True):
                image.axpy(sign / (2 * h), beside.matrix * v)
            bend.axpy(sign / (2 * h), beside.matrix * direction)
            bend.axpy(sign / (2 * h), beside.border)
        system.set_load(bend, 0.0)
        return out, bend


def load_uncertainty(solver: BranchSolver, found: SingularState) -> float:
    """Uncertainty of the load of a branch point, by round-off and by what several eigenvalues differ."""
    matrix = solver.inertia.at(found.x)
    doubt = max(matrix.noise(v) for v in found.vectors) + found.spread
    moved = abs(solver.system.scalar(found.last))
    return moved + doubt / max(abs(found.rate), TINY)


def _relaxed(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Amplitudes of modes near by under forces, those that nothing holds left at rest."""
    return np.linalg.lstsq(matrix, right, rcond=FREE)[0] if len(right) else right
