"""Newton's method, tangent and index at a state in one call of compiled code (``newton.c``), along the rod.

Of a point of seventy unknowns the arithmetic takes a tenth of a millisecond, and the way through Python and PETSc's
vectors several times as long.  The iteration is that of :mod:`rodfem.fem.newton` and of
:class:`~rodfem.continuation.corrector.Corrector`; ``tests/continuation/test_compiled_newton.py`` compares both at every
row of every scene.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from petsc4py import PETSc

from rodfem.fem import newton
from rodfem.fem.newton import NewtonResult
from rodfem.fem.state import State
from rodfem.linalg.chain import Chain
from rodfem.linalg.compiled import module
from rodfem.linalg.matrices import shared
from rodfem.stability.inertia import FRESH, Factored, Inertia

STRUCTURES = ("Rod", "Block", "Newton")
CONVERGED, FAILED, SINGULAR, BROKEN = range(4)
"""How the iteration ended: :class:`NewtonResult` tells the first two; ``S`` too near singular; no factors at all."""


def declarations() -> str:
    """The structures and functions of the code, for cffi."""
    code = Path(__file__).with_name("newton.c").read_text()
    first, last = code.index("typedef struct {\n    uintptr_t assemble"), code.index("static double dot(")
    functions = (
        "int assemble_at(const Rod *rod, const double *x);",
        "int solve_at(const Rod *rod, Block *b, const double *r);",
        "int correct(const Rod *rod, Block *b, Newton *newton, double *x, const double *row);",
    )
    return "\n".join([code[first:last], *functions])


class CompiledNewton:
    """The compiled iteration for one :class:`~rodfem.stability.inertia.Inertia`, whose matrix and factors it uses.

    Attributes
    ----------
    nearest
        Estimated distance of the eigenvalue nearest zero from zero, at the state last factored.
    """

    @staticmethod
    def serves(inertia: Inertia) -> bool:
        """Whether matrices and factors are those of compiled code."""
        return shared(inertia.matrix) is not None and isinstance(inertia.factors, Chain)

    def __init__(self, inertia: Inertia, block: int, near_zero: float) -> None:
        """Hand all arrays over.

        ``block`` is the number of vectors that are iterated inversely, ``near_zero`` the distance of an eigenvalue from
        zero below which ``S`` is too near singular.
        """
        system = self.system = inertia.system
        self.inertia, n = inertia, system.fields.unknowns
        compiled = module("newton", declarations(), Path(__file__).parent)
        self.lib, self.ffi = compiled.lib, compiled.ffi
        self._kept: list[Any] = []
        own, metric = shared(inertia.matrix), shared(system.metric)
        assert own is not None
        assert metric is not None
        drifts = np.array(system.drifts, dtype=np.int32)
        self.conditions, self.offsets = np.zeros((len(drifts), n)), np.zeros(len(drifts))
        self.active, self.border = np.zeros(len(drifts), dtype=np.int32), np.zeros(n)
        self._u = system.fields.clamps.copy()
        starts, load = own.pattern.indptr, system.load_index
        # scalars are the last columns of each row, and their own rows are dense
        column = {i: starts[1:] - (n - i) for i in (load, *system.drifts)}
        rod = self.rod = self.ffi.new("Rod *")
        rod.n, rod.locals, rod.entries = n, len(self._u), len(own.values)
        rod.number, rod.u = self._ints(system.maps(load=True)[1]), self._doubles(self._u)
        rod.values, rod.load, rod.load_diagonal = self._doubles(own.values), load, int(column[load][load])
        rod.load_column = self._ints(np.where(np.arange(n) == load, -1, column[load]))
        rod.drifts, rod.drift, rod.active = len(drifts), self._ints(drifts), self._ints(self.active)
        rod.conditions, rod.offsets = self._doubles(self.conditions), self._doubles(self.offsets)
        rod.drift_row = self._ints(np.array([starts[d] + np.arange(n) for d in drifts]))
        rod.drift_column = self._ints(np.array([column[d] for d in drifts]))
        rod.starts, rod.indices = self._ints(metric.pattern.indptr), self._ints(metric.pattern.indices)
        rod.metric, rod.border = self._doubles(metric.values), self._doubles(self.border)
        self._iteration(n)
        self._vectors(n, block, near_zero)

    def _iteration(self, n: int) -> None:
        self.newton = self.ffi.new("Newton *")
        self.newton.converged, self.newton.kept, self.newton.shrunk = newton.TOLERANCE, newton.KEPT, newton.SHRUNK
        self.factored, self.equations = np.zeros(n), np.zeros(n)
        self.newton.factored, self.newton.factored_equations = map(self._doubles, (self.factored, self.equations))
        self.newton.origin, self.newton.equations = (self._doubles(np.zeros(n)) for _ in range(2))

    def _vectors(self, n: int, block: int, near_zero: float) -> None:
        b = self.block = self.ffi.new("Block *")
        fresh = np.stack([self.inertia.seed(i).array_r.real for i in range(block)])
        self._fresh = fresh, np.ascontiguousarray(self.inertia.weighed(fresh.T).T)
        self._block = np.zeros((block, n)), np.zeros((block, n))
        self.tangent, self.step = np.zeros(n), np.zeros(n)
        b.block, b.share, b.near_zero = block, FRESH, near_zero
        b.vectors, b.images = map(self._doubles, self._block)
        b.fresh, b.fresh_images = map(self._doubles, self._fresh)
        b.right, b.solved = (self._doubles(np.zeros((block + 2) * n)) for _ in range(2))
        b.tangent, b.step = self._doubles(self.tangent), self._doubles(self.step)
        self.restart()

    def _ints(self, array: np.ndarray) -> Any:
        return self._pointer(np.asarray(array, dtype=np.int32), "int")

    def _doubles(self, array: np.ndarray) -> Any:
        return self._pointer(array, "double")

    def _pointer(self, array: np.ndarray, kind: str) -> Any:
        array = np.ascontiguousarray(array)
        self._kept.append(array)
        return self.ffi.cast(f"{kind} *", array.ctypes.data)

    def restart(self) -> None:
        """Begin a branch: nothing is known about its eigenvectors."""
        for mine, fresh in zip(self._block, self._fresh, strict=True):
            mine[:] = fresh
        self.block.started = 0

    @property
    def nearest(self) -> float:
        """Estimated distance of the eigenvalue nearest zero from zero, at the state last factored."""
        return float(self.block.nearest)

    def _take(self) -> None:
        """Use the parameters, the phase conditions and the factors that the system and the inertia have now."""
        system, rod, equations = self.system, self.rod, self.system.equations
        equations.take(system.line)
        for name, form in (("residual", equations.residual), ("jacobian", equations.jacobian)):
            setattr(rod, name, form.pointer)
            setattr(rod, f"{name}_constants", self.ffi.cast("double *", form.constants.ctypes.data))
        own = shared(self.inertia.matrix)
        assert own is not None
        assert system.equation_places is not None
        rod.equation_places = system.equation_places.pointer
        rod.entry_places = system.matrix_places(own.pattern, True).pointer
        rod.assemble = equations.residual.function
        factors = self.inertia.factors
        assert isinstance(factors, Chain)
        factors.prepare(self.inertia.matrix)
        rod.factors = factors.pointer
        rod.factor, rod.solve, rod.negative, rod.zero = factors.functions
        self.active[:], self.offsets[:] = 0, system.phase.offsets
        for i, row in system.phase.rows.items():
            self.active[i], self.conditions[i, : len(row)] = 1, row

    def factor(self, x: PETSc.Vec) -> Factored | None:
        """Factor ``S`` at ``x``, with the phase conditions as they are; the tangent is in :attr:`tangent`.

        None where it is too near singular.
        """
        self._take()
        state = x.array_r
        failed = self.lib.assemble_at(self.rod, self.ffi.cast("double *", state.ctypes.data))
        failed = failed or self.lib.solve_at(self.rod, self.block, self.ffi.NULL)
        self.inertia.factors.regular, found = not failed, self._held()
        return None if failed else found

    def _held(self) -> Factored:
        """The state that the matrix holds now, and its factors."""
        self.inertia.border.array[:] = self.border
        return self.inertia.hold()

    def correct(self, x: PETSc.Vec, row: PETSc.Vec, most: int, reach: float, tolerance: float) -> NewtonResult | None:
        """As :func:`rodfem.fem.newton.iterate`; None, with ``x`` as it was, where ``S`` is too near singular.

        ``row`` is the normal of the plane; ``most``, ``reach`` and ``tolerance`` are those of that function.
        """
        self._take()
        n, still = self.newton, newton.STALLED
        if damping := self.system.damping:
            still = max(still, newton.TOLERANCE * self.system.stiffness_scale / damping)
        n.most, n.reach, n.tolerance, n.still = most, reach, tolerance, still
        along = row.array_r
        with x as state:
            begin = state.copy()
            status = self.lib.correct(
                self.rod,
                self.block,
                n,
                self.ffi.cast("double *", state.ctypes.data),
                self.ffi.cast("double *", along.ctypes.data),
            )
            if status >= SINGULAR:
                state[:] = begin
        self.inertia.factors.regular = status < SINGULAR
        self._held()
        return NewtonResult(status == CONVERGED, n.iterations, n.error, n.moved) if status < SINGULAR else None

    def last_factored(self) -> tuple[State, PETSc.Vec]:
        """The iterate that was factored last, and the equations there."""
        x, equations = self.system.new_vector(), self.system.new_vector()
        x.array[:], equations.array[:] = self.factored, self.equations
        return self.system.at(x), equations
