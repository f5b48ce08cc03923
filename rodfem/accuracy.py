r"""Error bars: every special point is computed again on a richer discretisation, started from the first.

Elements half as long, of one degree more.  With errors ``e`` of the first and ``e'`` of the richer result their
difference is ``d = e - e'``, so that ``|e| <= |d| / (1 - |e' / e|)``.  What elements of length h and degree k miss of a
state falls like h^(k+1), what they miss of loads and of positions at vertices like h^(2k): halving alone leaves at most
``2^-(k+1)`` of an error, also where elements are so long that one degree more does not lower it, or turns its sign.
To that bound comes what location and arithmetic leave open of the richer result.

The state, its tangent and the null vector are interpolated, so that this costs a few solves.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from petsc4py import PETSc
from scipy.optimize import brentq

from rodfem import compat
from rodfem.branch import BRANCH_POINT, END, FOLD, Law, Point, Special
from rodfem.continuation import Equilibria, Follower
from rodfem.errors import ConvergenceError
from rodfem.fields import HIGHEST
from rodfem.locate import WINDOW, refine
from rodfem.newton import correct
from rodfem.pitchfork import ROUND_OFF, Origin, law_of, ordinate_along
from rodfem.system import System

STEADY = 3.0
"""Times the change in one more step of Newton's method, that a result is uncertain by."""


def richer_system(system: System) -> System:
    """Return the system of the same rod on halves of its elements, of one degree more (but of the highest one)."""
    d = system.fields.discretization
    halves = replace(d, vertices=tuple(map(float, system.fields.all_vertices())))
    finer = halves.finer(2, richer=int(d.degree < HIGHEST))
    return System(system.scene, finer, system.comm, system.clock, symmetries=system.symmetries)


def bound(value: float, richer: float, degree: int, left: float) -> float:
    """Bound of the error of a value on elements of a ``degree``, where the ``richer`` one is uncertain by ``left``."""
    return (abs(richer - value) + left) / (1 - 0.5 ** (degree + 1))


class Transfer:
    """Interpolates vectors of one system to another whose elements are those of the first, or parts of them."""

    def __init__(self, source: System, target: System) -> None:
        """Tabulate the bases of the source at the nodes of the target."""
        self.source, self.target = source, target
        old, new = source.fields, target.fields
        vertices = old.all_vertices()
        self._owned = slice(0, old.owned_cells)
        self._order = np.argsort(np.concatenate(source.comm.allgather(old.vertices[self._owned, 0])))
        self._parents = np.searchsorted(vertices, new.vertices.mean(axis=1)) - 1
        first, size = vertices[self._parents, None], np.diff(vertices)[self._parents, None]
        places, which = np.unique(np.round((new.vertices - first) / size, 9), axis=0, return_inverse=True)
        self._members = [np.flatnonzero(which.ravel() == i) for i in range(len(places))]
        degrees = {b.name: b.degree for b in old.blocks}
        self._bases = {
            b.name: [compat.lagrange_basis(degrees[b.name], a + (z - a) * compat.nodes(b.degree)) for a, z in places]
            for b in new.blocks
        }

    def __call__(self, vector: PETSc.Vec, *, state: bool) -> PETSc.Vec:
        """Interpolate a state, or (``state=False``) a direction, which is zero where a state is clamped."""
        old, new = self.source.fields, self.target.fields
        clamped = new.u.x.array.copy()
        self.source.bring(vector)
        values = old.u.x.array.copy()
        if not state:
            values[old.number < 0] = 0.0
        for name, bases in self._bases.items():
            every = np.concatenate(self.source.comm.allgather(values[old.dofs[name][self._owned]]))[self._order]
            for members, basis in zip(self._members, bases, strict=True):
                new.u.x.array[new.dofs[name][members]] = np.einsum("pn,cni->cpi", basis, every[self._parents[members]])
        new.u.x.array[new.copies] = values[old.copies[0]]
        out = self.target.take()
        fixed = new.number < 0
        new.u.x.array[fixed] = clamped[fixed]
        return out


@dataclass(frozen=True)
class Again:
    """A point computed again: state, load and ordinate, and what location and arithmetic leave open of these two."""

    x: PETSc.Vec
    load: float
    ordinate: float
    load_left: float
    ordinate_left: float


class Richer:
    """A second, richer discretisation of the system of a :class:`~rodfem.continuation.Follower`, and its estimates."""

    def __init__(self, follower: Follower) -> None:
        """Compile and allocate the richer system."""
        self.coarse, self.system = follower, richer_system(follower.system)
        self.follower = Follower(self.system)
        self.transfer = Transfer(follower.system, self.system)
        self._origins: list[tuple[Special, Origin]] = []

    def bound(self, value: float, richer: float, left: float) -> float:
        """Bound of the error of a value of the first discretisation; see :func:`bound`."""
        return bound(value, richer, self.coarse.system.fields.discretization.degree, left)

    def estimate(self, special: Special) -> None:
        """Set ``error_estimate`` and ``ordinate_error`` of a special point, bounds of what it may be in error by.

        They are infinite where the richer discretisation does not find the point.
        """
        if special.zero_of == "stretch":
            return  # it has its own estimate: see zero_stretch
        point, at_a_load = special.point, special.kind not in (FOLD, BRANCH_POINT)
        self.system.damping = self.coarse.system.damping
        try:
            again = self.again(point, fixed_load=True) if at_a_load else self._located(special)
        except ConvergenceError as trouble:
            special.error_estimate = special.ordinate_error = float("inf")
            special.note = f"no error estimate: {trouble}"
            return
        special.ordinate_error = self.bound(point.ordinate, again.ordinate, again.ordinate_left)
        load_error = max(self.bound(point.load, again.load, again.load_left), special.located_to)
        special.error_estimate = special.ordinate_error if at_a_load else load_error

    def again(self, point: Point, *, fixed_load: bool) -> Again:
        """Solve for a point on the richer discretisation, at its load or across its tangent.

        One more step of Newton's method tells what arithmetic leaves open.  Raises :class:`ConvergenceError` where
        there is no such point.
        """
        system, x = self.system, self.transfer(point.x, state=True)
        row = self.follower.axis
        if not fixed_load and point.tangent is not None:
            row = self.follower.row(self.transfer(point.tangent, state=False))
        system.set_phase(x)
        if not correct(system, x, row, reach=1.0).converged:
            raise ConvergenceError(
                f"the richer discretisation has no equilibrium near load {point.load:.8g}: use more elements"
            )
        load, ordinate = system.scalar(x), self.follower.shape.ordinate(x)
        equations, step = system.new_vector(), system.new_vector()
        system.residual(x, equations)
        system.solve(equations, step)
        x.axpy(-1.0, step)
        last = system.scalar(x), self.follower.shape.ordinate(x)
        moved = np.abs(np.subtract(last, (load, ordinate)))
        return Again(x, *last, *(STEADY * moved + ROUND_OFF * np.maximum(1.0, np.abs(last))))

    def law(self, special: Special, direction: PETSc.Vec, law: Law) -> None:
        """Set the uncertainty of a law of the first discretisation: that of the rod's law, infinite without another."""
        origin = next((o for known, o in self._origins if known is special), None)
        self.system.damping = self.coarse.system.damping
        way = self.transfer(direction, state=False)
        again = None if origin is None else law_of(self.follower, origin, way)
        if again is None or (again.kind, again.power) != (law.kind, law.power):
            law.uncertainty = float("inf")
        else:
            law.uncertainty = self.bound(law.coefficient, again.coefficient, again.uncertainty)

    def _located(self, special: Special) -> Again:
        """The fold or branch point on the richer discretisation, and its ordinate."""
        follower, point = self.follower, special.point
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

        found = refine(follower, curve, 0.0, WINDOW / 8, mode, special.zero_of, beside=point.load)
        ordinate = follower.shape.ordinate(found.x)
        slope = ordinate_along(follower, found.x, found.tangent)
        left = abs(slope) * found.along + ROUND_OFF * max(1.0, abs(ordinate))
        self._origins.append((special, Origin(found.x, found.load, ordinate, found.uncertainty, left)))
        return Again(found.x, found.load, ordinate, found.uncertainty, left)


def zero_stretch(follower: Follower, coarse: Point) -> Special:
    """Sharpen the point at which the smallest stretch vanishes; raises :class:`ConvergenceError` where that fails.

    A strain converges like ``h^k`` only, far slower than a load does.  The point is computed on meshes two and
    four times as fine, one degree richer (the forms of :class:`Richer` serve); the finer one is kept.  Its error is a
    quarter of their difference at most, all of it for linear elements.
    """
    system, d = follower.system, follower.system.fields.discretization
    sample = follower.shape.sample(coarse.x)
    found: list[tuple[float, float, float, float]] = []
    for factor in (2, 4):
        mesh = d.finer(factor, richer=int(d.degree < HIGHEST))
        fine = Equilibria(System(system.scene, mesh, system.comm, system.clock, symmetries=system.symmetries))
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
