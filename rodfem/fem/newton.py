"""Newton's method: the one loop, when it has converged or failed, and one iteration in compiled code (``newton.c``).

Whatever is solved for hands the loop an *iteration*: what moves the unknowns by one correction.  That of a state on a
plane is here, by LU factors of the bordered matrix; states held by forces, singular states and states away from known
ones have theirs (:mod:`rodfem.continuation.singular`, :mod:`rodfem.deflation.search`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import inf, isfinite
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from petsc4py import PETSc

from rodfem.fem.assembly import ONE_CELL
from rodfem.linalg.chain import Chain, Factors
from rodfem.linalg.compiled import Memory, buffer, module
from rodfem.linalg.matrices import EPS, shared

if TYPE_CHECKING:
    from rodfem.fem.system import System

TOLERANCE = 1e-10
"""Size of the last correction of a converged state: rotations in radian, load over its span, all else relative, in
natural sizes: reactions that vanish relative to the stiffness of the rod are round-off of that."""
STALLED = 1e-6
"""Below this a correction that no longer shrinks is round-off, not divergence; it is reported as the error."""
VIOLATED = 1e-8
"""Residual of an equilibrium, in natural units, if round-off is not larger, and that of a squared norm from one."""
ITERATIONS, STEPS = 12, 8
"""Iterations, at most, and in a step along a branch: a shorter step is cheaper than more of them."""
FAR = 1e3
"""Distance, in the metric, beyond which no equilibrium is meant."""
LARGEST = 0.4
"""Bound of a damped step, in the metric."""
MOVED, UNDEFINED, SINGULAR, BROKEN = range(4)
"""What a compiled iteration did: it moved the state; the equations have no value there; the Jacobian is singular,
exactly; there were no factors at all."""


class Correction(NamedTuple):
    """Change by a ``size`` that is to vanish, ``distance`` from the guess, by ``fresh`` factors or older ones."""

    distance: float
    size: float
    fresh: bool = True


Iteration = Callable[[bool], Correction | None]
"""Moves the unknowns by a correction, with fresh factors if that is asked for; None where there is no correction."""


@dataclass(frozen=True)
class Limits:
    """At most ``most`` iterations, over a distance of ``reach`` in the metric.

    A correction below ``small`` is small enough; one that no longer shrinks is round-off below ``still``, and where the
    unknowns are ``lost`` in the round-off of the equations, if these ``hold``: next to a barrier corrections grow.
    """

    most: int = ITERATIONS
    reach: float = FAR
    small: float = TOLERANCE
    still: float = STALLED
    lost: Callable[[], bool] = lambda: False
    hold: Callable[[], bool] = lambda: True

    def stalled(self, size: float, previous: float) -> bool:
        """Whether a correction by fresh factors is round-off, as it no longer shrinks."""
        return size > 0.5 * previous and (size < self.still or self.lost()) and self.hold()


@dataclass(frozen=True)
class NewtonResult:
    """How a Newton iteration ended: whether ``converged``, after how many ``iterations``.

    ``error`` is what the observed rate of convergence leaves after the last correction (that one's size, if the factors
    were new), ``moved`` the distance of the solution from the guess.
    """

    converged: bool
    iterations: int
    error: float
    moved: float


def newton(iteration: Iteration, limits: Limits) -> NewtonResult:
    """Newton's method with chord steps.

    A Jacobian is factored first, and again only while corrections do not shrink tenfold from one to the next: near a
    solution the old factors cost one solve where new ones cost five.  It has converged if a correction is small enough,
    and failed after too many iterations, where there is no correction, or no number, and too far away.
    """
    previous, size, fresh, number = inf, inf, True, 0
    for number in range(1, limits.most + 1):
        made = iteration(fresh)
        if made is None:
            break
        distance, size, fresh = made
        if not (isfinite(size) and distance <= limits.reach):
            break
        # chord steps converge linearly: their rate, doubled for safety, says what the next correction would be
        left = size if fresh else min(2.0 * size / previous, 1.0) * size
        if size < limits.small or (fresh and limits.stalled(size, previous)):
            return NewtonResult(True, number, left, distance)
        # far from a solution, or where the old factors gain less than a digit, new ones are worth their cost
        fresh = size > 0.02 or size > 0.1 * previous
        previous = size
    return NewtonResult(False, number, size, inf)


def correct(system: System, x: PETSc.Vec, row: PETSc.Vec, reach: float = FAR, most: int = ITERATIONS) -> NewtonResult:
    """Solve the equations on the plane through ``x`` orthogonal to ``row``, in place, with LU factors.

    The phase conditions are those of the guess ``x``.  A singular matrix is a failure.

    With damping ``d`` a correction of size c along a family of equilibria is that by a force ``d c``, which no mesh
    makes exactly zero: one that no longer shrinks is accepted where that force is within the tolerance.
    """
    system.set_phase(x)
    still = max(STALLED, TOLERANCE * system.stiffness_scale / system.damping) if system.damping else STALLED
    hold = (lambda: True) if system.damping else lambda: not violation(system, x)
    return newton(OnPlane(system, x, row), Limits(most, reach, still=still, hold=hold))


def violation(system: System, x: PETSc.Vec) -> float:
    """Largest entry of the equations at a state, in natural units; zero if that of an equilibrium.  Collective."""
    equations, largest = system.new_vector(), PETSc.NormType.INFINITY
    system.at(x).residual(equations)
    worst = system.in_units(equations, 1).norm(largest)
    if worst <= VIOLATED:
        return 0.0
    # round-off of the product of the second variation with the state
    matrix = system.state_matrix()
    system.at(x).assemble_into(matrix, system.equations.jacobian)
    matrix.assemble()
    size = system.matrix_in_units(matrix).norm(largest) * system.in_units(x, -1).norm(largest)
    return 0.0 if worst <= 1e3 * EPS * size else float(worst)


class OnPlane:
    """Iterations for the equations on the plane through ``x`` orthogonal to ``row``; compiled where that serves."""

    def __init__(self, system: System, x: PETSc.Vec, row: PETSc.Vec) -> None:
        self.system, self.x, self.row, self.origin = system, x, row, x.copy()
        self.compiled = None if system.damping else system.compiled
        if self.compiled is not None:
            self.compiled.take()
            self.compiled.origin[:] = x.array_r.real

    def __call__(self, fresh: bool) -> Correction | None:
        """Move the state by one correction."""
        system, x = self.system, self.x
        if self.compiled is not None:
            status, distance, size = self.compiled.iterate(x, self.row, fresh)
            if status != BROKEN:
                return Correction(distance, size, fresh) if status == MOVED else None
        step = linear_step(system, x, self.row, fresh=fresh)
        if step is None:
            return None
        x.axpy(-1.0, step)
        size = max(system.norm(step), relative_size(system, x, step))
        return Correction(system.distance(x, self.origin), size, fresh)


def linear_step(
    system: System, x: PETSc.Vec, row: PETSc.Vec, damping: float = 0.0, *, fresh: bool = True
) -> PETSc.Vec | None:
    """What one step of Newton's method subtracts from ``x`` on the plane across ``row``, with the phase as it is.

    ``damping`` times the metric is added to the second variation; without ``fresh`` factors the last ones serve.  None
    where the equations have no value, or the matrix is singular.
    """
    equations, step, state = system.new_vector(), system.new_vector(), system.at(x)
    state.residual(equations)
    if not isfinite(equations.norm()):  # outside of where the stored energy is defined
        return None
    if fresh:
        state.factor(row, damping)
    return step if system.solve(equations, step) else None


def relative_size(system: System, x: PETSc.Vec, step: PETSc.Vec) -> float:
    """Size of a ``step`` to or from the state ``x`` relative to that, in natural sizes of the ``system``."""
    return float(system.in_units(step, -1).norm() / (1.0 + system.in_units(x, -1).norm()))


def relax(
    system: System,
    x: PETSc.Vec,
    row: PETSc.Vec,
    longest: float = inf,
    accepts: Callable[[PETSc.Vec], bool] = lambda x: True,
) -> NewtonResult:
    """Solve from a guess that is too far for Newton's method, in place, by pseudo-transient continuation.

    The overdamped motion ``M x' = -F(x)`` on the constraints is integrated by implicit Euler steps, ``(S + M/tau) dx =
    -F``, with ``M`` the metric: it goes downhill, to a state that is stable if one can be reached.  The time step grows
    while the steps are small, and Newton's method takes over near the end (Kelley & Keyes, SIAM J. Numer. Anal. 35
    (1998) 508-523).

    Implicit steps longer than ``1/|mu|`` go uphill along a mode of a negative eigenvalue ``mu``, to a saddle.  Steps at
    most as long as ``longest`` lead away from one, and the way goes on while ``accepts`` denies what Newton's method
    finds.  As ``mu`` grows on the way a step that is uphill, ``dx.(K + M/tau) dx < 0``, is made again, half as long.
    """
    system.set_phase(x)
    tau, most = 0.01 / system.stiffness_scale, 300
    for iteration in range(most):
        step = linear_step(system, x, row, 1.0 / tau)
        if step is None or not isfinite(size := system.norm(step)):
            break
        if isfinite(longest) and quadratic_form(system, x, step) < 0:
            tau *= 0.5
            continue
        x.axpy(-LARGEST / max(size, LARGEST), step)  # constraints are mended in one step, however long
        tau = min(tau * _pace(size), longest)
        if size < (0.1 if iteration % 5 == 4 else 1e-3):  # not earlier: it might jump to a state uphill
            if (outcome := _arrival(system, x, row, accepts)) is not None:
                return outcome
    return NewtonResult(False, most, inf, inf)


def _pace(size: float) -> float:
    """Switched evolution: longer time steps while the motion is slow, shorter where it is fast."""
    return 2.0 if size < 0.2 else 0.5 if size > LARGEST else 1.0


def _arrival(system: System, x: PETSc.Vec, row: PETSc.Vec, accepts: Callable[[PETSc.Vec], bool]) -> NewtonResult | None:
    """What Newton's method makes of ``x``, in place, where it converges to what is accepted; None where it does not."""
    trial = x.copy()
    outcome = correct(system, trial, row, reach=0.3)
    if not (outcome.converged and accepts(trial)):
        return None
    trial.copy(x)
    return outcome


def quadratic_form(system: System, x: PETSc.Vec, step: PETSc.Vec) -> float:
    """``dx.(K + M/tau) dx = dx.F - dy.c`` of a damped step ``(K + M/tau, C; C^t, 0) (dx, dy) = (F, c)``."""
    equations = system.new_vector()
    system.at(x).residual(equations)
    fields, sign = system.fields, np.ones(step.local_size)
    dual = [fields.number[fields.dofs[b.name]].ravel() for b in fields.blocks if b.multiplier]
    moving = {x.name for x in fields.unknown_scalars if not x.multiplier}
    dual.append(np.array([n for name, n in system.scalars.items() if name not in moving], dtype=int))
    numbers, (first, last) = np.concatenate(dual), step.getOwnershipRange()
    sign[numbers[(first <= numbers) & (numbers < last)] - first] = -1.0
    return float(system.comm.allreduce(float(equations.array_r @ (sign * step.array_r))))


class CompiledNewton:
    """Compiled assembly, and iteration, for one ``matrix`` of a ``system``, which it fills, and its ``factors``.

    Of a point of seventy unknowns the arithmetic takes a tenth of a millisecond, and the way through Python and PETSc's
    vectors several times as long.

    ``border`` is the derivative of the equations in the load at the state last assembled, ``origin`` the state that an
    iteration began with, (n,).  Of each drift scalar ``active`` says whether it has a phase condition, ``conditions``
    and ``forces`` (drifts, n) have that, and what a drift of one adds to the equations.
    """

    def __init__(self, system: System, matrix: PETSc.Mat, factors: Chain) -> None:
        self.system, self.matrix, self.factors, n = system, matrix, factors, system.fields.unknowns
        compiled = module("fem/newton")
        self.lib, self.ffi = compiled.lib, compiled.ffi
        self.memory = Memory(self.ffi)
        self._given: tuple[Any, ...] = (None, None, None)
        own, metric = shared(matrix), shared(system.metric)
        assert own is not None and metric is not None
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
        given = (self.factors.pointer, equations.residual.constants, equations.jacobian.constants)
        if any(mine is not new for mine, new in zip(self._given, given, strict=True)):
            self._use()
            self._given = given
        self.active[:], self.offsets[:] = 0, system.phase.offsets
        for i, row in system.phase.rows.items():
            self.active[i], self.conditions[i, : len(row)] = 1, row
            self.forces[i, : len(row)] = system.phase.forces[i]

    def _use(self) -> None:
        """Let the rod point to the forms with their constants, and to the factors."""
        system, rod, keep = self.system, self.rod, self.memory.keep
        residual, jacobian = system.equations.residual, system.equations.jacobian
        self.memory.point(rod, residual_constants=residual.constants, jacobian_constants=jacobian.constants)
        owners = {
            "residual": residual,
            "jacobian": jacobian,
            "equation_places": system.equation_places,
            "entry_places": system.matrix_places(self._pattern, True),
            "factors": self.factors,
        }
        for name, owner in owners.items():
            setattr(rod, name, keep((rod, name), owner).pointer)
        rod.assemble, rod.multiply = residual.functions
        rod.factor, rod.solve = self.factors.functions

    def assemble(self, x: PETSc.Vec) -> None:
        """Fill the matrix with ``S`` at ``x`` and a one for the load, and :attr:`border`; phase conditions stay."""
        self.take()
        failed = self.lib.assemble_at(self.rod, buffer(self.ffi, x.array_r))
        assert not failed, ONE_CELL
        self.matrix.stateIncrease()

    def images(self, x: PETSc.Vec, own: np.ndarray, *, transposed: bool) -> np.ndarray:
        """Products of ``(S F_lam)`` at ``x``, or of its transpose, with the columns of ``own`` (n, k)."""
        self.take()
        own = np.ascontiguousarray(own)
        out = np.empty_like(own)
        given = (buffer(self.ffi, each) for each in (own, out))
        failed = self.lib.multiply_at(self.rod, buffer(self.ffi, x.array_r), transposed, own.shape[1], *given)
        assert not failed, ONE_CELL
        return out

    def iterate(self, x: PETSc.Vec, row: PETSc.Vec, fresh: bool) -> tuple[int, float, float]:
        """Move ``x`` by one correction on the plane across ``row``, with factors of the Jacobian there if ``fresh``.

        Returns what it did, the distance of ``x`` from :attr:`origin` in the metric, and the size of the correction.
        """
        newton = self.newton
        with self.system.clock("solve"):
            along = buffer(self.ffi, row.array_r)
            with x as state:
                status = self.lib.iterate(self.rod, newton, buffer(self.ffi, state), along, fresh)
        if newton.factored:
            self.factors.regular = status == MOVED
            self.matrix.stateIncrease()
        return status, newton.distance, newton.size


def compiled_newton(system: System, matrix: PETSc.Mat, factors: Factors) -> CompiledNewton | None:
    """Compiled iteration for a ``matrix`` of the ``system``, where compiled code makes its ``factors``."""
    return CompiledNewton(system, matrix, factors) if isinstance(factors, Chain) else None
