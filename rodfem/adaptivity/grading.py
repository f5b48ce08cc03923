"""Graded meshes: how smooth a state is along the rod, and the cheapest elements that resolve it to an accuracy.

On each element the Legendre coefficients of the strains (curvature and stretch, weighted as in the stored energy) decay
like ``A rho^-j``, for singularities of the state at a distance ``h (rho - 1/rho) / 4`` across the rod (Trefethen,
Approximation Theory and Approximation Practice, chapter 8).  Elements of degree d miss ``A rho^-d`` of the strains, and
the *square* of that, integrated along the rod, of loads and positions, which are stationary; the factor in front is
measured on a richer mesh.  On an element of another size the distance stays, and ``rho`` follows: how large an element
may be at each place is had in closed form.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.polynomial import legendre
from petsc4py import PETSc

from rodfem import compat
from rodfem.fem.fields import Discretization, Fields
from rodfem.fem.formulations import turning_of
from rodfem.problem.scene import Scene
from rodfem.tolerances import NEGLIGIBLE, SAME_PLACE, TINY, same_place

if TYPE_CHECKING:
    from rodfem.continuation.branch_solver import BranchSolver

FIXED, PER_DEGREE = 600.0, 0.27
"""Cost of a point of a branch with n unknowns of degree d is as ``FIXED + n (1 + PER_DEGREE d)``: measured, cord."""
LEAST_DECAY, MOST_DECAY = 1.5, 1e3


@dataclass(frozen=True)
class Smoothness:
    """Decay of the strains of a state on elements of a ``degree``: ``|coefficient j| < amplitude decay^-j``."""

    vertices: np.ndarray
    degree: int
    amplitude: np.ndarray
    decay: np.ndarray

    @property
    def indicator(self) -> float:
        """Squared norm of the interpolation error of the strains: proportional to the error of a load."""
        missed = self.amplitude * self.decay ** -float(self.degree)
        return float(np.sum(np.diff(self.vertices) * missed**2))

    def sizes(self, degree: int, indicator: float) -> np.ndarray:
        """Size of element at each present one with which, everywhere on the rod, the indicator has that value, (E,)."""
        length = self.vertices[-1] - self.vertices[0]
        needed = (self.amplitude**2 * length / indicator) ** (0.5 / degree)
        needed = np.maximum(needed, LEAST_DECAY)
        factor = (self.decay - 1 / self.decay) / (needed - 1 / needed)
        # the decay was measured on the element that there is: no element grows by more at a time
        return np.asarray(np.diff(self.vertices) * np.minimum(factor, 3.0))

    def fulfilled_by(self, mesh: Discretization, vertices: np.ndarray, indicator: float) -> bool:
        """Whether elements with these vertices are nowhere larger than the indicator allows."""
        sizes, (starts, ends) = self.sizes(mesh.degree, indicator), (self.vertices[:-1], self.vertices[1:])
        return all(b - a <= 1.05 * sizes[(starts < b) & (ends > a)].min() for a, b in pairwise(vertices))


class SmoothnessIndicator:
    """Measures how smooth the states of one discretisation are; collective."""

    def __init__(self, solver: BranchSolver) -> None:
        self.solver, self.weights = solver, _weights_of(solver.system.scene)
        fields = solver.system.fields
        self._cells = slice(0, fields.owned_cells)
        degrees = {b.name: b.degree for b in fields.blocks}
        self._series = {}
        for name, _ in self.weights:
            d = degrees[name]
            series = np.linalg.inv(legendre.legvander(2 * compat.nodes(d) - 1, d))
            series = legendre.legder(series, axis=0) if name == fields.turning.name else series
            self._series[name] = series / np.sqrt(2 * np.arange(len(series)) + 1)[:, None]

    def __call__(self, x: PETSc.Vec, directions: Sequence[PETSc.Vec] = ()) -> Smoothness:
        """Smoothness of a state and of changes of it (null vectors) together."""
        shape = self.solver.shape
        starts, rows = shape.system.whole(shape.start), shape.system.whole(self._squares(x, directions))
        order = np.argsort(starts)
        vertices = np.append(starts[order], self.solver.system.scene.interval[1])
        return _decay(vertices, np.sqrt(rows[order]))

    def unresolved(self, x: PETSc.Vec, directions: Sequence[PETSc.Vec] = ()) -> float:
        """Norm of the last two coefficients over that of all, or one, of a state and of changes of it together."""
        system = self.solver.system
        parts = system.comm.allreduce(self.solver.shape.size @ self._squares(x, directions))
        return float(np.sqrt(parts[-2:].sum() / max(parts.sum(), system.scene.length)))

    def changed(self, before: PETSc.Vec, after: PETSc.Vec, *, state: bool) -> float:
        """Norm of the change of the strains over that of those after, or one radian along the rod."""
        system = self.solver.system
        same = state or (system.metric * before).dot(after) >= 0
        apart = before - after if same else before + after
        squares = self._squares(None, [apart]), self._squares(*((after, []) if state else (None, [after])))
        change, size = (float(system.comm.allreduce(np.sum(self.solver.shape.size @ parts))) for parts in squares)
        return float(np.sqrt(change / max(size, system.scene.length)))

    def _squares(self, x: PETSc.Vec | None, directions: Sequence[PETSc.Vec]) -> np.ndarray:
        """Squared coefficients of the strains on the elements of this rank, (elements, degree)."""
        system, fields, shape = self.solver.system, self.solver.system.fields, self.solver.shape
        squares = np.zeros((fields.owned_cells, fields.discretization.degree))
        for vector in directions if x is None else (x, *directions):
            at = system.at(vector) if vector is x else system.change(vector)
            for name, weights in self.weights:
                series = np.einsum("jn,cni->cji", self._series[name], at.values(name)[self._cells])
                if name == fields.turning.name:
                    series *= (2 / shape.size)[:, None, None]
                squares += series**2 @ weights**2
        return squares


def _weights_of(scene: Scene) -> list[tuple[str, np.ndarray]]:
    """Weights of curvature (derivative of q or an angle) and of free strains v: root of stiffness over bending."""
    stiffness = np.diag(scene.stiffness())
    free = len(scene.free_strains)
    bending = stiffness[free:].min()
    turning = turning_of(scene)
    out = [(turning.name, np.full(turning.size, scene.length * (1.0 if turning.name == "q" else 0.5)))]
    return [*out, ("v", scene.length * np.sqrt(abs(stiffness[:free] / bending)))] if free else out


def _decay(vertices: np.ndarray, coefficients: np.ndarray) -> Smoothness:
    """Fit ``A rho^-j`` to the monotone envelope of the last coefficients of each element above round-off."""
    elements, degree = coefficients.shape
    envelope = np.maximum.accumulate(coefficients[:, ::-1], axis=1)[:, ::-1]
    floor = max(NEGLIGIBLE * coefficients.max(), TINY)
    amplitude, decay = np.full(elements, floor), np.full(elements, MOST_DECAY)
    for e, row in enumerate(envelope):
        last = int(np.count_nonzero(row > floor))
        # every other coefficient of a function that is even or odd on its element is nearly zero: a last one that falls
        # by more than the two before it says nothing
        if last >= 4 and row[last - 1] * row[last - 4] < row[last - 2] ** 2:
            last -= 1
        first = max(min(degree // 2 - 1, last - 3), 0)
        if last - first < 2:
            continue
        j = np.arange(first, last)
        slope, level = np.polyfit(j, np.log(row[first:last]), 1)
        decay[e] = np.clip(np.exp(-slope), LEAST_DECAY, MOST_DECAY)
        above = row[first:last] * decay[e] ** j
        amplitude[e] = max(np.exp(level), above[-1])
    return Smoothness(vertices, degree, amplitude, decay)


def pieces_of(scene: Scene) -> np.ndarray:
    """Arclengths at which elements must meet: ends, joints, and where the ordinate is taken.

    The centreline is as accurate as a load at vertices only, and far less inside of elements.
    """
    a, b = scene.interval
    inner = [s for s in (*scene.vertices, *scene.ordinate.places) if min(s - a, b - s) > SAME_PLACE * scene.length]
    out = [a]
    for s in sorted(inner):
        if not same_place(s, out[-1], scene.length):
            out.append(s)
    return np.array([*out, b])


def cost(fields: Fields, elements: int, degree: int) -> float:
    """Cost of a point of a branch with that many elements of a degree, in units of an unknown of degree zero."""
    unknowns = elements * degree * sum(b.size for b in fields.blocks)
    return FIXED + unknowns * (1 + PER_DEGREE * degree)


def cheapest(solver: BranchSolver, found: Smoothness, indicator: float) -> Discretization:
    """Cheapest discretisation with which the indicator of a state falls to that value: degree, number, vertices."""
    fields, made = solver.system.fields, list[Discretization]()
    present = fields.discretization
    for degree in sorted({*range(4, 11), present.degree}):
        vertices = tuple(map(float, _place(fields, found, found.sizes(degree, indicator))))
        made.append(replace(present, elements=len(vertices) - 1, degree=degree, vertices=vertices))
    # forms of another degree have to be compiled or loaded
    return min(made, key=lambda d: cost(fields, d.elements, d.degree) * (1.0 if d.degree == present.degree else 1.15))


def _place(fields: Fields, found: Smoothness, sizes: np.ndarray) -> np.ndarray:
    """Vertices of a mesh with elements of these sizes, an element for each rank at least."""
    number = np.append(0.0, np.cumsum(np.diff(found.vertices) / sizes))
    number *= max(1.0, (max(2, fields.comm.size) + 0.1) / number[-1])
    pieces = pieces_of(fields.scene)
    at = np.interp(pieces, found.vertices, number)
    out = [pieces[:1]]
    for left, right, a, b in zip(pieces, pieces[1:], at, at[1:], strict=False):
        count = max(1, int(np.ceil(b - a - 0.05)))
        inner = np.interp(np.linspace(a, b, count + 1)[1:-1], number, found.vertices)
        out += [inner[(inner > left) & (inner < right)], np.array([right])]
    return np.concatenate(out)
