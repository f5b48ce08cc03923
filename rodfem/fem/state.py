"""A state of a rod: its values by name, the parameters that its load stands for, and the equations evaluated there.

A form is assembled for the values that are handed in (:mod:`rodfem.fem.assembly`).  What dolfinx evaluates itself,
expressions and the matrices of several ranks, is compiled for one dolfinx Function, the *register*.  Only this module
writes there: an evaluation puts its own values there first, unless they are there already.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import scipy.sparse as sp
from mpi4py import MPI
from petsc4py import PETSc

from rodfem import compat
from rodfem.linalg.matrices import shared
from rodfem.problem.functions import Constants

if TYPE_CHECKING:
    from rodfem.fem.assembly import Assembler, Places
    from rodfem.fem.equations import Equations
    from rodfem.fem.system import System
    from rodfem.problem.scene import Scene


LOAD = "load"
"""Name of the load among the scalars."""


@dataclass(frozen=True, eq=False)
class Line:
    """Parameters ``origin + t direction``, (number of parameters,) each, where ``t`` is the unknown ``load``."""

    scene: Scene
    origin: np.ndarray
    direction: np.ndarray

    def constants(self, t: float) -> Constants:
        """All parameters as numbers, at the middle of the rod."""
        values = (self.origin + t * self.direction).tolist()
        return Constants(s=sum(self.scene.interval) / 2, **dict(zip(self.scene.parameters, values, strict=True)))


def line(scene: Scene, origin: Mapping[str, float], direction: Mapping[str, float]) -> Line:
    """Line through ``origin``, with the scene's values where it has none, along the named parameters."""
    start = [origin.get(name, p.value) for name, p in scene.parameters.items()]
    return Line(scene, np.array(start), np.array([direction.get(name, 0.0) for name in scene.parameters]))


def load_line(scene: Scene, /, **constants: float) -> Line:
    """Line along which the scene's load varies, with these ``constants``, and the scene's values for all others."""
    return line(scene, {**constants, scene.load: 0.0}, {scene.load: 1.0})


class Energies(NamedTuple):
    """Energies of a state; those of the loads are nan where a load has no potential.

    ``energy`` is the stored one, ``int W ds``, and ``potential`` the total ``V``, of the rod, loads, springs and
    foundations: what is stationary at an equilibrium.  ``conjugate`` is ``-dV/dload`` at fixed state: what the load
    does work on, as the displacement of its point or the angle of its end.  The distinguished ordinate of Maddocks,
    Arch. Ration. Mech. Anal. 99 (1987): along a branch ``dV = -conjugate dload``.
    """

    energy: float
    potential: float
    conjugate: float


class NodalValues:
    """Values of fields and scalars, of a state or of a change of one, and the ``equations`` there; they never change.

    ``local`` has each local degree of freedom, clamped ones and ghosts included; ``line`` are the parameters that the
    load stands for.
    """

    def __init__(self, equations: Equations, local: np.ndarray, line: Line) -> None:
        local.setflags(write=False)
        self.equations, self.fields, self.local, self.line = equations, equations.fields, local, line

    def values(self, name: str) -> np.ndarray:
        """Nodal values of a field in all local cells, ghosts last, (cells, nodes, components)."""
        return self.local[self.fields.dofs[name]]

    @property
    def turned(self) -> np.ndarray:
        """Nodal values of the field of the rotation, (cells, nodes, components)."""
        return self.values(self.fields.turning.name)

    @property
    def load(self) -> float:
        """Value of the scalar ``load``."""
        return float(self.local[self.fields.copies[0, -1]])

    @cached_property
    def scalars(self) -> dict[str, float]:
        """Values of the scalars by name, the load among them."""
        return dict(zip(self.fields.scalars, self.local[self.fields.copies[0]].tolist(), strict=False))

    @property
    def parts(self) -> dict[str, Any]:
        """Values of all fields and scalars by name: see :meth:`~rodfem.fem.fields.Fields.filled`."""
        return {name: self.values(name) for name in self.fields.dofs} | self.scalars

    def constants(self) -> Constants:
        """Parameters as numbers, at the middle of the rod."""
        return self.line.constants(self.load)

    def _register(self) -> None:
        """Put these values where the compiled forms read them."""
        equations = self.equations
        equations.take(self.line)
        if equations.register.values is not self.local:
            self.fields.u.x.array[:] = self.local
            equations.known.lay(self.load)
            equations.register.values = self.local

    def _add(self, form: Assembler, places: Places | None, out: np.ndarray) -> None:
        self.equations.take(self.line)
        form.add(self.local, places, out)

    def covector(self) -> np.ndarray:
        """The equations of this rank's cells, (local size,)."""
        out = np.zeros(len(self.local))
        self._add(self.equations.residual, self.equations.local_places, out)
        return out

    def tangent(self) -> sp.csr_matrix:
        """Their derivative in all local degrees of freedom, clamped ones included."""
        self._register()
        return compat.local_table(self.equations.jacobian.form)

    def integral(self, form: Assembler) -> float:
        """Integral over the rod; collective."""
        out, comm = np.zeros(1), self.fields.comm
        self._add(form, None, out)
        return float(out[0] if comm.size == 1 else comm.allreduce(out[0], op=MPI.SUM))

    def energy(self) -> float:
        """Stored energy; collective."""
        return self.integral(self.equations.energy)

    def energies(self) -> Energies:
        """All energies of an equilibrium; collective."""
        if self.equations.potential is None:
            return Energies(self.energy(), float("nan"), float("nan"))
        out, fields = np.zeros(3), self.fields
        self._add(self.equations.energy, None, out[:1])
        self._add(self.equations.potential, None, out[1:2])
        out[2] = -self.covector()[fields.copies[:, -1]].sum()
        if fields.comm.size > 1:
            out = fields.comm.allreduce(out, op=MPI.SUM)
        return Energies(*out.tolist())

    def evaluate(self, expression: Callable[[], np.ndarray]) -> np.ndarray:
        """Values of a compiled expression: see :func:`rodfem.fem.form_compiler.expression`."""
        self._register()
        return expression()


class State(NodalValues):
    """State of a :class:`~rodfem.fem.system.System`, whose borders and matrices it uses; collective over its ranks.

    ``drifts`` are its drift scalars.
    """

    def __init__(self, system: System, local: np.ndarray, drifts: np.ndarray, line: Line) -> None:
        super().__init__(system.equations, local, line)
        self.system, self.drifts = system, drifts

    def residual(self, out: PETSc.Vec) -> None:
        """Equations and phase conditions into ``out``; the row of the load is left zero."""
        system = self.system
        with system.clock("assembly"):
            out.set(0.0)
            if (places := system.equation_places) is not None:
                with out as array:
                    self._add(self.equations.residual, places, array)
                    array[system.load_index] = 0.0
            else:
                system.add_up(self.covector(), out)
            for i, value in enumerate(self.drifts.tolist()):
                if i in system.phase.conditions:
                    out.axpy(value, system.phase.pushes[i])
                    own = self.fields.free_owned  # a condition has no component along scalars
                    value = float(system.sum(system.phase.rows[i][: len(own)] @ self.local[own]))
                    value -= float(system.phase.offsets[i])
                if system.has_scalars:
                    out.setValue(system.drifts[i], value)
                out.assemble()

    def with_changes(self, changes: Sequence[PETSc.Vec | None]) -> np.ndarray:
        """Local values of the state, then of changes y, w, v, m of it, None for zero: (5, local size)."""
        zero = np.zeros(len(self.local))
        return np.array([self.local, *(zero if d is None else self.system.change(d).local for d in changes)])

    def adjoint(self, changes: Sequence[PETSc.Vec | None]) -> np.ndarray:
        """Derivative of ``y.F + w.S v - w.M m`` in the state, on this rank (local size,), without phase conditions."""
        out, form = np.zeros(len(self.local)), self.equations.adjoint
        with self.system.clock("assembly"):
            self.equations.take(self.line)
            form.add(self.with_changes(changes), self.equations.local_places, out)
        return out

    def jacobian(self, row: PETSc.Vec) -> PETSc.Mat:
        """Jacobian into the system's matrix, with ``row`` as the row of the load."""
        system, matrix = self.system, self.system.matrix
        with system.clock("assembly"):
            matrix.zeroEntries()
            self.assemble_into(matrix, self.equations.jacobian, load=True)
            system.add_drifts(matrix)
            columns = np.arange(*row.getOwnershipRange(), dtype=PETSc.IntType)
            matrix.setValues([system.load_index], columns, row.array_r, addv=True)
            matrix.assemble()
        return matrix

    def assemble_into(self, matrix: PETSc.Mat, form: Assembler, *, load: bool = False) -> None:
        """Add a bilinear form to a matrix of the system, with or without the load's column."""
        if (own := shared(matrix)) is not None:
            self._add(form, self.system.matrix_places(own.pattern, load), own.values)
            matrix.stateIncrease()
        else:
            self._register()
            compat.fem.petsc.assemble_matrix(matrix, form.form)

    def factor(self, row: PETSc.Vec, damping: float = 0.0) -> None:
        """Factor the Jacobian, with ``damping`` times the metric added, for :meth:`System.solve`."""
        system, matrix = self.system, self.jacobian(row)
        damping = damping or system.damping
        if damping:
            matrix.axpy(damping, system.metric, PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN)
            matrix.stateIncrease()
        with system.clock("solve"):
            system.lu(matrix)

    @cached_property
    def generators(self) -> np.ndarray:
        """Changes under all infinitesimal symmetries, (count, own rows)."""
        return self.system.generators.at(self)

    def generator(self, symmetry: int) -> PETSc.Vec:
        """Change under the infinitesimal symmetry, in all fields and scalars that it moves."""
        return self.system.new_vector(self.generators[symmetry])
