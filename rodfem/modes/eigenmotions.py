"""Motions of the rod in the eigenvectors of a state: signed, turned within equal eigenvalues, and named."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.branch_solver import BranchSolver
from rodfem.errors import ConvergenceError
from rodfem.linalg.orthogonal import combine, orthonormalize
from rodfem.modes.modes import SYMMETRY
from rodfem.modes.perturbation import Motion, Motions
from rodfem.modes.recorded import Few
from rodfem.stability import motion_names
from rodfem.stability.assessment import Assessor
from rodfem.stability.cluster import as_vectors
from rodfem.stability.left_right import alone, upper
from rodfem.stability.pencil import symmetry_modes, weighed_modes
from rodfem.stability.symmetric import CONVERGED
from rodfem.tolerances import SAME_EIGENVALUE

SEEN = 1e-3
"""Response of a mode to a functional, relative to the greatest one, below which the functional does not observe it."""
DOUBLE = 1e-3
"""Eigenvalues nearer than this, relative, to a double one are that: round-off parts them by its square root."""


class Turned(NamedTuple):
    """Modes of a conservative state: ``vectors`` orthonormal in the ``mass``, their ``motions``, and names.

    The symmetries come last, with ``duals``, the products of all vectors with the mass (or, of what moves no mass,
    with the metric).
    """

    vectors: list[PETSc.Vec]
    duals: list[PETSc.Vec]
    motions: list[Motion]
    names: tuple[str, ...]


class Eigenmotions:
    """Finds the motions of states of one :class:`~rodfem.fem.system.System`."""

    def __init__(self, solver: BranchSolver) -> None:
        """Keep the solver of the equilibria."""
        self.assessor, self.motions, self.system = Assessor(solver), Motions(solver.system), solver.system
        self._functionals = np.zeros((0, 0))

    def few(self, x: PETSc.Vec, number: int, double: float = np.nan) -> Few:
        """The ``number`` left-most modes (nearest zero without a potential) of ``x``, without weights and error bars.

        Rigid motions, whose eigenvalue is zero, are there besides.

        Raises :class:`~rodfem.errors.ConvergenceError` where the eigensolver fails.  ``double`` is the eigenvalue that
        is known to be a double one with a single vector, at flutter.
        """
        if not self.assessor.conservative:
            return self._few_nearest(x, number, double)
        found = self.assessor.leftmost(x, number)
        turned = self.turned(x, found.values, found.vectors, self.assessor.symmetric.mass)
        none = np.zeros(len(turned.names) - len(found.values))
        value, residual = np.append(found.values, none), np.append(found.errors, none * np.nan)
        return Few(value, residual, turned.names, *stack(turned.motions))

    # --- conservative ------------------------------------------------------------------------------------------

    def turned(self, x: PETSc.Vec, values: np.ndarray, found: list[PETSc.Vec], mass: PETSc.Mat) -> Turned:
        """Sign each of the vectors ``found``, and choose a basis of those of equal ``values``: the same from any one.

        The first moves along e1 where it can, the next do not as far as a fixed functional tells; and so on.  ``mass``
        is the kinetic metric at the state ``x``.
        """
        vectors = [v.copy() for v in found]
        orthonormalize(vectors, mass)
        motions = [self.motions.at(x, v) for v in vectors]
        weights = self._weights(values, self._responses(x, motions))
        vectors = [combine([vectors[i] for i in group], b) for group, b in weights]
        motions = [_sum([motions[i] for i in group], b) for group, b in weights]
        duals = [mass * v for v in vectors]
        names = [self._name(x, v) for v in vectors]
        symmetries = symmetry_modes(self.system, x)
        for vector, dual in weighed_modes(self.system, symmetries, mass).values():
            vectors.append(vector)
            duals.append(dual)
            motions.append(self.motions.at(x, vector))
        return Turned(vectors, duals, motions, (*names, *[SYMMETRY] * len(symmetries)))

    def _name(self, x: PETSc.Vec, v: PETSc.Vec) -> str:
        """Name of the motion."""
        return motion_names.name_of(motion_names.turning_shares(self.system, self.system.at(x).turned, [v.array_r]))

    def _weights(self, values: np.ndarray, responses: np.ndarray) -> list[tuple[list[int], np.ndarray]]:
        """Each new mode as a combination: places of those combined, and weights; ``responses`` are (K, 36)."""
        out = []
        for group in equal(values):
            mine = responses[group]
            basis: list[np.ndarray] = []
            for response in mine.T:
                rest = response - sum((b * (b @ response) for b in basis), np.zeros(len(group)))
                if np.linalg.norm(rest) > SEEN * abs(mine).max():
                    basis.append(rest / np.linalg.norm(rest))
                if len(basis) == len(group):
                    break
            out += [(group, b) for b in (basis if len(basis) == len(group) else np.eye(len(group)))]
        return out

    def _responses(self, x: PETSc.Vec, motions: list[Motion]) -> np.ndarray:
        """Responses (K, 36) to fixed functionals of the motions along e1, e2, e3 and about them."""
        if not len(self._functionals):
            s = self.motions.sample(x)["s"]  # the same in all states
            t = (s - s[0]) / (s[-1] - s[0])
            self._functionals = self.motions.node_weights() * [1 + t + np.cos(3.1 * t + 0.7 * j) for j in range(6)]
        return np.array([(self._functionals @ np.hstack([m.r, m.w])).ravel() for m in motions])

    # --- loads without a potential -----------------------------------------------------------------------------

    def _few_nearest(self, x: PETSc.Vec, number: int, double: float) -> Few:
        pencil = self.assessor.nonsymmetric.at(x)
        found = pencil.near_zero(2 * number)
        values, same = found.values, np.flatnonzero(abs(found.values - double) <= DOUBLE * abs(double))
        left_out = same[np.lexsort((values[same].real, -values[same].imag))][(len(same) + 1) // 2 :]
        nearest = [i for i in upper(values, len(values)) if i not in left_out]
        rigid = [i for i in nearest if found.kinds[i] == motion_names.RIGID]
        moving = [i for i in nearest if i not in rigid][:number]
        chosen = [*sorted(moving, key=lambda i: values[i].real), *rigid]
        if len(chosen) and (worst := found.errors[chosen].max()) > CONVERGED:
            raise ConvergenceError(f"Eigenvalues have a backward error of {worst:.0e}: use another discretisation.")
        columns, value = alone(pencil, found.vectors[:, chosen]), values[chosen]
        coalesced = np.isin(chosen, same)
        value = np.where(coalesced, double, np.where(np.isin(chosen, rigid), 0.0, value))
        columns = np.where(coalesced, columns.real, columns)
        moved = self.signed([self.complex(x, column) for column in columns.T])[0]
        return Few(value, found.errors[chosen], tuple(found.kinds[i] for i in chosen), *stack(moved))

    def signed(self, right: list[Motion]) -> tuple[list[Motion], np.ndarray]:
        """Motions of a fixed sign, and what each was multiplied by."""
        sign = np.sign([np.real(m.r.sum() + 0.01 * m.w.sum()) or 1.0 for m in right])
        return [Motion(k * m.r, k * m.w, k * m.q) for k, m in zip(sign, right, strict=True)], sign

    def complex(self, x: PETSc.Vec, values: np.ndarray, *, dual: bool = False) -> Motion:
        """Motion of a complex perturbation, or weights of a complex functional, by its values on this rank (n,)."""
        evaluate = self.motions.dual if dual else self.motions.at
        parts = as_vectors(self.system, np.stack([values.real, values.imag], axis=1))
        re, im = (evaluate(x, part) for part in parts)
        return Motion(re.r + 1j * im.r, re.w + 1j * im.w, re.q + 1j * im.q)


def equal(values: np.ndarray) -> list[list[int]]:
    """Positions of ascending ``values`` in groups of equal ones."""
    groups: list[list[int]] = []
    for i, value in enumerate(values):
        if groups and value - values[i - 1] <= SAME_EIGENVALUE * abs(values).max():
            groups[-1].append(i)
        else:
            groups.append([i])
    return groups


def stack(motions: list[Motion]) -> tuple[np.ndarray, np.ndarray]:
    """Displacements and rotations of several motions, (K, m, 3) each."""
    return np.array([m.r for m in motions]), np.array([m.w for m in motions])


def _sum(motions: list[Motion], weights: np.ndarray) -> Motion:
    """Linear combination of motions."""
    parts = ((m.r, m.w, m.q) for m in motions)
    return Motion(*(np.tensordot(weights, np.array(each), 1) for each in zip(*parts, strict=True)))
