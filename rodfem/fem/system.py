"""The bordered saddle point system of a scene: assembly, factorisation, and the vectors that live on it.

The unknown vector ``x`` holds the free values of the fields, then the scalars: components of a constant contact force,
the load, and one drift scalar for each symmetry.  The last two kinds are borders:

* the row of the load is the linear equation ``row . (x - x0) = 0`` (an arclength or "fixed load" equation);
* a drift scalar ``d`` adds ``d g`` to the equations, ``g`` the metric times the symmetry's generator at a reference
  state, and its row is the phase condition ``g . (x - x0) = 0``.  By the symmetry ``d`` vanishes at an equilibrium.
  Its force is another one for a rod that floats under loads without a potential (:mod:`rodfem.fem.symmetries`).
  At a state that the symmetry leaves alone the generator is zero, and the row is ``d = 0`` instead.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from mpi4py import MPI
from petsc4py import PETSc

from rodfem import compat
from rodfem.fem.assembly import Places, bordered_pattern, matrix_places, metric_pattern, new_matrix
from rodfem.fem.equations import Equations
from rodfem.fem.fields import FEW, Discretization
from rodfem.fem.invariance import find_motion_along, find_symmetries
from rodfem.fem.newton import compiled_newton
from rodfem.fem.state import LOAD, Line, NodalValues, State
from rodfem.fem.symmetries import (
    Generators,
    Symmetry,
    elementary_generators,
    may_slide,
    no_phase,
    phase_at,
    rigid_motions,
)
from rodfem.linalg.factorization import Sizes
from rodfem.linalg.matrices import shared, times
from rodfem.problem.functions import derived
from rodfem.problem.scene import Scene
from rodfem.problem.trials import floats
from rodfem.problem.units import own_units
from rodfem.timing import Clock


class System:
    """Residual, Jacobian and metric of a scene at a discretisation, and their borders.

    ``symmetries`` are those found in the equations of the scene, or those of another system of it; the motion of a
    closed rod along itself comes last.  ``line`` has the parameters that the load of a state stands for if nothing else
    is said: the scene's load, unless a locus in two parameters is followed.  ``damping`` is a multiple of the metric
    added to every Jacobian.  It is not zero if a state belongs to a family of equilibria at one and the same load that
    no symmetry explains: the Jacobian is singular there, and Newton's method must not move along the family.
    """

    def __init__(
        self,
        scene: Scene,
        discretization: Discretization,
        comm: MPI.Comm = MPI.COMM_WORLD,
        clock: Clock | None = None,
        symmetries: Sequence[Symmetry] | None = None,
    ) -> None:
        self.scene, self.comm, self.damping = scene, comm, 0.0
        self.clock = clock or Clock()
        self.equations = Equations.of(scene, discretization, comm)
        self.fields, self.line = self.equations.fields, self.equations.line
        self.symmetries = self._symmetries() if symmetries is None else list(symmetries)
        self.fields.add_drifts(len(self.symmetries))
        number, self.scalars = self.fields.number, self.fields.scalars
        self.load_index = self.scalars[LOAD]
        self.drifts = [self.scalars[f"drift{i}"] for i in range(len(self.symmetries))]
        self.has_scalars = comm.rank == comm.size - 1
        without_load = np.where(number == self.load_index, -1, number).astype(PETSc.IntType)
        self._recent: list[tuple[bytes, State]] = []
        self._columns = {True: number.astype(PETSc.IntType), False: without_load}
        self._maps = {load: PETSc.LGMap().create(columns, comm=comm) for load, columns in self._columns.items()}
        self.equation_targets = np.flatnonzero(without_load >= 0).astype(PETSc.IntType)
        self.equation_numbers = number[self.equation_targets].astype(PETSc.IntType)
        dofs = self.equations.cells.dofs
        self.equation_places = Places(number[dofs]) if self.fields.compiled else None
        self._pattern, self._metric_pattern = derived(  # where scenes have as many symmetries, they have the same ones
            self.equations, len(self.drifts), lambda: (bordered_pattern(self.fields), metric_pattern(self.fields))
        )
        self.matrix = self.state_matrix(load=True)
        self._numbered = np.flatnonzero(number >= 0)
        self._sources = np.append(number[self._numbered], self.drifts).astype(PETSc.IntType)
        self._gathered = PETSc.Vec().createSeq(len(self._sources), comm=PETSc.COMM_SELF)
        self.workspace = self.matrix.createVecRight()
        source = PETSc.IS().createGeneral(self._sources, comm=PETSc.COMM_SELF)
        self._gather = PETSc.Scatter().create(self.workspace, source, self._gathered, None)
        self.metric = self._assemble_metric()
        own, fixed = shared(self.metric), self.fields.unknowns - len(self.drifts)
        self._weights = None if own is None else own.matrix[:fixed, :fixed]
        self.generators = Generators(self)
        self.rigid = self._rigid()
        self.phase = no_phase(self)
        # no scaling (ICNTL(8) = 0): a third of the time; Newton's method mends what it costs
        self.lu = self.fields.factors("lu", self.natural_sizes)
        self.compiled = compiled_newton(self, self.matrix, self.lu)

    def _rigid(self) -> Generators | None:
        """Rigid motions of which a rod is capable that floats under loads without a potential; None for others."""
        if not (self.symmetries and floats(self.scene) and self.scene.without_potential()):
            return None
        motions = rigid_motions(elementary_generators(self.fields)).values()
        return Generators(self, [motion for motion in motions if motion.weights.any()])

    def _symmetries(self) -> list[Symmetry]:
        """Symmetries of the scene; found with few elements, which have the same ones, where there are many."""
        scene, equations, few = self.scene, self.equations, max(6, 2 * len(self.scene.joints) + 2)
        d = replace(self.fields.discretization, vertices=None)
        if self.fields.unknowns > FEW or self.comm.size > 1:
            equations = Equations.of(scene, replace(d, elements=few), MPI.COMM_SELF)  # each rank asks all equations
        found = find_symmetries(equations)
        if not may_slide(scene):
            return found
        if not equations.uniform:
            # a rod moves along itself there as well as in truth
            fine = replace(d, elements=128 + len(scene.joints), degree=max(d.degree, 6))
            equations = Equations.of(scene, fine, MPI.COMM_SELF)
        along = find_motion_along(equations)
        return found if along is None else [*found, along]

    def on_mesh(self, mesh: Discretization) -> System:
        """The same rod on another ``mesh``, which does not look for symmetries again."""
        return System(self.scene, mesh, self.comm, self.clock, symmetries=self.symmetries)

    @contextmanager
    def damped(self, damping: float) -> Iterator[None]:
        """Let the ``damping`` be another one inside the block."""
        before, self.damping = self.damping, damping
        try:
            yield
        finally:
            self.damping = before

    # --- vectors -----------------------------------------------------------------------------------------------

    def new_vector(self, own: np.ndarray | Sequence[float] = ()) -> PETSc.Vec:
        """Vector of all unknowns whose first rows on this rank are ``own``, and all others zero."""
        vector = self.workspace.duplicate()
        vector.set(0.0)
        if len(own):
            vector.array[: len(own)] = own
        return vector

    def vectors(self, columns: np.ndarray) -> list[PETSc.Vec]:
        """Vectors whose rows on this rank are ``columns`` (own rows, k)."""
        return [self.new_vector(column) for column in columns.T]

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

    def sum(self, own: np.ndarray) -> np.ndarray:
        """Sum over the ranks."""
        return own if self.comm.size == 1 else np.asarray(self.comm.allreduce(own, op=MPI.SUM))

    def whole(self, own: np.ndarray) -> np.ndarray:
        """Rows of all ranks, in their order."""
        return own if self.comm.size == 1 else np.concatenate(self.comm.allgather(own))

    def weighed(self, own: np.ndarray) -> np.ndarray:
        """Metric times vectors of which this rank has these rows each, (count, own rows)."""
        if self._weights is not None:
            return np.array([times(self._weights, row) for row in own]).reshape(own.shape)
        images = [self.metric * self.new_vector(row) for row in own]
        return np.array([image.array_r[: own.shape[1]].real for image in images]).reshape(own.shape)

    def norm(self, d: PETSc.Vec) -> float:
        """Size of a change of state in the metric."""
        self.metric.mult(d, self.workspace)
        return float(max(self.workspace.dot(d).real, 0.0)) ** 0.5

    def distance(self, a: PETSc.Vec, b: PETSc.Vec) -> float:
        """Distance of two states in the metric."""
        return self.norm(a - b)

    def at(self, x: PETSc.Vec, line: Line | None = None) -> State:
        """State of the values that ``x`` has now, with a ``line`` or :attr:`line`; the same object as lately."""
        line = line or self.line
        # each row is asked for the same state ten times over: what it has derived of itself is kept with it
        values = x.array_r.tobytes() if self.comm.size == 1 else b""
        for recent, state in self._recent:
            if values == recent and line is state.line:
                return state
        gathered, local = self.gathered(x), self.fields.clamps.copy()
        local[self._numbered] = gathered[: len(self._numbered)]
        if self.fields.unknowns > FEW:  # long vectors that Python has collected are destroyed together
            compat.destroy_garbage(self.comm)
        state = State(self, local, gathered[len(self._numbered) :], line)
        if values:  # a row is left for its neighbours and met again
            self._recent = [(values, state), *self._recent[: 7 if self.fields.unknowns <= FEW else 0]]
        return state

    def change(self, d: PETSc.Vec) -> NodalValues:
        """Nodal values of a change of state: zero where a state is clamped."""
        local = np.zeros(len(self.fields.number))
        local[self._numbered] = self.gathered(d)[: len(self._numbered)]
        return NodalValues(self.equations, local, self.line)

    def changes(self, columns: np.ndarray) -> np.ndarray:
        """Local values of changes of state whose own rows are ``columns`` (own rows, k): (k, local size)."""
        return np.array([self.change(vector).local for vector in self.vectors(columns)])

    def gathered(self, x: PETSc.Vec) -> np.ndarray:
        """Values of a vector at this rank's free local degrees of freedom, in ascending order, then the drifts'."""
        if self.comm.size == 1:
            return np.asarray(x.array_r[self._sources].real)
        self._gather.scatter(x, self._gathered, addv=PETSc.InsertMode.INSERT_VALUES)
        return np.array(self._gathered.array_r.real)

    def vector(self, local: np.ndarray, drifts: Sequence[float] | np.ndarray = ()) -> PETSc.Vec:
        """Vector of local values (see :meth:`Fields.filled`), of which those of clamps are left out, and of drifts."""
        f = self.fields
        scalars = [local[f.copies[0]], drifts] if self.has_scalars else []
        return self.new_vector(np.concatenate([local[f.free_owned], *scalars]))

    def add_up(self, local: np.ndarray, out: PETSc.Vec) -> None:
        """Add to a vector of equations what this rank's cells have of them, (local size,), but for the load's."""
        out.setValues(self.equation_numbers, local[self.equation_targets], addv=PETSc.InsertMode.ADD_VALUES)
        out.assemble()

    # --- assembly ----------------------------------------------------------------------------------------------

    def maps(self, load: bool) -> tuple[np.ndarray, np.ndarray]:
        """Global numbers of the rows and columns of a matrix at each local degree of freedom, -1 for none."""
        return self._columns[False], self._columns[load]

    def matrix_places(self, pattern: sp.csr_matrix, load: bool) -> Places:
        """Places of bilinear forms in a matrix of a ``pattern`` of this system, with the column of the ``load``."""
        dofs = self.equations.cells.dofs
        return derived(self.equations, (id(pattern), load), lambda: matrix_places(dofs, *self.maps(load), pattern))

    def add_drifts(self, matrix: PETSc.Mat) -> None:
        """Add rows and columns of the drift scalars: conditions and forces, or a one where a drift is switched off."""
        for i, index in enumerate(self.drifts):
            if i in self.phase.conditions:
                condition, push = self.phase.conditions[i], self.phase.pushes[i]
                own = np.arange(*condition.getOwnershipRange(), dtype=PETSc.IntType)
                matrix.setValues([index], own, condition.array_r, addv=True)
                matrix.setValues(own, [index], push.array_r, addv=True)
            elif self.has_scalars:
                matrix.setValue(index, index, 1.0, addv=True)

    @cached_property
    def stiffness_scale(self) -> float:
        """Lowest bending eigenvalue of the rod relative to the metric, up to a number about one."""
        return float(np.linalg.eigvalsh(self.scene.stiffness()[-3:, -3:])[0] * np.pi**2 / self.scene.length)

    @cached_property
    def sizes(self) -> PETSc.Vec:
        """Natural size of each unknown."""
        return self.vector(self.fields.sizes, [self.scene.units.moment] * len(self.drifts))

    @cached_property
    def own_sizes(self) -> PETSc.Vec:
        """Size of each unknown by the rod's own numbers, near one or not."""
        own = own_units(self.scene)
        return self.vector(self.fields.sizes_in(own), [own.moment] * len(self.drifts))

    @cached_property
    def balanced(self) -> PETSc.Vec:
        """Sizes of the unknowns over the root of that of energies: the second variation is of order one with them."""
        return self.sizes * self.scene.units.energy**-0.5

    @property
    def natural_sizes(self) -> Sizes | None:
        """What returns :attr:`balanced` sizes for factors of a matrix; None where all of them are one."""
        return None if self.scene.units.ordinary else lambda: self.balanced

    def matrix_in_units(self, matrix: PETSc.Mat) -> PETSc.Mat:
        """Second variation at fixed load for unknowns in units of their natural sizes."""
        if self.scene.units.ordinary:
            return matrix
        scaled, sizes = matrix.copy(), self.sizes.copy()
        self.set_load(sizes, 0.0)  # its row is that of a unit matrix, without units
        scaled.diagonalScale(sizes, sizes)
        return scaled

    def in_units(self, vector: PETSc.Vec, power: int) -> PETSc.Vec:
        """Vector times a power of the natural sizes: 1 for equations, -1 for a change of state."""
        if self.scene.units.ordinary:
            return vector
        out = vector.copy()
        (out.pointwiseMult if power > 0 else out.pointwiseDivide)(vector, self.sizes)
        return out

    def solve(self, right: PETSc.Vec, out: PETSc.Vec) -> bool:
        """Solve with the last factors; False where the matrix was found singular."""
        with self.clock("solve"):
            if self.lu.regular:
                self.lu.solve(right, out)
            return self.lu.regular

    def state_matrix(self, *, load: bool = False) -> PETSc.Mat:
        """Allocate a matrix for the second variation at fixed load (row of the load empty, column unless ``load``)."""
        return new_matrix(self.fields, self._pattern, self._maps[False], self._maps[load])

    def metric_matrix(self) -> PETSc.Mat:
        """Allocate a matrix for a metric (of rotations and centreline), whose pattern is part of the other's."""
        return new_matrix(self.fields, self._metric_pattern, self._maps[False], self._maps[False])

    def _assemble_metric(self) -> PETSc.Mat:
        metric = self.metric_matrix()
        self.at(self.new_vector()).assemble_into(metric, self.equations.metric)
        if self.has_scalars:
            a, b = self.scene.span
            metric.setValue(self.load_index, self.load_index, 1.0 / (b - a) ** 2, addv=True)
        metric.assemble()
        return metric

    # --- symmetry ----------------------------------------------------------------------------------------------

    def set_phase(self, reference: PETSc.Vec | None) -> None:
        """Set the phase conditions at ``reference`` (:mod:`rodfem.fem.symmetries`); None: none active."""
        if reference is None:
            self.phase = no_phase(self)
        elif self.drifts and not (self.phase.reference is not None and self.phase.reference.equal(reference)):
            self.phase = derived(self.at(reference), "phase", lambda: phase_at(self, reference))

    def drift(self, x: PETSc.Vec) -> float:
        """Greatest drift scalar of a state: zero, but for round-off, at an equilibrium."""
        return float(abs(self.at(x).drifts).max()) if self.drifts else 0.0

    def equivalent_directions(self, x: PETSc.Vec, direction: PETSc.Vec) -> list[PETSc.Vec]:
        """Directions into which the symmetries that the state ``x`` has itself carry a direction, to first order."""
        self.set_phase(x)
        moved = x.copy()
        moved.axpy(1.0, direction)
        changes = self.generators.at(self.at(moved)) - self.generators.at(self.at(x))
        return [self.new_vector(weights @ changes) for weights in self.phase.kept]

    def active_drifts(self, x: PETSc.Vec) -> int:
        """Number of symmetries that the state ``x`` breaks: as many of its zero eigenvalues belong to them."""
        self.set_phase(x)
        return self.phase.count

    def free_motions(self, x: PETSc.Vec) -> list[str]:
        """In words the motions that carry the state ``x`` through equivalent ones, one for each phase condition."""
        self.set_phase(x)
        if not self.phase.broken:
            return []
        parts, along = self.symmetries[0].parts, np.array([s.along for s in self.symmetries])
        every = np.array([s.weights for s in self.symmetries])
        return [str(Symmetry(w @ every, parts, float(w @ along))) for w in self.phase.broken.values()]
