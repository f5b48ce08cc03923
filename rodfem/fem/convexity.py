"""Convexity of the stored energy along the states of a branch.

The second derivative of ``W`` in the free strains and curvatures must be positive definite (the Legendre-Hadamard
condition of a rod; Antman, Nonlinear Problems of Elasticity, 2005, chapter 8): where it is not, neither are equilibria
regular functions of the load nor does the index mean stability.  For a quadratic energy the undeformed state decides
for all.
"""

from __future__ import annotations

import numpy as np
import ufl
from mpi4py import MPI
from petsc4py import PETSc
from ufl.algorithms.analysis import extract_coefficients, extract_type
from ufl.algorithms.apply_algebra_lowering import apply_algebra_lowering
from ufl.algorithms.apply_derivatives import apply_derivatives

from forms.kinematics import curvature, strain
from rodfem.fem import form_compiler
from rodfem.fem.literals import with_constants
from rodfem.fem.system import System


class Convexity:
    """Evaluates the least eigenvalue of the second derivative of ``W`` along a state.

    At the Gauss points of each element and at its ends: strains are largest at a clamp or a joint more often than not.
    """

    def __init__(self, system: System) -> None:
        """Compile the second derivative."""
        self.system = system
        e, f, scene = system.equations, system.fields, system.scene
        u, free = e.unknowns, scene.free_strains
        values = e.components(u.v, len(free))
        k = curvature(u.q, u.q.dx(0))
        x = ufl.variable(ufl.as_vector([*values, *(k[i] for i in range(3))]))
        v = strain(free, [x[i] for i in range(len(free))])
        W = scene.energy(v, ufl.as_vector([x[len(free) + i] for i in range(3)]), e.constants)
        hessian = ufl.diff(ufl.diff(W, x), x)
        self.size = len(free) + 3
        entries = [hessian[i, j] for i in range(self.size) for j in range(self.size)]
        expression = apply_derivatives(apply_algebra_lowering(ufl.as_vector(entries)))
        places = [*extract_coefficients(expression), *extract_type(expression, ufl.SpatialCoordinate)]
        self.evaluate = None
        if not places:  # the same everywhere: checked with the scene
            return
        inside = (np.polynomial.legendre.leggauss(f.discretization.degree + 1)[0] + 1) / 2
        points = np.array([0.0, *inside, 1.0])
        vector = with_constants(ufl.as_vector(entries), f.mesh)
        self.evaluate = form_compiler.expression(vector, points.reshape(-1, 1), f.mesh, f.owned_cells)

    def holds(self, x: PETSc.Vec) -> bool:
        """Whether the second derivative is positive definite along the whole rod at the state ``x``.

        It is where Cholesky's factors exist; where not, the least eigenvalue decides.
        """
        if self.evaluate is None:
            return True
        mine = True
        try:
            np.linalg.cholesky(self._matrices(x))
        except np.linalg.LinAlgError:
            mine = False
        comm = self.system.comm
        sure = mine if comm.size == 1 else comm.allreduce(mine, op=MPI.LAND)
        return sure or not self.lowest(x) <= 0

    def lowest(self, x: PETSc.Vec) -> float:
        """Least eigenvalue over the whole rod at the state ``x``, relative to the largest one; 1 if it is constant."""
        if self.evaluate is None:
            return 1.0
        values = np.linalg.eigvalsh(self._matrices(x))
        mine = (values[:, 0] / abs(values).max(axis=1)).min() if len(values) else 1.0
        return float(self.system.comm.allreduce(float(mine), op=MPI.MIN))

    def scales(self, x: PETSc.Vec) -> np.ndarray:
        """Roots of the diagonals of the second derivative at a state ``x`` where it is positive definite."""
        return np.sqrt(np.einsum("pii->pi", self._matrices(x)))

    def margin(self, x: PETSc.Vec, scales: np.ndarray) -> float:
        """Least eigenvalue over the whole rod at the state ``x``, in units of the ``scales`` of a state nearby.

        So stiff strains do not hide bending, as they do from :meth:`lowest`, and it depends smoothly on the state.
        """
        values = np.linalg.eigvalsh(self._matrices(x) / scales[:, :, None] / scales[:, None])
        return float(self.system.comm.allreduce(float(values.min(initial=1.0)), op=MPI.MIN))

    def _matrices(self, x: PETSc.Vec) -> np.ndarray:
        """Second derivatives at all places of this rank, symmetric, (places, size, size)."""
        assert self.evaluate is not None
        matrices = self.system.at(x).evaluate(self.evaluate).reshape(-1, self.size, self.size)
        return np.asarray((matrices + matrices.transpose(0, 2, 1)) / 2)
