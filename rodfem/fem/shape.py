"""The shape of a state: centreline, rotations, all fields in natural order along the rod; link; other meshes."""

from __future__ import annotations

from dataclasses import replace
from math import sqrt
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.polynomial import legendre
from petsc4py import PETSc

from rodfem import compat
from rodfem.errors import InputError
from rodfem.fem.equations import Equations
from rodfem.fem.fields import HIGHEST, Discretization, Fields
from rodfem.fem.state import LOAD, NodalValues, State
from rodfem.fem.system import System
from rodfem.forms.kinematics import UNDEFORMED
from rodfem.problem.functions import derived
from rodfem.problem.quaternions import CONJUGATE, directors, product
from rodfem.writhe import lies_on_itself, writhe


def turn(powers: list[float], t: float) -> float:
    """Value of a polynomial of rising ``powers`` where it turns next to ``t``, from -1 to 1, by Newton's method."""
    value = 0.0
    for _ in range(6):
        value = slope = bend = 0.0
        for p in reversed(powers):
            value, slope, bend = value * t + p, slope * t + value, bend * t + slope
        if bend <= 0.0:
            break
        t = min(max(t - slope / (2 * bend), -1.0), 1.0)
    return value


class Shape:
    """Evaluates shapes of the states of one :class:`~rodfem.fem.system.System`; collective over its ranks.

    ``cells`` are the owned ones among the local ones, ``s`` the arclengths of their nodes from left to right, (cells,
    nodes), ``order`` the order of the nodes of an element from left to right, and ``natural`` the degrees of freedom
    of each field in that order.
    """

    def __init__(self, system: System) -> None:
        self.system, f = system, system.fields
        k = f.discretization.degree
        cells = self.cells = slice(0, f.owned_cells)
        self.start = f.vertices[cells, 0]
        self.size = f.vertices[cells, 1] - f.vertices[cells, 0]
        self.order = np.argsort(compat.nodes(k))
        self.nodes = np.sort(compat.nodes(k))
        self.s = self.start[:, None] + self.size[:, None] * self.nodes
        x, w = legendre.leggauss(system.equations.quadrature_degree(k) // 2 + 1)
        self._gauss, self._gauss_coefficients = w / 2, np.linalg.inv(legendre.legvander(x, len(x) - 1))
        self._to_nodes = self._integrals(self.nodes)
        self._q_at_gauss = compat.lagrange_basis(k, (x + 1) / 2)
        self._v_at_gauss = compat.lagrange_basis(k - 1, (x + 1) / 2)
        self._v_at_samples = compat.lagrange_basis(k - 1, np.linspace(0, 1, 4 * k + 1))
        self._v_to_powers = np.linalg.inv(np.vander(2 * compat.nodes(k - 1) - 1, k, increasing=True))
        free = system.scene.free_strains
        self._held_strains = np.array([0.0 if i in free else x for i, x in enumerate(UNDEFORMED)])
        self._strains = np.eye(len(UNDEFORMED))[list(free)]
        self._probe_weights = [self.weights(s) for s in system.scene.ordinate.places]
        starts = system.whole(self.start)
        self._sequence = np.argsort(starts)
        self._first = np.searchsorted(starts[self._sequence], self.start)
        left = self.from_left(self.start)[:, None, None]
        widths = np.diff(left, axis=0, append=system.scene.interval[1])
        self._every_s = unique(left + widths * self.nodes[None, :, None])[:, 0]
        self.natural = {b.name: f.dofs[b.name][cells][:, np.argsort(compat.nodes(b.degree))] for b in f.blocks}

    def ordinate(self, x: PETSc.Vec) -> float:
        """Ordinate of the scene at the state ``x``."""
        state, of, integral = self.system.at(x), self.system.scene.ordinate, self.system.equations.ordinate
        return state.integral(integral) if integral is not None else float(of.of(*self.place(state, of.s or 0.0)))

    def stretch(self, x: PETSc.Vec) -> float:
        """Smallest stretch ``v3`` along the rod; 1 for an inextensible rod.

        It is sought where the polynomial turns, in each element whose least value at many points is above that of the
        rod by less than a quarter of a second difference: a parabola falls half of that between two neighbours.
        """
        if 2 not in self.system.scene.free_strains:
            return 1.0
        nodal = self.system.at(x).values("v")[self.cells, :, -1]
        samples = nodal @ self._v_at_samples.T
        lowest, comm = samples.min(axis=1), self.system.comm
        least = comm.allreduce(float(lowest.min()), op=MPI.MIN)
        near = lowest - least < abs(np.diff(samples, 2)).max(axis=1) / 4
        begin = np.linspace(-1.0, 1.0, samples.shape[1])[samples[near].argmin(axis=1)]
        inside = map(turn, (nodal[near] @ self._v_to_powers.T).tolist(), begin.tolist())
        return float(comm.allreduce(min([least, *inside]), op=MPI.MIN))

    def sample(self, x: PETSc.Vec) -> dict[str, Any]:
        """All of a state in natural order on every rank, independent of the number of ranks.

        ``s`` (m,), ``r`` (m, 3) and ``q`` (m, 4) at the nodes from left to right; each further field by name,
        continuous ones (m, components), discontinuous ones (elements, nodes, components); scalars by name.
        """
        state = self.system.at(x)
        return dict(derived(state, "sample", lambda: self._sampled(state)))

    def _sampled(self, state: State) -> dict[str, Any]:
        system, f = self.system, self.system.fields
        out: dict[str, Any] = {"elements": f.discretization.elements, "s": self._every_s}
        for block in f.blocks:
            values = state.local[self.natural[block.name]]
            out[block.name] = self.joined(values) if block.continuous else self.from_left(values)
        smooth = self.smooth(state)
        for name in f.surfaces:
            mean = state.scalars.get(name.replace("u", "h"), 0.0) / system.scene.length
            out[name.replace("u", "p")] = mean - self._slope(smooth.local[self.natural[name]])
        r, chord = f.formulation.nodal(self, state)
        out["r"] = r + f.formulation.offset(f, state, out["s"], chord)
        out["q"] = f.turning.quaternion(out[f.turning.name])
        return out | dict(zip(system.scalars, [*state.scalars.values(), *state.drifts.tolist()], strict=True))

    def smooth(self, state: NodalValues) -> NodalValues:
        """A state whose multipliers of surfaces are extrapolated to the ends of the rod.

        There they have couples of the surface, over the weight of the node, or are unknown at a clamp.
        """
        f, local, k = self.system.fields, state.local.copy(), len(self.nodes) - 1
        for name in f.surfaces:
            for end, (side, own) in zip(self.system.scene.interval, ((0, slice(1, None)), (k, slice(k))), strict=True):
                cell = np.flatnonzero(np.isclose(self.s[:, side], end))
                rows = self.natural[name][cell, :, 0]
                basis = np.linalg.solve(np.vander(self.nodes[own]).T, np.vander(self.nodes[[side]], k)[0])
                local[rows[:, side]] = local[rows[:, own]] @ basis
        return NodalValues(state.equations, local, state.line) if f.surfaces else state

    def _slope(self, values: np.ndarray) -> np.ndarray:
        """Derivative along the rod of nodal values (cells, nodes, 1) in natural order, (m, 1); a mean at vertices."""
        k, powers = len(self.nodes) - 1, np.linalg.inv(np.vander(self.nodes, increasing=True))
        slopes = np.vander(self.nodes, k, increasing=True) * np.arange(1, k + 1) @ powers[1:]
        inside = self.from_left(np.einsum("pn,cni->cpi", slopes, values) / self.size[:, None, None])
        inside[1:, 0] = inside[:-1, -1] = (inside[1:, 0] + inside[:-1, -1]) / 2
        return unique(inside)

    def restore(self, sample: dict[str, Any]) -> PETSc.Vec:
        """State vector of a :meth:`sample`, taken with the same formulation but any number of elements and degree."""
        f, elements, s = self.system.fields, int(sample["elements"]), np.asarray(sample["s"])
        degree = (len(s) - 1) // elements
        own = np.arange(elements)[:, None] * degree + np.arange(degree + 1)
        named = {name: sample[name] for name in self.system.scalars if not name.startswith("drift")}
        for block in f.blocks:
            table = np.asarray(sample[block.name])
            if block.name == "r":
                table = table - f.lift(s, self.system.line.constants(sample[LOAD]))
            table = table[own] if block.continuous else table
            named[block.name] = interpolated(table, s[::degree], f.coordinates(block.degree))
        return self.system.vector(f.filled(named))

    def with_centreline(self, given: NodalValues) -> PETSc.Vec:
        """State with the centreline, or the scalar positions of the ends, that rotations and strains integrate to."""
        system, out, c = self.system, given.local.copy(), given.constants()
        before, inside, chord = self.integrals(self.slopes(given))
        left, right = ([None if p is None else float(p) for p in end.support(c)] for end in system.scene.sides)
        a = np.array([p if p is not None else (q or 0.0) - d for p, q, d in zip(left, right, chord, strict=True)])
        b = np.array([q if q is not None else x + d for q, x, d in zip(right, a, chord, strict=True)])
        x = (self.s - system.scene.interval[0])[..., None] / system.scene.length
        r = a + before + inside + x * (b - a - chord)
        system.fields.formulation.store(self, out, r - system.fields.lift(self.s, c), (a, b))
        return system.vector(out)

    def weights(self, s: float) -> tuple[np.ndarray, np.ndarray]:
        """Weights (2, cells * points) of slopes in integrals to ``s`` and over the rod; (cells * nodes,) of values."""
        local = (s - self.start) / self.size
        integral = self._integrals(np.clip(local, 0, 1)) * self.size[:, None]
        first = self.system.scene.interval[0]
        inside = (local > 0) & (local <= 1) if s > first else np.isclose(self.start, first)
        value = np.zeros((len(local), len(self.nodes)))
        value[inside] = compat.lagrange_basis(len(self.nodes) - 1, local[inside])
        whole = np.outer(self.size, self._gauss)
        return np.stack([integral.ravel(), whole.ravel()]), value.ravel()

    def place(
        self, state: NodalValues, s: float, weights: tuple[np.ndarray, np.ndarray] | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Centreline (3,) and unit quaternion (4,) of a ``state`` at ``s`` by its weights, or those of the ordinate."""
        system, f = self.system, self.system.fields
        integral, value = weights or self._probe_weights[0]
        turned = value @ state.turned[self.cells].reshape(-1, f.turning.size)
        turned, sums = system.sum(turned), system.sum(f.formulation.sums(self, state, integral, value))
        place, chord = sums if sums.ndim > 1 else (sums, sums)
        r = place + f.formulation.offset(f, state, np.array(s), chord)
        q = f.turning.quaternion(turned)
        return r, q / sqrt(q @ q)

    # --- along the rod -----------------------------------------------------------------------------------------

    def from_left(self, values: np.ndarray) -> np.ndarray:
        """Rows of all ranks, one for each element, from left to right."""
        return self.system.whole(values)[self._sequence]

    def joined(self, values: np.ndarray) -> np.ndarray:
        """Values of a continuous field at its nodes from left to right, (cells, nodes, ...) -> (m, ...)."""
        return unique(self.from_left(values))

    def nodal(self, values: np.ndarray) -> np.ndarray:
        """The same, of nodal values of a field of the degree of the rotation."""
        return self.joined(values[:, self.order])

    def integrals(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Integrals of values at the Gauss points, (cells, points, 3).

        From the left end to each cell (cells, 1, 3), from there to its nodes (cells, nodes, 3), and over the rod (3,).
        """
        pieces = np.einsum("g,cgi,c->ci", self._gauss, values, self.size)
        inside = np.einsum("ng,cgi,c->cni", self._to_nodes, values, self.size)
        before = np.vstack([np.zeros(3), np.cumsum(self.from_left(pieces), axis=0)])
        return before[self._first][:, None, :], inside, before[-1]

    def _integrals(self, x: np.ndarray) -> np.ndarray:
        """Integrals from 0 to ``x`` (m,) of the Lagrange basis of the Gauss points on [0, 1], (m, points)."""
        antiderivative = legendre.legint(self._gauss_coefficients, lbnd=-1, axis=0) / 2
        return legendre.legval(2 * np.asarray(x, dtype=float) - 1, antiderivative).T

    def slopes(self, state: NodalValues) -> np.ndarray:
        """``r' = R v`` at the Gauss points of the owned cells, (cells, points, 3)."""
        R = directors(state.fields.turning.quaternion(self._q_at_gauss @ state.turned[self.cells]))
        if not self.system.scene.free_strains:
            return np.asarray(R @ self._held_strains)
        strains = self._v_at_gauss @ state.values("v")[self.cells] @ self._strains + self._held_strains
        return np.asarray((R @ strains[..., None])[..., 0])


def unique(values: np.ndarray) -> np.ndarray:
    """Values at the nodes of a continuous field, (elements, nodes, ...) -> (m, ...)."""
    return np.concatenate([values[:, :-1].reshape(-1, values.shape[-1]), values[-1:, -1]])


def twist(s: np.ndarray, q: np.ndarray) -> float:
    """Twist ``1/(2 pi) int k3 ds`` of directors given by quaternions ``q`` (m, 4) at ascending ``s`` (m,)."""
    from scipy.integrate import trapezoid
    from scipy.interpolate import CubicSpline

    unit = q / np.linalg.norm(q, axis=1, keepdims=True)
    spline = CubicSpline(s, unit)
    fine = np.linspace(s[0], s[-1], 8 * len(s) + 1)
    p, d = spline(fine), spline(fine, 1)
    k3 = 2 * product(p * CONJUGATE, d)[:, 3] / np.sum(p * p, axis=1)
    return float(trapezoid(k3, fine)) / (2 * np.pi)


def link(sample: dict[str, Any]) -> tuple[float, float, float]:
    """Linking number, twist and writhe of a state of a closed rod, given by :meth:`~rodfem.fem.shape.Shape.sample`.

    The linking number of the edge traced by a director with the centreline is ``Lk = Tw + Wr`` (Calugareanu 1959, White
    1969), with the twist ``Tw = 1/(2 pi) int k3 ds`` and the writhe ``Wr`` of the centreline.  It is an integer
    and a ring's turn, and does not change unless the rod passes through itself: it belongs to the scene's start.  Of a
    rod that lies on itself it is nan.
    """
    from scipy.interpolate import CubicSpline

    s, closed = np.asarray(sample["s"]), np.array(sample["r"])
    closed[-1] = closed[0]
    centreline = CubicSpline(s, closed, bc_type="periodic")
    Wr = writhe(centreline, (s[0], s[-1]), to=1e-5)  # the change that is accepted
    Tw = twist(s, np.asarray(sample["q"]))
    if lies_on_itself(centreline, (s[0], s[-1])):
        return np.nan, Tw, Wr
    a, b = np.asarray(sample["q"])[[0, -1]]
    turn = np.arctan2(a[0] * b[3] - a[3] * b[0] + a[2] * b[1] - a[1] * b[2], a @ b) / np.pi  # of conj(a) b about d3
    Lk = round(round(Tw + Wr - turn) + turn, 9) + 0.0  # no negative zero
    if abs(Tw + Wr - Lk) > 0.05:
        raise InputError(f"Twist {Tw:.4f} plus writhe {Wr:.4f} is no linking number: close the rod, without contact.")
    return Lk, Tw, Wr


# --- other meshes -----------------------------------------------------------------------------------------------------


def halved(degree: int) -> float:
    """Largest part of the error of a smooth state on elements of ``degree`` that remains on halved elements."""
    return float(0.5 ** (degree + 1))


def richer(system: System) -> Discretization:
    """Halves of the elements of a system, of one degree more (but of the highest one)."""
    d = system.fields.discretization
    halves = replace(d, vertices=tuple(map(float, system.fields.all_vertices)))
    return halves.finer(2, richer=int(d.degree < HIGHEST))


def compile_richer(system: System) -> None:
    """Begin to compile the forms of that in the background."""
    Equations.compile_ahead(Fields(system.scene, richer(system), system.comm))


def transferred(source: Shape, target: System, vector: PETSc.Vec, *, state: bool) -> PETSc.Vec:
    """A state, or (``state=False``) a direction, on another mesh: a direction is zero where a state is clamped."""
    old, new = source.system.fields, target.fields
    values = (source.system.at(vector) if state else source.system.change(vector)).local
    out, ends = np.zeros(len(new.number)), old.all_vertices
    for block in new.blocks:
        table = source.from_left(values[source.natural[block.name]])
        out[new.dofs[block.name]] = interpolated(table, ends, new.coordinates(block.degree))
    out[new.copies] = values[old.copies[0]]
    return target.vector(out)


def interpolated(table: np.ndarray, ends: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Values (cells, n, components) at the arclengths ``x`` (cells, n) of polynomials on elements between ``ends``."""
    inwards = x + 1e-9 * (x.mean(axis=1, keepdims=True) - x)  # the end of a cell belongs to that cell
    cell = np.clip(np.searchsorted(ends, inwards) - 1, 0, len(table) - 1)
    local, degree = (x - ends[cell]) / (ends[cell + 1] - ends[cell]), table.shape[1] - 1
    basis = compat.lagrange_basis(degree, local.ravel())[:, np.argsort(compat.nodes(degree))]
    return np.einsum("pn,pni->pi", basis, table[cell.ravel()]).reshape(*x.shape, -1)
