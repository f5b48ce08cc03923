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
from scipy.spatial.transform import Rotation

from forms.kinematics import UNDEFORMED
from rodfem import compat
from rodfem.fields import LOAD
from rodfem.system import System


def directors(q: np.ndarray) -> np.ndarray:
    """Rotation matrices of quaternions (..., 4), scalar first, of any length: (..., 3, 3)."""
    flat = np.asarray(q).reshape(-1, 4)
    return Rotation.from_quat(flat[:, [1, 2, 3, 0]]).as_matrix().reshape(*np.shape(q)[:-1], 3, 3)


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
    """Evaluates shapes of the states of one :class:`~rodfem.system.System`; collective over its ranks."""

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
        self._v_to_legendre = np.linalg.inv(legendre.legvander(2 * compat.nodes(k - 1) - 1, k - 1))
        self._probe_weights = self._position_weights(system.scene.ordinate.s)
        self._cells = cells
        self.reduced = f.discretization.formulation == "reduced"

    def ordinate(self, x: PETSc.Vec) -> float:
        """Ordinate of the scene at the state ``x``."""
        self.system.bring(x)
        of = self.system.scene.ordinate
        r, q = self._at(of.s)
        return float(of.of(r, q))

    def stretch(self, x: PETSc.Vec) -> float:
        """Smallest stretch ``v3`` along the rod; 1 for an inextensible rod.

        The least value at many points picks an element, and the minimum of the polynomial there is found from the
        roots of its slope.
        """
        f = self.system.fields
        if 2 not in self.system.scene.free_strains:
            return 1.0
        self.system.bring(x)
        nodal = f.u.x.array[f.dofs["v"][self._cells]][:, :, -1]
        lowest = nodal[np.argmin((nodal @ self._v_dense.T).min(axis=1))]
        polynomial = self._v_to_legendre @ lowest
        turns = (
            legendre.legroots(legendre.legder(polynomial))
            if len(polynomial) > 2 and abs(polynomial[2:]).max() > 1e-12
            else np.array([])
        )
        inside = np.clip(turns[abs(np.imag(turns)) < 1e-6].real, -1, 1) if len(turns) else turns
        mine = legendre.legval(np.array([-1.0, 1.0, *inside]), polynomial).min()
        return float(self.system.comm.allreduce(mine, op=MPI.MIN))

    def sample(self, x: PETSc.Vec) -> dict[str, Any]:
        """All of a state in natural order on every rank, independent of the number of ranks.

        ``s`` (m,), ``r`` (m, 3) and ``q`` (m, 4) at the nodes from left to right; each further field by name,
        continuous ones (m, components), discontinuous ones (elements, nodes, components); scalars by name.
        """
        system, f = self.system, self.system.fields
        system.bring(x)
        local: dict[str, np.ndarray] = {"start": self.start}
        for block in f.blocks:
            values = f.u.x.array[f.dofs[block.name][self._cells]]
            local[block.name] = values[:, np.argsort(compat.nodes(block.degree)), :]
        if self.reduced:
            slopes = self._slopes()
            local["ends"] = np.einsum("g,cgi,c->ci", self.gauss.weights, slopes, self.size)
            local["inside"] = np.einsum("ng,cgi,c->cni", self.gauss.integrals(self.nodes), slopes, self.size)
        out: dict[str, Any] = {"elements": f.discretization.elements}
        order = np.argsort(all_cells := self._gather(local.pop("start")))
        all_fields = {name: self._gather(values)[order] for name, values in local.items()}
        h = np.diff(np.append(all_cells[order], system.scene.interval[1]))
        out["s"] = self._unique(all_cells[order][:, None, None] + h[:, None, None] * self.nodes[None, :, None])[:, 0]
        for block in f.blocks:
            values = all_fields[block.name]
            out[block.name] = self._unique(values) if block.continuous else values
        load = system.scalar(x, LOAD)
        if self.reduced:
            ends = np.vstack([np.zeros(3), np.cumsum(all_fields["ends"], axis=0)])
            out["r"] = self._anchor(load, ends[-1]) + self._unique(ends[:-1, None, :] + all_fields["inside"])
        else:
            out["r"] = out["r"] + self.system.fields.lift(out["s"], load)
        for name in system.scalars:
            out[name] = system.scalar(x, name)
        return out

    def restore(self, sample: dict[str, Any]) -> PETSc.Vec:
        """State vector of a :meth:`sample`, taken with the same formulation but any number of elements and degree."""
        f = self.system.fields
        ends = np.append(sample["s"][:: self._degree_of(sample)], sample["s"][-1])[: self._elements_of(sample) + 1]
        held = f.number < 0
        clamped = f.u.x.array[held]
        for block in f.blocks:
            x = f.coordinates(block.degree)
            inwards = x + 1e-9 * (x.mean(axis=1, keepdims=True) - x)  # the end of a cell belongs to that cell
            values = self._evaluate(sample, block, ends, x, inwards)
            f.u.x.array[f.dofs[block.name]] = values
        for position, name in enumerate(name for name in self.system.scalars if not name.startswith("drift")):
            f.u.x.array[f.copies[:, position]] = sample[name]
        f.u.x.array[held] = clamped
        return self.system.take()

    def place_centreline(self, load: float) -> None:
        """Set the centreline, or the scalar positions of the ends, to what the rotations and strains integrate to.

        What then misses a held end is spread evenly over the rod.
        """
        system, f = self.system, self.system.fields
        slopes = self._slopes()
        pieces = np.einsum("g,cgi,c->ci", self.gauss.weights, slopes, self.size)
        starts, inside = self.start, np.einsum("ng,cgi,c->cni", self.gauss.integrals(self.nodes), slopes, self.size)
        order = np.argsort(self._gather(starts))
        steps = self._gather(pieces)[order]
        before = np.vstack([np.zeros(3), np.cumsum(steps, axis=0)])
        c = system.scene.constants(load)
        left, right = ([None if p is None else float(p) for p in end.held(c)] for end in system.scene.sides)
        a = np.array([p if p is not None else (q or 0.0) - d for p, q, d in zip(left, right, before[-1], strict=True)])
        b = np.array([q if q is not None else x + d for q, x, d in zip(right, a, before[-1], strict=True)])
        for i, unknown in enumerate(f.unknown_scalars):
            if unknown.group in ("a", "b"):
                f.u.x.array[f.copies[:, i]] = (a if unknown.group == "a" else b)[unknown.component]
        if self.reduced:
            return
        first = np.searchsorted(self._gather(starts)[order], starts)
        r = a + before[:-1][first][:, None, :] + inside
        s = starts[:, None] + self.size[:, None] * self.nodes
        x = (s - system.scene.interval[0])[..., None] / system.scene.length
        r = r + x * (b - a - before[-1]) - f.lift(s, load)
        values = np.empty_like(r)
        values[:, self._order] = r
        local = f.dofs["r"][self._cells]
        free = f.number[local] >= 0
        f.u.x.array[local[free]] = values[free]
        f.u.x.scatter_forward()

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
            table = table - self.system.fields.lift(sample["s"], sample[LOAD])
        if block.continuous:
            table = table[np.arange(len(ends) - 1)[:, None] * degree + np.arange(degree + 1)]
        local = (x - ends[cell]) / (ends[cell + 1] - ends[cell])
        basis = compat.lagrange_basis(own, local.ravel())[:, np.argsort(compat.nodes(own))]
        return np.einsum("pn,pni->pi", basis, table[cell.ravel()]).reshape(*x.shape, block.size)

    def _gather(self, values: np.ndarray) -> np.ndarray:
        return values if self.system.comm.size == 1 else np.concatenate(self.system.comm.allgather(values))

    @staticmethod
    def _unique(values: np.ndarray) -> np.ndarray:
        """Values at the nodes of a continuous field, (cells, nodes, ...) -> (m, ...)."""
        return np.concatenate([values[:, :-1].reshape(-1, values.shape[-1]), values[-1:, -1]])

    def _slopes(self) -> np.ndarray:
        """``r' = R v`` at the Gauss points of the owned cells, (cells, points, 3)."""
        f = self.system.fields
        q = np.einsum("gn,cni->cgi", self._q_at_gauss, f.u.x.array[f.dofs["q"][self._cells]])
        v = np.broadcast_to(np.array(UNDEFORMED), (*q.shape[:2], 3)).copy()
        free = list(self.system.scene.free_strains)
        if free:
            v[:, :, free] = np.einsum("gn,cni->cgi", self._v_at_gauss, f.u.x.array[f.dofs["v"][self._cells]])
        return np.einsum("cgij,cgj->cgi", directors(q), v)

    def _position_weights(self, s: float) -> tuple[np.ndarray, np.ndarray]:
        """Weights of the slopes at Gauss points in the integral up to ``s``, and of nodal values in the value there."""
        local = (s - self.start) / self.size
        integral = self.gauss.integrals(np.clip(local, 0, 1)) * self.size[:, None]
        first = self.system.scene.interval[0]
        inside = (local > 0) & (local <= 1) if s > first else np.isclose(self.start, first)
        value = np.zeros((len(local), len(self.nodes)))
        value[inside] = compat.lagrange_basis(len(self.nodes) - 1, local[inside])
        return integral, value

    def _at(self, s: float) -> tuple[np.ndarray, np.ndarray]:
        """Centreline (3,) and unit quaternion (4,) at the ordinate's arclength."""
        system, f = self.system, self.system.fields
        integral, value = self._probe_weights
        u = f.u.x.array
        parts = np.zeros((3, 4))
        parts[0] = np.einsum("cn,cni->i", value, u[f.dofs["q"][self._cells]])
        if self.reduced:
            slopes = self._slopes()
            parts[1, :3] = np.einsum("cg,cgi->i", integral, slopes)
            parts[2, :3] = np.einsum("g,cgi,c->i", self.gauss.weights, slopes, self.size)
        else:
            parts[1, :3] = np.einsum("cn,cni->i", value, u[f.dofs["r"][self._cells]])
        if system.comm.size > 1:
            parts = system.comm.allreduce(parts)
        load = float(f.u.x.array[f.copies[0, -1]])
        r = parts[1, :3] + (
            self._anchor(load, parts[2, :3]) if self.reduced else self.system.fields.lift(np.array(s), load)
        )
        return r, parts[0] / np.linalg.norm(parts[0])

    def _anchor(self, load: float, chord: np.ndarray) -> np.ndarray:
        """Position of the left end: where it is held, or else a chord back from where the right end is held."""
        f = self.system.fields
        scalar = {x.name: float(f.u.x.array[f.copies[0, i]]) for i, x in enumerate(f.unknown_scalars)}
        c = self.system.scene.constants(load)
        left, right = (
            [scalar.get(f"{letter}{i + 1}") if p is None else float(p) for i, p in enumerate(end.held(c))]
            for letter, end in zip("ab", self.system.scene.sides, strict=True)
        )
        return np.array([a if a is not None else (b or 0.0) - d for a, b, d in zip(left, right, chord, strict=True)])
