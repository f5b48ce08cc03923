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
    G_zz     by    -(s.y_z + dlam (w.y_z + f_z) + sum_j xi_j V_j.y_z),

    r_z = d/dt S(x + t w, lam + t) V_z,   q_z = V_z . d^2/dt^2 F(x + t w, lam + t),
    y_z = d/dt S(x + t V_z, lam) V_z,     f_z = V_z . d/dt F_lam(x + t V_z, lam),

the derivatives by central differences, whose errors do not enter the converged result.

*In two parameters* solutions form curves.  The second parameter ``t`` is one more column: its response ``w`` and its
``b`` are solutions with the same factors and another right-hand side.  One more equation is that of a plane across the
curve.  Without it the rows have a null vector ``(dlam, dt, xi)``, which is the tangent.  For folds they are regular
also at a *cusp*, where ``V.y = 0`` and neither parameter changes (Doedel, Keller & Kernevez, Int. J. Bifurcation Chaos
1 (1991) 493-520); but not where ``b = 0`` for both parameters: there the fold ends on a branch point.  Along a curve of
branch points ``lam`` leads across it, and ``b_z`` changes by minus the rate of the eigenvalue, times ``xi``: because of
the symmetry ``s`` and ``w`` have no part along the null vectors.  No difference is taken in a parameter, which next to
its bounds may make no sense.

*Divergence* under loads without a potential: S is not symmetric.  The columns of the border are ``M`` times the left
null vectors, its rows ``M`` times the right ones; the left ones ``W`` of the transposed equations take the place of
``V`` in ``b``, ``f`` and ``q``, and ``S^t W`` that of ``S V`` in ``r`` and ``y`` (Govaerts, *Numerical Methods for
Bifurcations of Dynamical Equilibria*, SIAM 2000, chapters 3 and 4).  No square root appears where divergence meets
flutter, a double zero eigenvalue with one null vector: S is as singular there as elsewhere.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.branch_solver import BranchSolver
from rodfem.errors import ConvergenceError
from rodfem.fem.newton import TOLERANCE, Correction, Limits, newton
from rodfem.fem.state import Line
from rodfem.linalg.matrices import rounding
from rodfem.linalg.orthogonal import combine, orthonormalize
from rodfem.stability.bordered import Bordered
from rodfem.stability.inertia import Factored
from rodfem.stability.reduced_stiffness import DIFFERENCE
from rodfem.tolerances import TINY

FARTHEST = 0.5
"""A point farther than this from where it is expected, in the metric, is another one."""
NOISE = 100.0
"""Times the rounding errors of ``phi . F``, independent and as large as those of ``phi . S x``, up to which ``beta`` is
round-off."""
LEAST = 1e-15
"""Round-off of ``beta`` where all of these vanish, over the lowest bending eigenvalue."""
Vectors = Sequence[PETSc.Vec]
FREE = 1e-8
"""Part of the equations, relative to the largest, below which they do not determine an unknown."""


@dataclass(frozen=True)
class Section:
    """Plane across a curve of singular states, in the space of the state, the load and a second parameter ``t``.

    The load of a state stands for what is on the ``line`` of t, and t for what is on the ``second`` line of the load;
    both are one in natural size, and zero at the state that :meth:`SingularSystem.solve` begins with.  The plane
    through it is ``weight t + row . dx = 0``, and ``t = 0`` without a ``row`` (n,).  ``reach`` bounds the distance.
    """

    line: Callable[[float], Line]
    second: Callable[[float], Line]
    weight: float
    row: PETSc.Vec | None
    reach: float


@dataclass(frozen=True)
class Curve:
    """The curve of singular states through one of them, in the load and a second parameter ``t``.

    Both changed by ``last`` (2,) at last.  A tangent, of any size, is ``slope`` (2,) in both and ``dx`` in the state;
    the defining function grows on its ``side``, -1 or 1.  Derivatives in both are ``rates`` (2,) of the mean of the
    eigenvalues that vanish and ``work`` (2, k) of the equations along the left null vectors; that of the tangent is a
    ``part`` of the sum of its terms, zero where it is round-off, and of a fold.  ``curvature`` is that of the
    eigenvalue along the first null vector.  Of the ``modes`` of the border the null vectors are first, ``left`` are the
    left ones.  ``negative`` counts the other eigenvalues below zero, and is -1 where S is not symmetric.
    """

    last: np.ndarray
    slope: np.ndarray
    dx: PETSc.Vec
    side: int
    rates: np.ndarray
    work: np.ndarray
    part: float
    curvature: float
    modes: list[PETSc.Vec]
    left: list[PETSc.Vec]
    negative: int


@dataclass(frozen=True)
class SingularState:
    """A solution of the singular system: state ``x``, ``load``, and the null ``vectors``, of metric norm 1.

    Relative to the metric, as eigenvalues are: the unfolding parameters ``beta`` (k,) are an eigenvalue times an
    amplitude in radian, ``noise`` is the round-off of their size.  ``directions`` are those of the two branches that
    cross at a branch point with one null vector, unit vectors.  ``response`` is the change of state with the load, the
    null vectors left out, ``rate`` the derivative of the eigenvalue along it, and ``spread`` what several eigenvalues,
    whose mean vanishes, differ from that.  ``modes`` are all of the border, relaxed, ``others`` the eigenvalues of
    those that do not vanish; ``last`` is what Newton's method leaves of the state.  With two parameters ``second`` is
    the other one, and it is on a ``curve``.
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
    second: float
    curve: Curve | None

    @property
    def size(self) -> float:
        """Size of the unfolding parameters."""
        return float(np.linalg.norm(self.beta))


@dataclass(frozen=True)
class _Linear:
    """Solutions of the bordered equations at a state: (V, G), (s, c), a (w, b) for each parameter's column.

    Columns ``Z`` (m, k) and ``N`` (m, m - k) of combinations are of the modes that are to vanish and of the others.  Of
    the former are the ``left`` null vectors, and the sums ``y`` and ``f`` (parameters,).
    """

    V: list[PETSc.Vec]
    G: np.ndarray
    s: PETSc.Vec
    c: np.ndarray
    columns: list[PETSc.Vec]
    w: list[PETSc.Vec]
    b: np.ndarray
    Z: np.ndarray
    N: np.ndarray
    left: list[PETSc.Vec]
    y: PETSc.Vec
    f: np.ndarray


@dataclass(frozen=True)
class _Step:
    """Newton's step ``dx``, ``dt``: the ``share`` (parameters + m,) of responses and modes, by ``rows`` of them."""

    dx: PETSc.Vec
    dt: float
    share: np.ndarray
    rows: np.ndarray


class SingularSystem:
    """The singular system of one mesh, with a border of so many modes."""

    def __init__(self, solver: BranchSolver, modes: Vectors, critical: np.ndarray, *, fold: bool) -> None:
        """Border with ``modes``, made orthonormal in M, of which the combinations ``critical`` (m, k) are to vanish.

        At a ``fold``, or at a branch point; the ``solver`` has the mesh.
        """
        self.solver, self.system = solver, solver.system
        self.inertia = solver.inertia
        self.fold, self.Z = fold, critical
        self._bordered, self._transposed = list[Bordered](), PETSc.Mat()
        self._section: Section | None = None
        self.border(modes)

    def border(self, modes: Vectors, left: Vectors = ()) -> None:
        """Border with these modes from now on; where S is not symmetric its columns are as many ``left`` ones."""
        self.phi = self._duals(modes)
        self.psi = self._duals(left) if left else self.phi

    def _duals(self, vectors: Vectors) -> list[PETSc.Vec]:
        """M times vectors, made orthonormal."""
        own = [v.copy() for v in vectors]
        orthonormalize(own, self.inertia.metric)
        return [self.inertia.metric * v for v in own]

    def relaxed(self, x: PETSc.Vec) -> tuple[list[PETSc.Vec], list[PETSc.Vec]]:
        """Modes of the border and left ones, relaxed at a state: a step of inverse iteration."""
        self._factor(self.inertia.at(x).matrix)
        sides = [self._modes(bordered)[0] for bordered in self._bordered]
        return sides[0], sides[-1]

    def solve(self, x: PETSc.Vec, section: Section | None = None) -> SingularState | None:
        """Newton's method from a state, on a curve in a ``section`` across it; None where there is no solution near by.

        With a section the load in ``x`` is zero, and the line of the system's parameters changes.
        """
        found = self._newton(x, section)
        return None if found is None else self._state(*found)

    def place(self, x: PETSc.Vec, section: Section) -> tuple[PETSc.Vec, np.ndarray, np.ndarray] | None:
        """The state of the same solution, both parameters (2,) and their last changes (2,)."""
        found = self._newton(x, section)
        if found is None:
            return None
        x, t, _, step = found
        return x, np.array([self.system.scalar(x), t]), step.share[:2]

    def _newton(self, x: PETSc.Vec, section: Section | None) -> tuple[PETSc.Vec, float, _Linear, _Step] | None:
        """The solution, its second parameter, and the last step, as it was linearised."""
        self._section = section
        start, x, t, moved = x, x.copy(), 0.0, 0.0
        at: _Linear | None = None
        step: _Step | None = None

        def iteration(fresh: bool) -> Correction | None:
            nonlocal at, step, t, moved
            try:  # on a curve third derivatives, which cost most, serve again where corrections shrink tenfold
                at = self._linear(x, t, at if section and not fresh else None)
                step = self._step(at, self._equations(x, at), x - start, t)
            except (ConvergenceError, np.linalg.LinAlgError):
                return None
            size = self._length(step)
            x.axpy(1.0, step.dx)
            t += step.dt
            moved += size
            return Correction(moved, size)

        reach = section.reach if section else FARTHEST
        outcome = newton(iteration, Limits(reach=reach, lost=lambda: self._lost(x, at, step)))
        if not outcome.converged or at is None or step is None:
            return None
        step.dx.scale(outcome.error if outcome.error < TOLERANCE else 1.0)  # what convergence leaves, or round-off
        return x, t, at, step

    def _lost(self, x: PETSc.Vec, at: _Linear | None, step: _Step | None) -> bool:
        """Whether round-off of the eigenvalue at ``x`` moves the load by as much as a step to a branch point."""
        if self.fold or self._section is not None or at is None or step is None:
            return False
        found = self.inertia.at(x)
        noise = max(found.noise(combine(at.V, z)) for z in at.Z.T)
        return bool(abs(self.system.scalar(step.dx) * step.rows[-1, 0]) <= noise * at.Z.shape[1])

    def _length(self, step: _Step) -> float:
        """Size of a step: in the metric, or in that of the state and in both parameters."""
        if self._section is None:
            return self.system.norm(step.dx)
        return float(np.sqrt(step.dx.dot(self.inertia.metric * step.dx) + (step.share[:2] ** 2).sum()))

    def _at(self, x: PETSc.Vec, t: float, *, moved: bool = False) -> Factored:
        """S at a state, and at a value of the second parameter where there is one; ``moved`` from the last state.

        Phase conditions stay then: their changes are felt by no vector without drift.
        """
        if self._section is not None:
            self.system.line = self._section.line(t)
        return self.inertia.moved(x) if moved else self.inertia.at(x)

    def _second(self, x: PETSc.Vec, t: float) -> PETSc.Vec:
        """Derivative of the equations in the second parameter."""
        assert self._section is not None
        there = x.copy()
        self.system.set_load(there, t)
        self.system.line = self._section.second(self.system.scalar(x))
        return self.inertia.at(there).border.copy()

    def _factor(self, matrix: PETSc.Mat) -> int:
        """Factor the bordered matrix, and its transpose where it is not symmetric; its other negative eigenvalues."""
        sides = [(matrix, self.psi, self.phi)]
        if self.psi is not self.phi:
            sides.append((matrix.transpose(self._transposed), self.phi, self.psi))
        if not self._bordered:
            constraints = self.inertia.constraints if len(sides) == 1 else None
            self._bordered = [Bordered(self.system, side, len(self.psi), constraints) for side, *_ in sides]
        counts = [bordered.factor(*side) for bordered, side in zip(self._bordered, sides, strict=True)]
        return counts[0]

    def _modes(self, bordered: Bordered) -> tuple[list[PETSc.Vec], np.ndarray]:
        """(V, G) by these factors."""
        solved = [bordered.solve(None, e) for e in np.eye(len(self.psi))]
        return [v for v, _ in solved], np.array([row for _, row in solved])

    def _linear(self, x: PETSc.Vec, t: float, old: _Linear | None = None) -> _Linear:
        """Factor the bordered matrix, and solve with it; derivatives of an ``old`` linearisation serve again."""
        system, none = self.system, np.zeros(len(self.psi))
        columns = [] if self._section is None or old else [self._second(x, t)]
        found = self._at(x, t)
        self._factor(found.matrix)
        columns.insert(0, found.border.copy())
        equations = system.new_vector()
        system.at(x).residual(equations)
        s, c = self._bordered[0].solve(-equations, none)
        V, G = self._modes(self._bordered[0])
        if old is not None:
            return replace(old, V=V, G=G, s=s, c=c)
        responses = [self._bordered[0].solve(-column, none) for column in columns]
        system.set_load(responses[0][0], 1.0)
        Z, N = self._split(G)
        sides = [V, V if self.psi is self.phi else self._modes(self._bordered[1])[0]]
        null, left = ([combine(side, z) for z in Z.T] for side in sides)
        w, b = [w for w, _ in responses], np.array([b for _, b in responses])
        return _Linear(V, G, s, c, columns, w, b, Z, N, left, *self._along_null(x, t, null, left))

    def _split(self, G: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The modes that are to vanish, and the others: eigenvectors of G, by what they have of the last ones."""
        m, k = self.Z.shape
        if k == m:
            return np.eye(m), np.zeros((m, 0))
        _, vectors = np.linalg.eigh((G + G.T) / 2)
        order = np.argsort(-np.linalg.norm(self.Z.T @ vectors, axis=0))
        return vectors[:, order[:k]], vectors[:, order[k:]]

    def _equations(self, x: PETSc.Vec, at: _Linear) -> tuple[np.ndarray, np.ndarray]:
        """Rows (m + 1, parameters + m) for changes of the parameters and along V, and right-hand sides (m + 1,)."""
        still = np.hstack([at.N, at.Z]).T if self.fold else at.N.T
        trace = np.array([*(at.f + [w.dot(at.y) for w in at.w]), *(v.dot(at.y) for v in at.V)])
        rows, right = np.hstack([still @ at.b.T, still @ at.G]), -still @ at.c
        if not self.fold:
            held, free = self._held(x, at, trace)
            rows, right = np.vstack([rows, held]), np.append(right, free)
        return np.vstack([rows, trace]), np.append(right, np.trace(at.Z.T @ at.G @ at.Z) - at.s.dot(at.y))

    def _along_null(self, x: PETSc.Vec, t: float, null: Vectors, lefts: Vectors) -> tuple[PETSc.Vec, np.ndarray]:
        """Sums over the null vectors, and the left ones, of ``y`` and of ``f`` (parameters,)."""
        y, f = self.system.new_vector(), np.zeros(1 if self._section is None else 2)
        for v, left in zip(null, lefts, strict=True):
            for sign in (1.0, -1.0):
                there, share = x + v * (sign * DIFFERENCE), sign / (2 * DIFFERENCE)
                if self._section is not None:
                    f[1] += share * left.dot(self._second(there, t))
                found = self._at(there, t, moved=True)
                f[0] += share * left.dot(found.border)
                y.axpy(share, self._image(found.matrix, left))
        return y, f

    def _held(self, x: PETSc.Vec, at: _Linear, trace: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rows (k, parameters + m) and right-hand sides (k,) of ``Z^t b = 0``."""
        k = at.Z.shape[1]
        if self._section is not None:
            return np.hstack([np.zeros((k, 2)), trace[0] / k * at.Z.T]), at.Z.T @ at.b[0]
        (w,), h = at.w, DIFFERENCE / self.system.norm(at.w[0])
        r, bend = [self.system.new_vector() for _ in range(k)], self.system.new_vector()
        for sign in (1.0, -1.0):
            found = self.inertia.moved(x + w * (sign * h))
            for image, left in zip(r, at.left, strict=True):
                image.axpy(sign / (2 * h), self._image(found.matrix, left))
            bend.axpy(sign / (2 * h), found.matrix * w)
            bend.axpy(sign / (2 * h), found.border)
        self.system.set_load(bend, 0.0)
        rows = [[bend.dot(left), *(v.dot(image) for v in at.V)] for left, image in zip(at.left, r, strict=True)]
        return np.array(rows), at.Z.T @ at.b[0] - [at.s.dot(image) for image in r]

    def _image(self, matrix: PETSc.Mat, left: PETSc.Vec) -> PETSc.Vec:
        """``S^t W``, which is known without a transpose where S is symmetric."""
        image = matrix.createVecRight()
        (matrix.mult if self.psi is self.phi else matrix.multTranspose)(left, image)
        self.system.set_load(image, 0.0)
        return image

    def _step(self, at: _Linear, equations: tuple[np.ndarray, np.ndarray], moved: PETSc.Vec, t: float) -> _Step:
        """Newton's step, from ``moved`` and ``t`` off where the section is."""
        (rows, right), (m, k) = equations, at.Z.shape
        if self._section is not None:
            plane, off = self._plane(at, self._section, moved, t)
            own, rest = self._follow(at)
            table, known = np.vstack([rows[m - k :], plane]), np.append(right[m - k :], off)
            known, table = known - table @ rest, table @ own
            size = abs(table).max(axis=1)
            share = own @ np.linalg.solve(table / size[:, None], known / size) + rest
        else:  # in natural units of eigenvalues and loads: what these do not determine, a free motion, stays as it is
            units, least = np.array([self.solver.units.load, *np.ones(m)]), np.full(m + 1, self.inertia.scale)
            least[m if self.fold else m - k : m] /= units[0]
            size = np.maximum(least, abs(rows * units).max(axis=1))
            share = units * np.linalg.lstsq(rows * units / size[:, None], right / size, rcond=FREE)[0]
        self.Z = at.Z
        dx, dt = combine([at.s, *at.w, *at.V], np.array([1.0, *share])), share[1] if self._section else 0.0
        return _Step(dx, dt, share, rows)

    def _follow(self, at: _Linear) -> tuple[np.ndarray, np.ndarray]:
        """Shares (2 + m, 2 + k) of both parameters and the null vectors, which modes near by follow, and the rest."""
        k, moved = at.Z.shape[1], at.N @ self._relaxed(at, -np.column_stack([at.b.T, at.c]))
        own = np.vstack([np.eye(2, 2 + k), np.hstack([moved[:, :2], at.Z])])
        return own, np.array([0.0, 0.0, *moved[:, 2]])

    def _plane(self, at: _Linear, section: Section, moved: PETSc.Vec, t: float) -> tuple[np.ndarray, float]:
        """Row and right-hand side of the equation of the section."""
        along = [0.0 if section.row is None else section.row.dot(v) for v in (moved, at.s, *at.w, *at.V)]
        along[0] += section.weight * t
        along[3] += section.weight
        return np.array(along[2:]), -(along[0] + along[1])

    def _state(self, x: PETSc.Vec, t: float, at: _Linear, step: _Step) -> SingularState:
        """The solution ``x``, ``t``, which the last step has led to."""
        rows, share, curve, parameters, k = step.rows, step.share, None, len(at.w), at.Z.shape[1]
        if self._section is not None:  # the derivatives so far are those of an iterate
            at = self._linear(x, t)
            rows, share = self._equations(x, at)[0], np.zeros(len(share))
        matrix = self._at(x, t).matrix
        self._factor(matrix)
        modes, _ = self._modes(self._bordered[0])  # of this very state
        null = [combine(modes, z) for z in at.Z.T]
        noise = NOISE * max(rounding(matrix, v, x) for v in null) + LEAST * self.inertia.scale
        if self._section is not None:
            curve = self._curve(step.share[:2], rows, at, noise)
        others, soft = at.N.T @ at.G @ at.N, at.Z.T @ at.G @ at.Z
        response = combine([at.w[0], *at.V], np.array([1.0, *(at.N @ self._relaxed(at, -at.b[0]))]))
        return SingularState(
            x,
            self.system.scalar(x),
            self._oriented(null),
            response,
            at.Z.T @ (at.c + share[:parameters] @ at.b + at.G @ share[parameters:]),
            noise,
            self._directions(response, null, rows, at.Z) if curve is None else [],
            rows[-1, 0] / k,
            float(np.linalg.norm(soft - np.trace(soft) / k * np.eye(k), 2)),
            modes,
            np.linalg.eigvalsh(others + others.T) / 2,
            step.dx,
            t,
            curve,
        )

    def _oriented(self, null: list[PETSc.Vec]) -> list[PETSc.Vec]:
        """Orthonormal vectors of this space, of the two directions of each always the same."""
        own, seed = [v.copy() for v in null], self.inertia.seed(0)
        orthonormalize(own, self.inertia.metric)
        return [v * (1.0 if seed.dot(v) >= 0 else -1.0) for v in own]

    def _curve(self, last: np.ndarray, rows: np.ndarray, at: _Linear, noise: float) -> Curve:
        """The curve through a solution, of which the equations are linearised in ``rows``."""
        (m, k), (own, _) = at.Z.shape, self._follow(at)
        table = rows[m - k :] @ own
        slope = np.linalg.svd(table / np.maximum(abs(table).max(axis=1), TINY)[:, None])[2][-1]
        square = np.vstack([table, slope]) if self.fold else np.vstack([table[-1:, :2], slope[:2]])
        dx = combine([*at.w, *at.V], own @ slope)
        self.system.set_load(dx, 0.0)
        return Curve(
            last,
            slope[:2],
            dx,
            int(np.copysign(1.0, np.linalg.det(square))),
            table[-1, :2] / k,
            -at.b @ at.Z,
            0.0 if self.fold else self._part(at, slope[:2] / np.linalg.norm(slope[:2]), noise),
            float(table[-1, 2]),
            [combine(at.V, z) for z in np.hstack([at.Z, at.N]).T],
            at.left,
            self._negative(at.N) if self.psi is self.phi else -1,
        )

    def _relaxed(self, at: _Linear, forces: np.ndarray) -> np.ndarray:
        """Amplitudes (m - k, ...) of modes near by under ``forces`` (m, ...); what nothing holds is left at rest."""
        G = at.N.T @ at.G @ at.N
        values, vectors = np.linalg.eigh((G + G.T) / 2)
        held = abs(values) > FREE * self.inertia.scale
        return np.asarray((vectors[:, held] / values[held]) @ vectors[:, held].T @ at.N.T @ forces)

    def _part(self, at: _Linear, direction: np.ndarray, noise: float) -> float:
        """Part of the change of the equations along a direction of the parameters that does work on null vectors."""
        work, terms = np.zeros(len(at.left)), np.zeros(len(at.left))
        for i, left in enumerate(at.left):
            each = combine(at.columns, direction)
            each.pointwiseMult(each, left)
            work[i], terms[i] = abs(each.sum()), each.norm(PETSc.NormType.NORM_1)
        return float((work[work > noise] / terms[work > noise]).max(initial=0.0))

    def _negative(self, N: np.ndarray) -> int:
        """Eigenvalues clearly below zero, but for those that vanish, at the state that the matrix holds.

        What is zero all along a curve has the sign of its round-off.
        """
        self.inertia.move(-self.inertia.tolerance)
        far = self._factor(self.inertia.matrix)
        G = N.T @ self._modes(self._bordered[0])[1] @ N
        return far + int((np.linalg.eigvalsh(G + G.T) > 0).sum())

    def _directions(self, w: PETSc.Vec, null: list[PETSc.Vec], rows: np.ndarray, Z: np.ndarray) -> list[PETSc.Vec]:
        """Unit directions ``xi V + dlam (w, 1)`` with ``a xi^2 + 2 b xi dlam + c dlam^2 = 0``, the reduced equation.

        That is the one of a branch point with one null vector, and known by the last two ``rows``.
        """
        if self.fold or len(null) > 1:
            return []
        c, b, a = rows[-2, 0], float(rows[-2, 1:] @ Z[:, 0]), float(rows[-1, 1:] @ Z[:, 0])
        root = np.sqrt(max(b * b - a * c, 0.0))
        pivot = -(b + np.copysign(root, b))
        out = []
        for xi, dlam in ((pivot, a), (c, pivot)):  # no cancellation: the two roots xi/dlam have the product c/a
            if xi or dlam:
                d = combine([null[0], w], np.array([xi, dlam]))
                out.append(d / self.system.norm(d))
        return out


def load_uncertainty(solver: BranchSolver, found: SingularState) -> float:
    """Uncertainty of the load of a branch point, by round-off and by what several eigenvalues differ."""
    matrix = solver.inertia.at(found.x)
    doubt = max(matrix.noise(v) for v in found.vectors) + found.spread
    moved = abs(solver.system.scalar(found.last))
    return moved + doubt / max(abs(found.rate), TINY)
