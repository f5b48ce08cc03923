"""Error bars: every special point is computed again on a richer discretisation, started from the first.

Same mesh, one degree more: with an error of order ``h^(2k)`` the richer result is much nearer to the truth, and
the difference estimates the error of the first.  The state, its tangent and the null vector are interpolated, so
that this costs a few solves.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from petsc4py import PETSc
from scipy.optimize import newton

from rodfem import compat
from rodfem.branch import BRANCH_POINT, FOLD, Special
from rodfem.continuation import Follower
from rodfem.errors import ConvergenceError
from rodfem.locate import WINDOW, refine, solve_at
from rodfem.system import System

STRAIN_SAFETY = 10.0
"""A strain converges like ``h^k`` only, and a degree more is not much nearer to the truth: multiply by this."""


class Transfer:
    """Interpolates vectors of one system to another on the same mesh with another degree."""

    def __init__(self, source: System, target: System) -> None:
        """Tabulate the bases of the source at the nodes of the target."""
        self.source, self.target = source, target
        degrees = {b.name: b.degree for b in source.fields.blocks}
        self.bases = {
            b.name: compat.lagrange_basis(degrees[b.name], compat.nodes(b.degree)) for b in target.fields.blocks
        }

    def __call__(self, vector: PETSc.Vec, *, state: bool) -> PETSc.Vec:
        """Interpolate a state, or (``state=False``) a direction, which is zero where a state is clamped."""
        old, new = self.source.fields, self.target.fields
        clamped = new.u.x.array.copy()
        self.source.bring(vector)
        values = old.u.x.array.copy()
        if not state:
            values[old.number < 0] = 0.0
        for name, basis in self.bases.items():
            new.u.x.array[new.dofs[name]] = np.einsum("pn,cni->cpi", basis, values[old.dofs[name]])
        new.u.x.array[new.copies] = values[old.copies]
        out = self.target.take()
        fixed = new.number < 0
        new.u.x.array[fixed] = clamped[fixed]
        return out


class Richer:
    """A second, richer discretisation of the system of a :class:`~rodfem.continuation.Follower`, and its estimates."""

    def __init__(self, follower: Follower) -> None:
        """Compile and allocate the richer system."""
        self.coarse, system = follower, follower.system
        d = system.fields.discretization
        self.system = System(
            system.scene, replace(d, degree=d.degree + 1), system.comm, system.clock, system.fields.mesh
        )
        self.follower = Follower(self.system)
        self.transfer = Transfer(system, self.system)

    def estimate(self, special: Special) -> None:
        """Set ``error_estimate`` and ``ordinate_error`` of a special point.

        They are never below what the location and the arithmetic leave uncertain, and infinite where the richer
        discretisation does not find the point.
        """
        floor = max(special.located_to, 1e-12 * max(1.0, abs(special.point.load)))
        try:
            load, ordinate = self._again(special)
        except ConvergenceError as trouble:
            special.error_estimate = special.ordinate_error = float("inf")
            special.note = f"no error estimate: {trouble}"
            return
        factor = STRAIN_SAFETY if special.zero_of == "stretch" else 1.0
        load, ordinate = (
            p + factor * (q - p) for p, q in ((special.point.load, load), (special.point.ordinate, ordinate))
        )
        special.ordinate_error = max(abs(ordinate - special.point.ordinate), floor)
        at_a_load = special.kind not in (FOLD, BRANCH_POINT) and special.zero_of != "stretch"
        special.error_estimate = special.ordinate_error if at_a_load else max(abs(load - special.point.load), floor)

    def _again(self, special: Special) -> tuple[float, float]:
        """Load and ordinate of the special point on the richer discretisation."""
        follower, point = self.follower, special.point
        x = self.transfer(point.x, state=True)
        if special.zero_of == "stretch" and point.tangent is not None:
            return self._zero_stretch(x, self.transfer(point.tangent, state=False))
        if special.kind not in (FOLD, BRANCH_POINT):
            self.system.set_phase(x)
            x, outcome = follower.at_load(x, point.load, reach=1.0)
            if not outcome.converged:
                raise ConvergenceError(f"the richer discretisation has no equilibrium near load {point.load:.8g}")
            return point.load, follower.shape.ordinate(x)
        if point.tangent is None:
            raise ConvergenceError("the branch has no tangent there")
        tangent = self.transfer(point.tangent, state=False)
        mode = self.transfer(special.null_vectors[0], state=False)
        mode.scale(1.0 / self.system.norm(mode))

        def curve(s: float) -> tuple[PETSc.Vec, PETSc.Vec]:
            y = x.copy()
            y.axpy(s, tangent)
            return y, tangent

        located = refine(follower, curve, 0.0, WINDOW / 2, mode, special.zero_of)
        return located.load, follower.shape.ordinate(located.x)

    def _zero_stretch(self, x: PETSc.Vec, tangent: PETSc.Vec) -> tuple[float, float]:
        """Load and ordinate where the smallest stretch vanishes, by the secant method along the tangent."""

        def solve(s: float) -> PETSc.Vec:
            def curve(t: float) -> tuple[PETSc.Vec, PETSc.Vec]:
                y = x.copy()
                y.axpy(t, tangent)
                return y, tangent

            return solve_at(self.follower, curve, s)

        s = newton(lambda s: self.follower.shape.stretch(solve(s)), 0.0, x1=-1e-3, tol=1e-10, maxiter=30)
        y = solve(float(s))
        return self.system.scalar(y), self.follower.shape.ordinate(y)
