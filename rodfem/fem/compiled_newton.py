"""One iteration of Newton's method in one call of compiled code (``newton.c``): one rank, factors along the rod.

Of a point of seventy unknowns the arithmetic takes a tenth of a millisecond, and the way through Python and PETSc's
vectors several times as long.  A test compares the rows of every scene with those by PETSc's matrices and factors
(``tests/continuation/test_compiled_newton.py``).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from petsc4py import PETSc

from rodfem.linalg.chain import Chain, Elimination
from rodfem.linalg.compiled import Memory, buffer, module
from rodfem.linalg.matrices import shared

if TYPE_CHECKING:
    from rodfem.fem.system import System
    from rodfem.linalg.factorization import Factors

MOVED, UNDEFINED, SINGULAR, BROKEN = range(4)
"""What an iteration did: it moved the state; the equations have no value there; the Jacobian is singular, exactly;
there were no factors at all."""


class CompiledNewton:
    """Compiled assembly, and iteration, for one matrix of a system, which it fills, and its factors.

    ``border`` is the derivative of the equations in the load at the state last assembled, ``origin`` the state that an
    iteration began with, (n,).  Of each drift scalar ``active`` says whether it has a phase condition, ``conditions``
    and ``forces`` (drifts, n) have that, and what a drift of one adds to the equations.
    """

    @staticmethod
    def serves(matrix: PETSc.Mat, factors: Factors) -> bool:
        """Whether matrix and factors are those of compiled code."""
        return shared(matrix) is not None and isinstance(factors, Chain)

    def __init__(self, system: System, matrix: PETSc.Mat, factors: Chain) -> None:
        """Hand all arrays over: of the ``system``, of a ``matrix`` of it with all columns, and its ``factors``."""
        self.system, self.matrix, self.factors, n = system, matrix, factors, system.fields.unknowns
        compiled = module("fem/newton")
        self.lib, self.ffi = compiled.lib, compiled.ffi
        self.memory = Memory(self.ffi)
        self._given: tuple[Any, ...] = (None, None, None)
        own, metric = shared(matrix), shared(system.metric)
        assert own is not None
        assert metric is not None
        self._pattern = own.pattern
        drifts = np.array(system.drifts, dtype=np.int32)
        self.conditions, self.offsets = np.zeros((len(drifts), n)), np.zeros(len(drifts))
        self.active, self.border = np.zeros(len(drifts), dtype=np.int32), np.zeros(n)
        self.forces = np.zeros_like(self.conditions) if system.rigid else self.conditions
        starts, load, every = own.pattern.indptr, system.load_index, np.arange(n)
        # scalars are the last columns of each row, and their own rows are dense
        column = {i: starts[1:] - (n - i) for i in (load, *system.drifts)}
        self.rod, self.newton = self.ffi.new("Rod *"), self.ffi.new("Newton *")
        rod = self.rod
        rod.n, rod.locals, rod.entries = n, len(system.fields.clamps), len(own.values)
        rod.load, rod.load_diagonal, rod.drifts = load, int(column[load][load]), len(drifts)
        integers = {
            "number": system.maps(load=True)[1],
            "load_column": np.where(every == load, -1, column[load]),
            "load_row": starts[load] + every,
            "drift": drifts,
            "active": self.active,
            "drift_row": np.array([starts[d] + every for d in drifts]),
            "drift_column": np.array([column[d] for d in drifts]),
            "starts": metric.pattern.indptr,
            "indices": metric.pattern.indices,
        }
        self.memory.point(rod, **{name: np.ascontiguousarray(x, dtype=np.int32) for name, x in integers.items()})
        self.memory.point(rod, u=system.fields.clamps.copy(), values=own.values, metric=metric.values)
        self.memory.point(rod, conditions=self.conditions, offsets=self.offsets, forces=self.forces, border=self.border)
        self.memory.point(rod, sizes=system.sizes.array.copy())
        self.origin = np.zeros(n)
        room = {name: np.zeros(n) for name in ("step", "equations", "away")}
        self.memory.point(self.newton, origin=self.origin, **room)

    def take(self) -> None:
        """Use the parameters, the phase conditions and the factors that the system has now."""
        system, equations = self.system, self.system.equations
        equations.take(system.line)
        self.factors.prepare(self.matrix)
        given = (self.factors.elimination, equations.residual.constants, equations.jacobian.constants)
        if any(mine is not new for mine, new in zip(self._given, given, strict=True)):
            self._use(given[0])
            self._given = given
        self.active[:], self.offsets[:] = 0, system.phase.offsets
        for i, row in system.phase.rows.items():
            self.active[i], self.conditions[i, : len(row)] = 1, row
            self.forces[i, : len(row)] = system.phase.forces[i]

    def _use(self, elimination: Elimination) -> None:
        """Let the rod point to the forms with their constants, and to the factors."""
        system, rod, keep = self.system, self.rod, self.memory.keep
        residual, jacobian = system.equations.residual, system.equations.jacobian
        self.memory.point(rod, residual_constants=residual.constants, jacobian_constants=jacobian.constants)
        owners = {
            "residual": residual,
            "jacobian": jacobian,
            "equation_places": system.equation_places,
            "entry_places": system.matrix_places(self._pattern, True),
            "factors": elimination,
        }
        for name, owner in owners.items():
            setattr(rod, name, keep((rod, name), owner).pointer)
        rod.assemble = residual.function
        rod.factor, rod.solve = elimination.functions

    def assemble(self, x: PETSc.Vec) -> None:
        """Fill the matrix with ``S`` at ``x`` and a one for the load, and :attr:`border`; phase conditions stay."""
        self.take()
        failed = self.lib.assemble_at(self.rod, buffer(self.ffi, x.array_r))
        assert not failed, "A term at a point inside the rod must be evaluated in one of the two cells there."
        self.matrix.stateIncrease()

    def iterate(self, x: PETSc.Vec, row: PETSc.Vec, fresh: bool) -> tuple[int, float, float]:
        """Move ``x`` by one correction on the plane across ``row``, with factors of the Jacobian there if ``fresh``.

        Returns what it did, the distance of ``x`` from :attr:`origin` in the metric, and the size of the correction in
        it, or relative to ``x``, the larger.
        """
        newton = self.newton
        with self.system.clock("solve"):
            along = buffer(self.ffi, row.array_r)
            with x as state:
                status = self.lib.iterate(self.rod, newton, buffer(self.ffi, state), along, fresh)
        if newton.factored:
            self.factors.adopt(regular=status == MOVED)
            self.matrix.stateIncrease()
        return status, newton.distance, newton.size
