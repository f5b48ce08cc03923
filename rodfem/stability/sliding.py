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
from petsc4py import PETSc

from rodfem.fem.symmetries import derivative, mismatch
from rodfem.linalg.matrices import times
from rodfem.stability.inertia import Factored, Inertia
from rodfem.stability.motion_names import DEPENDENT, SHARE, MotionNames, share
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

    across: np.ndarray | None

    def __init__(self, names: MotionNames, x: PETSc.Vec) -> None:
        """Find the generators; those of the symmetries of the state have no part in them."""
        self.names, self.system, self.state = names, names.system, names.system.at(x)
        turning, rigid, along = (rows for _, rows in names.rows(x, self.state))
        self.group = np.concatenate([along, turning, rigid])
        self.across = None
        self.images = self.system.weighed(self.group)
        self.gram = names.sum(self.group @ self.images.T)
        if len(along):
            along_them, weights = share(self.gram[1:, 1:], self.gram[0, 1:])
            if along_them < 1 - DEPENDENT:  # else it is a motion of the whole rod
                self.across = self.group[0] - weights @ self.group[1:]

    def part(self, v: PETSc.Vec) -> float:
        """``c w . S s`` of a vector of metric norm 1, zero for one that is no motion along the rod."""
        own = v.array_r[: self.group.shape[1]].real
        if self.across is None or share(self.gram, self.names.sum(self.images @ own))[0] <= SHARE:
            return 0.0
        c, product = self._factors(own[None])
        return float(c[0] * product[0])

    def _factors(self, own: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """``c`` and ``w . S s`` of vectors of which this rank has the rows ``own`` (number, own rows)."""
        assert self.across is not None
        system, sums = self.system, self.names.sum
        image = system.weighed(self.across[None])[0]
        c = sums(own @ image) / sums(self._derivative @ image)
        whole = np.zeros((len(own), system.workspace.local_size))
        whole[:, : own.shape[1]] = own
        return c, sums(system.changes(whole.T) @ self._covector)

    def suspects(self, found: Factored, nearest: float) -> int:
        """Number of motions along the rod that cost less than its bending, but for the mesh's part.

        ``found`` is ``S`` at the state; the mesh's part exceeds ``nearest``.
        """
        if self.across is None:
            return 0
        inertia, number = found.inertia, self.group.shape[1]
        products = [(found.matrix * self.system.generators.vector(g)).array_r[:number].real for g in self.group]
        quadratic = self.names.sum(self.group @ np.array(products).T)
        squares, turn = np.linalg.eigh(self.gram)
        basis = turn[:, squares > DEPENDENT] / np.sqrt(squares[squares > DEPENDENT])
        theta, z = np.linalg.eigh(basis.T @ quadratic @ basis)
        c, product = ((basis @ z).T @ x for x in self._factors(self.group))
        parts = abs(c * product)
        cheap = abs(abs(theta) - parts) < np.maximum(inertia.scale, MOSTLY * parts)
        return int((cheap & (AMPLE * parts > nearest)).sum())

    @cached_property
    def _derivative(self) -> np.ndarray:
        """``s``, without what is clamped, (own rows,)."""
        x = self.system.vector(derivative(self.state), np.zeros(len(self.system.drifts)))
        return np.asarray(x.array_r[: self.group.shape[1]].real)

    @cached_property
    def _covector(self) -> np.ndarray:
        """``S s`` by this rank's cells, zero at the ends and for scalars, (local size,)."""
        fields, state = self.system.fields, self.state
        out = times(state.tangent(), fields.scattered(times(fields.arclength.everywhere, state.local)))
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
