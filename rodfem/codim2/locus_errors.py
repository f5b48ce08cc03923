"""Errors of the rows of a locus: how far the curve of a richer discretisation is away."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from petsc4py import PETSc

from rodfem.adaptivity.error_estimate import RESOLVED_TO
from rodfem.adaptivity.grading import SmoothnessIndicator, weights_of
from rodfem.adaptivity.ordinate_bound import bound
from rodfem.codim2.along import place
from rodfem.codim2.collision import Collision
from rodfem.codim2.criterion import Criterion
from rodfem.codim2.parameter_plane import LocusPoint, Plane
from rodfem.codim2.singular import Singular
from rodfem.continuation.kinds import FLUTTER, FOLD
from rodfem.continuation.static_solver import StaticSolver
from rodfem.errors import ConvergenceError
from rodfem.fem.quadrature_check import QuadratureCheck
from rodfem.fem.transfer import Transfer, halved, richer_system

CUSP = 1e-3
"""Part of the tangent in the plane, as a share of the bounds, below which a node is at a cusp."""


class Errors(NamedTuple):
    """Bounds (n, 2) of the errors of rows, nan where they are not estimated, inf where the richer mesh finds no point.

    Of ``unresolved`` rows the mesh does not resolve the state, or its null vectors: there errors may exceed them.
    """

    error: np.ndarray
    unresolved: list[int]


def criterion_of(solver: StaticSolver, plane: Plane, kind: str, near: LocusPoint) -> Criterion:
    """Defining equations of the locus of a ``kind`` of special points in a ``plane``, one of which is ``near``.

    ``solver`` has the mesh.
    """
    if kind == FLUTTER:
        return Collision(solver, plane)
    return Singular(solver, plane, near, fold=kind == FOLD)


def errors_of(
    solver: StaticSolver, kind: str, plane: Plane, nodes: Sequence[LocusPoint], marked: Iterable[int], error_bars: int
) -> Errors:
    """Estimate errors at so many rows and at the marked ones: the distance to the curve of a richer discretisation.

    It is measured across the curve, but for turning points and ends to those of the other curve.

    Parameters
    ----------
    solver, kind, plane
        What found the locus, of a kind of special points in a plane.
    nodes, marked
        Its rows, and the numbers of those with a mark.
    error_bars
        At how many rows besides, evenly along the curve; 0: at none, nor at the marked ones.
    """
    error, unresolved = np.full((len(nodes), 2), np.nan), list[int]()
    if not error_bars:
        return Errors(error, unresolved)
    rows = sorted({*np.linspace(0, len(nodes) - 1, error_bars).round().astype(int).tolist(), *marked})
    richer = type(solver)(richer_system(solver.system))
    transfer = Transfer(solver.system, richer.system)
    other = Plane(richer.system, plane.names[1], (tuple(plane.bounds[0]), tuple(plane.bounds[1])))
    indicator = SmoothnessIndicator(richer, weights_of(richer.system.scene))
    criterion: Criterion | None = None
    rho = halved(solver.system.fields.discretization.degree)
    for row in rows:
        node = nodes[row]
        x = transfer(node.x, state=True)
        modes, left = ([transfer(v, state=False) for v in side] for side in (node.modes, node.left))
        dx = transfer(node.dx, state=False)
        near = LocusPoint(node.p, x, node.dp, dx, node.p, omega2=node.omega2, modes=modes, left=left)
        if criterion is None:
            criterion = criterion_of(richer, other, kind, near)
        along = node.dp
        if np.linalg.norm(along / plane.width) < CUSP:
            along = nodes[min(row + 1, len(nodes) - 1)].p - nodes[max(row - 1, 0)].p
        try:
            if node.sought is None:
                found = criterion.correct(node.p, x, (along, None), near, 0.1)
                there, located_to = found.p, found.located_to
                if _changed(indicator, x, found, [] if kind == FLUTTER else modes) > RESOLVED_TO:
                    unresolved.append(row)
            else:
                sought = place(criterion, other, near, node.sought, node.windows)
                there, located_to = sought.p, sought.dp
            each = zip(node.p, there, node.located_to + located_to, strict=True)
            error[row] = [bound(*pair, rho) for pair in each]
        except ConvergenceError:
            error[row] = np.inf
    beside = [{rows[max(i - 1, 0)], row, rows[min(i + 1, len(rows) - 1)]} for i, row in enumerate(rows)]
    doubtful = [row for row, near in zip(rows, beside, strict=True) if nodes[row].sought and near & {*unresolved}]
    return Errors(error, sorted({*unresolved, *doubtful}))


def _changed(indicator: SmoothnessIndicator, x: PETSc.Vec, found: LocusPoint, modes: list[PETSc.Vec]) -> float:
    """Relative change of the strains of a state ``x``, or of one of its null vectors, on the richer discretisation.

    Vectors of a subspace have no counterparts on another mesh: ``modes`` are to be null vectors, or none.
    """
    changes = [indicator.changed(x, found.x, state=True)]
    norm = indicator.solver.system.norm
    for first, last in zip(modes, found.modes, strict=False):
        changes.append(indicator.changed(first / norm(first), last / norm(last), state=False))
    return max(changes)


def not_integrated(solver: StaticSolver, plane: Plane, nodes: Sequence[LocusPoint], error: np.ndarray) -> str:
    """Take the errors away of points at which the mesh does not integrate the equations; a clause on the first.

    Parameters
    ----------
    solver, plane
        What found the locus in a plane.
    nodes, error
        Its rows and their errors (n, 2), which are changed.
    """
    check, said = QuadratureCheck(solver.system), ""
    for row in np.flatnonzero(np.isfinite(error[:, 0])):
        node = nodes[row]
        solver.system.line = plane.along(node.p, 0)
        if words := check(node.x):
            error[row] = np.nan
            where = ", ".join(f"{name} = {value:.6g}" for name, value in zip(plane.names, node.p, strict=True))
            said = said or f"at {where} {words}"
    return said
