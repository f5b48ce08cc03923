r"""Eigenvalues by reduction: the pencil of a state on the kernel of its constraints.

With ``C = (Q1 Q2) (R; 0)`` from :mod:`rodfem.linalg.null_space`, the perturbations that fulfil the constraints are ``x
= Q2 z``, and the singular pencil ``(K C; C^t 0), (M 0; 0 0)`` of size m + p becomes

    Q2^t K Q2 z = mu Q2^t M Q2 z,        of size m - p,

whose finite eigenvalues are those of the former, without its 2p infinite ones (Kumar & Healey 2010, (21)-(32)).  SLEPc
sees a matrix that it can only multiply by, in O(m) operations for pointwise constraints, O(m p) for integral ones.

Shift-invert and Cayley transforms need the inverse of the shifted matrix: :mod:`rodfem.stability.projection`.

Every rank gathers the whole matrices and computes the same.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from petsc4py import PETSc
from slepc4py import SLEPc

from rodfem.errors import ConvergenceError, InputError
from rodfem.linalg.orthogonal import generic
from rodfem.stability.blocks import Pencil
from rodfem.stability.pencil import UNSYMMETRIC, eigensolver, seek, use_inverse
from rodfem.stability.projection import INVERSES, Projection, ShiftedInverse

TRANSFORMS = ("shift-invert", "cayley")
FACTORISATIONS = 3
"""Of the eigenvalues of a symmetric pencil near a shift: there, and to count on both sides of it."""
BEYOND = 1e-6
"""Part of the farthest distance from the target by which a count reaches farther."""
SPURIOUS = 1e-8
"""A vector of an infinite eigenvalue (no mass) comes with an arbitrary value, and a residual greater than this."""


def cayley_parameters(first: float, second: float) -> tuple[float, float]:
    """Shift ``a1 = (first + second)/2`` and antishift ``a2 = 2 second - a1`` for two left-most values.

    ``(mu - a2)/(mu - a1)`` is then 3 at the first, -1 at the second, and less than one in size beyond: the first
    dominates (Kumar & Healey 2010).  Along a branch the two are estimated by the values at the point before.
    """
    shift = (first + second) / 2
    return shift, 2 * second - shift


@dataclass(frozen=True)
class Reduced:
    """Eigenvalues ``values`` (k,) by their real parts, ``vectors`` ``Q2 z`` (m, k) in the pencil's coordinates.

    ``errors`` are backward errors ``|Q2^t (K - mu M) x| / ((|K| + |mu| |M|) |x|)``; real arrays for a symmetric pencil.
    ``certified`` says that a count by inertia found no other eigenvalue as near to the target (symmetric pencils only).
    """

    values: np.ndarray
    vectors: np.ndarray
    errors: np.ndarray
    certified: bool


class Reduction:
    """The reduced eigenproblem of a :class:`~rodfem.stability.blocks.Pencil`."""

    def __init__(self, pencil: Pencil, inverse: str = "saddle") -> None:
        """Gather the blocks and factor ``C``; raises :class:`InputError` for dependent constraints."""
        if inverse not in INVERSES:
            raise InputError(f"Unknown inverse {inverse!r}: choose one of {', '.join(INVERSES)}.")
        self.inverse, self.symmetric = inverse, pencil.symmetric
        self.projection = Projection(pencil)

    def near(
        self, number: int, target: float, transform: str = "shift-invert", antishift: float | None = None
    ) -> Reduced:
        """Return the ``number`` eigenvalues nearest to ``target``, the shift.

        With a target below the spectrum they are the left-most ones.  ``antishift`` is the zero ``a2`` of the Cayley
        transform ``(mu - a2)/(mu - target)``, by default ``-target``: poor where the target is small.  Raises
        :class:`InputError` for an unknown transform or for more eigenvalues than there are, :class:`ConvergenceError`
        where SLEPc finds fewer or where the shifted matrix is singular.
        """
        if transform not in TRANSFORMS:
            raise InputError(f"Unknown transform {transform!r}: choose one of {', '.join(TRANSFORMS)}.")
        n = self.projection.kernel.dimension
        if number > n:
            raise InputError(f"{number} eigenvalues of a reduced pencil of size {n}: ask for at most {n}.")
        shifted = ShiftedInverse(self.projection, target, self.inverse)
        found = Reduced(np.array([]), np.array([]), np.array([]), False)
        for extra in (2, 6, 14) if self.symmetric else (0,):
            found = self._solve(shifted, number, min(number + extra, n), transform, antishift)
            if self.symmetric:
                found = self._certified(found, number, target)
            if found.certified:
                break
        return found

    def _certified(self, found: Reduced, number: int, target: float) -> Reduced:
        """Keep the ``number`` nearest to ``target``, of equally near ones the left; count whether any is missing."""
        distance = abs(found.values - target)
        nearest = np.lexsort((found.values, np.round(distance / distance.max(), 9)))[:number]
        radius = distance[nearest[-1]] * (1 + BEYOND)
        count = self.projection.below(target + radius) - self.projection.below(target - radius)
        keep = np.sort(nearest)
        return Reduced(
            found.values[keep], found.vectors[:, keep], found.errors[keep], count == int((distance < radius).sum())
        )

    def _solve(
        self, shifted: ShiftedInverse, least: int, number: int, transform: str, antishift: float | None
    ) -> Reduced:
        """Return about ``number`` eigenvalues, ``least`` at least: a pencil may have fewer finite ones than rows."""
        n, target = self.projection.kernel.dimension, shifted.sigma
        # Not symmetric: where strains have no mass M is semidefinite, and in the coordinates of the kernel only up to
        # round-off.  At a breakdown, which double eigenvalues bring about early, SLEPc would find it indefinite.
        stiffness, mass = (self._operator(matrix) for matrix in (self.projection.K, self.projection.M))
        solver = eigensolver(stiffness, mass, "rodfem_reduced_", symmetric=False)
        seek(solver, target, number, min(2 * number + 20, n), UNSYMMETRIC)
        spectral = solver.getST()
        if transform == "cayley":
            spectral.setType(SLEPc.ST.Type.CAYLEY)
            if not self.symmetric:
                raise InputError(
                    "SLEPc does not transform complex eigenvalues back from Cayley's transform: use shift-invert."
                )
            a2 = -target if antishift is None else antishift
            if a2 == target:
                raise InputError(f"A Cayley transform with shift and antishift {target:g} is constant: change one.")
            spectral.setCayleyAntishift(-a2)
        spectral.setShift(target)
        use_inverse(solver, shifted)
        start = self._operator(self.projection.K).createVecRight()
        start.array[:] = shifted(self.projection.times(self.projection.M, generic(np.arange(n))))  # no massless part
        solver.setInitialSpace([start])
        solver.setFromOptions()
        try:
            solver.solve()
        except PETSc.Error as trouble:
            raise ConvergenceError(
                f"SLEPc gave up on eigenvalues near {target:g} ({str(trouble).splitlines()[-1]}): change the target."
            ) from trouble
        found = solver.getConverged()
        result = self._collect(solver, shifted, min(found, number))
        solver.destroy()
        if len(result.values) < least:
            raise ConvergenceError(
                f"SLEPc found {len(result.values)} of {least} eigenvalues near {target:g}: ask for fewer, or elsewhere."
            )
        return result

    def _operator(self, matrix: sp.csr_matrix) -> PETSc.Mat:
        n = self.projection.kernel.dimension
        context = Product(lambda z: self.projection.times(matrix, z))
        out = PETSc.Mat().createPython((n, n), context, comm=PETSc.COMM_SELF)
        out.setUp()
        return out

    def _collect(self, solver: SLEPc.EPS, shifted: ShiftedInverse, number: int) -> Reduced:
        re, im = self._operator(self.projection.K).createVecs()
        values, vectors = np.empty(number, dtype=complex), np.empty((re.getSize(), number), dtype=complex)
        for i in range(number):
            values[i] = solver.getEigenpair(i, re, im)
            vectors[:, i] = re.array_r + 1j * im.array_r
        vectors = self.projection.kernel.expand(vectors)
        order = np.lexsort((values.imag, values.real))
        values, vectors = values[order], vectors[:, order]
        if self.symmetric:  # round-off may make a complex pair of a double eigenvalue: its parts span the same plane
            second = np.append(False, (values.imag[1:] > 0) & (values.imag[:-1] < 0))
            vectors = np.where(second, vectors.imag, vectors.real)
            values, vectors = shifted.ritz(vectors)
        p = self.projection
        residuals = np.linalg.norm(p.kernel.project(p.K @ vectors - (p.M @ vectors) * values), axis=0)
        residuals /= np.linalg.norm(vectors, axis=0)
        stiffness, mass = (float(abs(matrix).sum(axis=1).max()) for matrix in (p.K, p.M))
        finite = residuals < SPURIOUS * stiffness
        errors = residuals / (stiffness + abs(values) * mass)
        return Reduced(values[finite], vectors[:, finite], errors[finite], False)


class Product:
    """Python context of a PETSc matrix that is known by its product with a vector."""

    def __init__(self, product: Callable[[np.ndarray], np.ndarray]) -> None:
        """Keep the product, (n,) -> (n,)."""
        self.product = product

    def mult(self, matrix: PETSc.Mat, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """``y = A x``."""
        y.array[:] = self.product(x.array_r)
