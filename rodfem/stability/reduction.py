r"""Eigenvalues by reduction: the pencil of a state on the kernel of its constraints.

With ``C = (Q1 Q2) (R; 0)`` from :mod:`rodfem.stability.kernel`, the perturbations that fulfil the constraints are ``x =
Q2 z``, and the singular pencil ``(K C; C^t 0), (M 0; 0 0)`` of size m + p becomes

    Q2^t K Q2 z = mu Q2^t M Q2 z,        of size m - p,

whose finite eigenvalues are those of the former, without its 2p infinite ones (Kumar & Healey 2010).  SLEPc sees a
matrix that it can only multiply by, in O(m) operations for pointwise constraints, O(m p) for integral ones.

Shift-invert and Cayley transforms need the inverse of the shifted matrix ``Q2^t A Q2``, ``A = K - sigma M``.  It is a
part of the inverse of a sparse matrix:

    ( A    C ) ( x )   ( Q2 b )
    ( C^t  0 ) ( y ) = (  0   ),        (Q2^t A Q2)^-1 b = Q2^t x:

the second row puts x in the kernel, Q2^t times the first is Q2^t A Q2 z = b (``inverse="saddle"``).  It holds whenever
C has full rank and sigma is no eigenvalue, also where A itself is singular.  Elimination of x,

    (Q2^t A Q2)^-1 = Q2^t [A^-1 - A^-1 C (C^t A^-1 C)^-1 C^t A^-1] Q2        (``inverse="elimination"``),

factors A alone and needs p solves and a dense p x p matrix more: for a few integral constraints.  It fails where A is
singular although the reduced matrix is not.  So it is in the pointwise formulation without mass (``rho_A = 0``) or with
sigma = 0, where A has no entry for the centreline at all, and where sigma is an eigenvalue of the unconstrained pencil.

Every rank gathers the whole matrices and computes the same.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from mpi4py import MPI
from petsc4py import PETSc
from slepc4py import SLEPc

from rodfem.errors import ConvergenceError, SceneError
from rodfem.stability.blocks import Pencil
from rodfem.stability.inertia import inertia_factorizer
from rodfem.stability.kernel import kernel
from rodfem.stability.matrices import gathered, petsc_matrix

TRANSFORMS = ("shift-invert", "cayley")
INVERSES = ("saddle", "elimination")
SINGULAR = 1e-6
"""A solve that leaves more than this of its right-hand side behind was made with a singular matrix."""
TOLERANCE = 1e-13


def cayley_parameters(first: float, second: float) -> tuple[float, float]:
    """Shift ``a1 = (first + second)/2`` and antishift ``a2 = 2 second - a1`` for two left-most values.

    ``(mu - a2)/(mu - a1)`` is then -3 at the first, -1 at the second, and less than one in size beyond: the first
    dominates (Kumar & Healey 2010).  Along a branch the two are estimated by the values at the point before.
    """
    shift = (first + second) / 2
    return shift, 2 * second - shift


@dataclass(frozen=True)
class Reduced:
    """Eigenvalues in ascending order of their real parts (k,), vectors ``Q2 z`` in the pencil's coordinates (m, k).

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
        """Gather the blocks and factor ``C``; raises :class:`SceneError` for dependent constraints."""
        if inverse not in INVERSES:
            raise SceneError(f"Unknown inverse {inverse!r}: choose one of {', '.join(INVERSES)}.")
        self.inverse, self.symmetric = inverse, pencil.symmetric
        self.K, self.C, self.M = gathered(pencil.K), gathered(pencil.C), gathered(pencil.M)
        self.kernel = kernel(self.C, pencil.place)

    def near(
        self, number: int, target: float, transform: str = "shift-invert", antishift: float | None = None
    ) -> Reduced:
        """Return the ``number`` eigenvalues nearest to ``target``, the shift.

        With a target below the spectrum they are the left-most ones.  ``antishift`` is the zero ``a2`` of the Cayley
        transform ``(mu - a2)/(mu - target)``, by default ``-target``: poor where the target is small.  Raises
        :class:`SceneError` for an unknown transform or for more eigenvalues than there are, :class:`ConvergenceError`
        where SLEPc finds fewer or where the shifted matrix is singular.
        """
        if transform not in TRANSFORMS:
            raise SceneError(f"Unknown transform {transform!r}: choose one of {', '.join(TRANSFORMS)}.")
        n = self.kernel.dimension
        if number > n:
            raise SceneError(f"{number} eigenvalues of a reduced pencil of size {n}: ask for at most {n}.")
        shifted = ShiftedInverse(self, target)
        found = Reduced(np.array([]), np.array([]), np.array([]), False)
        for extra in (2, 6, 14) if self.symmetric else (0,):
            found = self._solve(shifted, min(number + extra, n), target, transform, antishift)
            if self.symmetric:
                found = self._certified(found, number, target)
            if found.certified:
                break
        return found

    def below(self, sigma: float) -> int:
        """Number of eigenvalues of a symmetric pencil below ``sigma``, by the inertia of the saddle matrix."""
        factors = inertia_factorizer(MPI.COMM_SELF)
        return int(factors(petsc_matrix(MPI.COMM_SELF, self.saddle(sigma))).getInertia()[0]) - self.C.shape[1]

    def saddle(self, sigma: float) -> sp.csr_matrix:
        """``(K - sigma M, C; C^t, 0)``."""
        shifted = self.K - sigma * self.M
        return (sp.bmat([[shifted, self.C], [self.C.T, None]]) if self.C.shape[1] else shifted).tocsr()

    def _certified(self, found: Reduced, number: int, target: float) -> Reduced:
        """Keep the ``number`` nearest to ``target``, and count whether any is missing among them."""
        distance = abs(found.values - target)
        nearest = np.argsort(distance)[:number]
        radius = distance[nearest[-1]] * (1 + 1e-6)
        count = self.below(target + radius) - self.below(target - radius)
        keep = np.sort(nearest)
        return Reduced(
            found.values[keep], found.vectors[:, keep], found.errors[keep], count == int((distance < radius).sum())
        )

    def _solve(
        self, shifted: ShiftedInverse, number: int, target: float, transform: str, antishift: float | None
    ) -> Reduced:
        n = self.kernel.dimension
        solver = SLEPc.EPS().create(PETSc.COMM_SELF)
        solver.setOptionsPrefix("rodfem_reduced_")
        solver.setOperators(self._operator(self.K), self._operator(self.M))
        # Not GHEP: where strains have no mass M is semidefinite, and in the coordinates of the kernel only up to
        # round-off.  At a breakdown, which double eigenvalues bring about early, SLEPc would find it indefinite.
        solver.setProblemType(SLEPc.EPS.ProblemType.GNHEP)
        solver.setWhichEigenpairs(SLEPc.EPS.Which.TARGET_MAGNITUDE)
        solver.setTarget(target)
        solver.setTolerances(tol=TOLERANCE, max_it=300)
        solver.setDimensions(number, min(2 * number + 20, n))
        spectral = solver.getST()
        spectral.setType(SLEPc.ST.Type.SINVERT if transform == "shift-invert" else SLEPc.ST.Type.CAYLEY)
        spectral.setMatMode(SLEPc.ST.MatMode.SHELL)
        spectral.setShift(target)
        if transform == "cayley":
            a2 = -target if antishift is None else antishift
            if a2 == target:
                raise SceneError(f"A Cayley transform with shift and antishift {target:g} is constant: change one.")
            spectral.setCayleyAntishift(-a2)
        ksp = spectral.getKSP()
        ksp.setType("preonly")
        ksp.getPC().setType("python")
        ksp.getPC().setPythonContext(shifted)
        start = self._operator(self.K).createVecRight()
        start.array[:] = shifted(self._times(self.M, np.sin(1.0 + 0.731 * np.arange(n)) + 0.3))  # no massless part
        solver.setInitialSpace([start])
        solver.setFromOptions()
        try:
            solver.solve()
        except PETSc.Error as trouble:
            raise ConvergenceError(
                f"SLEPc gave up on eigenvalues near {target:g} ({str(trouble).splitlines()[-1]}): change the target."
            ) from trouble
        found = solver.getConverged()
        if found < number:
            solver.destroy()
            raise ConvergenceError(f"SLEPc found {found} of {number} eigenvalues near {target:g}: change the target.")
        return self._collect(solver, number)

    def _times(self, matrix: sp.csr_matrix, z: np.ndarray) -> np.ndarray:
        return self.kernel.project(matrix @ self.kernel.expand(z))

    def _operator(self, matrix: sp.csr_matrix) -> PETSc.Mat:
        n = self.kernel.dimension
        context = Product(lambda z: self._times(matrix, z))
        out = PETSc.Mat().createPython((n, n), context, comm=PETSc.COMM_SELF)
        out.setUp()
        return out

    def _collect(self, solver: SLEPc.EPS, number: int) -> Reduced:
        re, im = self._operator(self.K).createVecs()
        values = np.array([solver.getEigenpair(i, re, im) for i in range(number)])
        vectors = np.empty((self.kernel.size, number), dtype=complex)
        for i in range(number):
            solver.getEigenpair(i, re, im)
            vectors[:, i] = self.kernel.expand(re.array_r) + 1j * self.kernel.expand(im.array_r)
        solver.destroy()
        order = np.lexsort((values.imag, values.real))
        values, vectors = values[order], vectors[:, order]
        if self.symmetric:  # round-off may make a complex pair of a double eigenvalue: its parts span the same plane
            second = np.append(False, (values.imag[1:] > 0) & (values.imag[:-1] < 0))
            values, vectors = values.real, np.where(second, vectors.imag, vectors.real)
        residuals = self.kernel.project(self.K @ vectors - (self.M @ vectors) * values)
        size = abs(self.K).sum(axis=1).max() + abs(values) * abs(self.M).sum(axis=1).max()
        errors = np.linalg.norm(residuals, axis=0) / (size * np.linalg.norm(vectors, axis=0))
        return Reduced(values, vectors, errors, False)


class Product:
    """Python context of a PETSc matrix that is known by its product with a vector."""

    def __init__(self, product: Callable[[np.ndarray], np.ndarray]) -> None:
        """Keep the product, (n,) -> (n,)."""
        self.product = product

    def mult(self, matrix: PETSc.Mat, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """``y = A x``."""
        y.array[:] = self.product(x.array_r)


class ShiftedInverse:
    """``(Q2^t (K - sigma M) Q2)^-1`` as the python context of a PETSc preconditioner."""

    def __init__(self, reduction: Reduction, sigma: float) -> None:
        """Factor at ``sigma``; raises :class:`ConvergenceError` where the formula does not apply."""
        r = self.reduction = reduction
        shifted, p = r.K - sigma * r.M, r.C.shape[1]
        if r.inverse == "saddle":
            self.solve = factored(r.saddle(sigma))
            return
        self.solve = factored(shifted)
        self.border = np.zeros((r.C.shape[0], 0))
        if p:
            columns = r.C.toarray()
            self.border = np.stack([self.solve(column) for column in columns.T], axis=1)
            left = abs(shifted @ self.border - columns).max() / abs(columns).max()
            if not left < SINGULAR:
                raise ConvergenceError(
                    f"K - sigma M is singular at sigma = {sigma:g} without the constraints: use the inverse 'saddle'."
                )
            self.capacitance = scipy.linalg.lu_factor(columns.T @ self.border)

    def apply(self, pc: PETSc.PC, b: PETSc.Vec, z: PETSc.Vec) -> None:
        """``z = (Q2^t (K - sigma M) Q2)^-1 b``."""
        z.array[:] = self(b.array_r)

    def __call__(self, b: np.ndarray) -> np.ndarray:
        """Solution for the right-hand side ``b`` (m - p,)."""
        r = self.reduction
        x = r.kernel.expand(b)
        if r.inverse == "saddle":
            x = self.solve(np.append(x, np.zeros(r.C.shape[1])))[: len(x)]
        else:
            x = self.solve(x)
            if r.C.shape[1]:
                x = x - self.border @ scipy.linalg.lu_solve(self.capacitance, r.C.T @ x)
        return r.kernel.project(x)


def factored(matrix: sp.spmatrix) -> Callable[[np.ndarray], np.ndarray]:
    """Solver with the LU factors of a matrix (MUMPS); raises :class:`ConvergenceError` where there are none."""
    petsc = petsc_matrix(MPI.COMM_SELF, matrix)
    ksp = PETSc.KSP().create(PETSc.COMM_SELF)
    ksp.setOptionsPrefix("rodfem_reduced_inverse_")
    ksp.setType("preonly")
    ksp.getPC().setType("lu")
    ksp.getPC().setFactorSolverType("mumps")
    ksp.setFromOptions()
    ksp.setOperators(petsc)
    ksp.getPC().setFactorSetUpSolverType()
    factors = ksp.getPC().getFactorMatrix()
    factors.setMumpsIcntl(14, 200)  # room for delayed pivots
    ksp.setUp()
    status = ksp.getPC().getFactorMatrix().getMumpsInfog(1)
    if status < 0:
        raise ConvergenceError(f"MUMPS could not factor the shifted matrix (INFOG(1) = {status}): change the shift.")
    right, out = petsc.createVecs()

    def solve(b: np.ndarray) -> np.ndarray:
        right.array[:] = b
        ksp.solve(right, out)
        return out.array_r.copy()

    return solve
