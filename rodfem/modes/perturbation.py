r"""Motion of the rod in a perturbation of a state: displacement and infinitesimal rotation, in order along the rod.

The rotation is the spin ``w`` with ``dd_i = w x d_i``, in the space frame; of the quaternion it is ``w = 2 vec(dq
conj(q)) / |q|^2``.  Without a centreline the displacement is the integral of the linearised kinematics ::

    dr' = w x r' + R dv,        r' = R v,

with the quadrature of the weak form, from the end that is held: it obeys the end conditions as exactly as the integral
constraints do.  Of a ring it is taken without its mean.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from petsc4py import PETSc

from rodfem.fem.fields import end_positions
from rodfem.fem.shape import Shape
from rodfem.fem.values import NodalValues
from rodfem.problem.quaternions import CONJUGATE, directors, product


@dataclass(frozen=True)
class Motion:
    """Displacement ``r`` (m, 3), rotation ``w`` (m, 3), both in the space frame, change of quaternion ``q`` (m, 4)."""

    r: np.ndarray
    w: np.ndarray
    q: np.ndarray


class Motions(Shape):
    """Evaluates perturbations of the states of one :class:`~rodfem.fem.system.System`; collective over its ranks."""

    def at(self, x: PETSc.Vec, d: PETSc.Vec) -> Motion:
        """Motion in the perturbation ``d`` of the state ``x``, at fixed load."""
        turning, state, motion = self.system.fields.turning, self.system.at(x), self.system.change(d)
        field, change = state.turned[self._cells], motion.turned[self._cells]
        dq = turning.change(field, change)
        pieces = {"q": dq, "w": spin(turning.quaternion(field), dq)}
        if not self.reduced:
            every = self._in_order(pieces | {"r": motion.values("r")[self._cells]})
            return Motion(self._unique(every["r"]), self._unique(every["w"]), self._unique(every["q"]))
        field, change = (np.einsum("gn,cni->cgi", self._q_at_gauss, values) for values in (field, change))
        q, dq = turning.quaternion(field), turning.change(field, change)
        turned = np.cross(spin(q, dq), self._slopes(state))
        if "v" in motion.fields.dofs:
            free = list(self.system.scene.free_strains)
            dv = np.einsum("gn,cni->cgi", self._v_at_gauss, motion.values("v")[self._cells])
            turned += np.einsum("cgij,cgj->cgi", directors(q)[..., free], dv)
        every = self._in_order(pieces) | self._in_order(
            {
                "ends": np.einsum("g,cgi,c->ci", self.gauss.weights, turned, self.size),
                "r": np.einsum("ng,cgi,c->cni", self.gauss.integrals(self.nodes), turned, self.size),
            },
            sort=False,
        )
        ends = np.vstack([np.zeros(3), np.cumsum(every["ends"], axis=0)])
        r = self._unique(ends[:-1, None, :] + every["r"]) + self._first(motion, ends[-1])
        if self.system.scene.closed:
            r = r - self._mean(r)
        return Motion(r, self._unique(every["w"]), self._unique(every["q"]))

    def dual(self, x: PETSc.Vec, y: PETSc.Vec) -> Motion:
        """Nodal weights of the linear functional ``d -> y . d`` of perturbations of the state ``x``.

        ``sum over nodes of (r . displacement + w . rotation)`` is its value, where ``y`` involves nothing but positions
        and rotations, as a product with the kinetic metric does.
        """
        turning, weights = self.system.fields.turning, self.system.change(y)
        field = self.system.at(x).turned[self._cells]
        q, dq = turning.quaternion(field), turning.functional(field, weights.turned[self._cells])
        pieces = {"q": dq, "w": np.sum(q * q, axis=-1, keepdims=True) / 4 * spin(q, dq)}
        if not self.reduced:
            pieces["r"] = weights.values("r")[self._cells]
        every = {name: self._unique(values) for name, values in self._in_order(pieces).items()}
        return Motion(every.get("r", np.zeros_like(every["w"])), every["w"], every["q"])

    def _in_order(self, pieces: dict[str, np.ndarray], *, sort: bool = True) -> dict[str, np.ndarray]:
        """Values of all ranks' cells from left to right, with ``sort`` those of their nodes too."""
        order = np.argsort(self.gather(self.start))
        every = {name: self.gather(values)[order] for name, values in pieces.items()}
        return {name: values[:, self._order] for name, values in every.items()} if sort else every

    def _first(self, motion: NodalValues, chord: np.ndarray) -> np.ndarray:
        """Displacement of the left end in a perturbation, if the right one's is ``chord`` more."""
        scene = self.system.scene
        left, right = end_positions(scene, scene.constants(), motion.scalars, lambda held: 0.0)
        return np.array([a if a is not None else (b or 0.0) - d for a, b, d in zip(left, right, chord, strict=True)])

    def _mean(self, values: np.ndarray) -> np.ndarray:
        """Mean over the arclength of nodal values (m, ...), by Gauss-Lobatto quadrature in each element."""
        weights = self.node_weights()
        return np.asarray(np.tensordot(weights, values, 1) / weights.sum())

    def node_weights(self) -> np.ndarray:
        """Weights (m,) of the nodes in an integral over the rod: Gauss-Lobatto quadrature in each element."""
        at_gauss = self._q_at_gauss[:, self._order]
        each = self.gauss.weights @ at_gauss
        sizes = self._in_order({"h": self.size}, sort=False)["h"]
        out = np.zeros(len(sizes) * (len(each) - 1) + 1)
        for node, weight in enumerate(each):
            out[node : len(out) - len(each) + node + 1 : len(each) - 1] += weight * sizes
        return out


def spin(q: np.ndarray, dq: np.ndarray) -> np.ndarray:
    """Infinitesimal rotation ``2 vec(dq conj(q)) / |q|^2`` in the space frame, (..., 4) -> (..., 3)."""
    return np.asarray(2 * product(dq, q * CONJUGATE)[..., 1:] / np.sum(q * q, axis=-1, keepdims=True))
