"""Pairs of special points that a mesh may miss: where a test function is least, a richer mesh tells whether it is zero.

A pair of folds comes out of a cusp: beside it the load has an inflection along the branch, and its slope a least value.
A pair of branch points comes out of a point at which an eigenvalue touches zero.  A mesh whose error is as large has
the least value on one side of zero, the rod has it on the other.  No special point of that mesh shows it, nor an index,
which is another one on the short piece between the two points only.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import inf

import numpy as np
from petsc4py import PETSc

from rodfem.adaptivity.mesh_sequence import Meshes
from rodfem.continuation.branch import Branch, Point
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.determinants import BEYOND, LARGEST, Logarithm, LowModes, steep, whole
from rodfem.continuation.locate import ORDERED
from rodfem.continuation.pair_search import vertex
from rodfem.continuation.states_between import point_between
from rodfem.errors import ConvergenceError
from rodfem.stability.inertia import ZERO_BAND
from rodfem.stability.round_off import quotient_error

LESS = 0.9
"""A least value over the greatest ones on both sides of it, above which it is no dip."""
KNOWN = 0.5
"""Part of a test function that it may change by on a richer mesh: more, and its sign is in doubt."""


def missed_points(branch: Branch, meshes: Meshes) -> Iterator[str]:
    """Yield a sentence on each row of a ``branch`` on the ``meshes`` beside which special points may be missing.

    Where the slope of the load is less than on both sides it is compared with that of a richer mesh, and where the
    determinant of the saddle matrix is, the eigenvalue nearest to zero.
    """
    rows = branch.points
    for name, points, values, of in (
        ("the slope of the load along the branch", "folds", np.array([p.slope for p in rows]), _slope),
        ("the eigenvalue nearest to zero", "branch points", _determinants(rows, meshes), _nearest),
    ):
        for i in dips(values):
            mesh = rows[i].mesh
            solver, richer = meshes.solvers[mesh], meshes.richer(mesh)
            point = _least(solver, rows[i - 1 : i + 2], values[i - 1 : i + 2])
            if point.tangent is None:
                continue
            try:
                mine, noise = of(solver, point.x, point.tangent)
                x, tangent = richer.again(point, fixed_load=False).x, richer.transfer(point.tangent, state=False)
                again, _ = of(richer.solver, x, tangent)
                found = f"is {mine:.2g}, and {again:.2g} on a richer mesh"
                if abs(mine) <= noise or abs(again - mine) <= KNOWN * abs(mine):
                    continue
            except ConvergenceError:
                found = "has a value that a richer mesh has no state for"
            yield (
                f"{branch.name}: Near {richer.system.scene.load} = {point.load:.8g} {name} {found}: a pair of {points} "
                "may be missing there, use more elements."
            )


def _determinants(rows: list[Point], meshes: Meshes) -> np.ndarray:
    """Determinants at ``rows`` over the largest one, signed; those of the low modes where the others change much."""
    functions: dict[int, Logarithm] = dict.fromkeys({p.mesh for p in rows}, whole)
    if steep(rows):
        sigma = max(meshes.solvers[0].inertia.scale, *(BEYOND * p.nearest for p in rows))
        functions = {mesh: LowModes(meshes.solvers[mesh], sigma) for mesh in functions}
    logarithms = np.array([functions[p.mesh](p) for p in rows])
    largest = np.max(logarithms, where=np.isfinite(logarithms), initial=-inf)
    return np.exp(np.clip(logarithms - largest, -LARGEST, 0.0)) * [(-1.0) ** p.negative for p in rows]


def dips(values: np.ndarray) -> list[int]:
    """Places at which ``values`` (n,) of one sign are nearer to zero than on both sides, by a tenth or more."""
    out: list[int] = []
    for i in range(1, len(values) - 1):
        a, b, c = values[i - 1 : i + 2]
        if np.isfinite([a, b, c]).all() and min(a * b, b * c) > 0 and abs(a) > abs(b) <= abs(c):
            if abs(b) < LESS * min(_greatest(values[i::-1]), _greatest(values[i:])):
                out.append(i)
    return out


def _greatest(values: np.ndarray) -> float:
    """Greatest size from the first value on, up to where values become less again, or change sign."""
    greatest = abs(values[0])
    for value in values[1:]:
        if not value * values[0] > 0 or not greatest <= abs(value) < np.inf:
            break
        greatest = abs(value)
    return float(greatest)


def _least(solver: BranchSolver, rows: list[Point], values: np.ndarray) -> Point:
    """State of a mesh between three rows, at the vertex of the parabola through their ``values``: else the middle one.

    ``solver`` has the mesh of that row.
    """
    a, b, c = rows
    if a.mesh != b.mesh or b.mesh != c.mesh:
        return b
    s, _ = vertex([(p.arclength, abs(value)) for p, value in zip(rows, values, strict=True)])
    ends = (a, b) if s < b.arclength else (b, c)
    return point_between(solver, *ends, float(s)) or b if s != b.arclength else b


def _slope(solver: BranchSolver, x: PETSc.Vec, direction: PETSc.Vec) -> tuple[float, float]:
    """Slope of the load at a state of a branch, on the side of a ``direction``, and what of it may be zero."""
    tangent, span = solver.tangent(solver.row(direction), at=x), solver.system.scene.span
    slope = solver.system.scalar(tangent) / solver.system.norm(tangent)
    return float(slope), ZERO_BAND * abs(span[1] - span[0])


def _nearest(solver: BranchSolver, x: PETSc.Vec, _: PETSc.Vec) -> tuple[float, float]:
    """Eigenvalue of a state nearest to zero, symmetry modes left out, and what of it may be zero."""
    found = solver.inertia.at(x)
    found.count()
    with solver.inertia.afresh():
        (value,), (vector,) = found.nearest(1, ORDERED)
    return float(value), ZERO_BAND * solver.inertia.scale + quotient_error(found.matrix, vector)
