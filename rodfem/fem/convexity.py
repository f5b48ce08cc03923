"""Convexity of the stored energy along the states of a branch.

The second derivative of ``W`` in the free strains and curvatures must be positive definite (the Legendre-Hadamard
condition of a rod; Antman, Nonlinear Problems of Elasticity, 2005, chapter 8): where it is not, neither are equilibria
regular functions of the load nor does the index mean stability.  For a quadratic energy the undeformed state decides
for all.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import ufl
from mpi4py import MPI
from petsc4py import PETSc

from rodfem.expressions import Variable, differentiated, extract_coefficients, extract_type
from rodfem.fem.equations import Equations
from rodfem.fem.system import System
from rodfem.forms.kinematics import curvature, strain
from rodfem.problem.functions import derived

GRID = 25
"""Places of an element, at equal distances, at which a material that varies along it is looked at as well."""


def second_derivative(e: Equations) -> tuple[Any, bool, Any]:
    """Entries of the second derivative of ``W`` as a vector in UFL; whether the state is in them; and them expanded."""
    u, scene = e.unknowns, e.fields.scene
    free, k = scene.free_strains, curvature(u.q, u.q.dx(0))
    x = ufl.variable(ufl.as_vector([*e.components(u.v, len(free)), *(k[i] for i in range(3))]))
    v = strain(free, [x[i] for i in range(len(free))])
    W = scene.energy(v, ufl.as_vector([x[len(free) + i] for i in range(3)]), e.constants)
    hessian, every = ufl.diff(ufl.diff(W, x), x), range(len(free) + 3)
    vector = ufl.as_vector([hessian[i, j] for i in every for j in every])
    expanded = differentiated(vector)
    variables = extract_type(expanded, Variable)
    return vector, any(node.ufl_operands[1] == x.label() for node in variables), expanded


class Convexity:
    """Evaluates the least eigenvalue of the second derivative of ``W`` along a state.

    At the Gauss points of each element and at its ends: strains are largest at a clamp or a joint more often than not.
    A material that varies along the rod may be too soft between them: it is looked at on a grid as well, and at the
    vertices of parabolas through the values there.

    It ``alters`` with the state or the load, of the parameters with these ``names``, and ``varies`` along the rod.
    """

    def __init__(self, system: System, *names: str) -> None:
        self.system, e, f = system, system.equations, system.fields
        self.size = len(system.scene.free_strains) + 3
        vector, of_state, known = derived(e, "second derivative", lambda: second_derivative(e))
        self.alters = of_state or (bool(extract_coefficients(known)) and system.scene.energy_depends_on(*names))
        self.varies = bool(extract_type(known, ufl.SpatialCoordinate))
        self.evaluate = None
        if not self.alters and not self.varies:  # the same everywhere: checked with the scene
            return
        inside = (np.polynomial.legendre.leggauss(f.discretization.degree + 1)[0] + 1) / 2
        points = np.array([0.0, *inside, 1.0, *(np.linspace(0.0, 1.0, GRID) if self.varies else [])])
        self.places = len(points)
        self.evaluate = derived(e, "convexity", lambda: e.evaluated(vector, points))

    def holds(self, x: PETSc.Vec) -> bool:
        """Whether the second derivative is positive definite along the whole rod at the state ``x``."""
        if self.varies and not self.margin(x, self.scales(x)) > 0:
            return False
        return not self.lowest(x) <= 0

    def lowest(self, x: PETSc.Vec) -> float:
        """Least eigenvalue over the whole rod at the state ``x``, relative to the largest one; 1 if it is constant."""
        if self.evaluate is None:
            return 1.0
        values = np.linalg.eigvalsh(self._matrices(x))
        mine = (values[:, 0] / abs(values).max(axis=1)).min() if len(values) else 1.0
        return float(self.system.comm.allreduce(float(mine), op=MPI.MIN))

    def scales(self, *states: PETSc.Vec) -> np.ndarray:
        """Roots of the largest diagonals of the second derivative on each element, at some states: (cells, 1, size).

        Of one state alone they are too small where a strain has hardly any stiffness left: in units of these the other
        strains are the least eigenvalue almost everywhere, and hide it.
        """
        diagonals = [abs(np.einsum("cpii->cpi", self._by_element(x))) for x in states]
        return np.asarray(np.sqrt(np.max(diagonals, axis=0).max(axis=1, keepdims=True)))

    def margin(self, x: PETSc.Vec, scales: np.ndarray) -> float:
        """Least eigenvalue over the whole rod at the state ``x``, in units of the ``scales`` of states nearby.

        So stiff strains do not hide bending, as they do from :meth:`lowest`, and it depends smoothly on the state.
        """
        least = np.linalg.eigvalsh(self._by_element(x) / scales[..., None] / scales[..., None, :])[..., 0]
        mine = least.min(initial=1.0)
        if self.varies:
            mine = min(mine, _vertices(least[:, -GRID:]).min(initial=1.0))
        return float(self.system.comm.allreduce(float(mine), op=MPI.MIN))

    def _by_element(self, x: PETSc.Vec) -> np.ndarray:
        """Second derivatives by element of this rank and place on it, (cells, places, size, size)."""
        return self._matrices(x).reshape(self.system.fields.owned_cells, self.places, self.size, self.size)

    def _matrices(self, x: PETSc.Vec) -> np.ndarray:
        """Second derivatives at all places of this rank, symmetric, (places, size, size)."""
        assert self.evaluate is not None
        matrices = self.system.at(x).evaluate(self.evaluate).reshape(-1, self.size, self.size)
        return np.asarray((matrices + matrices.transpose(0, 2, 1)) / 2)


def _vertices(values: np.ndarray) -> np.ndarray:
    """Lowest values of parabolas through three of some ``values`` on elements, (cells, places), of those believed."""
    a, b, c = values[:, :-2], values[:, 1:-1], values[:, 2:]
    slope, curvature = (c - a) / 2, a - 2 * b + c
    before, after = (3 * a - 3 * b + c)[:, 1:] - values[:, :-3], (a - 3 * b + 3 * c)[:, :-1] - values[:, 3:]
    off = np.maximum(np.pad(abs(before), ((0, 0), (1, 0))), np.pad(abs(after), ((0, 0), (0, 1))))
    # a parabola through a jump is not believed: it has lower values than the function
    believed = (abs(slope) <= curvature) & (curvature > 0) & (off <= 0.1 * (np.maximum(a, c) - b))
    return np.asarray(b[believed] - slope[believed] ** 2 / (2 * curvature[believed]))
