"""A step of continuation in one call of compiled code (``step.c``): prediction, correction, tangent, index, checks.

Between the calls of a step Python and PETSc's vectors take longer than the arithmetic.  Where the compiled step gives
up, as near a singular state, or where a condition below is not met, ``BranchSolver.step`` makes it step by step: a
test compares both at every row of every scene.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.sparse as sp
from petsc4py import PETSc

from rodfem.continuation.branch import Point
from rodfem.continuation.compiled_corrector import CompiledCorrector
from rodfem.continuation.prediction import ROWS, weights
from rodfem.errors import ConvergenceError
from rodfem.fem import verification
from rodfem.fem.newton import NewtonResult
from rodfem.fem.state import Energies
from rodfem.fem.symmetries import SYMMETRIC_STATE, Phase
from rodfem.linalg.compiled import Memory, buffer, module
from rodfem.linalg.matrices import EPS, shared

if TYPE_CHECKING:
    from rodfem.fem.compiled_newton import Limits
    from rodfem.fem.parameters import Line
    from rodfem.stability.inertia import Factored

MOST = 16
"""Symmetries of a scene that the code has room for."""
MADE = 0
INDEX = {"starts": "indptr", "indices": "indices"}
"""Pointers to the pattern of a sparse matrix, and what scipy calls it."""


@dataclass(frozen=True)
class Made:
    """A step that was made.

    Attributes
    ----------
    x, tangent
        State, and unit tangent on the side of the prediction's direction.
    found, below
        Factors at the state, and the index by their count.
    nearest
        Estimated distance of the eigenvalue nearest zero from zero.
    outcome
        The Newton iteration.
    aligned
        Cosine between the direction of the prediction and the tangent.
    length
        Distance from the last state, in the metric.
    energies
        Stored and potential energy, and what the load does work on.
    """

    x: PETSc.Vec
    tangent: PETSc.Vec
    found: Factored
    nearest: float
    below: int
    outcome: NewtonResult
    aligned: float
    length: float
    energies: Energies


@dataclass(frozen=True)
class Checked:
    """What was checked of a state ``x``.

    The largest ``residual``, in natural units, and the largest difference of the squared ``norm`` of a quaternion from
    one.
    """

    x: PETSc.Vec
    residual: float
    norm: float


class CompiledStep:
    """Steps with the matrix and the factors of one :class:`CompiledCorrector`.

    Attributes
    ----------
    checked
        What was checked at the state of the last step; None before the first.
    """

    def __init__(self, corrector: CompiledCorrector) -> None:
        """Hand all arrays over."""
        self.corrector, self.system = corrector, corrector.system
        system, n = self.system, self.system.fields.unknowns
        code = module("continuation/step")
        self._lib, self._ffi, self._memory = code.lib, code.ffi, Memory(code.ffi)
        step = self._step = self._ffi.new("Step *")
        theirs, newton = corrector.ffi, corrector.newton
        self._address(step, "correct", theirs.addressof(corrector.lib, "correct"))
        self._address(step, "factor", theirs.addressof(corrector.lib, "factor_at"))
        self._address(step, "equations", theirs.addressof(corrector.lib, "residual_at"))
        step.rod, step.block, step.newton = corrector.rod, corrector.block, newton
        step.iterations = self._theirs("int *", theirs.addressof(newton, "iterations"))
        step.error = self._theirs("double *", theirs.addressof(newton, "error"))
        step.factored_tangent, step.u = (
            self._theirs("double *", x) for x in (corrector.block.tangent, corrector.rod.u)
        )
        step.n, step.load, step.drifts = n, system.load_index, n - len(system.drifts)
        metric, saddle = shared(system.metric), shared(corrector.matrix)
        assert metric is not None
        assert saddle is not None
        self._sparse("metric", metric.pattern, metric.values)
        self._sparse("saddle", saddle.pattern, saddle.values)
        if not system.scene.units.ordinary:
            self._memory.point(step, sizes=system.sizes.array_r.real.copy())
        quaternions = system.fields.dofs.get("q", np.zeros((0, 4), int)).reshape(-1, 4)
        step.quaternions = len(quaternions)
        self._memory.point(step, quaternion=quaternions.astype(np.int32))
        self._symmetries(step)
        self._arrays = {name: np.zeros(n) for name in ("x", "direction", "row", "tangent")}
        self._memory.point(step, **self._arrays, right=np.zeros(n), combined=np.zeros(n))
        self._states = self._ffi.new("double *[]", ROWS)
        self.checked: Checked | None = None
        self._line: Line | None = None
        self._exact = not any(symmetry.along for symmetry in system.symmetries) and len(system.symmetries) <= MOST

    def _symmetries(self, step: Any) -> None:
        system, rod = self.system, self.corrector.rod
        count, own = len(system.symmetries), step.drifts
        matrix = system.generators.in_unknowns()
        step.symmetries, step.symmetric = count, SYMMETRIC_STATE
        self._sparse("generator", matrix, matrix.data)
        self._memory.point(step, generic=verification.generic_weights(count))
        step.active = self._theirs("int *", rod.active)
        step.conditions, step.offsets = (self._theirs("double *", x) for x in (rod.conditions, rod.offsets))
        step.zero, step.tiny = verification.ZERO * system.stiffness_scale, verification.TINY
        step.round_off, step.residual = verification.ROUND_OFF * EPS, verification.RESIDUAL
        self._memory.point(step, generators=np.zeros(count * own), images=np.zeros(count * own))

    def _theirs(self, kind: str, pointer: Any) -> Any:
        """Pointer into what another module of compiled code uses."""
        return self._ffi.cast(kind, int(self.corrector.ffi.cast("uintptr_t", pointer)))

    def _address(self, step: Any, name: str, function: Any) -> None:
        setattr(step, name, int(self.corrector.ffi.cast("uintptr_t", function)))

    def _sparse(self, name: str, pattern: sp.csr_matrix, values: np.ndarray) -> None:
        sparse = getattr(self._step, name)
        sparse.rows = pattern.shape[0]
        index = {part: getattr(pattern, of).astype(np.int32, copy=False) for part, of in INDEX.items()}
        self._memory.point(sparse, **index, values=values)

    def __call__(
        self, known: Sequence[Point], s: float, bounds: tuple[float, float], limits: Limits, same: float
    ) -> Made | None:
        """Step to the arclength ``s``; None where it is to be made step by step.

        Parameters
        ----------
        known
            Rows of the branch; it goes on from the last one.
        bounds
            Least and greatest load of a prediction.
        limits
            Those of Newton's method.
        same
            Correction, relative, below which a prediction is the state itself.
        """
        if not self._serves():
            return None
        system, corrector, step, ffi = self.system, self.corrector, self._step, self._ffi
        last = known[-1]
        rows, value, slope = weights(known, s)
        corrector.prepare(limits)
        self._energies()
        step.norm = system.verification.norm
        held = [buffer(ffi, row.array_r) for row in rows]
        for i, row in enumerate(held):
            self._states[i] = row
        before = ffi.NULL if last.tangent is None else buffer(ffi, last.tangent.array_r)
        given = (value.tolist(), slope.tolist(), buffer(ffi, last.x.array_r), before)
        with system.clock("solve"):
            status = self._lib.advance(step, len(rows), self._states, *given, *bounds, same)
        corrector.adopt(regular=status == MADE)
        return self._made() if status == MADE else None

    def _energies(self) -> None:
        """Hand over the forms of the energies, with the constants that they have now."""
        step, equations = self._step, self.system.equations
        step.assemble = equations.energy.function
        for name, form in (("energy", equations.energy), ("potential", equations.potential)):
            if form is not None:
                setattr(step, name, self._memory.keep(name, form).pointer)
                self._memory.point(step, **{f"{name}_constants": form.constants})

    def _serves(self) -> bool:
        """Whether the code does all that a step of the system asks for now."""
        system = self.system
        if not self._exact or system.damping or system.verification.dropped:
            return False
        if not system.symmetries:
            return True
        if system.line is not self._line:
            self._line, fixed = system.line, system.generators.fixed(system.line)
            self._fixed = fixed is not None
            if fixed is not None:
                self._memory.point(self._step, constants=fixed)
        return self._fixed and system.verification.norm > 0

    def _made(self) -> Made | None:
        """The step that the code has just made; None where a symmetry is to be verified again, or the count fails."""
        system, corrector, step = self.system, self.corrector, self._step
        x, tangent = system.new_vector(), system.new_vector()
        x.array[:], tangent.array[:] = self._arrays["x"], self._arrays["tangent"]
        if system.symmetries:
            system.phase = self._phase(x)
        if not step.verified and not system.verify(corrector.matrix, system.at(x)):
            return None
        found, newton = corrector.hold(), corrector.newton
        try:
            below = found.counted()
        except ConvergenceError:
            return None
        outcome = NewtonResult(True, newton.iterations, newton.error, newton.moved)
        self.checked = Checked(x, step.unbalanced, step.stretched)
        energies = Energies(step.energy_value, step.potential_value, -float(corrector.load_equation[0]))
        if system.equations.potential is None:
            energies = Energies(step.energy_value, float("nan"), float("nan"))
        return Made(x, tangent, found, corrector.nearest, below, outcome, step.along, step.length, energies)

    def _phase(self, x: PETSc.Vec) -> Phase:
        """Phase conditions at ``x``, which the code has just found."""
        step, count, own = self._step, len(self.system.symmetries), self._step.drifts
        corrector = self.corrector
        active, combinations = np.flatnonzero(corrector.active).tolist(), np.frombuffer(self._ffi.buffer(step.weights))
        combinations = combinations[: count**2].reshape(count, count).copy()
        rows = {i: corrector.conditions[i, :own].copy() for i in active}
        kept = combinations[[i for i in range(count) if i not in rows]]
        broken = {i: combinations[i] for i in active}
        make = self.system.generators.vector
        phase = Phase(rows, rows, corrector.offsets.copy(), broken, kept, x.copy(), make)
        self.system.at(x).phases[frozenset()] = phase
        return phase
