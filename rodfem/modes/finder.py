r"""Finds the modes of states: signed, turned within equal eigenvalues, named; see :mod:`rodfem.modes.modes`.

The rotation in a perturbation is the spin ``w`` with ``dd_i = w x d_i``, in the space frame; of the quaternion it is
``w = 2 vec(dq conj(q)) / |q|^2``.  Where the centreline is no field the displacement is the integral of the linearised
kinematics ::

    dr' = w x r' + R dv,        r' = R v,

with the quadrature of the weak form, from the end that is held: it obeys the end conditions as exactly as the integral
constraints do.  Of a ring it is taken without its mean.

Under loads without a potential right and left eigenvectors are biorthonormal in the mass.  Every run records a few
modes at typical states of each branch: its ends, evenly between, special points.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

import numpy as np
from petsc4py import PETSc

from rodfem.adaptivity.error_estimate import Enriched, bound
from rodfem.continuation.branch import Branch
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.errors import ConvergenceError, InputError
from rodfem.fem.checks import QuadratureCheck
from rodfem.fem.shape import Shape, halved
from rodfem.fem.state import NodalValues
from rodfem.linalg.matrices import local_rows, rounding, rounding_of
from rodfem.linalg.orthogonal import combine, orthonormalize
from rodfem.modes.modes import LEFT, SYMMETRY, Few, Modes, Typical
from rodfem.problem.quaternions import CONJUGATE, directors, product
from rodfem.ranks import as_failure
from rodfem.stability import motion_names
from rodfem.stability.assessment import Assessor, Verdict
from rodfem.stability.cluster import DRAWN
from rodfem.stability.inertia import NOISE
from rodfem.stability.near_zero import soft_limit
from rodfem.stability.nonsymmetric import Frequencies, NonsymmetricPencil
from rodfem.stability.pencil import symmetry_modes, weighed_modes
from rodfem.stability.symmetric import CONVERGED, Eigenvalues, SymmetricSolver
from rodfem.tolerances import SAME_EIGENVALUE

SEEN = 1e-3
"""Response of a mode to a functional, relative to the greatest one, below which the functional does not observe it."""
DOUBLE = 1e-3
"""Eigenvalues nearer than this, relative, to a double one are that: round-off parts them by its square root."""
FEWEST, MOST = 4, 8  # modes of a state: those of negative eigenvalues are among them up to the latter
FLOOR = 5e-12
"""Least uncertainty of an eigenvalue by round-off, relative to the greatest one (rings of 32 elements: 2e-12)."""


@dataclass(frozen=True)
class Motion:
    """Displacement ``r`` (m, 3), rotation ``w`` (m, 3), both in the space frame, change of quaternion ``q`` (m, 4)."""

    r: np.ndarray
    w: np.ndarray
    q: np.ndarray


class Motions(Shape):
    """Evaluates perturbations of the states of one :class:`~rodfem.fem.system.System`; collective over its ranks."""

    def at(self, x: PETSc.Vec, d: PETSc.Vec) -> Motion:
        """Motion in the perturbation ``d`` of the state ``x``, at fixed load."""
        turning, state, change = self.system.fields.turning, self.system.at(x), self.system.change(d)
        field = state.turned[self.cells]
        dq = turning.change(field, change.turned[self.cells])
        r = self.system.fields.formulation.displacement(self, state, change)
        return Motion(r, self.nodal(spin(turning.quaternion(field), dq)), self.nodal(dq))

    def slope_changes(self, state: NodalValues, change: NodalValues) -> np.ndarray:
        """Change ``dr'`` of the slope at the Gauss points of the owned cells, (cells, points, 3)."""
        turning = self.system.fields.turning
        field, turned = (np.einsum("gn,cni->cgi", self._q_at_gauss, v.turned[self.cells]) for v in (state, change))
        q = turning.quaternion(field)
        out = np.cross(spin(q, turning.change(field, turned)), self.slopes(state))
        if free := list(self.system.scene.free_strains):
            dv = np.einsum("gn,cni->cgi", self._v_at_gauss, change.values("v")[self.cells])
            out += np.einsum("cgij,cgj->cgi", directors(q)[..., free], dv)
        return np.asarray(out)

    def dual(self, x: PETSc.Vec, y: PETSc.Vec) -> Motion:
        """Nodal weights of the linear functional ``d -> y . d`` of perturbations of the state ``x``."""
        turning, weights = self.system.fields.turning, self.system.change(y)
        field = self.system.at(x).turned[self.cells]
        q, dq = turning.quaternion(field), turning.functional(field, weights.turned[self.cells])
        w = self.nodal(np.sum(q * q, axis=-1, keepdims=True) / 4 * spin(q, dq))
        r = self.nodal(weights.values("r")[self.cells]) if "r" in weights.fields.dofs else np.zeros_like(w)
        return Motion(r, w, self.nodal(dq))

    def mean(self, values: np.ndarray) -> np.ndarray:
        """Mean over the arclength of nodal values (m, ...)."""
        weights = self.node_weights()
        return np.asarray(np.tensordot(weights, values, 1) / weights.sum())

    def node_weights(self) -> np.ndarray:
        """Weights (m,) of the nodes in an integral over the rod: Gauss-Lobatto quadrature in each element."""
        each, sizes = self._gauss @ self._q_at_gauss[:, self.order], self.from_left(self.size)
        out = np.zeros(len(sizes) * (len(each) - 1) + 1)
        for node, weight in enumerate(each):
            out[node : len(out) - len(each) + node + 1 : len(each) - 1] += weight * sizes
        return out


def spin(q: np.ndarray, dq: np.ndarray) -> np.ndarray:
    """Infinitesimal rotation ``2 vec(dq conj(q)) / |q|^2`` in the space frame, (..., 4) -> (..., 3)."""
    return np.asarray(2 * product(dq, q * CONJUGATE)[..., 1:] / np.sum(q * q, axis=-1, keepdims=True))


class ModeFinder:
    """Finds the modes of states of one system; ``error_bars`` are from a second, richer discretisation."""

    def __init__(self, solver: BranchSolver, error_bars: bool = True) -> None:
        self.solver, self.assessor, self.error_bars = solver, Assessor(solver), error_bars
        self.motions, self.system = Motions(solver.system), solver.system

    def __call__(self, x: PETSc.Vec, number: int, method: str = "auto") -> tuple[Verdict, Modes]:
        """Assess the equilibrium ``x`` and find its ``number`` left-most modes (nearest zero without a potential)."""
        verdict = self.assessor(x, method, number)
        found, left, noise = self._conservative(x, verdict) if self.assessor.conservative else self._pairs(x, number)
        errors = np.full(len(found.value), np.nan)
        values = found.value[: len(errors) - found.motion.count(SYMMETRY)]
        note = QuadratureCheck(self.system)(x) if self.error_bars else ""
        if self.error_bars and not note:
            errors[: len(values)] = self._errors(x, values, noise)
        sample = self.motions.sample(x)
        unit = sample["q"] / np.linalg.norm(sample["q"], axis=1, keepdims=True)
        state: dict[str, Any] = {"load": self.system.scalar(x), "s": sample["s"], "r": sample["r"], "q": unit}
        state |= found._asdict() | dict(zip(LEFT, left, strict=True))
        rates = self.system.scene.inertia.order == 1
        return verdict, Modes(**state, error=errors, rates=rates, note=note)

    def few(self, x: PETSc.Vec, number: int, double: float = np.nan) -> Few:
        """The ``number`` left-most modes (nearest zero without a potential) of ``x``, and rigid motions."""
        if not self.assessor.conservative:
            return self._few_nearest(x, number, double)
        return self._turned(x, self.assessor.leftmost(x, number), self.assessor.symmetric.mass)[0]

    def _errors(self, x: PETSc.Vec, values: np.ndarray, noise: np.ndarray) -> np.ndarray:
        """Bounds by the eigenvalues of the same state on a richer mesh, and their ``noise``; inf where it has none."""
        (richer, assessor), number = self._richer, len(values)
        y, outcome = richer.solver.at_load(richer.transfer(x, state=True), self.system.scalar(x), reach=1.0)
        if not outcome.converged:
            return np.full(number, np.inf)
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

    @cached_property
    def _richer(self) -> tuple[Enriched, Assessor]:
        enriched = Enriched(self.solver)
        return enriched, Assessor(enriched.solver)

    # --- conservative ------------------------------------------------------------------------------------------

    def _conservative(self, x: PETSc.Vec, verdict: Verdict) -> tuple[Few, list[np.ndarray], np.ndarray]:
        """Modes from the vectors of a verdict, and the symmetries', their left sides, and round-off."""
        if not verdict.vectors:
            raise InputError("Counting alone finds no modes: choose another method than 'count'.")
        pencil = self.assessor.symmetric.at(x)
        modes, vectors, duals = self._turned(
            x, Eigenvalues(verdict.values, verdict.vectors, verdict.errors), pencil.mass
        )
        weights = _stacked([self.motions.dual(x, y) for y in duals])
        return modes, [modes.displacement, modes.rotation, *weights], _rounded(pencil, vectors, verdict.values)

    def _turned(
        self, x: PETSc.Vec, found: Eigenvalues, mass: PETSc.Mat
    ) -> tuple[Few, list[PETSc.Vec], list[PETSc.Vec]]:
        """Modes of a conservative state, and symmetries; the vectors of the former, and the duals of all."""
        vectors = [v.copy() for v in found.vectors]
        orthonormalize(vectors, mass)
        motions = [self.motions.at(x, v) for v in vectors]
        weights = self._weights(found.values, self._responses(x, motions))
        vectors = [combine([vectors[i] for i in group], b) for group, b in weights]
        motions = [_sum([motions[i] for i in group], b) for group, b in weights]
        names = map(self._name, [x] * len(vectors), vectors, found.values)
        symmetries = list(weighed_modes(self.system, symmetry_modes(self.system, x), mass).values())
        duals = [*(mass * v for v in vectors), *(dual for _, dual in symmetries)]
        moved = _stacked([*motions, *(self.motions.at(x, vector) for vector, _ in symmetries)])
        none = np.zeros(len(symmetries))
        value, residual = np.append(found.values, none), np.append(found.errors, none * np.nan)
        return Few(value, residual, (*names, *[SYMMETRY] * len(none)), *moved), vectors, duals

    def _name(self, x: PETSc.Vec, v: PETSc.Vec, value: float) -> str:
        """Name of a mode of mass 1; that of a soft one is the name of its soft mode."""
        inertia = self.solver.inertia
        square = v.dot(inertia.metric * v).real
        if abs(value) < soft_limit(inertia) * square:
            return motion_names.names_for(self.system)(x, [v / square**0.5])[0]
        return motion_names.name_of(self.system, self.system.at(x).turned, v.array_r.real[:, None])

    def _weights(self, values: np.ndarray, responses: np.ndarray) -> list[tuple[list[int], np.ndarray]]:
        """Each new mode as a combination: places of those combined, and weights; ``responses`` are (K, 36)."""
        out = []
        parted = np.flatnonzero(np.diff(values) > SAME_EIGENVALUE * abs(values).max(initial=0.0)) + 1
        for group in np.split(np.arange(len(values)), parted):
            mine, basis = responses[group], list[np.ndarray]()
            seen = SEEN * abs(mine).max()
            for response in mine.T:
                rest = response - sum((b * (b @ response) for b in basis), np.zeros(len(group)))
                if (size := np.linalg.norm(rest)) > seen:
                    basis.append(rest / size)
                if len(basis) == len(group):
                    break
            out += [(group.tolist(), b) for b in (basis if len(basis) == len(group) else np.eye(len(group)))]
        return out

    def _responses(self, x: PETSc.Vec, motions: list[Motion]) -> np.ndarray:
        """Responses (K, 36) to fixed functionals of the motions along e1, e2, e3 and about them."""
        s = self.motions.sample(x)["s"]
        t = (s - s[0]) / (s[-1] - s[0])
        functionals = self.motions.node_weights() * [1 + t + np.cos(3.1 * t + 0.7 * j) for j in range(6)]
        return np.array([(functionals @ np.hstack([m.r, m.w])).ravel() for m in motions])

    # --- loads without a potential -----------------------------------------------------------------------------

    def _pairs(self, x: PETSc.Vec, number: int) -> tuple[Few, list[np.ndarray], np.ndarray]:
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
            if distance[partners[-1]] > 1e-6 * abs(value):  # another one
                raise ConvergenceError(
                    f"The left mode of the eigenvalue {value:.6g} was not found: ask for fewer modes, or change the "
                    "load."
                )
        X, Z = _alone(pencil, right.vectors[:, chosen]), left.vectors[:, partners]
        Z = Z @ np.linalg.inv(comm.allreduce(Z.T @ pencil.weighed(X)).T)
        quotients = comm.allreduce(np.sum(Z * (local_rows(pencil.matrix) @ np.concatenate(comm.allgather(X))), axis=0))
        rounded = np.array([rounding_of(pencil.matrix, z, x) for z, x in zip(Z.T, X.T, strict=True)])
        moved, sign = self._signed(x, X)
        duals = _stacked([self._complex(x, column) for column in (sign * Z).T])
        weights = _stacked([self._complex(x, column, dual=True) for column in (sign * pencil.weighed(Z)).T])
        modes = Few(values, right.errors[chosen], tuple(right.kinds[i] for i in chosen), *moved)
        return modes, [*duals, *weights], NOISE * rounded + DRAWN * abs(quotients - values)

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
        coalesced, columns = np.isin(chosen, same), _alone(pencil, found.vectors[:, chosen])
        value = np.where(coalesced, double, np.where(np.isin(chosen, rigid), 0.0, values[chosen]))
        moved, _ = self._signed(x, np.where(coalesced, columns.real, columns))
        return Few(value, found.errors[chosen], tuple(found.kinds[i] for i in chosen), *moved)

    def _signed(self, x: PETSc.Vec, columns: np.ndarray) -> tuple[tuple[np.ndarray, np.ndarray], np.ndarray]:
        """Displacements and rotations of a fixed sign in perturbations (n, K), and what each was multiplied by."""
        r, w = _stacked([self._complex(x, column) for column in columns.T])
        sign = np.array([np.sign(np.real(a.sum() + 0.01 * b.sum()) or 1.0) for a, b in zip(r, w, strict=True)])
        return (sign[:, None, None] * r, sign[:, None, None] * w), sign

    def _complex(self, x: PETSc.Vec, values: np.ndarray, *, dual: bool = False) -> Motion:
        """Motion of a complex perturbation, or weights of a complex functional, by its values on this rank (n,)."""
        evaluate = self.motions.dual if dual else self.motions.at
        parts = self.system.vectors(np.stack([values.real, values.imag], axis=1))
        return _sum([evaluate(x, part) for part in parts], np.array([1.0, 1j]))


def _moving(found: Frequencies, number: int) -> list[int]:
    """Places of the ``number`` eigenvalues ``found`` nearest zero, nearest first: one of each pair, no rigid motion."""
    places = [i for i in _upper(found.values) if found.kinds[i] != motion_names.RIGID]
    if len(places) < number:
        raise ConvergenceError(
            f"The mesh has {len(places)} modes, not {number}: ask for fewer, or use a richer discretisation."
        )
    return places[:number]


def _upper(values: np.ndarray) -> list[int]:
    """Places of ``values`` without a negative imaginary part, nearest zero first: one of each pair."""
    return [int(i) for i in np.argsort(abs(values), kind="stable") if values[i].imag >= 0.0]


def _alone(pencil: NonsymmetricPencil, X: np.ndarray) -> np.ndarray:
    """Columns ``X`` (n, k) of vectors with ``X^* M X = 1``, and ``X^t M X`` real and positive, for each."""
    comm = pencil.system.comm
    X = X / np.sqrt(comm.allreduce(np.sum(X.conj() * pencil.weighed(X), axis=0)).real)
    return np.asarray(X * np.exp(-0.5j * np.angle(comm.allreduce(np.sum(X * pencil.weighed(X), axis=0)))))


def _stacked(motions: list[Motion]) -> tuple[np.ndarray, np.ndarray]:
    """Displacements and rotations of several motions, (K, m, 3) each."""
    return np.array([m.r for m in motions]), np.array([m.w for m in motions])


def _sum(motions: list[Motion], weights: np.ndarray) -> Motion:
    """Linear combination of motions."""
    parts = ((m.r, m.w, m.q) for m in motions)
    return Motion(*(np.tensordot(weights, np.array(each), 1) for each in zip(*parts, strict=True)))


def _rounded(pencil: SymmetricSolver, vectors: list[PETSc.Vec], values: np.ndarray) -> np.ndarray:
    """Uncertainty of eigenvalues of a ``pencil``: round-off of its matrix, to first order, and of the eigensolver."""
    out = []
    for v, value in zip(vectors, values, strict=True):
        square = v.dot(pencil.mass * v).real
        off = abs(v.dot(pencil.matrix * v).real / square - value)
        out.append(NOISE * rounding(pencil.matrix, v, v) / square + DRAWN * off)
    return np.array(out)


# --- typical states --------------------------------------------------------------------------------------------


def typical_modes(branches: Sequence[Branch], solvers: Sequence[BranchSolver]) -> list[list[Typical]]:
    """Modes at the typical states of each of the ``branches``, whose meshes have the ``solvers``; collective."""
    with solvers[0].system.clock.scope("modes"):
        return [_of_branch(branch, solvers) for branch in branches]


def _of_branch(branch: Branch, solvers: Sequence[BranchSolver]) -> list[Typical]:
    """Modes at the typical states of a branch, each on the mesh of its point; none of a rod without inertia."""
    if solvers[0].system.equations.massless:
        return []
    finder_on = cache(lambda mesh: ModeFinder(solvers[mesh]))
    rates = solvers[0].system.scene.inertia.order == 1
    double = {special.row: special.omega2 for special in branch.special if not rates}
    out = []
    for row, number in _typical_rows(branch).items():
        point = branch.points[row]
        try:
            with as_failure(solvers[point.mesh].system.comm):
                found = finder_on(point.mesh).few(point.x, number, double.get(row, np.nan))
            out.append(Typical(row, found))
        except (ConvergenceError, InputError) as trouble:
            out.append(Typical(row, None, str(trouble)))
    return out


def _typical_rows(branch: Branch) -> dict[int, int]:
    """Rows of the typical states of a branch, and how many modes of each are wanted."""
    along = np.array([point.arclength for point in branch.points])
    rows = [int(np.argmin(abs(along - place))) for place in np.linspace(along[0], along[-1], 5)]
    wanted = {row: branch.points[row].negative for row in rows}
    for special in branch.special:
        indices = special.negative_before, special.negative_after
        wanted[special.row] = max(wanted.get(special.row, 0), *indices)
    return {row: min(max(FEWEST, wanted[row]), MOST) for row in sorted(wanted)}
