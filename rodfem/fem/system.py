"""The bordered saddle point system of a scene: assembly, factorisation, and the vectors that live on it.

The unknown vector ``x`` holds the free values of the fields, then the scalars: components of a constant contact force,
the load, and one drift scalar for each symmetry.  The last two kinds are borders:

* the row of the load is the linear equation ``row . (x - x0) = 0`` (an arclength or "fixed load" equation);
* a drift scalar ``d`` adds ``d g`` to the equations, ``g`` the metric times the symmetry's generator at a reference
  state, and its row is the phase condition ``g . (x - x0) = 0``.  By the symmetry ``d`` vanishes at an equilibrium.
  At a state that the symmetry leaves alone the generator is zero, and the row is ``d = 0`` instead.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
from dolfinx import fem
from mpi4py import MPI
from petsc4py import PETSc

from rodfem import compat
from rodfem.fem.equations import Equations
from rodfem.fem.fields import LOAD, Discretization, Fields
from rodfem.fem.invariance import find_motion_along, find_symmetries
from rodfem.fem.sparsity import bordered_pattern, metric_pattern, new_matrix
from rodfem.fem.symmetries import Symmetry, may_slide, mismatch
from rodfem.fem.verification import Verification
from rodfem.linalg.selection import factors_of
from rodfem.problem.scene import Scene
from rodfem.timing import Clock

FEW = 4000
"""Number of unknowns up to which symmetries are sought on the mesh itself."""
FINE = 128
"""Number of elements of a mesh on which a rod may move along itself as well as in truth."""
SYMMETRIC_STATE = 1e-6
"""A generator smaller than this (in the metric) is zero: the state has the symmetry itself."""


MESH = 10.0
"""Times the mismatch of a mesh with the motion of a ring along itself, below which a generator is the mesh's error."""


class System:
    """Residual, Jacobian and metric of a scene at a discretisation, and their borders.

    Attributes
    ----------
    metric
        Symmetric matrix of the squared size of a change of state: rotations, centreline, and the load over its span.
    lu
        LU factors of the last Jacobian given to :meth:`factor`.
    symmetries
        Those found in the equations of the scene; the motion of a closed rod along itself comes last.
    drifting
        Drift scalars of the state that :meth:`residual` was last asked of.
    verification
        What verifies the symmetries at the states where the second variation is assembled.
    damping
        Multiple of the metric added to every Jacobian.  Not zero where a state belongs to a family of equilibria at one
        and the same load that no symmetry explains: the Jacobian is singular there, and Newton's method must not move
        along the family.
    """

    def __init__(
        self,
        scene: Scene,
        discretization: Discretization,
        comm: MPI.Comm = MPI.COMM_WORLD,
        clock: Clock | None = None,
        mesh: Any = None,
        symmetries: Sequence[Symmetry] | None = None,
    ) -> None:
        """Compile the forms and allocate all matrices once; on a given mesh, with known symmetries if they are."""
        self.scene, self.comm, self.damping = scene, comm, 0.0
        self.clock = clock or Clock()
        self.fields = Fields(scene, discretization, comm, mesh)
        self.equations = Equations(self.fields)
        _set_clamps(self.fields)
        self.symmetries = self._symmetries() if symmetries is None else list(symmetries)
        self.fields.add_drifts(len(self.symmetries))
        number, self.scalars = self.fields.number, self.fields.scalars
        self.load_index = self.scalars[LOAD]
        self.drifts = [self.scalars[f"drift{i}"] for i in range(len(self.symmetries))]
        self.has_scalars = comm.rank == comm.size - 1
        without_load = np.where(number == self.load_index, -1, number).astype(PETSc.IntType)
        self._columns = {True: number.astype(PETSc.IntType), False: without_load}
        self._all = PETSc.LGMap().create(self._columns[True], comm=comm)
        self._no_load = PETSc.LGMap().create(without_load, comm=comm)
        self._equation_targets = np.flatnonzero(without_load >= 0).astype(PETSc.IntType)
        self._equation_numbers = number[self._equation_targets].astype(PETSc.IntType)
        self._pattern, self._metric_pattern = bordered_pattern(self.fields), metric_pattern(self.fields)
        self.matrix = self.state_matrix(load=True)
        self.x_local = PETSc.Vec().createSeq(int((number >= 0).sum()), comm=PETSc.COMM_SELF)
        self._numbered = np.flatnonzero(number >= 0)
        self.workspace = self.matrix.createVecRight()
        source = PETSc.IS().createGeneral(number[self._numbered].astype(PETSc.IntType), comm=PETSc.COMM_SELF)
        self._gather = PETSc.Scatter().create(self.workspace, source, self.x_local, None)
        self._residual_local = np.zeros(len(self.fields.u.x.array))
        self.metric = self._assemble_metric()
        self.phases: list[PETSc.Vec | None] = [None] * len(self.drifts)
        self.broken: dict[int, np.ndarray] = {}
        self._phase_offset = [0.0] * len(self.drifts)
        self._reference: PETSc.Vec | None = None
        self.drifting = np.zeros(len(self.drifts))
        self.verification = Verification(self)
        # no scaling (ICNTL(8) = 0): a third of the time; Newton's method mends what it costs
        self.lu = factors_of("lu", comm, self.fields.unknowns, self.fields.dense_rows, {8: 0})

    def _symmetries(self) -> list[Symmetry]:
        """Symmetries of the scene; found with few elements, which have the same ones, where there are many.

        The motion of a closed rod along itself comes last.
        """
        scene, d = self.scene, self.fields.discretization
        fields, equations = self.fields, self.equations
        if fields.unknowns > FEW or (self.comm.size > 1 and not scene.conservative):  # each rank asks all equations
            fields, equations = self._elsewhere(replace(d, elements=max(6, 2 * len(scene.joints) + 2), vertices=None))
        found = find_symmetries(fields, equations)
        if not may_slide(scene):
            return found
        if not equations.uniform:
            elements = FINE + len(scene.joints)
            fields, equations = self._elsewhere(replace(d, elements=elements, degree=max(d.degree, 6), vertices=None))
        along = find_motion_along(fields, equations)
        return found if along is None else [*found, along]

    def _elsewhere(self, discretization: Discretization) -> tuple[Fields, Equations]:
        """The scene on another mesh, all of it on each rank."""
        fields = Fields(self.scene, discretization, MPI.COMM_SELF)
        _set_clamps(fields)
        return fields, Equations(fields)

    # --- vectors -----------------------------------------------------------------------------------------------

    def new_vector(self) -> PETSc.Vec:
        """Zero vector of all unknowns."""
        vector = self.workspace.duplicate()
        vector.set(0.0)
        return vector

    def scalar(self, x: PETSc.Vec, name: str = LOAD) -> float:
        """Value of a scalar unknown, the same on all ranks."""
        value = float(x.getValue(self.scalars[name]).real) if self.has_scalars else 0.0
        return self.comm.bcast(value, root=self.comm.size - 1) if self.comm.size > 1 else value

    def set_load(self, x: PETSc.Vec, value: float) -> None:
        """Set the load in ``x``."""
        if self.has_scalars:
            x.setValue(self.load_index, value)
        x.assemble()

    def load_axis(self) -> PETSc.Vec:
        """Unit vector of the load: as a row it fixes the load."""
        row = self.new_vector()
        self.set_load(row, 1.0)
        return row

    def norm(self, d: PETSc.Vec) -> float:
        """Size of a change of state in the metric."""
        self.metric.mult(d, self.workspace)
        return float(max(self.workspace.dot(d).real, 0.0)) ** 0.5

    def bring(self, x: PETSc.Vec) -> None:
        """Put ``x`` into the dolfinx function on which the forms are assembled."""
        self.fields.u.x.array[self._numbered] = self.gathered(x)

    def gathered(self, x: PETSc.Vec) -> np.ndarray:
        """Values of a vector at this rank's free local degrees of freedom, in ascending order; overwritten later."""
        self._gather.scatter(x, self.x_local, addv=PETSc.InsertMode.INSERT_VALUES)
        return np.asarray(self.x_local.array_r.real)

    def take(self) -> PETSc.Vec:
        """Vector of the values that the dolfinx function holds; drift scalars are zero."""
        x, f = self.new_vector(), self.fields
        x.array[: len(f.free_owned)] = f.u.x.array[f.free_owned]
        if self.has_scalars:
            x.array[len(f.free_owned) : len(f.free_owned) + f.copies.shape[1]] = f.u.x.array[f.copies[0]]
        x.assemble()
        return x

    # --- assembly ----------------------------------------------------------------------------------------------

    def residual(self, x: PETSc.Vec, out: PETSc.Vec) -> None:
        """Equations at ``x`` into ``out``; the row of the load is left zero."""
        with self.clock("assembly"):
            self.bring(x)
            self._residual_local[:] = 0.0
            fem.assemble_vector(self._residual_local, self.equations.residual)
            out.set(0.0)
            values = self._residual_local[self._equation_targets]
            out.setValues(self._equation_numbers, values, addv=PETSc.InsertMode.ADD_VALUES)
            out.assemble()
            for i, (phase, index) in enumerate(zip(self.phases, self.drifts, strict=True)):
                drift = self.drifting[i] = self.scalar(x, f"drift{i}")
                value = drift
                if phase is not None:
                    out.axpy(drift, phase)
                    value = phase.dot(x) - self._phase_offset[i]
                if self.has_scalars:
                    out.setValue(index, value)
                out.assemble()

    def jacobian(self, row: PETSc.Vec) -> PETSc.Mat:
        """Jacobian at the state last brought by :meth:`residual`, with ``row`` as the row of the load."""
        with self.clock("assembly"):
            self.matrix.zeroEntries()
            self.assemble_into(self.matrix, self.equations.jacobian, load=True)
            self.add_drifts(self.matrix)
            begin, end = row.getOwnershipRange()
            self.matrix.setValues([self.load_index], np.arange(begin, end, dtype=PETSc.IntType), row.array_r, addv=True)
            self.matrix.assemble()
        return self.matrix

    def assemble_into(self, matrix: PETSc.Mat, form: Any, *, load: bool = False) -> None:
        """Add a bilinear form at the state last brought to a matrix of this system, with or without the load's column.

        The caller assembles the matrix (``matrix.assemble()``) when all is added.
        """
        compat.assemble_matrix(matrix, form, self._columns[False], self._columns[load])

    def add_drifts(self, matrix: PETSc.Mat) -> None:
        """Add rows and columns of the drift scalars: the generators, or a one where a drift is switched off."""
        for phase, index in zip(self.phases, self.drifts, strict=True):
            if phase is None:
                if self.has_scalars:
                    matrix.setValue(index, index, 1.0, addv=True)
                continue
            begin, end = phase.getOwnershipRange()
            own = np.arange(begin, end, dtype=PETSc.IntType)
            matrix.setValues([index], own, phase.array_r, addv=True)
            matrix.setValues(own, [index], phase.array_r, addv=True)

    @cached_property
    def stiffness_scale(self) -> float:
        """Lowest bending eigenvalue of the rod relative to the metric, up to a number about one."""
        return float(np.linalg.eigvalsh(self.scene.stiffness()[-3:, -3:])[0] * np.pi**2 / self.scene.length)

    def factor(self, row: PETSc.Vec, damping: float = 0.0) -> None:
        """Assemble and factor the Jacobian at the state last brought, with ``damping`` times the metric added."""
        matrix, damping = self.jacobian(row), damping or self.damping
        if damping:
            matrix.axpy(damping, self.metric, PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN)
            matrix.stateIncrease()
        with self.clock("solve"):
            self.lu(matrix)

    def solve(self, right: PETSc.Vec, out: PETSc.Vec) -> bool:
        """Solve with the last factors; False where the matrix was found singular."""
        with self.clock("solve"):
            if self.lu.regular:
                self.lu.solve(right, out)
            return self.lu.regular

    def state_matrix(self, *, load: bool = False) -> PETSc.Mat:
        """Allocate a matrix for the second variation at fixed load (row of the load empty, column unless ``load``)."""
        return new_matrix(self.fields, self._pattern, self._no_load, self._all if load else self._no_load)

    def metric_matrix(self) -> PETSc.Mat:
        """Allocate a matrix for a metric (of rotations and centreline), whose pattern is part of the other's."""
        return new_matrix(self.fields, self._metric_pattern, self._no_load, self._no_load)

    # --- symmetry ----------------------------------------------------------------------------------------------

    def generator(self, x: PETSc.Vec, symmetry: int) -> PETSc.Vec:
        """Change of ``x`` under the infinitesimal symmetry, in all fields and scalars that it moves."""
        self.bring(x)
        u = self.fields.u.x.array
        state, u[:] = u.copy(), self.symmetries[symmetry].change(self.fields)
        change = self.take()
        u[:] = state
        return change

    def set_phase(self, reference: PETSc.Vec | None) -> None:
        """Take the phase conditions at ``reference``: as many as it breaks symmetries; None: none active.

        The symmetries form a linear space.  Those combinations of their generators that vanish at the reference state
        are its own symmetries and have no phase condition; the others, orthonormal in the metric, have one each.
        """
        count, dropped = len(self.drifts), self.verification.dropped
        self.phases, self._phase_offset, self.kept = [None] * count, [0.0] * count, np.eye(count)
        self.broken, self._reference = {}, None if reference is None else reference.copy()
        if reference is None or count == len(dropped):
            return
        generators = [self.generator(reference, i) for i in range(count)]
        images = [self.metric * g for g in generators]
        exact = [i for i, s in enumerate(self.symmetries) if not s.along and i not in dropped]
        gram = np.array([[np.real(generators[i].dot(images[j])) for j in exact] for i in exact])
        squares, turn = np.linalg.eigh(gram.reshape(len(exact), len(exact)))
        combinations, sizes = list((np.eye(count)[:, exact] @ turn).T), list(np.sqrt(np.maximum(squares, 0.0)))
        least = [SYMMETRIC_STATE] * len(exact)
        last = self.symmetries[-1]
        if last.along and count - 1 not in dropped:  # what of the motion along itself the exact ones do not do as well
            rest = np.eye(count)[-1]
            for weights, size in zip(combinations, sizes, strict=True):
                if size >= SYMMETRIC_STATE:
                    rest = rest - weights / size**2 * np.real(combine(images, weights).dot(generators[-1]))
            combinations.append(rest / np.linalg.norm(rest))
            sizes.append(self.norm(combine(generators, combinations[-1])))
            self.bring(reference)
            least.append(max(MESH * mismatch(self.fields), 10 * SYMMETRIC_STATE))
        broken = np.array(sizes) >= least
        self.kept = np.array(combinations)[~broken]
        for i in np.flatnonzero(broken):
            phase = combine(images, combinations[i] / sizes[i])
            self.phases[i], self._phase_offset[i] = phase, np.real(phase.dot(reference))
            self.broken[self.drifts[i]] = combinations[i] / sizes[i]

    def verify(self, matrix: PETSc.Mat, x: PETSc.Vec, equations: PETSc.Vec | None = None) -> bool:
        """Verify the symmetries at the state ``x``, where ``S`` is ``matrix`` and the equations are given (None: zero).

        Where one is none the phase conditions are taken anew without it, and False is returned: the borders of the
        matrix are to be assembled again.
        """
        if not self.symmetries or self.verification(matrix, x, equations):
            return True
        self.set_phase(self._reference)
        self.bring(x)
        return False

    def drift(self, x: PETSc.Vec) -> float:
        """Greatest drift scalar of a state: zero, but for round-off, at an equilibrium."""
        return max((abs(self.scalar(x, f"drift{i}")) for i in range(len(self.drifts))), default=0.0)

    def equivalent_directions(self, x: PETSc.Vec, direction: PETSc.Vec) -> list[PETSc.Vec]:
        """Directions into which the symmetries that the state ``x`` has itself carry a direction, to first order.

        The symmetries kept by the state last given to :meth:`set_phase`, which must be ``x``.
        """
        moved = x.copy()
        moved.axpy(1.0, direction)
        changes = []
        for i in range(len(self.drifts)):
            change = self.generator(moved, i)
            change.axpy(-1.0, self.generator(x, i))
            changes.append(change)
        return [combine(changes, weights) for weights in self.kept]

    def active_drifts(self) -> int:
        """Number of symmetries that the current reference state breaks: as many zero eigenvalues belong to it."""
        return sum(phase is not None for phase in self.phases)

    def free_motions(self) -> list[str]:
        """In words the motions that carry the reference state through equivalent ones, one for each phase condition."""
        out = []
        for weights in self.broken.values():
            sums = sum((w * s.weights for w, s in zip(weights, self.symmetries, strict=True)), 0.0 * weights[:1])
            along = sum(w * s.along for w, s in zip(weights, self.symmetries, strict=True))
            out.append(str(Symmetry(sums, self.symmetries[0].parts, along)))
        return out

    # --- set-up ------------------------------------------------------------------------------------------------

    def _assemble_metric(self) -> PETSc.Mat:
        metric = self.metric_matrix()
        self.assemble_into(metric, self.equations.metric)
        if self.has_scalars:
            a, b = self.scene.span
            metric.setValue(self.load_index, self.load_index, 1.0 / (b - a) ** 2, addv=True)
        metric.assemble()
        return metric


def _set_clamps(fields: Fields) -> None:
    """Give the clamped degrees of freedom their values, once and for all."""
    u, scene = fields.u.x.array, fields.scene
    u[:] = 0.0
    x = fields.coordinates(fields.discretization.degree)
    for end, s in zip(scene.sides, scene.interval, strict=True):
        if end.fixed_rotation is not None:
            here = fields.dofs[fields.turning.name][np.isclose(x, s, rtol=0, atol=1e-9 * scene.length)]
            u[here] = fields.turning.clamp(end.fixed_rotation, scene.start, s, scene.interval)


def dense_columns(system: System, count: int) -> PETSc.Mat:
    """Zero matrix of as many columns, each a vector of the system: right-hand sides or solutions."""
    columns = PETSc.Mat().createDense(
        ((system.fields.local_unknowns, system.fields.unknowns), (None, count)), comm=system.comm
    )
    columns.setUp()
    columns.assemble()
    return columns


def combine(vectors: list[PETSc.Vec], weights: np.ndarray) -> PETSc.Vec:
    """Linear combination of vectors."""
    out = vectors[0].duplicate()
    out.set(0.0)
    out.maxpy(list(weights), vectors)
    return out
