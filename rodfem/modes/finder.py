"""Finds the modes of a state from the eigenvectors of its assessment: see :mod:`rodfem.modes.modes`."""

from __future__ import annotations

from typing import Any

import numpy as np
from petsc4py import PETSc

from rodfem.adaptivity.ordinate_bound import bound
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.errors import InputError
from rodfem.fem.quadrature_check import QuadratureCheck
from rodfem.fem.transfer import Transfer, halved, richer_system
from rodfem.linalg.matrices import rounding
from rodfem.modes.eigenmotions import Eigenmotions, stack
from rodfem.modes.modes import LEFT, SYMMETRY, Modes
from rodfem.stability.assessment import Assessor, Verdict
from rodfem.stability.cluster import DRAWN
from rodfem.stability.inertia import NOISE
from rodfem.stability.left_right import moving, two_sided
from rodfem.stability.symmetric import SymmetricPencil

FLOOR = 5e-12
"""Least uncertainty of an eigenvalue by round-off, relative to the greatest one (rings of 32 elements: 2e-12)."""


class ModeFinder(Eigenmotions):
    """Finds the modes of states of one :class:`~rodfem.fem.system.System`."""

    def __init__(self, solver: BranchSolver, error_bars: bool = True) -> None:
        """Keep the solver of the equilibria; ``error_bars`` are from a second, richer discretisation."""
        super().__init__(solver)
        self.error_bars = error_bars
        self._quadrature = QuadratureCheck(solver.system)
        self._richer: tuple[BranchSolver, Assessor, Transfer] | None = None

    def __call__(self, x: PETSc.Vec, number: int, method: str = "auto") -> tuple[Verdict, Modes]:
        """Assess the equilibrium ``x`` and find its ``number`` left-most modes (nearest zero without a potential)."""
        verdict = self.assessor(x, method, number)
        sample = self.motions.sample(x)
        found, noise = self._conservative(x, verdict) if self.assessor.conservative else self._pairs(x, number)
        errors = np.full(len(found["value"]), np.nan)
        values = found["value"][: len(found["value"]) - found["motion"].count(SYMMETRY)]
        note = self._quadrature(x) if self.error_bars else ""
        if self.error_bars and not note:
            errors[: len(values)] = self._errors(x, values, noise)
        unit = sample["q"] / np.linalg.norm(sample["q"], axis=1, keepdims=True)
        state = {"load": self.system.scalar(x), "s": sample["s"], "r": sample["r"], "q": unit}
        return verdict, Modes(**state, error=errors, note=note, **found)

    def _conservative(self, x: PETSc.Vec, verdict: Verdict) -> tuple[dict[str, Any], np.ndarray]:
        """Modes from the vectors of a verdict, orthonormal in the mass, the symmetries', and round-off of those."""
        if not verdict.vectors:
            raise InputError("Counting alone finds no modes: choose another method than 'count'.")
        pencil = self.assessor.symmetric.at(x)
        turned = self.turned(x, verdict.values, verdict.vectors, pencil.mass)
        noise = _rounded(pencil, turned.vectors[: len(verdict.values)], verdict.values)
        weights = [self.motions.dual(x, y) for y in turned.duals]
        none = np.zeros(len(turned.vectors) - len(verdict.values))
        right = stack(turned.motions)
        found = {
            "value": np.append(verdict.values, none),
            "residual": np.append(verdict.errors, none * np.nan),
            "motion": turned.names,
            **dict(zip(("displacement", "rotation"), right, strict=True)),
            **dict(zip(LEFT, (*right, *stack(weights)), strict=True)),
        }
        return found, noise

    def _pairs(self, x: PETSc.Vec, number: int) -> tuple[dict[str, Any], np.ndarray]:
        """Right and left modes of the eigenvalues nearest zero, biorthonormal in the mass, and round-off of these."""
        found = two_sided(self.assessor.nonsymmetric.at(x), number)
        right, sign = self.signed([self.complex(x, column) for column in found.right.T])
        left = [self.complex(x, k * column) for k, column in zip(sign, found.left.T, strict=True)]
        weights = [self.complex(x, k * column, dual=True) for k, column in zip(sign, found.weighed.T, strict=True)]
        modes = {
            "value": found.values,
            "residual": found.errors,
            "motion": found.kinds,
            **dict(zip(("displacement", "rotation"), stack(right), strict=True)),
            **dict(zip(LEFT, (*stack(left), *stack(weights)), strict=True)),
        }
        return modes, found.noise

    def _errors(self, x: PETSc.Vec, values: np.ndarray, noise: np.ndarray) -> np.ndarray:
        """Bounds by the eigenvalues of the same state on a richer mesh, and their ``noise``; inf where it has none."""
        if self._richer is None:
            richer = richer_system(self.system)
            solver = BranchSolver(richer)
            self._richer = solver, Assessor(solver), Transfer(self.system, richer)
        solver, assessor, transfer = self._richer
        guess = transfer(x, state=True)
        y, outcome = solver.at_load(guess, self.system.scalar(x), reach=1.0)
        if not outcome.converged:
            return np.full(len(values), np.inf)
        number = len(values)
        if assessor.conservative:
            verdict = assessor(y, number=number)
            others = verdict.values
            noise = noise + _rounded(assessor.symmetric.at(y), verdict.vectors, others)
        else:  # each with that of the same rank: what is nearest to a value may be another mode, the more so far off
            found = assessor.nonsymmetric.at(y).near_zero(2 * number)
            others = np.empty(number, dtype=complex)
            others[np.argsort(abs(values), kind="stable")] = found.values[moving(found, number)]
        left = np.maximum(noise, FLOOR * max(self.system.scene.units.omega2, float(abs(values).max())))
        rho = halved(self.system.fields.discretization.degree)
        return np.array([bound(*each, rho) for each in zip(values, others, left, strict=True)])


def _rounded(pencil: SymmetricPencil, vectors: list[PETSc.Vec], values: np.ndarray) -> np.ndarray:
    """Uncertainty of eigenvalues of a ``pencil``: round-off of its matrix, to first order, and of the eigensolver."""
    out = []
    for v, value in zip(vectors, values, strict=True):
        square = v.dot(pencil.mass * v).real
        off = abs(v.dot(pencil.matrix * v).real / square - value)
        out.append(NOISE * rounding(pencil.matrix, v, v) / square + DRAWN * off)
    return np.array(out)
