"""Newton's method in one call of compiled code (``newton.c``), on one rank, with factors along the rod.

Of a point of seventy unknowns the arithmetic takes a tenth of a millisecond, and the way through Python and PETSc's
vectors several times as long.  The iteration is that of :mod:`rodfem.fem.newton`; a test compares both at every row of
every scene (``tests/continuation/test_compiled_newton.py``).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from petsc4py import PETSc

from rodfem.linalg.chain import Chain, Elimination
from rodfem.linalg.compiled import module
from rodfem.linalg.matrices import shared

if TYPE_CHECKING:
    from rodfem.fem.system import System
    from rodfem.linalg.factorization import Factors

FUNCTIONS = """
int assemble_at(const Rod *rod, const double *x);
int residual_at(const Rod *rod, const double *x, double *out);
int factor_at(const Rod *rod, Block *b, const double *x);
int correct(const Rod *rod, Block *b, Newton *newton, double *x, const double *row);
"""
CONVERGED, FAILED, SINGULAR, BROKEN = range(4)
"""How an iteration ended: it converged, or not; ``S`` was too near singular; there were no factors at all."""


def declarations() -> str:
    """The structures and functions of the code, for cffi."""
    code = Path(__file__).with_name("newton.c").read_text()
    return code[code.index("typedef struct {") : code.index("static double dot(")] + FUNCTIONS


@dataclass(frozen=True)
class Limits:
    """Constants of Newton's method, for one call.

    At most ``most`` iterations are made, the first one with the factors of the last call where ``held`` says that its
    state was nearby; ``reach`` bounds a correction, ``tolerance`` is an error that is small enough,
    ``still`` the size below which a correction that no longer shrinks is round-off.  ``converged``, ``kept`` and
    ``shrunk`` are TOLERANCE, KEPT and SHRUNK of :mod:`rodfem.fem.newton`.
    """

    most: int
    held: bool
    reach: float
    tolerance: float
    still: float
    converged: float
    kept: float
    shrunk: float


class Ended(NamedTuple):
    """How an iteration ended: ``status``, number of ``iterations``, error, and by how much the state ``moved``."""

    status: int
    iterations: int
    error: float
    moved: float


class CompiledNewton:
    """The compiled iteration for one matrix of a system, which it fills, and its factors.

    Attributes
    ----------
    factored, equations
        The iterate that was factored last, and the equations there, (n,).
    border
        Derivative of the equations in the load at that state, (n,), where the factors are symmetric.
    active, conditions, offsets, forces
        Of each drift scalar: whether it has a phase condition, that condition (drifts, n), its offset, and what a drift
        of one adds to the equations (drifts, n).
    """

    @staticmethod
    def serves(matrix: PETSc.Mat, factors: Factors) -> bool:
        """Whether matrix and factors are those of compiled code."""
        return shared(matrix) is not None and isinstance(factors, Chain)

    def __init__(self, system: System, matrix: PETSc.Mat, factors: Chain) -> None:
        """Hand all arrays over: of the ``system``, of a ``matrix`` of it with all columns, and its ``factors``."""
        self.system, self.matrix, self.factors, n = system, matrix, factors, system.fields.unknowns
        compiled = module("newton", declarations(), Path(__file__).parent)
        self.lib, self.ffi = compiled.lib, compiled.ffi
        self._kept: list[Any] = []
        self._given: tuple[Any, ...] = (None, None, None)
        own, metric = shared(matrix), shared(system.metric)
        assert own is not None
        assert metric is not None
        self._pattern = own.pattern
        drifts = np.array(system.drifts, dtype=np.int32)
        self.conditions, self.offsets = np.zeros((len(drifts), n)), np.zeros(len(drifts))
        self.active, self.border = np.zeros(len(drifts), dtype=np.int32), np.zeros(n)
        self.forces = np.zeros_like(self.conditions) if system.drift_forces else self.conditions
        starts, load, every = own.pattern.indptr, system.load_index, np.arange(n)
        # scalars are the last columns of each row, and their own rows are dense
        column = {i: starts[1:] - (n - i) for i in (load, *system.drifts)}
        rod = self.rod = self.ffi.new("Rod *")
        rod.n, rod.locals, rod.entries = n, len(system.fields.clamps), len(own.values)
        rod.number, rod.u = self._ints(system.maps(load=True)[1]), self._doubles(system.fields.clamps.copy())
        rod.values, rod.load, rod.load_diagonal = self._doubles(own.values), load, int(column[load][load])
        rod.load_column = self._ints(np.where(every == load, -1, column[load]))
        rod.load_row = self._ints(starts[load] + every)
        rod.drifts, rod.drift, rod.active = len(drifts), self._ints(drifts), self._ints(self.active)
        rod.conditions, rod.offsets = self._doubles(self.conditions), self._doubles(self.offsets)
        rod.forces = self._doubles(self.forces)
        rod.drift_row = self._ints(np.array([starts[d] + every for d in drifts]))
        rod.drift_column = self._ints(np.array([column[d] for d in drifts]))
        rod.starts, rod.indices = self._ints(metric.pattern.indptr), self._ints(metric.pattern.indices)
        rod.metric, rod.border = self._doubles(metric.values), self._doubles(self.border)
        rod.sizes = self._doubles(system.sizes.array.copy())
        self.load_equation = np.zeros(1)
        rod.load_equation = self._doubles(self.load_equation)
        self.newton = self.ffi.new("Newton *")
        self.factored, self.equations = np.zeros(n), np.zeros(n)
        self.newton.factored, self.newton.factored_equations = map(self._doubles, (self.factored, self.equations))
        self.newton.step, self.newton.origin, self.newton.equations = (self._doubles(np.zeros(n)) for _ in range(3))
        self.block = self.ffi.NULL

    def _ints(self, array: np.ndarray) -> Any:
        return self._pointer(np.asarray(array, dtype=np.int32), "int")

    def _doubles(self, array: np.ndarray) -> Any:
        return self._pointer(array, "double")

    def _pointer(self, array: np.ndarray, kind: str) -> Any:
        array = np.ascontiguousarray(array)
        self._kept.append(array)
        return self.ffi.cast(f"{kind} *", array.ctypes.data)

    def _take(self) -> None:
        """Use the parameters, the phase conditions and the factors that the system has now."""
        system, rod, equations = self.system, self.rod, self.system.equations
        equations.take(system.line)
        self.factors.prepare(self.matrix)
        given = (self.factors.elimination, equations.residual.constants, equations.jacobian.constants)
        if any(mine is not new for mine, new in zip(self._given, given, strict=True)):
            self._point(rod, given[0])
            self._given = given
        self.active[:], self.offsets[:] = 0, system.phase.offsets
        for i, row in system.phase.rows.items():
            self.active[i], self.conditions[i, : len(row)] = 1, row
            self.forces[i, : len(row)] = system.phase.forces[i]

    def prepare(self, limits: Limits) -> None:
        """Use what the system has now, and these ``limits`` of Newton's method."""
        self._take()
        for name, value in vars(limits).items():
            setattr(self.newton, name, value)

    def adopt(self, *, regular: bool) -> None:
        """The matrix holds another state, whose factors are ``regular``, as compiled code has left them."""
        self.factors.adopt(regular=regular)
        self.matrix.stateIncrease()

    def _point(self, rod: Any, elimination: Elimination) -> None:
        """Let the ``rod`` point to the forms with their constants, and to the factors."""
        system, equations = self.system, self.system.equations
        for name, form in (("residual", equations.residual), ("jacobian", equations.jacobian)):
            setattr(rod, name, form.pointer)
            setattr(rod, f"{name}_constants", self.ffi.cast("double *", form.constants.ctypes.data))
        assert system.equation_places is not None
        rod.equation_places = system.equation_places.pointer
        rod.entry_places = system.matrix_places(self._pattern, True).pointer
        rod.assemble, rod.factors = equations.residual.function, elimination.pointer
        rod.factor, rod.solve, rod.negative, rod.zero = elimination.functions

    def assemble(self, x: PETSc.Vec) -> None:
        """Fill the matrix with ``S`` at ``x`` and a one for the load, and :attr:`border`; phase conditions stay."""
        self._take()
        state = x.array_r
        failed = self.lib.assemble_at(self.rod, self.ffi.cast("double *", state.ctypes.data))
        assert not failed, "A term at a point inside the rod must be evaluated in one of the two cells there."
        self.matrix.stateIncrease()

    def correct(self, x: PETSc.Vec, row: PETSc.Vec, limits: Limits) -> Ended:
        """Solve the equations on the plane through ``x`` across ``row``, in place.

        ``x`` is as it was where there were no factors.
        """
        self.prepare(limits)
        newton, along = self.newton, row.array_r
        with x as state:
            begin, arrays = state.copy(), (state, along)
            pointers = [self.ffi.cast("double *", array.ctypes.data) for array in arrays]
            status = self.lib.correct(self.rod, self.block, newton, *pointers)
            if status >= SINGULAR:
                state[:] = begin
        if newton.factorisations:
            self.adopt(regular=status < SINGULAR and not newton.singular)
        return Ended(status, newton.iterations, newton.error, newton.moved)
