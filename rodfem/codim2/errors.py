"""Errors of the rows of a locus: how far the curve of a richer discretisation is away."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rodfem.adaptivity.error_estimate import RESOLVED_TO
from rodfem.adaptivity.grading import SmoothnessIndicator, weights_of
from rodfem.adaptivity.ordinate_bound import bound
from rodfem.codim2.collision import Collision
from rodfem.codim2.criteria import Singular
from rodfem.codim2.place import place
from rodfem.codim2.plane import Criterion, LocusPoint, Plane
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.kinds import FLUTTER, FOLD
from rodfem.errors import ConvergenceError
from rodfem.fem.quadrature_check import QuadratureCheck
from rodfem.fem.transfer import Transfer, halved, richer_system


class Errors(NamedTuple):
    """Bounds (n, 2) of the errors of rows, nan where they are not estimated, inf where the richer mesh finds no point.

    Of ``unresolved`` rows the mesh does not resolve the state, or its null vectors: there errors may exceed them.
    """

    error: np.ndarray
    unresolved: list[int]


def criterion_of(solver: BranchSolver, plane: Plane, kind: str, near: LocusPoint) -> Criterion:
    """Defining equations of the locus of a ``kind`` of special points in a ``plane``, one of which is ``near``.

    ``solver`` has the mesh.
    """
    return Collision(solver, plane) if kind == FLUTTER else Singular(solver, plane, near, fold=kind == FOLD)


class RicherMesh:
    """The same locus, of a ``kind`` of special points in a ``plane``, on a discretisation one degree richer."""

    def __init__(self, solver: BranchSolver, kind: str, plane: Plane) -> None:
        """``solver`` has the mesh on which it was found."""
        self.solver, self.kind = type(solver)(richer_system(solver.system)), kind
        self.transfer = Transfer(solver.system, self.solver.system)
        self.plane = Plane(self.solver.system, plane.names[1], plane.intervals)
        self.indicator = SmoothnessIndicator(self.solver, weights_of(self.solver.system.scene))
        self.rho = halved(solver.system.fields.discretization.degree)
        self._criterion: Criterion | None = None

    def compare(self, node: LocusPoint) -> tuple[list[float], bool]:
        """Bounds of the errors of both parameters, and whether the mesh resolves the state and its null vectors.

        Raises :class:`ConvergenceError`.
        """
        near = self._transferred(node)
        if self._criterion is None:
            self._criterion = criterion_of(self.solver, self.plane, self.kind, near)
        resolved = True
        if node.sought is None:
            found = self._criterion.correct((node.p, near.x, node.dp, None), near, 0.1)
            there, located_to = found.p, found.located_to
            resolved = self._changed(near, found) <= RESOLVED_TO
        else:
            sought = place(self._criterion, self.plane, near, node.sought, node.windows)
            there, located_to = sought.p, sought.dp
        each = zip(node.p, there, node.located_to + located_to, strict=True)
        return [bound(*pair, self.rho) for pair in each], resolved

    def _transferred(self, node: LocusPoint) -> LocusPoint:
        """A point of the first mesh on this one."""
        x, dx = self.transfer(node.x, state=True), self.transfer(node.dx, state=False)
        modes, left = ([self.transfer(v, state=False) for v in side] for side in (node.modes, node.left))
        return replace(node, x=x, dx=dx, modes=modes, left=left)

    def _changed(self, near: LocusPoint, found: LocusPoint) -> float:
        """Relative change of the strains of a state, or of one of its null vectors.

        Vectors of the invariant subspace of a double eigenvalue have no counterparts on another mesh.
        """
        norm, modes = self.solver.system.norm, near.modes[: near.multiplicity]
        changes = [self.indicator.changed(near.x, found.x, state=True)]
        for first, last in zip(modes, found.modes, strict=False):
            changes.append(self.indicator.changed(first / norm(first), last / norm(last), state=False))
        return max(changes)


def errors_of(
    solver: BranchSolver, kind: str, plane: Plane, nodes: Sequence[LocusPoint], rows: Iterable[int]
) -> Errors:
    """Estimate errors at some ``rows``: the distance to the curve of a richer discretisation.

    It is measured across the curve, but for turning points and ends to those of the other curve.  ``solver``, ``kind``
    and ``plane`` are those of a locus of special points, and ``nodes`` all its rows.
    """
    error, rows, unresolved = np.full((len(nodes), 2), np.nan), sorted(rows), set[int]()
    if not rows:
        return Errors(error, [])
    richer = RicherMesh(solver, kind, plane)
    for row in rows:
        try:
            error[row], resolved = richer.compare(nodes[row])
            unresolved |= set() if resolved else {row}
        except ConvergenceError:
            error[row] = np.inf
    beside = [{*rows[max(i - 1, 0) : i + 2]} for i in range(len(rows))]
    doubtful = {row for row, near in zip(rows, beside, strict=True) if nodes[row].sought and near & unresolved}
    return Errors(error, sorted(unresolved | doubtful))


def not_integrated(solver: BranchSolver, plane: Plane, nodes: Sequence[LocusPoint], error: np.ndarray) -> str:
    """Take the errors away of points at which the mesh does not integrate the equations; a clause on the first.

    ``solver`` has found the locus of these ``nodes`` in a ``plane``; ``error`` (n, 2) is changed.
    """
    check, said = QuadratureCheck(solver.system), ""
    for row in np.flatnonzero(np.isfinite(error[:, 0])):
        node = nodes[row]
        if words := check(plane.at(node.p, node.x)):
            error[row] = np.nan
            said = said or f"at {plane.words(node.p, 6)} {words}"
    return said
