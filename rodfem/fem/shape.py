"""The shape of a state: centreline, rotations, and all fields in natural order along the rod.

In the reduced formulation the centreline is recovered by integrating ``r' = R v`` with the quadrature of the weak
form, so that it closes exactly where the integral constraints say it does, and is as accurate as the pointwise
one.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.polynomial import legendre
from petsc4py import PETSc

from forms.kinematics import UNDEFORMED
from rodfem import compat
from rodfem.fem.fields import LOAD, end_positions
from rodfem.fem.system import System
from rodfem.fem.values import NodalValues
from rodfem.problem.contribution import Motion
from rodfem.problem.end import LETTERS
from rodfem.problem.quaternions import directors


def minimum(powers: list[float], t: float, spacing: float) -> float:
    """Value of a polynomial, given by rising powers, at its minimum within ``spacing`` of ``t`` in [-1, 1].

    By Newton's method for its slope; the value somewhere nearby where there is no such minimum.
    """
    low, high = max(t - spacing, -1.0), min(t + spacing, 1.0)
    slopes = [i * p for i, p in enumerate(powers)][1:]
    bends = [i * p for i, p in enumerate(slopes)][1:]
    for _ in range(6):
        bend = horner(bends, t)
        if bend <= 0:
            break
        t = min(max(t - horner(slopes, t) / bend, low), high)
    return horner(powers, t)


def horner(powers: list[float], t: float) -> float:
    """Value at ``t`` of the polynomial with these coefficients of rising powers."""
    value = 0.0
    for p in reversed(powers):
        value = value * t + p
    return value


class Gauss:
    """Gauss rule on [0, 1] with the integrals of its Lagrange basis from 0 to any point."""

    def __init__(self, points: int) -> None:
        """Make the rule; it is exact for polynomials of degree ``2 points - 1``."""
        x, self.weights = legendre.leggauss(points)
        self.points = (x + 1) / 2
        self.weights = self.weights / 2
        self._coefficients = np.linalg.inv(legendre.legvander(x, points - 1))

    def integrals(self, x: np.ndarray) -> np.ndarray:
        """Integrals of the Lagrange basis on the points from 0 to ``x`` of shape (m,): (m, points)."""
        antiderivative = legendre.legint(self._coefficients, lbnd=-1, axis=0) / 2
        return legendre.legval(2 * np.asarray(x, dtype=float) - 1, antiderivative).T


class Shape:
    """Evaluates shapes of the states of one :class:`~rodfem.fem.system.System`; collective over its ranks."""

    def __init__(self, system: System) -> None:
        """Tabulate bases and quadrature."""
        self.system, f = system, system.fields
        k = f.discretization.degree
        cells = slice(0, f.owned_cells)
        self.start = f.vertices[cells, 0]
        self.size = f.vertices[cells, 1] - f.vertices[cells, 0]
        self.nodes = np.sort(compat.nodes(k))
        self.gauss = Gauss(system.equations.quadrature_degree(k) // 2 + 1)
        self._order = np.argsort(compat.nodes(k))
        self._q_at_gauss = compat.lagrange_basis(k, self.gauss.points)
        self._v_at_gauss = compat.lagrange_basis(k - 1, self.gauss.points)
        self._v_dense = compat.lagrange_basis(k - 1, np.linspace(0, 1, 4 * k + 1))
        self._v_to_powers = np.linalg.inv(np.vander(2 * compat.nodes(k - 1) - 1, k, increasing=True))
        self._held_strains = np.array([0.0 if i in system.scene.free_strains else x for i, x in enumerate(UNDEFORMED)])
        self._probe_weights = [self._position_weights(s) for s in system.scene.ordinate.places]
        self._cells = cells
        self.reduced = f.discretization.formulation == "reduced"

    def ordinate(self, x: PETSc.Vec) -> float:
        """Ordinate of the scene at the state ``x``."""
        state, of = self.system.at(x), self.system.scene.ordinate
        return state.integral(self.system.equations.ordinate) if of.s is None else float(of.of(*self._at(state, of.s)))

    def stretch(self, x: PETSc.Vec) -> float:
        """Smallest stretch ``v3`` along the rod; 1 for an inextensible rod.

        The least value at many points picks an element and a place; Newton's method finds the minimum of the polynomial
        nearby.
        """
        if 2 not in self.system.scene.free_strains:
            return 1.0
        nodal = self.system.at(x).values("v")[self._cells, :, -1]
        dense = nodal @ self._v_dense.T
        cell, place = divmod(int(dense.argmin()), dense.shape[1])
        spacing = 2.0 / (dense.shape[1] - 1)
        turn = minimum((self._v_to_powers @ nodal[cell]).tolist(), -1.0 + spacing * place, spacing)
        return float(self.system.comm.allreduce(min(float(dense[cell, place]), turn), op=MPI.MIN))

    def sample(self, x: PETSc.Vec) -> dict[str, Any]:
        """All of a state in natural order on every rank, independent of the number of ranks.

        ``s`` (m,), ``r`` (m, 3) and ``q`` (m, 4) at the nodes from left to right; each further field by name,
        continuous ones (m, components), discontinuous ones (elements, nodes, components); scalars by name.
        """
        system, f, state = self.system, self.system.fields, self.system.at(x)
        local: dict[str, np.ndarray] = {"start": self.start}
        for block in f.blocks:
            local[block.name] = state.values(block.name)[self._cells][:, np.argsort(compat.nodes(block.degree)), :]
        if self.reduced:
            slopes = self._slopes(state)
            local["ends"] = np.einsum("g,cgi,c->ci", self.gauss.weights, slopes, self.size)
            local["inside"] = np.einsum("ng,cgi,c->cni", self.gauss.integrals(self.nodes), slopes, self.size)
        out: dict[str, Any] = {"elements": f.discretization.elements}
        order = np.argsort(all_cells := self.gather(local.pop("start")))
        all_fields = {name: self.gather(values)[order] for name, values in local.items()}
        h = np.diff(np.append(all_cells[order], system.scene.interval[1]))
        out["s"] = self._unique(all_cells[order][:, None, None] + h[:, None, None] * self.nodes[None, :, None])[:, 0]
        for block in f.blocks:
            values = all_fields[block.name]
            out[block.name] = self._unique(values) if block.continuous else values
        if self.reduced:
            ends = np.vstack([np.zeros(3), np.cumsum(all_fields["ends"], axis=0)])
            out["r"] = self._anchor(state, ends[-1]) + self._unique(ends[:-1, None, :] + all_fields["inside"])
        else:
            out["r"] = out["r"] + f.lift(out["s"], state.constants())
        out["q"] = f.turning.quaternion(out[f.turning.name])
        return out | dict(zip(system.scalars, [*state.scalars.values(), *state.drifts.tolist()], strict=True))

    def restore(self, sample: dict[str, Any]) -> PETSc.Vec:
        """State vector of a :meth:`sample`, taken with the same formulation but any number of elements and degree."""
        f = self.system.fields
        ends = np.append(sample["s"][:: self._degree_of(sample)], sample["s"][-1])[: self._elements_of(sample) + 1]
        named = {name: sample[name] for name in self.system.scalars if not name.startswith("drift")}
        for block in f.blocks:
            x = f.coordinates(block.degree)
            inwards = x + 1e-9 * (x.mean(axis=1, keepdims=True) - x)  # the end of a cell belongs to that cell
            named[block.name] = self._evaluate(sample, block, ends, x, inwards)
        return self.system.vector(f.filled(named))

    def with_centreline(self, given: NodalValues) -> PETSc.Vec:
        """State with the centreline, or the scalar positions of the ends, that rotations and strains integrate to.

        What then misses a held end is spread evenly over the rod.
        """
        system, f, out = self.system, self.system.fields, given.local.copy()
        slopes = self._slopes(given)
        pieces = np.einsum("g,cgi,c->ci", self.gauss.weights, slopes, self.size)
        starts, inside = self.start, np.einsum("ng,cgi,c->cni", self.gauss.integrals(self.nodes), slopes, self.size)
        order = np.argsort(self.gather(starts))
        steps = self.gather(pieces)[order]
        before = np.vstack([np.zeros(3), np.cumsum(steps, axis=0)])
        c = given.constants()
        left, right = ([None if p is None else float(p) for p in end.held(c)] for end in system.scene.sides)
        a = np.array([p if p is not None else (q or 0.0) - d for p, q, d in zip(left, right, before[-1], strict=True)])
        b = np.array([q if q is not None else x + d for q, x, d in zip(right, a, before[-1], strict=True)])
        for i, unknown in enumerate(f.unknown_scalars):
            if unknown.group.motion is Motion.POSITION:
                out[f.copies[:, i]] = (a, b)[LETTERS.index(unknown.group.name)][unknown.component]
        if self.reduced:
            return system.vector(out)
        first = np.searchsorted(self.gather(starts)[order], starts)
        r = a + before[:-1][first][:, None, :] + inside
        s = starts[:, None] + self.size[:, None] * self.nodes
        x = (s - system.scene.interval[0])[..., None] / system.scene.length
        out[f.dofs["r"][self._cells][:, self._order]] = r + x * (b - a - before[-1]) - f.lift(s, c)
        return system.vector(out)

    # --- inside ------------------------------------------------------------------------------------------------

    @staticmethod
    def _elements_of(sample: dict[str, Any]) -> int:
        return int(sample["elements"]) if "elements" in sample else 0

    def _degree_of(self, sample: dict[str, Any]) -> int:
        return (len(sample["s"]) - 1) // self._elements_of(sample)

    def _evaluate(
        self, sample: dict[str, Any], block: Any, ends: np.ndarray, x: np.ndarray, inwards: np.ndarray
    ) -> np.ndarray:
        degree, cell = self._degree_of(sample), np.clip(np.searchsorted(ends, inwards) - 1, 0, len(ends) - 2)
        own = degree if block.continuous else degree - 1
        table = np.asarray(sample[block.name])
        if block.name == "r":
            table = table - self.system.fields.lift(sample["s"], self.system.line.constants(sample[LOAD]))
        if block.continuous:
            table = table[np.arange(len(ends) - 1)[:, None] * degree + np.arange(degree + 1)]
        local = (x - ends[cell]) / (ends[cell + 1] - ends[cell])
        basis = compat.lagrange_basis(own, local.ravel())[:, np.argsort(compat.nodes(own))]
        return np.einsum("pn,pni->pi", basis, table[cell.ravel()]).reshape(*x.shape, block.size)

    def gather(self, values: np.ndarray) -> np.ndarray:
        """Rows of all ranks, one for each element, in the order of the ranks."""
        return values if self.system.comm.size == 1 else np.concatenate(self.system.comm.allgather(values))

    @staticmethod
    def _unique(values: np.ndarray) -> np.ndarray:
        """Values at the nodes of a continuous field, (cells, nodes, ...) -> (m, ...)."""
        return np.concatenate([values[:, :-1].reshape(-1, values.shape[-1]), values[-1:, -1]])

    def _slopes(self, state: NodalValues) -> np.ndarray:
        """``r' = R v`` at the Gauss points of the owned cells, (cells, points, 3)."""
        R = directors(state.fields.turning.quaternion(self._q_at_gauss @ state.turned[self._cells]))
        free = list(self.system.scene.free_strains)
        slopes = R @ self._held_strains
        if free:
            v = self._v_at_gauss @ state.values("v")[self._cells]
            slopes += (R[..., free] @ v[..., None])[..., 0]
        return np.asarray(slopes)

    def _position_weights(self, s: float) -> tuple[np.ndarray, np.ndarray]:
        """Weights of slopes at Gauss points in their integrals to ``s`` and over the rod, of nodal values at ``s``."""
        local = (s - self.start) / self.size
        integral = self.gauss.integrals(np.clip(local, 0, 1)) * self.size[:, None]
        first = self.system.scene.interval[0]
        inside = (local > 0) & (local <= 1) if s > first else np.isclose(self.start, first)
        value = np.zeros((len(local), len(self.nodes)))
        value[inside] = compat.lagrange_basis(len(self.nodes) - 1, local[inside])
        whole = np.outer(self.size, self.gauss.weights)
        return np.stack([integral.ravel(), whole.ravel()]), value.ravel()

    def _at(self, state: NodalValues, s: float) -> tuple[np.ndarray, np.ndarray]:
        """Centreline (3,) and unit quaternion (4,) at the ordinate's arclength."""
        system, f = self.system, self.system.fields
        ((integral, value),) = self._probe_weights
        parts = np.zeros((3, 4))
        size = f.turning.size
        parts[0, :size] = value @ state.turned[self._cells].reshape(-1, size)
        if self.reduced:
            parts[1:, :3] = integral @ self._slopes(state).reshape(-1, 3)
        else:
            parts[1, :3] = value @ state.values("r")[self._cells].reshape(-1, 3)
        if system.comm.size > 1:
            parts = system.comm.allreduce(parts)
        r = parts[1, :3] + (
            self._anchor(state, parts[2, :3]) if self.reduced else f.lift(np.array(s), state.constants())
        )
        q = f.turning.quaternion(parts[0, :size])
        return r, q / np.linalg.norm(q)

    def _anchor(self, state: NodalValues, chord: np.ndarray) -> np.ndarray:
        """Position of the left end: where it is held, or else a chord back from where the right end is held."""
        left, right = end_positions(self.system.scene, state.constants(), state.scalars, float)
        return np.array([a if a is not None else (b or 0.0) - d for a, b, d in zip(left, right, chord, strict=True)])
