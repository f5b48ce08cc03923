r"""Equilibria whose second variation is singular, as a regular system of equations in two parameters.

Let ``F(x, a, b) = 0`` be the equations of equilibrium with the phase conditions of the symmetries that the state
breaks, and ``S = F_x``, which is symmetric where all loads have a potential.  With vectors ``psi`` near ``M phi``,
``phi`` the null vectors, the matrix

    ( S       psi )  ( V )     ( 0 )
    ( psi^t   0   )  ( G )  =  ( I )

is regular where ``S`` is singular, and ``S`` is singular exactly where the small matrix ``G`` is; its derivative along
any ``z`` is ``-V^t S_z V`` (Govaerts, *Numerical Methods for Bifurcations of Dynamical Equilibria*, SIAM 2000,
chapters 3 and 4).  All solves below are with this one bordered matrix.

*Fold*: ``F = 0`` and ``G = 0`` in ``(x, a, b)``.  The curve has the null vector of

    ( phi.F_a   phi.F_b   0           )
    ( G_a       G_b       phi.S_phi phi )

as its tangent ``(da, db, xi)``, ``xi`` the share of ``phi`` in ``dx`` (Doedel, Keller & Kernevez, Int. J. Bifurcation
Chaos 1 (1991) 493-520).  It is regular also at a *cusp*, where ``phi.S_phi phi = 0`` and ``da = db = 0``; only where
``phi.F_a = phi.F_b = 0`` is it not: there the fold ends on a branch point.

*Branch point*: ``phi.F_a = phi.F_b = 0`` all along the curve, because of a symmetry that ``phi`` breaks.  Then ``F +
beta psi = 0``, ``psi.x = 0`` and ``tr G = 0`` are regular in ``(x, beta, a, b)``, and ``beta = 0``: the equation
``psi.x = 0``, for the part of ``x`` that breaks the symmetry, keeps the state symmetric, and ``beta`` is the
imperfection that a parameter would have to make up for.  Where it does not vanish the parameter destroys the branch
point.  Null vectors that a symmetry relates are several columns of ``psi``, and ``G`` is a multiple of the identity.

*Divergence* under loads without a potential: ``S`` is not symmetric.  The columns of the border are near ``M`` times
the left null vectors, its rows near ``M`` times the right ones, and with ``W`` the solution of the transposed bordered
equations the derivative of ``G`` is ``-W^t S_z V``; else all is as for a branch point.  No square root appears where
divergence meets flutter, a double zero eigenvalue with one null vector: ``S`` is as singular there as elsewhere.

The index of a symmetric ``S`` comes for free: the negative eigenvalues of the bordered matrix, less all constraints and
the columns of ``psi``, are those of the second variation on what is orthogonal to the null vectors.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from petsc4py import PETSc

from rodfem.codim2.criterion import SPLIT, Destroyed
from rodfem.codim2.others import UNSTABLE, VANISHED, beside_zero
from rodfem.codim2.parameter_plane import LocusPoint, Plane, Tangent
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.static_solver import StaticSolver
from rodfem.errors import ConvergenceError
from rodfem.fem.newton import KEPT, SHRUNK, STALLED, TOLERANCE
from rodfem.linalg.orthogonal import combine, orthonormalize, project_out
from rodfem.stability.bordered import Bordered
from rodfem.stability.inertia import ZERO_BAND, Factored, Inertia
from rodfem.stability.nonsymmetric import NonsymmetricSolver
from rodfem.tolerances import ROUND_OFF, TINY

DIFFERENCE = 1e-4
"""Step of the central differences for the third derivatives, in the metric: their errors do not enter the result."""
IMPERFECT = 1e-7
"""An imperfection above this, of the rod's lowest bending eigenvalue, is not round-off."""
FEWER = 1e-5
"""Null vectors whose eigenvalues differ by more than this, of the same, are not related by a symmetry."""
CANCELLED, ACROSS = 1e-6, 1e-9
"""A coupling with the null vectors that is not zero by symmetry: over the sum of its terms, and over their sizes."""
OFF, NONE = 1e-5, 1e-12
"""One along the curve that is none: over that across it, and over the lowest bending eigenvalue."""


@dataclass
class _Linear:
    """Linearisation at a state: residual solve, responses to both parameters, right and left null vectors, G_z.

    ``coupled`` tells of either parameter whether its derivative has a part along the left null vectors.
    """

    s0: PETSc.Vec
    b0: np.ndarray
    response: list[PETSc.Vec]
    b: np.ndarray
    v: list[PETSc.Vec]
    w: list[PETSc.Vec]
    g: float
    spread: float
    grad_x: PETSc.Vec
    grad_p: np.ndarray
    rest: int
    coupled: tuple[bool, ...] = ()


class Singular:
    """Corrects states to where the tangent matrix is singular: a ``fold``, else a branch point or divergence."""

    def __init__(self, solver: StaticSolver, plane: Plane, near: LocusPoint, *, fold: bool) -> None:
        """Border with the null vectors of a point ``near`` the curve, and the left ones where there are such.

        ``solver`` has the mesh, ``plane`` the two parameters; as many eigenvalues vanish as there are vectors.  At a
        ``fold`` the single null vector is coupled to the load; otherwise the points are branch points.
        """
        vectors, left = near.modes, near.left
        self.solver: StaticSolver = solver
        self.system, self.plane, self.fold = solver.system, plane, fold
        self.saddle = solver.inertia if isinstance(solver, BranchSolver) else Inertia(solver.system)
        self.metric = self.saddle.metric
        self._adopt(vectors, left)
        matrix = self.saddle.at(near.x).matrix  # for its pattern
        constraints = None if left else self.saddle.constraints
        self.bordered = Bordered(self.system, matrix, len(vectors), constraints)
        self.turned: Bordered | None = None
        self._stay: bool | None = None
        self.others = UNSTABLE if left else VANISHED
        if left:
            self._transposed = matrix.transpose(PETSc.Mat())
            self.turned = Bordered(self.system, self._transposed, len(vectors), None)
            self.frequencies = NonsymmetricSolver(self.system)

    def _adopt(self, vectors: list[PETSc.Vec], left: list[PETSc.Vec]) -> None:
        """Border with these vectors from now on, made orthonormal in the metric."""
        self.phi = [self.metric * v for v in self._orthonormal(vectors)]
        self.psi = [self.metric * v for v in self._orthonormal(left)] if left else self.phi

    def _orthonormal(self, vectors: list[PETSc.Vec]) -> list[PETSc.Vec]:
        done: list[PETSc.Vec] = []
        for vector in vectors:
            v = vector.copy()
            self.system.set_load(v, 0.0)
            project_out(v, done, self.metric)
            v.scale(1.0 / self.system.norm(v))
            done.append(v)
        return done

    def length(self, dp: np.ndarray, dx: PETSc.Vec) -> float:
        """Size of a step: parameters over the widths of their bounds, the state in the metric."""
        return float(np.hypot(np.linalg.norm(dp / self.plane.width), np.sqrt(max((self.metric * dx).dot(dx), 0.0))))

    def correct(
        self, p: np.ndarray, x: PETSc.Vec, tangent: Tangent, near: LocusPoint, reach: float = 1.0
    ) -> LocusPoint:
        """Point of the locus on the plane through ``(p, x)`` across ``tangent``; raises :class:`ConvergenceError`.

        With None for the state's part of the tangent the plane is that of the parameters alone: a line of theirs.
        ``near`` is a point of the curve whose null vectors are close by.  ``reach`` bounds how far ``x`` may move, in
        the metric.
        """
        p, x, last = self._newton(p, x, tangent, near, reach)
        return self._node(p, x, tangent, last)

    def onto(self, p: np.ndarray, x: PETSc.Vec, tangent: Tangent, near: LocusPoint, reach: float = 1.0) -> LocusPoint:
        """The same point with its parameters and state alone: no tangent, null vectors or counts.

        ``p`` (2,), ``x``, ``tangent``, ``near`` and ``reach`` are those of :meth:`correct`, and so is what is raised.
        """
        p, x, last = self._newton(p, x, tangent, near, reach)
        return LocusPoint(p, x, tangent[0], tangent[1] or self.system.new_vector(), self._located(p, last))

    def _newton(
        self, p: np.ndarray, x: PETSc.Vec, tangent: Tangent, near: LocusPoint, reach: float
    ) -> tuple[np.ndarray, PETSc.Vec, np.ndarray]:
        """Parameters, state, and the last changes of the parameters."""
        self._adopt(near.modes, near.left)
        p, x, origin = np.array(p, dtype=float), x.copy(), (np.array(p, dtype=float), x.copy())
        # pseudo-arclength equation, in the metric of states and with parameters over the widths of their bounds
        self.system.set_phase(x)
        row_p = tangent[0] / self.plane.width**2
        row_x = None if tangent[1] is None else self.metric * tangent[1]
        scale = self.length(tangent[0], tangent[1] or self.system.new_vector())
        old: _Linear | None = None
        before, total = np.inf, 0.0
        for _ in range(12):
            now = self._linear(p, x, old)
            along = row_p @ (p - origin[0]) + (row_x.dot(x - origin[1]) if row_x else 0.0)
            dp, dx = self._step(now, row_p, row_x, along, scale)
            size = self.length(dp, dx)
            p, total = p + dp, total + size
            x.axpy(1.0, dx)
            if not np.isfinite(size) or total > reach:
                break
            if size < TOLERANCE or (STALLED > size > 0.5 * before):
                return p, x, abs(dp)
            # chord step: the third derivatives, which cost most, serve again where corrections shrink tenfold
            old = now if size < SHRUNK * before and size < KEPT else None
            before = size
        raise ConvergenceError("Newton's method does not converge")

    def _step(
        self, at: _Linear, row_p: np.ndarray, row_x: PETSc.Vec | None, along: float, scale: float
    ) -> tuple[np.ndarray, PETSc.Vec]:
        """Newton's correction of parameters and state."""
        # dx = s0 + response dp (+ xi v at a fold): left are G = 0, arclength and, at a fold, phi.F = 0 in (dp, xi)
        free = [at.s0, *at.response] + ([at.v[0]] if self.fold else [])
        g = np.array([at.grad_x.dot(w) for w in free])
        g[0] += at.g
        g[1:3] += at.grad_p
        r = np.array([row_x.dot(w) if row_x else 0.0 for w in free])
        r[0] += along
        r[1:3] += row_p
        rows = [g, r / scale]
        if self.fold:
            rows.append(np.array([at.b0[0], *at.b[:, 0], at.g]))
        table = np.array(rows)
        unknowns = table[:, 1:] * np.append(self.plane.width, [1.0] * (len(free) - 3))
        size = abs(unknowns).max(axis=1)
        try:
            z = np.linalg.solve(unknowns / size[:, None], -table[:, 0] / size)
        except np.linalg.LinAlgError as trouble:
            raise ConvergenceError("the curve is singular") from trouble
        dp = z[:2] * self.plane.width
        return dp, combine(free, np.array([1.0, *dp, *z[2:]]))

    def _columns(self, p: np.ndarray, x: PETSc.Vec, w: PETSc.Vec | None) -> tuple[list[PETSc.Vec], PETSc.Vec]:
        """Derivatives of ``F`` in both parameters at ``x``, and ``S^t w``."""
        system, image, columns = self.system, self.system.new_vector(), []
        x = x.copy()
        for which in (0, 1):
            system.set_load(x, float(p[which]))
            matrix = system.at(x, self.plane.along(p, which)).jacobian(self.solver.axis)
            column = matrix * self.solver.axis
            system.set_load(column, 0.0)
            columns.append(column)
            if w is not None and which == 0:
                image = matrix.createVecRight()
                matrix.multTranspose(w, image)
                system.set_load(image, 0.0)
        return columns, image

    def _linear(self, p: np.ndarray, x: PETSc.Vec, old: _Linear | None) -> _Linear:
        """Linearise at a point; with ``old`` its derivatives serve again."""
        system, bordered, k = self.system, self.bordered, len(self.psi)
        columns = self._columns(p, x, None)[0] if old is None else []
        system.set_load(x, float(p[0]))
        system.line = self.plane.along(p, 0)
        equations = system.new_vector()
        system.at(x).residual(equations)
        if not np.isfinite(equations.norm()):
            raise ConvergenceError("the stored energy is not defined there")
        saddle = self.saddle.at(x)
        rest = bordered.factor(saddle.matrix, self.psi, self.phi)
        # psi.dx = 0 keeps the state symmetric where it is no fold: beta, in b0, then is the imperfection
        s0, b0 = bordered.solve(-equations, np.zeros(k))
        solved = [bordered.solve(None, e) for e in np.eye(k)]
        v, G = [w for w, _ in solved], np.array([row for _, row in solved])
        # where a symmetry relates the null vectors G is a multiple of the identity: one equation, its trace
        g = float(np.trace(G)) / k
        spread = float(np.linalg.norm(G - g * np.eye(k), 2))
        if old is not None:
            return _Linear(s0, b0, old.response, old.b, v, old.w, g, spread, old.grad_x, old.grad_p, rest)
        responses = [bordered.solve(-column, np.zeros(k)) for column in columns]
        w = self._left(saddle, v)
        grad_x, grad_p = self._gradient(p, x, v, w)
        b = np.array([row for _, row in responses])
        coupled = tuple(any(_along(left, column) for left in w) for column in columns)
        if not self.fold:
            responded = np.array([grad_x.dot(y) for y, _ in responses]) + grad_p
            s0 = combine([s0, *v], np.append(1.0, -self._aside(b, responded)))
        return _Linear(s0, b0, [y for y, _ in responses], b, v, w, g, spread, grad_x, grad_p, rest, coupled)

    def _left(self, saddle: Factored, v: list[PETSc.Vec]) -> list[PETSc.Vec]:
        """Left null vectors of a state, those of the columns of ``psi``; the right ones ``v`` by symmetry."""
        if self.turned is None:
            return v
        saddle.matrix.transpose(self._transposed)
        self.turned.factor(self._transposed, self.phi, self.psi)
        return [self.turned.solve(None, e)[0] for e in np.eye(len(self.psi))]

    def _gradient(
        self, p: np.ndarray, x: PETSc.Vec, v: list[PETSc.Vec], w: list[PETSc.Vec]
    ) -> tuple[PETSc.Vec, np.ndarray]:
        """Derivatives of ``tr G / k``: as ``S`` is a derivative itself, ``w.S_z v`` is ``z.d/de S(x + e v)^t w``."""
        grad_x, grad_p = self.system.new_vector(), np.zeros(2)
        for right, left in zip(v, w, strict=True):
            for sign in (1.0, -1.0):
                columns, image = self._columns(p, x + right * (sign * DIFFERENCE), left)
                factor = -sign / (2 * DIFFERENCE * len(v))
                grad_x.axpy(factor, image)
                grad_p += factor * np.array([column.dot(left) for column in columns])
        return grad_x, grad_p

    def _node(self, p: np.ndarray, x: PETSc.Vec, along: Tangent, last: np.ndarray) -> LocusPoint:
        """Evaluate tangent, count and records at a point of the locus, and border with its null vectors."""
        at = self._linear(p, x, None)
        scale = self.saddle.scale
        broken = "{} is an imperfection that destroys the branch point, or is one on this mesh alone"
        if not self.fold and abs(at.b0).max() > IMPERFECT * scale:
            raise Destroyed(broken.format(self.plane.names[1]))
        if at.spread > FEWER * scale:
            raise Destroyed(f"its {len(self.psi)} zero eigenvalues do not vanish together any more")
        width = self.plane.width
        g = (np.array([at.grad_x.dot(w) for w in at.response]) + at.grad_p) * width
        curvature = at.grad_x.dot(at.v[0])
        coupling = at.b[:, 0] * width
        # the tangent is the null vector of (phi.F_p 0; G_p phi.S_phi phi); without coupling of G_p alone
        if self.fold:
            a, b = np.array([*coupling, at.g]), np.array([*g, curvature])
            z = np.cross(a / max(np.linalg.norm(a), TINY), b / np.linalg.norm(b))
            dp, free, weights = z[:2] * width, [*at.response, at.v[0]], np.array([*(z[:2] * width), z[2]])
        else:
            dp = np.array([-g[1], g[0]]) * width
            free, weights = at.response, dp
        dx = combine(free, weights)
        size = self.length(dp, dx)
        forward = along[0] / width**2 @ dp + ((self.metric * dx).dot(along[1]) if along[1] else 0.0)
        size = size if forward >= 0 else -size
        coupled = [] if self.fold else self._imperfections(at, dp / width)
        dx.scale(1.0 / size)
        # each of several eigenvalues vanishes no farther across the curve than their mean by what they differ
        split = SPLIT * at.spread * abs(g) / max(g @ g, TINY) * width if len(at.v) > 1 else 0.0
        return LocusPoint(
            p,
            x,
            dp / size,
            dx,
            self._located(p, last) + split,
            ordinate=self.solver.shape.ordinate(x),
            ended=broken.format(coupled[-1]) if coupled else "",
            orientation=1 if size > 0 else -1,
            rest=self._negative(p, x, at.rest) if self.turned is None else self._others(p, x),
            curvature=float(curvature) if self.fold else 0.0,
            coupling=coupling if self.fold else np.zeros(2),
            modes=at.v,
            left=[] if self.turned is None else at.w,
        )

    def _aside(self, b: np.ndarray, gradient: np.ndarray) -> np.ndarray:
        """How far a state is off along each of the null vectors, (k,), by the coupling ``b`` (2, k) that this brings.

        No equation but that keeps a state from drifting along them: ``b`` is ``u`` times the ``gradient`` (2,) of
        ``tr G / k``, which changes by ``u^2``.  Any other ``b`` is no drift, and left.
        """
        across = gradient * self.plane.width
        off = across @ (b * self.plane.width[:, None]) / max(across @ across, TINY)
        rest = np.linalg.norm(b * self.plane.width[:, None] - np.outer(across, off))
        return np.where(rest <= OFF * np.linalg.norm(across) * np.linalg.norm(off), off, 0.0)

    def _imperfections(self, at: _Linear, along: np.ndarray) -> list[str]:
        """Parameters that have a part along the null vectors, which destroys the branch point ``along`` the curve.

        A state that is off by a little of a null vector has such a part as well, but across the curve: it is that of
        the gradient of ``G``.
        """
        b = at.b * self.plane.width[:, None]
        changed = abs(along @ b).max() / np.linalg.norm(along)
        if changed <= max(OFF * np.linalg.norm(b), NONE * self.saddle.scale):
            return []
        return [name for name, is_so in zip(self.plane.names, at.coupled, strict=True) if is_so]

    def _located(self, p: np.ndarray, last: np.ndarray) -> np.ndarray:
        """Uncertainties of both parameters, across the curve, by their ``last`` changes."""
        return np.asarray(np.maximum(last, ROUND_OFF * np.maximum(self.plane.sizes, abs(p))))

    def _negative(self, p: np.ndarray, x: PETSc.Vec, rest: int) -> int:
        """Negative eigenvalues but for those that vanish: ``rest``, unless others are zero all along the curve.

        Those have the sign of their round-off, and are counted as zero, as they are along branches.  Whether there are
        any the first point tells.
        """
        if self._stay is not False:
            self.system.line = self.plane.along(p, 0)
            self.system.set_load(x, float(p[0]))
            found = self.saddle.at(x)
            index = found.count()
            sharp = self.saddle.tolerance <= ZERO_BAND * self.saddle.scale
            others = index.zero - found.drifts - len(self.phi)
            if self._stay is None:
                self._stay = sharp and others > 0
            if sharp and others > 0:
                return index.negative
        return rest

    def _others(self, p: np.ndarray, x: PETSc.Vec) -> int:
        """Unstable eigenvalues at a divergence load but for those that vanish."""
        self.system.line = self.plane.along(p, 0)
        self.system.set_load(x, float(p[0]))
        return beside_zero(self.frequencies.at(x), len(self.phi))


def _along(left: PETSc.Vec, column: PETSc.Vec) -> bool:
    """Whether a ``column`` has a part along a ``left`` null vector that neither symmetry nor round-off explains."""
    terms, sizes = left.copy(), column.copy()
    terms.abs()
    sizes.abs()
    part = abs(left.dot(column))
    return bool(part > max(CANCELLED * terms.dot(sizes), ACROSS * left.norm() * column.norm()))


def null_vectors(saddle: Inertia, x: PETSc.Vec, number: int) -> tuple[list[PETSc.Vec], list[PETSc.Vec]]:
    """Right and left null vectors of the tangent matrix at ``x``, not symmetric, with the ``number`` it has there.

    By solves with borders that are arbitrary at first.  Of several the left ones are turned such that each is along
    the right one of the same number as far as it can be: where a symmetry relates them ``G`` is a multiple of one.
    """
    system, metric = saddle.system, saddle.metric
    matrix = saddle.at(x).matrix
    transposed = matrix.transpose(PETSc.Mat())
    straight, turned = (Bordered(system, side, number, None) for side in (matrix, transposed))
    right = left = [saddle.seed(i) for i in range(number)]
    # each solve of the bordered equations is a step of inverse iteration, and its result the better border
    for _ in range(3):
        orthonormalize(right, metric)
        orthonormalize(left, metric)
        phi, psi = ([metric * v for v in side] for side in (right, left))
        straight.factor(matrix, psi, phi)
        turned.factor(transposed, phi, psi)
        right, left = ([one.solve(None, e)[0] for e in np.eye(number)] for one in (straight, turned))
    orthonormalize(right, metric)
    orthonormalize(left, metric)
    overlap = np.array([[(metric * v).dot(w) for w in left] for v in right])
    u, _, vt = np.linalg.svd(overlap)
    return right, [combine(left, column) for column in (vt.T @ u.T).T]
