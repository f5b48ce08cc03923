"""Finds the modes of a state from the eigenvectors of its assessment: see :mod:`rodfem.modes.modes`."""

from __future__ import annotations

from typing import Any

import numpy as np
from petsc4py import PETSc

from rodfem.adaptivity.error_estimate import bound, halved
from rodfem.continuation.static_solver import StaticSolver
from rodfem.errors import InputError
from rodfem.fem.transfer import Transfer, richer_system
from rodfem.linalg.orthogonal import combine, orthonormalize
from rodfem.modes.modes import LEFT, SYMMETRY, Modes
from rodfem.modes.perturbation import Motion, Motions
from rodfem.stability import mode_type
from rodfem.stability.assessment import Assessor, Verdict
from rodfem.stability.cluster import as_vectors
from rodfem.stability.left_right import two_sided
from rodfem.stability.pencil import symmetry_modes, weighed_modes

EQUAL = 1e-6
"""Eigenvalues closer than this, relative to the greatest, are one: their modes are any basis of a plane."""
SEEN = 1e-3
"""Response of a mode to a functional, relative to the greatest one, below which the functional does not observe it."""
FLOOR = 1e-12
"""Least uncertainty of an eigenvalue by round-off, relative to the greatest one."""


class ModeFinder:
    """Finds the modes of states of one :class:`~rodfem.fem.system.System`."""

    def __init__(self, solver: StaticSolver, error_bars: bool = True) -> None:
        """Keep the solver of the equilibria; ``error_bars`` are from a second, richer discretisation."""
        self.assessor, self.motions = Assessor(solver), Motions(solver.system)
        self.system, self.error_bars = solver.system, error_bars
        self._richer: tuple[StaticSolver, Assessor, Transfer] | None = None

    def __call__(self, x: PETSc.Vec, number: int, method: str = "auto") -> tuple[Verdict, Modes]:
        """Assess the equilibrium ``x`` and find its ``number`` left-most modes (nearest zero without a potential)."""
        verdict = self.assessor(x, method, number)
        sample = self.motions.sample(x)
        found = self._conservative(x, verdict) if self.assessor.conservative else self._pairs(x, number)
        errors = np.full(len(found["value"]), np.nan)
        values = found["value"][: len(found["value"]) - found["motion"].count(SYMMETRY)]
        if self.error_bars:
            errors[: len(values)] = self._errors(x, values)
        unit = sample["q"] / np.linalg.norm(sample["q"], axis=1, keepdims=True)
        state = {"load": self.system.scalar(x), "s": sample["s"], "r": sample["r"], "q": unit}
        return verdict, Modes(**state, error=errors, **found)

    # --- conservative ------------------------------------------------------------------------------------------

    def _conservative(self, x: PETSc.Vec, verdict: Verdict) -> dict[str, Any]:
        """Modes from the vectors of a verdict, orthonormal in the mass, and the symmetries'."""
        if not verdict.vectors:
            raise InputError("Counting alone finds no modes: choose another method than 'count'.")
        mass = self.assessor.symmetric.at(x).mass
        vectors = [v.copy() for v in verdict.vectors]
        orthonormalize(vectors, mass)
        vectors = self._turned(x, verdict.values, vectors)
        duals = [mass * v for v in vectors]
        symmetries = symmetry_modes(self.system, x)
        for vector, dual in weighed_modes(self.system, symmetries, mass).values():
            vectors.append(vector)
            duals.append(dual)
        motions = [self.motions.at(x, v) for v in vectors]
        weights = [self.motions.dual(x, y) for y in duals]
        names = [self._name(x, v) for v in vectors[: len(verdict.values)]]
        none = np.zeros(len(symmetries))
        right = stack(motions)
        return {
            "value": np.append(verdict.values, none),
            "residual": np.append(verdict.errors, none * np.nan),
            "motion": (*names, *[SYMMETRY] * len(symmetries)),
            **dict(zip(("displacement", "rotation"), right, strict=True)),
            **dict(zip(LEFT, (*right, *stack(weights)), strict=True)),
        }

    def _name(self, x: PETSc.Vec, v: PETSc.Vec) -> str:
        """Name of the motion."""
        return mode_type.name(mode_type.shares(self.system, self.system.at(x).turned, [v.array_r]))

    def _turned(self, x: PETSc.Vec, values: np.ndarray, vectors: list[PETSc.Vec]) -> list[PETSc.Vec]:
        """Sign each mode, and choose a basis of the modes of equal eigenvalues: the same from any orthonormal one.

        The first moves along e1 where it can, the next do not as far as a fixed functional tells; and so on.
        """
        out: list[PETSc.Vec] = []
        for group in equal(values):
            members = [vectors[i] for i in group]
            responses = np.array([self._responses(x, v) for v in members])
            basis: list[np.ndarray] = []
            for response in responses.T:
                rest = response - sum((b * (b @ response) for b in basis), np.zeros(len(group)))
                if len(basis) < len(group) and np.linalg.norm(rest) > SEEN * abs(responses).max():
                    basis.append(rest / np.linalg.norm(rest))
            out += [combine(members, b) for b in basis] if len(basis) == len(group) else members
        return out

    def _responses(self, x: PETSc.Vec, v: PETSc.Vec) -> np.ndarray:
        """Responses (36,) to fixed functionals of the motion along e1, e2, e3 and about them."""
        motion, s = self.motions.at(x, v), self.motions.sample(x)["s"]
        t = (s - s[0]) / (s[-1] - s[0])
        shapes = self.motions.node_weights() * [1 + t + np.cos(3.1 * t + 0.7 * j) for j in range(6)]
        return np.concatenate([(row @ np.hstack([motion.r, motion.w])) for row in shapes])

    # --- loads without a potential -----------------------------------------------------------------------------

    def _pairs(self, x: PETSc.Vec, number: int) -> dict[str, Any]:
        """Right and left modes of the eigenvalues nearest zero, biorthonormal in the mass."""
        found = two_sided(self.assessor.nonsymmetric.at(x), number)
        right, left = ([self._complex(x, column) for column in part.T] for part in (found.right, found.left))
        sign = np.sign([np.real(m.r.sum() + 0.01 * m.w.sum()) or 1.0 for m in right])
        right, left = (
            [Motion(k * m.r, k * m.w, k * m.q) for k, m in zip(sign, part, strict=True)] for part in (right, left)
        )
        weights = [self._complex(x, k * column, dual=True) for k, column in zip(sign, found.weighed.T, strict=True)]
        return {
            "value": found.values,
            "residual": found.errors,
            "motion": found.kinds,
            **dict(zip(("displacement", "rotation"), stack(right), strict=True)),
            **dict(zip(LEFT, (*stack(left), *stack(weights)), strict=True)),
        }

    def _complex(self, x: PETSc.Vec, values: np.ndarray, *, dual: bool = False) -> Motion:
        """Motion of a complex perturbation, or weights of a complex functional, by its values on this rank (n,)."""
        evaluate = self.motions.dual if dual else self.motions.at
        parts = as_vectors(self.system, np.stack([values.real, values.imag], axis=1))
        re, im = (evaluate(x, part) for part in parts)
        return Motion(re.r + 1j * im.r, re.w + 1j * im.w, re.q + 1j * im.q)

    # --- others ------------------------------------------------------------------------------------------------

    def _errors(self, x: PETSc.Vec, values: np.ndarray) -> np.ndarray:
        """Bounds from the eigenvalues of the same state on a richer discretisation; inf where there is none."""
        if self._richer is None:
            richer = richer_system(self.system)
            solver = StaticSolver(richer)
            self._richer = solver, Assessor(solver), Transfer(self.system, richer)
        solver, assessor, transfer = self._richer
        guess = transfer(x, state=True)
        y, outcome = solver.at_load(guess, self.system.scalar(x), reach=1.0)
        if not outcome.converged:
            return np.full(len(values), np.inf)
        others = assessor(y, number=2 * len(values) + 2 if np.iscomplexobj(values) else len(values)).values
        rho, left = (
            halved(self.system.fields.discretization.degree),
            FLOOR * max(self.system.scene.units.moment, float(abs(values).max())),
        )
        if np.iscomplexobj(values):
            others = np.array([others[np.argmin(abs(others - v))] for v in values])
        return np.array([bound(v, other, left, rho) for v, other in zip(values, others, strict=True)])


def equal(values: np.ndarray) -> list[list[int]]:
    """Positions of ascending ``values`` in groups of equal ones."""
    groups: list[list[int]] = []
    for i, value in enumerate(values):
        if groups and value - values[i - 1] <= EQUAL * abs(values).max():
            groups[-1].append(i)
        else:
            groups.append([i])
    return groups


def stack(motions: list[Motion]) -> tuple[np.ndarray, np.ndarray]:
    """Displacements and rotations of several motions, (K, m, 3) each."""
    return np.array([m.r for m in motions]), np.array([m.w for m in motions])
