r"""What a mesh makes of the motion along a rod: the part of an eigenvalue that is the mesh's alone.

Where no equation has the arclength in it the derivative ``s`` of a state along the rod solves the linearised equations
inside the rod, whatever happens at its ends: ``w . S s = 0`` for every change ``w`` of state that vanishes at the ends
and leaves the scalars alone.  On a mesh that product is not zero.  An eigenvector ``v`` of metric norm 1 that is a
motion along the rod and motions of all of it, ``v = c s + ...``, has the eigenvalue

    mu = v . S v = c w . S s + (what the ends do),

with ``w`` for ``v`` without its values at the ends and its scalars.  The first term is the mesh's part.  A buckle far
from the ends has an eigenvalue that falls exponentially with their distance, the mesh's part falls with a power of its
elements' length: it pins the buckle, where that is stable or where it is not.

``S`` is here that of all values, and the derivative is taken at clamped ends, too, where a change of state vanishes.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from rodfem.fem.symmetries import derivative, mismatch
from rodfem.linalg.orthogonal import combine
from rodfem.stability.inertia import Factored, Inertia
from rodfem.stability.motion_names import DEPENDENT, SHARE, MotionNames
from rodfem.tolerances import same_place

AMPLE = 2.0
"""Safety factor on the mesh's part: that of one motion, while the eigenvector has a little of others."""

JUMP = 100.0
"""The mesh's part over the lowest bending eigenvalue is less than this times the square of the greatest jump of the
derivative between elements: ten times as much as was seen."""
MOSTLY = 0.5
"""Part of the cost of a motion that may be another's than the mesh's where most of it is the mesh's."""


class Sliding:
    """Finds what the mesh makes of the motion along an open rod; collective over the ranks of its system."""

    def __init__(self, names: MotionNames) -> None:
        """Nothing is computed before a state is given; ``names`` knows the motions of its rod."""
        self.names, self.system = names, names.system

    @cached_property
    def possible(self) -> bool:
        """Whether the equations are the same all along an open rod, and have a potential."""
        scene = self.system.scene
        return not scene.closed and scene.conservative and self.system.equations.uniform

    def parts(self, x: PETSc.Vec, vectors: list[PETSc.Vec]) -> np.ndarray:
        """Bounds of what the mesh makes of the eigenvalues of some ``vectors`` of metric norm 1 at a state ``x``.

        Zero for those that are no motion along the rod; (number,).
        """
        along = _Along(self.names, x) if self.possible and vectors else None
        return np.zeros(len(vectors)) if along is None else AMPLE * np.array([abs(along.part(v)) for v in vectors])

    def suspects(self, inertia: Inertia, x: PETSc.Vec, nearest: float) -> int:
        """Number of motions along the rod at a state ``x`` of which the mesh may make an eigenvalue of another sign.

        No eigenvalue is known to be nearer to zero than ``nearest``, in the metric of the ``inertia``.
        """
        if not self.possible or JUMP * inertia.scale * mismatch(self.system.at(x)) ** 2 < nearest:
            return 0
        return _Along(self.names, x).suspects(inertia.at(x), nearest)


class _Along:
    """Motion along the rod at one state, beside the motions of all of it."""

    def __init__(self, names: MotionNames, x: PETSc.Vec) -> None:
        """Find the generators; those of the symmetries of the state have no part in them."""
        self.names, self.system, self.state = names, names.system, names.system.at(x)
        turning, rigid, along = names.generators(x, self.state)
        self.group = [*along, *turning, *rigid]
        self.across: PETSc.Vec | None = None
        if along:
            share, weights = names.share(along[0][1], self.group[1:])
            if share < 1 - DEPENDENT:  # else it is a motion of the whole rod
                self.across = along[0][1] - combine([g for _, g in self.group], np.append(0.0, weights))

    def part(self, v: PETSc.Vec) -> float:
        """``c w . S s`` of a vector of metric norm 1, zero for one that is no motion along the rod."""
        if self.across is None or self.names.share(v, self.group)[0] <= SHARE:
            return 0.0
        c, product = self._factors([v])
        return float(c[0] * product[0])

    def _factors(self, vectors: list[PETSc.Vec]) -> tuple[np.ndarray, np.ndarray]:
        """``c`` and ``w . S s`` of vectors, each (number,)."""
        assert self.across is not None
        image, comm = self.names.metric * self.across, self.system.comm
        c = np.array([v.dot(image).real for v in vectors]) / self._derivative.dot(image).real
        own = np.array([self.system.change(v).local @ self._covector for v in vectors])
        return c, own if comm.size == 1 else comm.allreduce(own, op=MPI.SUM)

    def suspects(self, found: Factored, nearest: float) -> int:
        """Number of motions along the rod that cost less than its bending, but for the mesh's part.

        ``found`` is ``S`` at the state; the mesh's part exceeds ``nearest``.
        """
        if self.across is None:
            return 0
        inertia, vectors = found.inertia, [g for _, g in self.group]
        gram, quadratic = (
            np.array([[g.dot(w).real for w in images] for g in vectors])
            for images in ([matrix * g for g in vectors] for matrix in (inertia.metric, found.matrix))
        )
        squares, turn = np.linalg.eigh(gram)
        basis = turn[:, squares > DEPENDENT] / np.sqrt(squares[squares > DEPENDENT])
        theta, z = np.linalg.eigh(basis.T @ quadratic @ basis)
        c, product = ((basis @ z).T @ x for x in self._factors(vectors))
        parts = abs(c * product)
        cheap = abs(abs(theta) - parts) < np.maximum(inertia.scale, MOSTLY * parts)
        return int((cheap & (AMPLE * parts > nearest)).sum())

    @cached_property
    def _derivative(self) -> PETSc.Vec:
        """``s``, without what is clamped."""
        return self.system.vector(derivative(self.state), np.zeros(len(self.system.drifts)))

    @cached_property
    def _covector(self) -> np.ndarray:
        """``S s`` by this rank's cells, zero at the ends and for scalars, (local size,)."""
        fields, state = self.system.fields, self.state
        out = np.array(state.tangent() @ fields.scattered(fields.arclength.everywhere @ state.local))
        out[self._ends] = 0.0
        return out

    @cached_property
    def _ends(self) -> np.ndarray:
        """Local degrees of freedom of continuous fields at the ends of the rod, and scalars."""
        fields = self.system.fields
        found, interval, length = [fields.copies.ravel()], fields.scene.interval, fields.scene.length
        for block in (b for b in fields.blocks if b.continuous):
            s = fields.coordinates(block.degree)
            found += [fields.dofs[block.name][same_place(s, end, length)].ravel() for end in interval]
        return np.concatenate(found)
