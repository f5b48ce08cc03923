r"""Motion of the rod in a perturbation of a state: displacement and infinitesimal rotation, in order along the rod.

The rotation is the spin ``w`` with ``dd_i = w x d_i``, in the space frame; of the quaternion it is ``w = 2 vec(dq
conj(q)) / |q|^2``.  Where the centreline is no field the displacement is the integral of the linearised kinematics ::

    dr' = w x r' + R dv,        r' = R v,

with the quadrature of the weak form, from the end that is held: it obeys the end conditions as exactly as the integral
constraints do.  Of a ring it is taken without its mean.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from petsc4py import PETSc

from rodfem.fem.shape import Shape
from rodfem.fem.state import NodalValues
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
        turning, state, change = self.system.fields.turning, self.system.at(x), self.system.change(d)
        field = state.turned[self.cells]
        dq = turning.change(field, change.turned[self.cells])
        r = self.system.fields.formulation.displacement(self, state, change)
        return Motion(r, self.nodal(spin(turning.quaternion(field), dq)), self.nodal(dq))

    def slope_changes(self, state: NodalValues, change: NodalValues) -> np.ndarray:
        """Change ``dr'`` of the slope at the Gauss points of the owned cells, (cells, points, 3)."""
        turning = self.system.fields.turning
        field, turned = (np.einsum("gn,cni->cgi", self._q_at_gauss, v.turned[self.cells]) for v in (state, change))
        q = turning.quaternion(field)
        out = np.cross(spin(q, turning.change(field, turned)), self.slopes(state))
        if free := list(self.system.scene.free_strains):
            dv = np.einsum("gn,cni->cgi", self._v_at_gauss, change.values("v")[self.cells])
            out += np.einsum("cgij,cgj->cgi", directors(q)[..., free], dv)
        return np.asarray(out)

    def dual(self, x: PETSc.Vec, y: PETSc.Vec) -> Motion:
        """Nodal weights of the linear functional ``d -> y . d`` of perturbations of the state ``x``.

        ``sum over nodes of (r . displacement + w . rotation)`` is its value, where ``y`` involves nothing but positions
        and rotations, as a product with the kinetic metric does.
        """
        turning, weights = self.system.fields.turning, self.system.change(y)
        field = self.system.at(x).turned[self.cells]
        q, dq = turning.quaternion(field), turning.functional(field, weights.turned[self.cells])
        w = self.nodal(np.sum(q * q, axis=-1, keepdims=True) / 4 * spin(q, dq))
        r = self.nodal(weights.values("r")[self.cells]) if "r" in weights.fields.dofs else np.zeros_like(w)
        return Motion(r, w, self.nodal(dq))

    def mean(self, values: np.ndarray) -> np.ndarray:
        """Mean over the arclength of nodal values (m, ...), by Gauss-Lobatto quadrature in each element."""
        weights = self.node_weights()
        return np.asarray(np.tensordot(weights, values, 1) / weights.sum())

    def node_weights(self) -> np.ndarray:
        """Weights (m,) of the nodes in an integral over the rod: Gauss-Lobatto quadrature in each element."""
        at_gauss = self._q_at_gauss[:, self.order]
        each = self.gauss.weights @ at_gauss
        sizes = self.from_left(self.size)
        out = np.zeros(len(sizes) * (len(each) - 1) + 1)
        for node, weight in enumerate(each):
            out[node : len(out) - len(each) + node + 1 : len(each) - 1] += weight * sizes
        return out


def spin(q: np.ndarray, dq: np.ndarray) -> np.ndarray:
    """Infinitesimal rotation ``2 vec(dq conj(q)) / |q|^2`` in the space frame, (..., 4) -> (..., 3)."""
    return np.asarray(2 * product(dq, q * CONJUGATE)[..., 1:] / np.sum(q * q, axis=-1, keepdims=True))
