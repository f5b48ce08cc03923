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
17 (1980) 567-576) it is regular again, and they measure the imperfection: ``-eps`` above.

Newton's step is ``dx = s + dlam w + sum_j xi_j V_j``, which changes

    beta = c + dlam b + G xi,
    b_z      by    -(s.r_z + dlam q_z + sum_j xi_j V_j.r_z),
    G_zz     by    -(s.y_z + dlam (w.y_z + f_z) + sum_j xi_j V_j.y_z),

    r_z = d/dt S(x + t w, lam + t) V_z,   q_z = V_z . d^2/dt^2 F(x + t w, lam + t),
    y_z = d/dt S(x + t V_z, lam) V_z,     f_z = V_z . d/dt F_lam(x + t V_z, lam),

the derivatives by central differences, whose errors do not enter the converged result.

*In two parameters* solutions form curves.  The second one, ``t``, has a response ``w`` and a ``b``, too, and one more
equation is that of a plane across the curve.  Without it the null vector ``(dlam, dt, xi)`` of the rows is the tangent,
at a *cusp* of folds as well, where ``V.y = 0`` and neither parameter changes (Doedel, Keller & Kernevez, Int. J.
Bifurcation Chaos 1 (1991) 493-520).  Where ``b = 0`` for both parameters a fold ends on a branch point.  Along a curve
of branch points ``lam`` leads across it, and ``b_z`` of ``lam`` vanishes: in its derivative in ``t``, along ``w`` of
``t``, ``d/dt F_t(x + t w, lam + t)`` takes the place of that of ``F_lam``.  A parameter may turn or move the symmetry,
as that of a helix: the tangent has a part along the null vectors then.

*Divergence* under loads without a potential: S is not symmetric.  The border has ``M`` times the left null vectors as
columns and ``M`` times the right ones as rows; the left ones ``W`` of the transposed equations take the place of ``V``
in ``b``, ``f`` and ``q``, and ``S^t W`` that of ``S V`` in ``r`` and ``y`` (Govaerts, *Numerical Methods for
Bifurcations of Dynamical Equilibria*, SIAM 2000, chapters 3 and 4).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from petsc4py import PETSc

from rodfem.errors import ConvergenceError
from rodfem.fem.newton import TOLERANCE, Correction, Limits, newton
from rodfem.fem.state import Line
from rodfem.linalg.matrices import rounding
from rodfem.linalg.orthogonal import combine, orthonormalize
from rodfem.stability.inertia import Factored
from rodfem.stability.reduced_stiffness import DIFFERENCE, Bordered, bordered_of
from rodfem.tolerances import TINY

if TYPE_CHECKING:
    from rodfem.continuation.branch_solver import BranchSolver

FREE = 1e-8
"""Part of the equations, relative to the largest, below which they do not determine an unknown."""
SPLIT = 1.1
"""Times what eigenvalues, or the ``D`` of pairs, that vanish as one differ by that each may be off: to first order."""
SHARP = ((1.0, 4 / 3), (-1.0, -4 / 3), (2.0, -1 / 6), (-2.0, 1 / 6))
"""Steps of a central difference of the fourth order, and their weights, twice the step over them.

Over the steps once more these are the weights of a second difference, of what vanishes in the middle.
"""
Vectors = Sequence[PETSc.Vec]


@dataclass(frozen=True)
class Section:
    """Plane ``weight t + row . dx = 0`` across a curve of singular states; ``t = 0`` without a ``row`` (n,).

    Load and t are one in natural size, and zero at the state that :meth:`SingularSystem.solve` begins with.
    """

    line: Callable[[float], Line]  # of the load, at a t
    second: Callable[[float], Line]  # of t, at a load
    weight: float
    row: PETSc.Vec | None
    reach: float  # bound of the distance from there


@dataclass(frozen=True)
class Curve:
    """The curve of singular states through one of them, in the load and a second parameter ``t``."""

    last: np.ndarray  # (2,), of both the last change
    slope: np.ndarray  # (2,), with dx a tangent of any size
    dx: PETSc.Vec
    side: int  # sign of the defining function on the left of the tangent
    rates: np.ndarray  # (2,), derivatives of the mean of the eigenvalues that vanish
    work: np.ndarray  # (2, k), derivatives of the equations along the left null vectors
    part: float  # of the sum of its terms that the work of the tangent is; zero of round-off, and of a fold
    curvature: float  # derivative of the eigenvalue along a fold, the second one along the branch of a pitchfork
    modes: list[PETSc.Vec]  # of the border, the null vectors first
    left: list[PETSc.Vec]  # left null vectors
    negative: int  # other eigenvalues below zero; -1 where S is not symmetric


@dataclass(frozen=True)
class SingularState:
    """A solution of the singular system: a state ``x`` with null ``vectors`` of metric norm 1."""

    x: PETSc.Vec
    load: float
    vectors: list[PETSc.Vec]
    response: PETSc.Vec  # change of state with the load, the null vectors left out
    size: float  # of the unfolding parameters in the metric: an eigenvalue times an amplitude in radian
    noise: float  # round-off of that
    directions: list[PETSc.Vec]  # unit vectors along both branches that cross, of one null vector
    rate: float  # derivative of the eigenvalue along the response
    spread: float  # what several eigenvalues, whose mean vanishes, differ from that
    modes: list[PETSc.Vec]  # of the border, relaxed
    last: PETSc.Vec  # what Newton's method leaves of the state
    second: float  # the second parameter
    curve: Curve | None  # with two parameters


@dataclass(frozen=True)
class Linear:
    """The equations linearised at a state; ``y`` and ``f`` (parameters,) are sums over the null vectors.

    At a branch point ``r`` and ``q`` (k, parameters) are of each of them.
    """

    vectors: list[PETSc.Vec]  # s, a w for each parameter, V
    border: np.ndarray  # (m, 1 + parameters + m): c, b, G
    columns: list[PETSc.Vec]  # derivatives in the parameters
    Z: np.ndarray
    N: np.ndarray
    left: list[PETSc.Vec]
    y: PETSc.Vec
    f: np.ndarray
    r: list[PETSc.Vec]
    q: np.ndarray
    rows: np.ndarray  # (m + 1, 1 + parameters + m): their products with (1, share) are to vanish

    @property
    def V(self) -> list[PETSc.Vec]:
        """Modes of the border, relaxed."""
        return self.vectors[-len(self.border) :]

    @property
    def b(self) -> np.ndarray:
        """Work of the parameters on them."""
        return self.border[:, 1 : -len(self.border)]

    @property
    def G(self) -> np.ndarray:
        """Minus their reduced stiffness matrix."""
        return self.border[:, -len(self.border) :]


Step = tuple[PETSc.Vec, np.ndarray]
"""Newton's step of the state, and its share (parameters + m,) of parameters and modes."""


class SingularSystem:
    """The singular system of one mesh, at a ``fold`` or at a branch point, with a border of modes."""

    def __init__(self, solver: BranchSolver, modes: Vectors, count: int, *, fold: bool) -> None:
        """Border with ``modes``, of which the first ``count`` are to vanish; the ``solver`` has the mesh."""
        self.solver, self.system, self.inertia = solver, solver.system, solver.inertia
        self.fold, self.count = fold, count
        self._bordered, self._transposed = list[Bordered](), PETSc.Mat()
        self._section: Section | None = None
        self.border(modes)

    def border(self, modes: Vectors, left: Vectors = ()) -> None:
        """Border with these modes from now on; where S is not symmetric its columns are as many ``left`` ones."""
        self.phi = self._duals(modes)
        self.psi = self._duals(left) if left else self.phi
        self.Z = np.eye(len(modes), self.count)

    def _duals(self, vectors: Vectors) -> list[PETSc.Vec]:
        """M times vectors, made orthonormal."""
        own = [v.copy() for v in vectors]
        orthonormalize(own, self.inertia.metric)
        return [self.inertia.metric * v for v in own]

    def relaxed(self, x: PETSc.Vec) -> tuple[list[PETSc.Vec], list[PETSc.Vec], np.ndarray, Bordered]:
        """Modes of the border, left ones and G, by inverse iteration; factors of the transposed equations."""
        _, sides, G, _ = self._modes(self.inertia.at(x).matrix)
        return sides[0], sides[-1], G, self._bordered[-1]

    def solve(self, x: PETSc.Vec, section: Section | None = None) -> SingularState | None:
        """Newton's method from a state, on a curve in a ``section`` across it; None without a solution near by."""
        self._section = section
        start, x, t, moved, size = x, x.copy(), 0.0, 0.0, np.inf
        at: Linear | None = None
        step: Step | None = None

        def iteration(fresh: bool) -> Correction | None:
            nonlocal at, step, t, moved, size
            try:  # third derivatives, which cost most, serve again: on a curve where corrections shrink tenfold
                at = self._linear(x, t, at if (section and not fresh) or 100 * size**2 < TOLERANCE else None)
                dx, share = step = self._step(at, x - start, t)
            except (ConvergenceError, np.linalg.LinAlgError):
                return None
            size = self._size(dx, share)
            t += share[1] if section else 0.0
            x.axpy(1.0, dx)
            moved += size
            return Correction(moved, size)

        outcome = newton(iteration, Limits(reach=self._reach, lost=lambda: self._lost(x, at, step)))
        if not outcome.converged or at is None or step is None:
            return None
        step[0].scale(outcome.error if outcome.error < TOLERANCE else 1.0)  # what convergence leaves, or round-off
        return self._state(x, t, at, step)

    @property
    def _reach(self) -> float:
        """Distance, in the metric, beyond which a state is another one."""
        return 0.5 if self._section is None else self._section.reach

    def _size(self, dx: PETSc.Vec, share: np.ndarray) -> float:
        """Size of a step; on a curve in the metric of the state, and both parameters."""
        if self._section is None:
            return self.system.norm(dx)
        return float(np.sqrt(dx.dot(self.inertia.metric * dx) + (share[:2] ** 2).sum()))

    def _lost(self, x: PETSc.Vec, at: Linear | None, step: Step | None) -> bool:
        """Whether round-off of the eigenvalue at ``x`` moves the load by as much as a step to a branch point."""
        if self.fold or self._section is not None or at is None or step is None:
            return False
        noise = max(self.inertia.at(x).noise(combine(at.V, z)) for z in at.Z.T)
        return bool(abs(self.system.scalar(step[0]) * at.rows[-1, 1]) <= noise * self.count)

    def _matrix(self, x: PETSc.Vec, t: float) -> Factored:
        """S at a state and a second parameter."""
        self._take(t)
        return self.inertia.at(x)

    def _take(self, t: float) -> None:
        if self._section is not None:
            self.system.line = self._section.line(t)

    def images(self, x: PETSc.Vec, vectors: Vectors, t: float = 0.0) -> list[PETSc.Vec]:
        """``S^t W`` at a state near the last one, whose phase conditions stay, and ``F_lam``."""
        self._take(t)
        inertia, both = self.inertia, self.psi is self.phi
        own = np.stack([v.array_r for v in (*vectors, *([self.solver.axis] if both else []))], axis=1)
        found = self.system.vectors(inertia.images(x, own, transposed=not both))
        return found if both else [*found, inertia.force(x)]

    def _second(self, x: PETSc.Vec, t: float) -> PETSc.Vec:
        """Derivative of the equations in the second parameter."""
        assert self._section is not None
        there = x.copy()
        self.system.set_load(there, t)
        self.system.line = self._section.second(self.system.scalar(x))
        return self.inertia.force(there)

    def _modes(
        self, matrix: PETSc.Mat, columns: Vectors = ()
    ) -> tuple[list[PETSc.Vec], list[list[PETSc.Vec]], np.ndarray, int]:
        """Solutions for ``columns`` by new factors; V, with its left counterpart if S is not symmetric.

        Then the multipliers (m, columns + m) of both, and the number of other negative eigenvalues.
        """
        count, sides = len(columns), [(matrix, self.psi, self.phi)]
        if self.psi is not self.phi:
            sides.append((matrix.transpose(self._transposed), self.phi, self.psi))
            self._bordered = self._bordered or [Bordered(self.system, side, len(self.psi), None) for side, *_ in sides]
        else:
            self._bordered = [bordered_of(self.inertia, len(self.psi))]
        counts = [bordered.factor(*side) for bordered, side in zip(self._bordered, sides, strict=True)]
        solved, border = self._bordered[0].solve(columns)
        left = [bordered.solve()[0] for bordered in self._bordered[1:]]
        return solved[:count], [solved[count:], *left], border, counts[0]

    def _linear(self, x: PETSc.Vec, t: float, old: Linear | None = None, *, sharp: bool = False) -> Linear:
        """Factor the bordered matrix, and solve with it; derivatives of an ``old`` linearisation serve again."""
        system = self.system
        columns = [] if self._section is None or old else [self._second(x, t)]
        found = self._matrix(x, t)
        columns.insert(0, found.border.copy())
        residual = system.new_vector()
        system.at(x).residual(residual)
        forces = [-force for force in (residual, *([] if old else columns))]
        (s, *responses), sides, border, _ = self._modes(found.matrix, forces)
        V = sides[0]
        if old is not None:
            border = np.column_stack([border[:, 0], old.b, border[:, 1:]])
            at = replace(old, vectors=[s, *old.vectors[1 : -len(V)], *V], border=border)
        else:
            system.set_load(responses[0], 1.0)
            Z, N = self.split(border[:, -len(V) :])
            null, left = ([combine(side, z) for z in Z.T] for side in (V, sides[-1]))
            y, f = self._along_null(x, t, (null, left), sharp=sharp)
            r, q = self._along_load(x, t, responses[0], [] if self.fold else left)
            at = Linear([s, *responses, *V], border, columns, Z, N, left, y, f, r, q, border)
        return replace(at, rows=self._equations(at))

    def split(self, G: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The modes that are to vanish, and the others: eigenvectors of G, by what they have of the last ones."""
        m, k = self.Z.shape
        if k == m:
            return np.eye(m), np.zeros((m, 0))
        _, vectors = np.linalg.eigh((G + G.T) / 2)
        order = np.argsort(-np.linalg.norm(self.Z.T @ vectors, axis=0))
        return vectors[:, order[:k]], vectors[:, order[k:]]

    def _equations(self, at: Linear) -> np.ndarray:
        """The rows of the equations."""
        forces = (np.hstack([at.N, at.Z]).T if self.fold else at.N.T) @ at.border
        trace = np.array([v.dot(at.y) for v in at.vectors])
        trace[1 : 1 + len(at.f)] += at.f
        trace[0] -= np.trace(at.Z.T @ at.G @ at.Z)
        return np.vstack([forces, *([] if self.fold else [self._work(at)]), trace])

    def _along_null(
        self, x: PETSc.Vec, t: float, sides: tuple[Vectors, Vectors], *, sharp: bool
    ) -> tuple[PETSc.Vec, np.ndarray]:
        """Sums over the null vectors, and the left ones, the ``sides``, of ``y`` and of ``f`` (parameters,).

        They are central differences, of the fourth order if ``sharp``.
        """
        y, f = self.system.new_vector(), np.zeros(1 if self._section is None else 2)
        steps = SHARP if sharp else ((1.0, 1.0), (-1.0, -1.0))
        for v, left in zip(*sides, strict=True):
            for step, weight in steps:
                there, share = x + v * (step * DIFFERENCE), weight / (2 * DIFFERENCE)
                if self._section is not None:
                    f[1] += share * left.dot(self._second(there, t))
                image, force = self.images(there, [left], t)
                f[0] += share * left.dot(force)
                y.axpy(share, image)
        return y, f

    def _along_load(self, x: PETSc.Vec, t: float, w: PETSc.Vec, left: Vectors) -> tuple[list[PETSc.Vec], np.ndarray]:
        """``r`` of each of the ``left`` null vectors, and ``q``, by central differences along the response ``w``."""
        moved, one = w.copy(), 0.0 if self._section is None else 1.0  # in a section the natural size of the load
        self.system.set_load(moved, self.system.scalar(w) - one)
        h, r = DIFFERENCE / np.hypot(self.system.norm(moved), one), [self.system.new_vector() for _ in left]
        q = np.zeros((len(left), 1 if self._section is None else 2))
        for share in (0.5 / h, -0.5 / h) if left else ():
            there = x + w * float(np.copysign(h, share))
            if self._section is not None:
                second = self._second(there, t)
                q[:, 1] += [share * v.dot(second) for v in left]
            *parts, force = self.images(there, left, t)
            q[:, 0] += [share * v.dot(force) for v in left]
            for image, part in zip(r, parts, strict=True):
                image.axpy(share, part)
        return r, q

    def _work(self, at: Linear) -> np.ndarray:
        """Rows (k, 1 + parameters + m) of ``Z^t b = 0``."""
        rows = np.array([[v.dot(image) for v in at.vectors] for image in at.r])
        rows[:, 1 : 1 + at.q.shape[1]] += at.q
        rows[:, 0] -= at.Z.T @ at.b[:, 0]
        return rows

    def _step(self, at: Linear, moved: PETSc.Vec, t: float) -> Step:
        """Newton's step, from ``moved`` and ``t`` off where the section is."""
        m, k = at.Z.shape
        if self._section is not None:
            own = self._own(at)
            table = np.vstack([at.rows[m - k :], self._plane(at, self._section, moved, t)]) @ own
            size = np.maximum(abs(table[:, 1:]).max(axis=1), TINY)
            share = (own @ [1.0, *np.linalg.solve(table[:, 1:] / size[:, None], -table[:, 0] / size)])[1:]
        else:  # in natural units of eigenvalues and loads: what these do not determine, a free motion, stays as it is
            units, least = np.array([self.solver.units.load, *np.ones(m)]), np.full(m + 1, self.inertia.scale)
            least[m if self.fold else m - k : m] /= units[0]
            table = at.rows[:, 1:] * units
            size = np.maximum(least, abs(table).max(axis=1))
            share = units * np.linalg.lstsq(table / size[:, None], -at.rows[:, 0] / size, rcond=FREE)[0]
        self.Z = at.Z
        return combine(at.vectors, np.array([1.0, *share])), share

    def _own(self, at: Linear) -> np.ndarray:
        """Columns (3 + m, 3 + k) of ``s``, both parameters and the null vectors, which modes near by follow."""
        moved = at.N @ self.rest(at.N, at.G, -at.border[:, :3])
        return np.block([[np.eye(3, 3 + self.count)], [moved, at.Z]])

    def _plane(self, at: Linear, section: Section, moved: PETSc.Vec, t: float) -> np.ndarray:
        """Row of the equation of the section."""
        along = [0.0 if section.row is None else section.row.dot(v) for v in (moved, *at.vectors)]
        along[1] += along[0] + section.weight * t
        along[3] += section.weight
        return np.array(along[1:])

    def _state(self, x: PETSc.Vec, t: float, at: Linear, step: Step) -> SingularState:
        """The solution ``x``, ``t``, which the last step has led to."""
        (last, share), k = step, self.count
        changes = [1.0, *share]
        if self._section is not None:  # the derivatives so far are those of an iterate
            at, changes = self._linear(x, t, sharp=True), [1.0, *np.zeros(len(share))]
        matrix = self._matrix(x, t).matrix
        _, (modes, *_), *_ = self._modes(matrix)  # of this very state
        null = [combine(modes, z) for z in at.Z.T]
        # rounding errors of phi . F, independent and as large as those of phi . S x, a hundred times
        noise = 100.0 * max(rounding(matrix, v, x) for v in null) + 1e-15 * self.inertia.scale  # or all vanish
        curve = self.curve(at, (x, t, share), null, noise)
        soft = at.Z.T @ at.G @ at.Z
        response = combine([at.vectors[1], *at.V], np.array([1.0, *(at.N @ self.rest(at.N, at.G, -at.b[:, 0]))]))
        vectors = [v.copy() for v in null]
        orthonormalize(vectors, self.inertia.metric)
        parts = np.array([[wave.dot(v) for wave in self.inertia.waves(k)] for v in vectors])
        basis, seen = np.linalg.qr(parts)  # the same on any mesh and number of ranks: the wave i sees none after i
        return SingularState(
            x,
            self.system.scalar(x),
            [combine(vectors, z * np.copysign(1.0, r)) for z, r in zip(basis.T, np.diag(seen), strict=True)],
            response,
            float(np.linalg.norm(at.Z.T @ (at.border @ changes))),
            noise,
            self._directions(response, null, at) if curve is None else [],
            at.rows[-1, 1] / k,
            float(np.linalg.norm(soft - np.trace(soft) / k * np.eye(k), 2)),
            modes,
            last,
            t,
            curve,
        )

    def curve(
        self, at: Linear, found: tuple[PETSc.Vec, float, np.ndarray], null: Vectors, noise: float
    ) -> Curve | None:
        """The curve through a solution, its state, t and the share of the last step; none of a system of points."""
        return None

    def rest(self, N: np.ndarray, G: np.ndarray, forces: np.ndarray) -> np.ndarray:
        """Amplitudes (m - k, ...) of modes near by under ``forces`` (m, ...); zero where nothing holds a mode."""
        G = N.T @ G @ N
        values, vectors = np.linalg.eigh((G + G.T) / 2)
        stiff = abs(values) > FREE * self.inertia.scale
        return np.asarray((vectors[:, stiff] / values[stiff]) @ vectors[:, stiff].T @ N.T @ forces)

    def _directions(self, w: PETSc.Vec, null: list[PETSc.Vec], at: Linear) -> list[PETSc.Vec]:
        """Unit directions ``xi V + dlam (w, 1)`` with ``a xi^2 + 2 b xi dlam + c dlam^2 = 0``, the reduced equation."""
        if self.fold or len(null) > 1:
            return []
        c, (b, a) = at.rows[-2, 1], (at.rows[-2:, 2:] @ at.Z[:, 0]).tolist()
        root = np.sqrt(max(b * b - a * c, 0.0))
        pivot = -(b + np.copysign(root, b))
        # no cancellation: the two roots xi/dlam have the product c/a
        out = [combine([null[0], w], np.array(each)) for each in ((pivot, a), (c, pivot)) if any(each)]
        return [d / self.system.norm(d) for d in out]


def load_uncertainty(solver: BranchSolver, found: SingularState) -> float:
    """Uncertainty of the load of a branch point, by round-off and by what several eigenvalues differ."""
    matrix = solver.inertia.at(found.x)
    doubt = max(matrix.noise(v) for v in found.vectors) + SPLIT * found.spread
    return abs(solver.system.scalar(found.last)) + doubt / max(abs(found.rate), TINY)
