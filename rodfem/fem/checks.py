r"""What the equations do not say of themselves in a state: whether the stored energy is convex, and integrated.

The second derivative of ``W`` in the free strains and curvatures must be positive definite (the Legendre-Hadamard
condition of a rod; Antman, Nonlinear Problems of Elasticity, 2005, chapter 8): where it is not, neither are equilibria
regular functions of the load nor does the index mean stability.  For a quadratic energy the undeformed state decides
for all.

To check the quadrature of the elements the residual is assembled once more on equal pieces of each element, on which
the state is the same polynomial: the rule of the element on each piece is a composite rule of many points.  The rows
are those of the element's own test functions.  An error bar assumes that the rule is far better on smaller elements.
With the errors ``e`` of the elements, and ``e'`` of their halves or their thirds, the largest ones along the rod, as
the composite rule has them, a rule of n points integrates the equations where

    e' <= max(2^-n e, 1e-8 of the residual):

of a smooth function ``e' / e`` is ``4^-n`` or less, of a kink 1/4, of a jump 1/2, of a layer between the points 1.
What is narrower than the distance of the points of the composite rule, a four thousandth of the rod, is not seen.

The residual of a straight rod does not have its bending stiffness in it.  The change of the residual in a small smooth
motion has, and is compared in the same way; so is the inertia in a translation and a rotation.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
import ufl
from mpi4py import MPI
from petsc4py import PETSc

from rodfem import compat
from rodfem.expressions import Variable, differentiated, extract_coefficients, extract_type
from rodfem.fem.assembly import Assembler, Cells, Places
from rodfem.fem.state import NodalValues, State
from rodfem.forms.kinematics import curvature
from rodfem.linalg.matrices import EPS
from rodfem.problem.functions import derived
from rodfem.tolerances import TINY

if TYPE_CHECKING:
    from rodfem.fem.equations import Equations
    from rodfem.fem.system import System

GRID = 25
"""Places of an element, at equal distances, at which a material that varies along it is looked at as well."""
POINTS, LEAST = 4096, 4
"""Points of the composite rule along the rod, about, and least number of pieces of an element."""
MOTION = 1e-3 * np.array([1.0, 0.7, 0.45])
"""Sizes of the components of the motion: rotations in radian, strains, displacements over the length."""


def second_derivative(e: Equations) -> tuple[Any, bool, Any]:
    """Entries of the second derivative of ``W`` as a vector in UFL; whether the state is in them; and them expanded."""
    u, free = e.unknowns, len(e.fields.scene.free_strains)
    k, every = curvature(u.q, u.q.dx(0)), range(free + 3)
    x, hessian = e.fields.scene.second_derivative([*e.components(u.v, free), *(k[i] for i in range(3))], e.constants)
    vector = ufl.as_vector([hessian[i, j] for i in every for j in every])
    expanded = differentiated(vector)
    variables = extract_type(expanded, Variable)
    return vector, any(node.ufl_operands[1] == x.label() for node in variables), expanded


class Convexity:
    """Evaluates the least eigenvalue of the second derivative of ``W`` along a state.

    At the Gauss points of each element and at its ends: strains are largest at a clamp or a joint more often than not.
    A material that varies along the rod may be too soft between them: it is looked at on a grid as well.

    It ``alters`` with the state or the load, of the parameters with these ``names``, and ``varies`` along the rod.
    """

    def __init__(self, system: System, *names: str) -> None:
        self.system, e, f = system, system.equations, system.fields
        self.size = len(system.scene.free_strains) + 3
        vector, of_state, known = derived(e, "second derivative", lambda: second_derivative(e))
        self.alters = of_state or (bool(extract_coefficients(known)) and system.scene.energy_depends_on(*names))
        self.varies = bool(extract_type(known, ufl.SpatialCoordinate))
        self.evaluate = None
        if not self.alters and not self.varies:  # the same everywhere: checked with the scene
            return
        inside = (np.polynomial.legendre.leggauss(f.discretization.degree + 1)[0] + 1) / 2
        points = np.array([0.0, *inside, 1.0, *(np.linspace(0.0, 1.0, GRID) if self.varies else [])])
        self.places = len(points)
        self.evaluate = derived(e, "convexity", lambda: e.evaluated(vector, points))

    def holds(self, x: PETSc.Vec) -> bool:
        """Whether the second derivative is positive definite along the whole rod at the state ``x``."""
        return not self.lowest(x) <= 0

    def lowest(self, x: PETSc.Vec) -> float:
        """Least eigenvalue over the whole rod at the state ``x``, relative to the largest one; 1 if it is constant."""
        if self.evaluate is None:
            return 1.0
        values = np.linalg.eigvalsh(self._matrices(x))
        mine = (values[..., 0] / abs(values).max(axis=-1)).min(initial=1.0)
        return float(self.system.comm.allreduce(float(mine), op=MPI.MIN))

    def scales(self, x: PETSc.Vec) -> np.ndarray:
        """Roots of the largest diagonals of the second derivative on each element at a state: (cells, 1, size)."""
        diagonals = abs(np.diagonal(self._matrices(x), axis1=-2, axis2=-1))
        return np.asarray(np.sqrt(diagonals.max(axis=1, keepdims=True)))

    def margin(self, x: PETSc.Vec, scales: np.ndarray) -> float:
        """Least eigenvalue over the whole rod at ``x``, in units of the ``scales`` of a state nearby: smooth."""
        least = np.linalg.eigvalsh(self._matrices(x) / (scales[..., None] * scales[..., None, :]))[..., 0]
        return float(self.system.comm.allreduce(float(least.min(initial=1.0)), op=MPI.MIN))

    def _matrices(self, x: PETSc.Vec) -> np.ndarray:
        """Second derivatives by element of this rank and place on it, symmetric, (cells, places, size, size)."""
        assert self.evaluate is not None
        state, evaluate = self.system.at(x), self.evaluate
        shape = self.system.fields.owned_cells, self.places, self.size, self.size

        def symmetric() -> np.ndarray:
            matrices = state.evaluate(evaluate).reshape(shape)
            return np.asarray((matrices + matrices.swapaxes(-1, -2)) / 2)

        return derived(state, evaluate, symmetric)


class Pieces:
    """Forms of some ``equations`` on their own cells, each cut into equal pieces: values are (pieces, cells, n).

    The pieces of several cuts, with the given numbers of pieces each, come one cut after the other.

    ``dofs`` (cells, n) are local degrees of freedom; ``rows`` says which of these n each field has, ``load`` which the
    load is.  The rule of an element has as many ``points``, and a ``number`` of pieces makes a rule of :data:`POINTS`.
    """

    def __init__(self, equations: Equations) -> None:
        self.fields, self.equations = equations.fields, equations
        own = slice(0, self.fields.owned_cells)
        self.dofs, self._x = self.equations.cells.dofs[own], self.equations.cells.x[own]
        numbers = {int(dof): i for i, dof in enumerate(self.dofs[0])}
        self.rows = {name: np.vectorize(numbers.get)(dofs[0]) for name, dofs in self.fields.dofs.items()}
        d = self.fields.discretization
        self.points = self.equations.quadrature_degree(d.degree) // 2 + 1
        self.number = max(LEAST, 2 ** round(np.log2(POINTS / d.elements / self.points)))
        self.load = numbers[int(self.fields.copies[0, -1])]
        self._cells, self._bases = cache(self._cut), cache(self._tabulated)
        self._places = cache(lambda *cuts: Places(self._cells(*cuts).dofs))
        self._form = cache(self._assembler)

    def vectors(self, form: Assembler, values: np.ndarray, *cuts: int) -> np.ndarray:
        """A linear form, whose parameters have been taken, at ``values`` (cells, n), or (functions, cells, n)."""
        return self._assembled(form, values, cuts, self._places(*cuts))

    def rigid(self, form: Assembler, values: np.ndarray, *cuts: int) -> np.ndarray:
        """A bilinear form times a change of one in all rotations and positions."""
        every = self._cells(*cuts).dofs
        moving = [rows.ravel() for name, rows in self.rows.items() if name in (self.fields.turning.name, "r")]
        chosen = np.where(np.isin(np.arange(every.shape[1]), np.concatenate(moving)), 0, -1)
        places = Places(every, np.zeros_like(every), np.broadcast_to(chosen, (len(every), 1, every.shape[1])))
        return self._assembled(form, values, cuts, places)

    def _assembler(self, form: Assembler, *cuts: int) -> Assembler:
        cells = self._cells(*cuts)
        load = int(cells.dofs[0, self.load])
        return Assembler(form.form, cells, self.equations.known.cut(*cuts), load, inside=True)

    def _assembled(self, form: Assembler, values: np.ndarray, cuts: tuple[int, ...], places: Places) -> np.ndarray:
        mine, bases = self._form(form, *cuts), self._bases(*cuts)
        sizes = [sum(cuts) * len(self.dofs) * rows.size for rows, _ in bases]
        out, whole = np.zeros(sum(sizes)), np.empty((sum(cuts), *self.dofs.shape))
        mine.constants = form.constants
        mine.add(np.array([self._cut_up(each, bases) for each in values.reshape(-1, *self.dofs.shape)]), places, out)
        for (rows, basis), part in zip(bases, np.split(out, np.cumsum(sizes)[:-1]), strict=True):
            shape = len(basis), -1, rows.shape[1]
            whole[..., rows] = (part.reshape(shape) @ basis).reshape(-1, len(self.dofs), *rows.shape)
        return whole

    def _cut_up(self, values: np.ndarray, bases: list[tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
        """Values at the nodes of all pieces, in their order, by those of a function (cells, n)."""
        parts = (values[:, rows].reshape(-1, rows.shape[1]) @ basis.swapaxes(1, 2) for rows, basis in bases)
        return np.concatenate([part.ravel() for part in parts])

    def _cut(self, *cuts: int) -> Cells:
        """All pieces: their values are by field, piece, cell and component, and those of the nodes side by side."""
        ends = np.concatenate([(np.arange(n)[:, None] + np.array([0.0, 1.0])) / n for n in cuts])
        first, size = self._x[:, :1], self._x[:, 1:] - self._x[:, :1]
        x = first + size * ends[:, None, :, None]
        dofs, known = np.empty((len(ends), *self.dofs.shape), dtype=np.int32), 0
        for rows, _ in self._bases(*cuts):
            shape = *dofs.shape[:2], *rows.shape
            dofs[..., rows] = np.arange(known, known := known + int(np.prod(shape)), dtype=np.int32).reshape(shape)
        return Cells(np.ascontiguousarray(x.reshape(-1, 2, 3)), dofs.reshape(-1, dofs.shape[-1]))

    def _tabulated(self, *cuts: int) -> list[tuple[np.ndarray, np.ndarray]]:
        """Of each field the rows (size, nodes), and its basis at the nodes of pieces, (pieces, nodes, nodes)."""
        out, scalar = list[tuple[np.ndarray, np.ndarray]](), np.ones(self.dofs.shape[1], dtype=bool)
        for x in self.fields.blocks:
            rows = self.rows[x.name].T
            out.append((rows, np.concatenate([compat.basis_on_pieces(x.degree, n) for n in cuts])))
            scalar[rows] = False
        return [*out, (np.flatnonzero(scalar)[:, None], np.ones((sum(cuts), 1, 1)))]


class QuadratureCheck:
    """Tells where the quadrature of a ``system`` does not integrate the equations in a state; collective."""

    def __init__(self, system: System) -> None:
        self.system, self._pieces = system, derived(system.equations, Pieces, lambda: Pieces(system.equations))
        names = (system.fields.turning.name, "v", "r")
        self._rows = {name: self._pieces.rows[name].ravel() for name in names if name in system.fields.dofs}

    def __call__(self, x: PETSc.Vec, share: int = 1) -> str:
        """Return a clause on where the equations are not integrated in a state ``x``; empty for nowhere.

        The composite rule has a ``share`` of its points where functions of arclength are known to be integrated.
        """
        number = max(LEAST, self._pieces.number // share)
        found = self._found(self.system.at(x), number)
        if not (every := [each for part in self.system.comm.allgather(found) for each in part]):
            return ""
        if share > 1:
            return self(x)
        _, (a, b, low, high) = max(every)
        return (
            f"the quadrature of the element from {a:.6g} to {b:.6g} does not integrate the equations about s = "
            f"{(low + high) / 2:.6g}, within {high - low:.1g}: no error is estimated; use breaks=(...) where a "
            "function jumps or has a kink, and shorter elements elsewhere."
        )

    def _found(self, state: State, number: int) -> list[tuple[float, Any]]:
        """Errors over what is allowed, and their places, by a composite rule with a ``number`` of points."""
        elements = self.system.fields.discretization.elements
        self.system.equations.take(state.line)
        values = [local[self._pieces.dofs] for local in (state.local, self._moved(state.local))]
        *coarse, fine = np.split(self._terms(values, 1, 2, 3, number), np.cumsum([1, 2, 3]), axis=1)
        true, size = fine.sum(axis=1), abs(fine).sum(axis=1)
        off = [terms.sum(axis=1) - true for terms in coarse]
        found = []
        for rows in self._rows.values():
            first, second, third, sizes = (abs(y[..., rows]).max(axis=2) for y in (*off, size))
            largest = self._largest(sizes)
            least = 1e-8 * largest + TINY  # is no error: equilibria are solved for to 1e-10
            # round-off of curvatures, relative to the residual in a strain of one, for each piece of the rod
            least[:2] += 100 * EPS * number * elements * largest[1] / MOTION[0]
            allowed = np.maximum(0.5**self._pieces.points * self._largest(first), least)
            for term, errors in enumerate(np.maximum(second, third) / allowed[:, None]):
                cell = int(errors.argmax())
                if errors[cell] > 1:
                    parts = fine[term, :, cell, rows].T
                    found.append((errors[cell], self._place(values, term, cell, rows, parts, least[term])))
        return found

    def kink(self, x: PETSc.Vec) -> str:
        """Return what has a kink at the very state ``x``, as next to a support to one side: the equations, or nothing.

        The changes of the residual in two opposite motions add up to what is proportional to the motion at a kink, and
        to its square elsewhere.  Where the residual jumps its changes are not proportional to the motion.
        """
        little, felt = 1e-3, 1e-6  # part of the motion in which a kink shows, least difference over the changes
        state, dofs = self.system.at(x), [self.system.fields.dofs[name] for name in self._rows]
        dofs += [copies for _, copies in self._positions()]
        here, motion = state.covector(), self._moved(state.local) - state.local

        def changes(size: float) -> list[np.ndarray]:
            # largest sum of the changes in two opposite motions, and largest change, by kind of row
            moved = (NodalValues(state.equations, state.local + by * motion, state.line) for by in (size, -size))
            ahead, back = (values.covector() - here for values in moved)
            return [self._largest([change[rows] for rows in dofs]) for change in (ahead + back, ahead)]

        (uneven, change), (more, larger) = changes(little), changes(4 * little)
        bent = (uneven > felt * change) & (abs(more - 4 * uneven) < uneven)
        return "equations" if (bent | (larger < 2 * change)).any() else ""

    def _positions(self) -> Iterator[tuple[int, np.ndarray]]:
        """Scalars that are positions: yields the component of each, and its degrees of freedom."""
        fields = self.system.fields
        for unknown, copies in zip(fields.unknown_scalars, fields.copies.T, strict=False):
            if not unknown.multiplier:
                yield unknown.component, copies

    def _largest(self, values: Iterable[np.ndarray]) -> np.ndarray:
        """Largest absolute value in each of some arrays, of all ranks."""
        mine, comm = np.array([abs(x).max() for x in values]), self.system.comm
        return mine if comm.size == 1 else np.max(comm.allgather(mine), axis=0)

    def _terms(self, values: list[np.ndarray], *cuts: int) -> np.ndarray:
        """What is compared: the residual, its change by the motion, inertia; (terms, pieces, cells, n)."""
        equations = self.system.equations
        first, moved = (self._pieces.vectors(equations.residual, x, *cuts) for x in values)
        if equations.even:
            return np.array([first, moved - first])
        return np.array([first, moved - first, self._pieces.rigid(equations.kinetic, values[0], *cuts)])

    def _moved(self, local: np.ndarray) -> np.ndarray:
        """Local values after a small motion, with no curvature at one place of the rod and no strain at another."""
        scene, fields, out = self.system.scene, self.system.fields, local.copy()
        for block in fields.blocks:
            dofs, t = fields.dofs[block.name], (fields.coordinates(block.degree) - scene.interval[0]) / scene.length
            if block.name == fields.turning.name:
                out[dofs] = fields.turning.turned(local[dofs], (t[..., None] - 0.382) ** 2 * MOTION)
            elif block.name in ("v", "r"):
                unit = scene.length if block.name == "r" else 1.0
                out[dofs] += unit * (t[..., None] - 0.618) * MOTION[: block.size]
        for component, copies in self._positions():
            out[copies] += scene.length * MOTION[component]
        for dofs in fields.out_of_plane(scene.normal).values():
            out[dofs] = local[dofs]
        return out

    def _place(
        self, values: list[np.ndarray], term: int, cell: int, rows: np.ndarray, fine: np.ndarray, least: float
    ) -> tuple[float, float, float, float]:
        """Ends of a cell, and of the smallest part of it that an error above the ``least`` comes from."""
        pieces, place = 1, 0
        while pieces < len(fine):
            halves = self._terms(values, 2 * pieces)[term, :, cell, rows].T
            errors = abs(halves - fine.reshape(2 * pieces, -1, len(rows)).sum(axis=1)).max(axis=1)
            if errors[2 * place : 2 * place + 2].max() <= least:
                break
            pieces, place = 2 * pieces, 2 * place + int(errors[2 * place : 2 * place + 2].argmax())
        a, b = self.system.fields.vertices[cell].tolist()
        low, high = (a + (b - a) * part / pieces for part in (place, place + 1))
        return (*sorted((a, b)), *sorted((low, high)))
