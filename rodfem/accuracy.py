"""Error bars: every special point is computed again on a richer discretisation, started from the first.

Same mesh, one degree more: with an error of order ``h^(2k)`` the richer result is much nearer to the truth, and
the difference estimates the error of the first.  The state, its tangent and the null vector are interpolated, so
that this costs a few solves.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from petsc4py import PETSc
from scipy.optimize import brentq

from rodfem import compat
from rodfem.branch import BRANCH_POINT, END, FOLD, Point, Special
from rodfem.continuation import Equilibria, Follower
from rodfem.errors import ConvergenceError
from rodfem.locate import WINDOW, refine
from rodfem.newton import correct
from rodfem.system import System


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
        if special.zero_of == "stretch":
            return  # it has its own estimate: see zero_stretch
        floor = max(special.located_to, 1e-12 * max(1.0, abs(special.point.load)))
        try:
            load, ordinate = self._again(special)
        except ConvergenceError as trouble:
            special.error_estimate = special.ordinate_error = float("inf")
            special.note = f"no error estimate: {trouble}"
            return
        special.ordinate_error = max(abs(ordinate - special.point.ordinate), floor)
        at_a_load = special.kind not in (FOLD, BRANCH_POINT)
        special.error_estimate = special.ordinate_error if at_a_load else max(abs(load - special.point.load), floor)

    def again(self, point: Point, *, fixed_load: bool, sharp: bool = False) -> PETSc.Vec:
        """State of a point on the richer discretisation, at its load or across its tangent, ``sharp`` to round-off.

        Raises :class:`ConvergenceError` where there is none.
        """
        x = self.transfer(point.x, state=True)
        row = self.follower.axis
        if not fixed_load and point.tangent is not None:
            row = self.follower.row(self.transfer(point.tangent, state=False))
        self.system.set_phase(x)
        if not all(correct(self.system, x, row, reach=1.0).converged for _ in range(1 + sharp)):
            raise ConvergenceError(
                f"the richer discretisation has no equilibrium near load {point.load:.8g}: use more elements"
            )
        return x

    def _again(self, special: Special) -> tuple[float, float]:
        """Load and ordinate of the special point on the richer discretisation."""
        follower, point = self.follower, special.point
        self.system.damping = self.coarse.system.damping
        if special.kind not in (FOLD, BRANCH_POINT):
            return point.load, follower.shape.ordinate(self.again(point, fixed_load=True))
        if point.tangent is None:
            raise ConvergenceError("the branch has no tangent there")
        x = self.transfer(point.x, state=True)
        tangent = self.transfer(point.tangent, state=False)
        mode = self.transfer(special.null_vectors[0], state=False)
        mode.scale(1.0 / self.system.norm(mode))

        def curve(s: float) -> tuple[PETSc.Vec, PETSc.Vec]:
            y = x.copy()
            y.axpy(s, tangent)
            return y, tangent

        located = refine(follower, curve, 0.0, WINDOW / 2, mode, special.zero_of)
        return located.load, follower.shape.ordinate(located.x)


def zero_stretch(follower: Follower, coarse: Point) -> Special:
    """Sharpen the point at which the smallest stretch vanishes; raises :class:`ConvergenceError` where that fails.

    A strain converges like ``h^k`` only, far slower than a load does.  The point is computed on meshes two and
    four times as fine, one degree richer (the forms of :class:`Richer` serve); the finer one is kept, and their
    difference is its error.
    """
    system, d = follower.system, follower.system.fields.discretization
    sample = follower.shape.sample(coarse.x)
    found: list[tuple[float, float, float, float]] = []
    for factor in (2, 4):
        fine = Equilibria(System(system.scene, d.finer(factor, richer=1), system.comm, system.clock))
        state = fine.shape.restore(sample)

        def stretch(load: float, fine: Equilibria = fine, guess: PETSc.Vec = state) -> float:
            fine.system.set_phase(guess)
            x, outcome = fine.at_load(guess, load, reach=1.0)
            if not outcome.converged:
                raise ConvergenceError(f"no equilibrium near load {load:.8g} on the finer mesh")
            x.copy(guess)
            return fine.shape.stretch(guess)

        load = _bracketed_zero(stretch, coarse, abs(system.scene.span[1] - system.scene.span[0]))
        last = stretch(load)
        found.append((load, fine.shape.ordinate(state), fine.energy(state), last))
        sample = fine.shape.sample(state)
    (load2, ordinate2, *_), (load, ordinate, energy, last) = found
    x = follower.shape.restore(sample)
    point = replace(coarse, x=x, load=load, ordinate=ordinate, energy=energy, stretch=last)
    special = Special(END, point, point.negative, point.negative, 1e-10 * max(1.0, abs(load)), zero_of="stretch")
    left = 1.0 if d.degree == 1 else 0.25
    special.error_estimate = max(left * abs(load - load2), special.located_to)
    special.ordinate_error = max(left * abs(ordinate - ordinate2), special.located_to)
    special.note = f"computed with {4 * d.elements} elements of degree {d.degree + 1}"
    return special


def _bracketed_zero(stretch: Callable[[float], float], coarse: Point, span: float) -> float:
    """Load at which ``stretch`` vanishes: bracketed by steps from the coarse load along the branch, then solved for."""
    a, value = coarse.load, stretch(coarse.load)
    step = np.copysign(2e-4 * span, coarse.slope if value > 0 else -coarse.slope)
    for _ in range(14):
        b, other = a + step, stretch(a + step)
        if value * other <= 0:
            return float(brentq(stretch, a, b, xtol=1e-12 * span))
        a, value, step = b, other, 1.7 * step
    raise ConvergenceError("the zero of the stretch was not found on the finer mesh")
