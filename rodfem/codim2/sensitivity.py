r"""Derivatives of critical loads in the constants of a scene, and along the rod.

The load of a special point moves with a parameter ``p`` as its locus does: the derivative is the slope of a tangent of
the singular system (:mod:`rodfem.continuation.singular`), exact but for the differences along null vectors in it.

*Along the rod* a parameter may be another one in each element: a stiffness that varies.  At a fold with the null vector
``v`` the load ``lam`` changes by ``v . F_p dp + v . F_lam dlam = 0``.  Where eigenvalues ``mu_i`` vanish with null
vectors ``v_i``, their sum changes along the branch at a rate ``mu'``, and

    mu' dlam = -(sum_i v_i . S_p v_i + y . F_p) dp,        S y = -sum_i D(S v_i) v_i  across the null vectors,

as the state moves by ``-S^-1 F_p dp``.  Each term is a sum over elements, or pieces of them, on which the state is the
same polynomial: the part of one, over its length, is the mean there of the density ``dlam/dp(s)``.  What acts at
points, as a load at an end, is not in it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from petsc4py import PETSc

from rodfem.adaptivity.error_estimate import bound
from rodfem.codim2.criteria import LocusPoint, Plane
from rodfem.codim2.follow import Curve, RicherMesh
from rodfem.continuation.branch import SpecialPoint
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.kinds import FOLD
from rodfem.continuation.singular import SingularSystem
from rodfem.errors import ConvergenceError, InputError
from rodfem.fem.checks import Pieces
from rodfem.fem.state import line
from rodfem.fem.system import System
from rodfem.output.words import number
from rodfem.problem.functions import derived
from rodfem.problem.scene import Parameter
from rodfem.tolerances import unit

PIECES = 4
"""Pieces of each element on which a density is known."""
DIFFERENCES = ((-2e-3, 1e3 / 12), (-1e-3, -2e3 / 3), (1e-3, 2e3 / 3), (2e-3, -1e3 / 12))
"""Places and weights of a central difference of the fourth order: along a null vector, in a parameter over its size."""

Adjoint = tuple[PETSc.Vec, list[PETSc.Vec], PETSc.Vec | None]  # a state, its null vectors, and ``y``


@dataclass(frozen=True)
class Derivative:
    """Derivative ``value`` of a critical load in a parameter, with a bound of its ``error``: nan without one.

    Along the rod ``density`` (m,) has its means on pieces of the rod from ``ends`` (m,) to ``ends`` (m + 1,), a
    derivative per length, with a bound of the largest error, ``density_error``: ``density @ diff(ends)`` is the value,
    if nothing at a point depends on the parameter.
    """

    value: float
    error: float
    ends: np.ndarray = field(default_factory=lambda: np.zeros(1))
    density: np.ndarray = field(default_factory=lambda: np.zeros(0))
    density_error: float = float("nan")

    def __repr__(self) -> str:
        return f"<Derivative: {number(self.value, self.error)}>"


def derivative(
    solver: BranchSolver, special: SpecialPoint, parameter: str, *, error_bar: bool = True, along_the_rod: bool = False
) -> Derivative:
    """How fast the load of a ``special`` point changes with a ``parameter`` of the scene; collective.

    Of eigenvalues that vanish together it is that of their mean.  Raises :class:`InputError` for what has no locus, or
    no density, and :class:`ConvergenceError` where the parameter destroys the point, which then has no derivative.
    """
    scene, load = solver.system.scene, special.point.load
    if along_the_rod and not special.kind.singular:
        raise InputError(f"A density along the rod is known at folds and branch points, not at {special.kind.words}.")
    known = scene.parameters.get(parameter, Parameter(0.0))
    room = min(abs(end - known.value) for end in known.admissible)
    near, own = 0.05 * unit(load, one=solver.units.load), min(0.05 * (abs(known.value) or 1.0), 0.5 * room)
    plane = Plane(solver.system, parameter, ((load - near, load + near), (known.value - own, known.value + own)))
    with solver.system.clock.scope("locus"), plane.kept():
        curve = Curve(solver, special, plane, doubtful=False)
        node, fold = curve.first, special.kind == FOLD
        if node.ended:
            raise ConvergenceError(f"The {special.kind} at {plane.words(node.p)} has no derivative: {node.ended}.")
        value, error, along = float(node.dp[0] / node.dp[1]), float("nan"), list[Any]()
        if along_the_rod:
            along = [*_along(solver, node, parameter, PIECES, fold=fold), float("nan")]
        if error_bar:
            richer = RicherMesh(curve.criterion, special.kind, node)
            there = richer.again(node)
            rounded = 1e-9  # round-off of the differences, relative
            error = bound(value, float(there.dp[0] / there.dp[1]), rounded * abs(value), richer.rho)
        if error_bar and along_the_rod:
            finer = _along(richer.richer.solver, there, parameter, PIECES // 2, fold=fold)[1]
            along[2] = bound(0.0, abs(finer - along[1]).max(), rounded * abs(along[1]).max(), richer.rho)
    return Derivative(value, error, *along)


def _along(
    solver: BranchSolver, node: LocusPoint, parameter: str, pieces: int, *, fold: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Ends (m + 1,) of the pieces of the rod, and the density (m,) on each."""
    system, shape, known = solver.system, solver.shape, solver.system.scene.parameters[parameter]
    states = SingularSystem(solver, node.modes[: node.multiplicity], node.multiplicity, fold=fold)
    null, y, rate = states.adjoint(node.x)
    size = abs(known.value) or 1.0
    parts = sum(
        weight / size * _work(system, (node.x, null, y), {parameter: known.value + place * size}, pieces)
        for place, weight in DIFFERENCES
    )
    start, length = (shape.from_left(each)[:, None] for each in (shape.start, shape.size))
    ends = np.append((start + length * np.arange(pieces) / pieces).ravel(), start[-1, 0] + length[-1, 0])
    return ends, (-shape.from_left(np.transpose(parts)) / rate * pieces / length).ravel()


def _work(system: System, point: Adjoint, constants: dict[str, float], number: int) -> np.ndarray:
    """Parts (pieces, cells) of ``sum v . S v + y . F``, or without ``y`` of ``sum v . F``, with other constants."""
    (x, null, y), scene, equations = point, system.scene, system.equations
    pieces = derived(equations, Pieces, lambda: Pieces(equations))
    equations.take(line(scene, {**constants, scene.load: 0.0}, {scene.load: 1.0}))

    def product(state: PETSc.Vec, covector: PETSc.Vec) -> np.ndarray:
        values, own = (v.local[pieces.dofs] for v in (system.at(state), system.change(covector)))
        return np.einsum("pcn,cn->pc", pieces.vectors(equations.residual, values, number), own)

    if y is None:
        return np.asarray(sum(product(x, v) for v in null))
    out = product(x, y)
    for v in null:
        out += sum(weight * product(x + v * place, v) for place, weight in DIFFERENCES)
    return out
