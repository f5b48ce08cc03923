"""Finds the modes of states: signed, turned within equal eigenvalues, named; see :mod:`rodfem.modes.modes`.

Under loads without a potential right and left eigenvectors are biorthonormal in the mass.  Every run records a few
modes at typical states of each branch: its ends, evenly between, special points.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from petsc4py import PETSc

from rodfem.adaptivity.error_estimate import Enriched, bound
from rodfem.continuation.branch import Branch
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.errors import ConvergenceError, InputError
from rodfem.fem.quadrature_check import QuadratureCheck
from rodfem.fem.shape import halved
from rodfem.linalg.matrices import local_rows, rounding, rounding_of
from rodfem.linalg.orthogonal import combine, orthonormalize
from rodfem.modes.modes import LEFT, SYMMETRY, Few, Modes, Typical
from rodfem.modes.perturbation import Motion, Motions
from rodfem.ranks import as_failure
from rodfem.stability import motion_names
from rodfem.stability.assessment import Assessor, Verdict
from rodfem.stability.cluster import DRAWN, as_vectors
from rodfem.stability.inertia import NOISE
from rodfem.stability.motion_names import MotionNames
from rodfem.stability.near_zero import soft_limit
from rodfem.stability.nonsymmetric import Frequencies, NonsymmetricPencil
from rodfem.stability.pencil import symmetry_modes, weighed_modes
from rodfem.stability.symmetric import CONVERGED, SymmetricPencil
from rodfem.tolerances import SAME_EIGENVALUE

SAME = 1e-6
"""Relative difference below which a left and a right eigenvalue are paired."""
SEEN = 1e-3
"""Response of a mode to a functional, relative to the greatest one, below which the functional does not observe it."""
DOUBLE = 1e-3
"""Eigenvalues nearer than this, relative, to a double one are that: round-off parts them by its square root."""
FEWEST, MOST = 4, 8
"""Modes of a state: those of negative eigenvalues are among them up to the latter."""
FLOOR = 5e-12
"""Least uncertainty of an eigenvalue by round-off, relative to the greatest one (rings of 32 elements: 2e-12)."""


class Turned(NamedTuple):
    """Modes of a conservative state: ``vectors`` orthonormal in the mass, ``motions``, ``names``; symmetries come last.

    ``duals`` are the products of the vectors with the mass or, of what moves no mass, with the metric.
    """

    vectors: list[PETSc.Vec]
    duals: list[PETSc.Vec]
    motions: list[Motion]
    names: tuple[str, ...]


class ModeFinder:
    """Finds the modes of states of one system; ``error_bars`` are from a second, richer discretisation."""

    def __init__(self, solver: BranchSolver, error_bars: bool = True) -> None:
        self.solver, self.assessor = solver, Assessor(solver)
        self.motions, self.system = Motions(solver.system), solver.system
        self.error_bars, self._functionals = error_bars, np.zeros((0, 0))
        self._richer: tuple[Enriched, Assessor] | None = None

    def __call__(self, x: PETSc.Vec, number: int, method: str = "auto") -> tuple[Verdict, Modes]:
        """Assess the equilibrium ``x`` and find its ``number`` left-most modes (nearest zero without a potential)."""
        verdict = self.assessor(x, method, number)
        sample = self.motions.sample(x)
        found, noise = self._conservative(x, verdict) if self.assessor.conservative else self._pairs(x, number)
        errors = np.full(len(found["value"]), np.nan)
        values = found["value"][: len(found["value"]) - found["motion"].count(SYMMETRY)]
        note = QuadratureCheck(self.system)(x) if self.error_bars else ""
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
        """Right modes X and left ones Z of the eigenvalues nearest zero, ``Z^t M X = 1``, and round-off of these.

        Rigid motions are left out: of eigenvalue zero, they have no left vectors of their own under a thrust that
        follows the rod, which accelerates as it turns.  Near a double eigenvalue, where left and right vectors are
        nearly orthogonal, the round-off is as much more as they are.
        """
        pencil, comm = self.assessor.nonsymmetric.at(x), self.system.comm
        right, left = (pencil.near_zero(2 * number, left=side) for side in (False, True))
        chosen = sorted(_moving(right, number), key=lambda i: right.values[i].real)
        values, partners = right.values[chosen], list[int]()
        for value in values:
            distance = abs(left.values - value)
            distance[partners] = np.inf
            partners.append(int(np.argmin(distance)))
            if distance[partners[-1]] > SAME * abs(value):
                raise ConvergenceError(
                    f"The left mode of the eigenvalue {value:.6g} was not found: ask for fewer modes, or change the "
                    "load."
                )
        X, Z = _alone(pencil, right.vectors[:, chosen]), left.vectors[:, partners]
        Z = Z @ np.linalg.inv(comm.allreduce(Z.T @ pencil.weighed(X)).T)
        quotients = comm.allreduce(np.sum(Z * (local_rows(pencil.matrix) @ np.concatenate(comm.allgather(X))), axis=0))
        rounded = np.array([rounding_of(pencil.matrix, z, x) for z, x in zip(Z.T, X.T, strict=True)])
        moved, sign = self.signed([self.complex(x, column) for column in X.T])
        duals = [self.complex(x, k * column) for k, column in zip(sign, Z.T, strict=True)]
        weights = [self.complex(x, k * column, dual=True) for k, column in zip(sign, pencil.weighed(Z).T, strict=True)]
        modes = {
            "value": values,
            "residual": right.errors[chosen],
            "motion": tuple(right.kinds[i] for i in chosen),
            **dict(zip(("displacement", "rotation"), stack(moved), strict=True)),
            **dict(zip(LEFT, (*stack(duals), *stack(weights)), strict=True)),
        }
        return modes, NOISE * rounded + DRAWN * abs(quotients - values)

    def _errors(self, x: PETSc.Vec, values: np.ndarray, noise: np.ndarray) -> np.ndarray:
        """Bounds by the eigenvalues of the same state on a richer mesh, and their ``noise``; inf where it has none."""
        if self._richer is None:
            enriched = Enriched(self.solver)
            self._richer = enriched, Assessor(enriched.solver)
        richer, assessor = self._richer
        y, outcome = richer.solver.at_load(richer.transfer(x, state=True), self.system.scalar(x), reach=1.0)
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
            others[np.argsort(abs(values), kind="stable")] = found.values[_moving(found, number)]
        left = np.maximum(noise, FLOOR * max(self.system.scene.units.omega2, float(abs(values).max())))
        rho = halved(self.system.fields.discretization.degree)
        return np.array([bound(*each, rho) for each in zip(values, others, left, strict=True)])

    def few(self, x: PETSc.Vec, number: int, double: float = np.nan) -> Few:
        """The ``number`` left-most modes (nearest zero without a potential) of ``x``, and rigid motions.

        They have no weights and error bars.  ``double`` is an eigenvalue that has a single vector, at flutter.
        Raises :class:`~rodfem.errors.ConvergenceError` if the eigensolver fails.
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
        names = [self._name(x, v, value) for v, value in zip(vectors, values, strict=True)]
        symmetries = symmetry_modes(self.system, x)
        for vector, dual in weighed_modes(self.system, symmetries, mass).values():
            vectors.append(vector)
            duals.append(dual)
            motions.append(self.motions.at(x, vector))
        return Turned(vectors, duals, motions, (*names, *[SYMMETRY] * len(symmetries)))

    def _name(self, x: PETSc.Vec, v: PETSc.Vec, value: float) -> str:
        """Name of a mode of mass 1; that of a soft one is the name of its soft mode."""
        inertia = self.solver.inertia
        square = v.dot(inertia.metric * v).real
        if abs(value) < soft_limit(inertia) * square:
            return self._soft(x, [v / square**0.5])[0]
        return motion_names.name_of(self.system, self.system.at(x).turned, v.array_r.real[:, None])

    @cached_property
    def _soft(self) -> MotionNames:
        return MotionNames(self.system)

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
        nearest = [i for i in _upper(values) if i not in left_out]
        rigid = [i for i in nearest if found.kinds[i] == motion_names.RIGID]
        moving = [i for i in nearest if i not in rigid][:number]
        chosen = [*sorted(moving, key=lambda i: values[i].real), *rigid]
        if (worst := found.errors[chosen].max(initial=0.0)) > CONVERGED:
            raise ConvergenceError(f"Eigenvalues have a backward error of {worst:.0e}: use another discretisation.")
        columns, value = _alone(pencil, found.vectors[:, chosen]), values[chosen]
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


def _moving(found: Frequencies, number: int) -> list[int]:
    """Places of the ``number`` eigenvalues ``found`` nearest zero, nearest first: one of each pair, no rigid motion.

    Raises :class:`ConvergenceError` where there are fewer.
    """
    places = [i for i in _upper(found.values) if found.kinds[i] != motion_names.RIGID]
    if len(places) < number:
        raise ConvergenceError(
            f"The mesh has {len(places)} modes, not {number}: ask for fewer, or use a richer discretisation."
        )
    return places[:number]


def _upper(values: np.ndarray) -> list[int]:
    """Places of ``values`` without a negative imaginary part, nearest zero first: one of each pair."""
    return [int(i) for i in np.argsort(abs(values), kind="stable") if values[i].imag >= 0.0]


def _alone(pencil: NonsymmetricPencil, vectors: np.ndarray) -> np.ndarray:
    """Columns ``X`` (n, k) of ``vectors`` with ``X^* M X = 1``, and ``X^t M X`` real and positive, for each."""
    comm, X = pencil.system.comm, vectors
    X = X / np.sqrt(comm.allreduce(np.sum(X.conj() * pencil.weighed(X), axis=0)).real)
    return np.asarray(X * np.exp(-0.5j * np.angle(comm.allreduce(np.sum(X * pencil.weighed(X), axis=0)))))


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


def typical_rows(branch: Branch) -> dict[int, int]:
    """Rows of the typical states of a branch, and how many modes of each are wanted."""
    along = np.array([point.arclength for point in branch.points])
    rows = [int(np.argmin(abs(along - place))) for place in np.linspace(along[0], along[-1], 5)]
    wanted = {row: branch.points[row].negative for row in rows}
    for special in branch.special:
        indices = special.negative_before, special.negative_after
        wanted[special.row] = max(wanted.get(special.row, 0), *indices)
    return {row: min(max(FEWEST, wanted[row]), MOST) for row in sorted(wanted)}


def typical_modes(branches: Sequence[Branch], solvers: Sequence[BranchSolver]) -> list[list[Typical]]:
    """Modes at the typical states of each of the ``branches``, whose meshes have the ``solvers``; collective."""
    with solvers[0].system.clock.scope("modes"):
        return [_of_branch(branch, solvers) for branch in branches]


def _of_branch(branch: Branch, solvers: Sequence[BranchSolver]) -> list[Typical]:
    """Modes at the typical states of a branch, each on the mesh of its point; none of a rod without inertia."""
    if solvers[0].system.equations.massless:
        return []
    finders: dict[int, ModeFinder] = {}
    double = {special.row: special.omega2 for special in branch.special}
    out = []
    for row, number in typical_rows(branch).items():
        point = branch.points[row]
        if point.mesh not in finders:
            finders[point.mesh] = ModeFinder(solvers[point.mesh])
        try:
            with as_failure(solvers[point.mesh].system.comm):
                found = finders[point.mesh].few(point.x, number, double.get(row, np.nan))
            out.append(Typical(row, found))
        except (ConvergenceError, InputError) as trouble:
            out.append(Typical(row, None, str(trouble)))
    return out


def _rounded(pencil: SymmetricPencil, vectors: list[PETSc.Vec], values: np.ndarray) -> np.ndarray:
    """Uncertainty of eigenvalues of a ``pencil``: round-off of its matrix, to first order, and of the eigensolver."""
    out = []
    for v, value in zip(vectors, values, strict=True):
        square = v.dot(pencil.mass * v).real
        off = abs(v.dot(pencil.matrix * v).real / square - value)
        out.append(NOISE * rounding(pencil.matrix, v, v) / square + DRAWN * off)
    return np.array(out)
