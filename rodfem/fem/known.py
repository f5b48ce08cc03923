r"""What the compiled forms read in addition to the unknown: numbers, tables along the rod, and paths of the load.

A number in Python that a scene's functions have in them is part of the text of a form, ``0.617 * k1**2``, and each
other number would be compiled anew.  As a constant it is a value that the compiled form reads.

Tables and paths are values of one discontinuous function, of which a cell has its own.  A table ``f`` along the rod is
its projection on polynomials on each element, of the degree ``p`` for which the rule of the element has ``p + 1``
points::

    int (f - f_h) P_j ds = 0,    P_j the Legendre polynomials of the element, j = 0 ... p,

by a rule on each piece of the table.  The rule of the element is exact for ``f_h P_j`` as well: whatever has degree
``p`` or less is integrated against all rows of the table, also where these are many in an element.  The error is of
second order in what polynomials miss of ``f``.

A path of the load is one cubic between two rows.  Its coefficients are the values that a cell has, and what assembles a
form lays there those of the piece in which the load is: derivatives with respect to the load are UFL's.
"""

from __future__ import annotations

from copy import copy
from functools import cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import ufl
from dolfinx import fem
from numpy.polynomial import legendre

from rodfem import compat
from rodfem.expressions import Expr, FloatValue, MultiFunction, PositiveRestricted, map_integrand_dags, parts
from rodfem.problem.table import Entry, Table
from rodfem.tolerances import TINY

if TYPE_CHECKING:
    from rodfem.fem.fields import Fields
    from rodfem.fem.state import Line

KEPT = {sign * value for sign in (-1.0, 1.0) for value in (0.25, 0.5, 1.0, 2.0, 3.0, 4.0)}
"""Numbers that belong to formulas, as the half of an energy."""


class TableFunctions:
    """Tables of a scene as a dolfinx Function, None if it has no table.

    ``along`` are values of the ``tables`` along the rod in each local cell, (cells, values), in the order in which a
    cell has them.  Of each of the ``paths``, with the name of its constant, ``rows`` say where its pieces begin, and
    have their coefficients, (pieces, size), and ``lines`` (paths, 2) its constant at zero load, and the slope in the
    load.
    """

    name = "known"
    """Name of the function, by which compiled forms have it."""

    def __init__(self, fields: Fields, degree: int) -> None:
        self._fields, self._degree = fields, degree
        self.function: Any = None
        found, cells = fields.scene.tables, len(fields.vertices)
        self.tables = list(dict.fromkeys(table for table, name in found if name == "s"))
        self.paths = [(table, name) for table, name in found if name != "s"]
        self.names: dict[Any, str] = {}
        self.lines = np.zeros((len(self.paths), 2))
        self.rows = [np.hstack([t.knots[:-1, None], t.pieces.reshape(len(t.pieces), -1)]) for t, _ in self.paths]
        self.along, self._dofs = np.zeros((cells, 0)), np.zeros((cells, 0), dtype=int)
        if found:
            self._make(cells)

    def _make(self, cells: int) -> None:
        """Make the function and its components, with the tables along the rod in it."""
        sizes = sum(len(t.rows[0]) for t in self.tables), sum(rows.shape[1] for rows in self.rows)
        parts = [(False, d, size) for d, size in zip((self._degree, 0), sizes, strict=True) if size]
        space = compat.mixed_space(self._fields.mesh, parts)
        self.function = fem.Function(space, name=self.name, dtype=compat.REAL)
        self._dofs = compat.cell_dofs(space, cells)
        self._values = []
        for part, (_, _, size) in zip(ufl.split(self.function), parts, strict=True):
            self._values += [part] if size == 1 else [part[i] for i in range(size)]
        if self.tables:
            self.along = np.array([self._at_nodes(a, b, self._degree) for a, b in self._fields.vertices.tolist()])
        self.function.x.array[self._dofs[:, : self.along.shape[1]]] = self.along

    def rough(self) -> str:
        """Sentence on a table that varies within elements as the error bar's halves do not see it; empty for none."""
        vertices, k = self._fields.all_vertices, self._fields.discretization.degree
        halves = np.sort(np.concatenate([vertices, (vertices[1:] + vertices[:-1]) / 2]))
        for table in self.tables:
            size = np.ptp(vertices) * (table.rows**2).mean()
            meshes = (vertices, k - 1), (halves, k)
            own, left = (sum(_moments(table, a, b, p)[1] for a, b in pairwise(x)) / size for x, p in meshes)
            if left > max(own / 4, 1e-11):  # of the square of the table: less need not be seen
                return (
                    f"The {table.what} varies by {left**0.5:.1g} of its size within the elements of the error bar: a "
                    f"stiffness that does so changes loads by about {left:.0e} of themselves, which no bar holds; give "
                    "the Discretization vertices at its rows, or more elements, or the table means of several rows."
                )
        return ""

    def cut(self, *cuts: int) -> TableFunctions:
        """The same on equal pieces of this rank's elements, those of the first piece of all elements before others."""
        out, own = copy(self), self.along[: self._fields.owned_cells]
        values = own.reshape(len(own), self._degree + 1, -1)
        cut = np.concatenate([compat.basis_on_pieces(self._degree, n) for n in cuts])[:, None] @ values
        out.along = cut.reshape(sum(cuts) * len(values), -1)
        return out

    def _at_nodes(self, a: float, b: float, p: int) -> np.ndarray:
        """Values of all tables at the nodes of an element from ``a`` to ``b``, which may be the left one."""
        polynomials = legendre.legvander((2 * compat.nodes(p) - 1) * np.sign(b - a), p)
        return np.hstack([polynomials @ _bounded(t, min(a, b), max(a, b), p) for t in self.tables]).ravel()

    def take(self, line: Line) -> None:
        """Let the constants of paths be those of a ``line``."""
        for i, (_, name) in enumerate(self.paths):
            number = list(line.scene.parameters).index(name)
            self.lines[i] = line.origin[number], line.direction[number]

    def lay(self, load: float) -> None:
        """Put the pieces of paths at a ``load`` where dolfinx reads them."""
        if self.function is not None and self.paths:
            places = self.lines @ (1.0, load)
            pieces = [rows[path.piece(t)] for rows, (path, _), t in zip(self.rows, self.paths, places, strict=True)]
            self.function.x.array[self._dofs[:, self.along.shape[1] :]] = np.concatenate(pieces)

    def value(self, entry: Entry) -> Any:
        """Expression of the function that an ``entry`` stands for."""
        at, place, m = entry.ufl_operands[0], 0, len(entry.table.rows[0])
        for table, name in [*((table, "s") for table in self.tables), *self.paths]:
            size = len(table.rows[0]) * (1 if name == "s" else 4) + (name != "s")
            if table is entry.table and name == self.names[at]:
                break
            place += size
        values = self._values[place : place + size]
        if name == "s":
            return values[entry.number]
        if any(isinstance(node, PositiveRestricted) for node in parts(at)):
            values = [value("+") for value in values]
        t, (a, b, c, d) = at - values[0], values[1 + entry.number :: m]
        return a + t * (b + t * (c + t * d))


def _knots(table: Table, a: float, b: float) -> np.ndarray:
    """Knots of a table on an element, and its ends."""
    return np.array([a, *table.knots[(table.knots > a) & (table.knots < b)], b])


def _bounded(table: Table, a: float, b: float, p: int) -> np.ndarray:
    """Legendre coefficients (p + 1, m) of a table on an element, drawn to its mean as far as they leave its range.

    A stiffness stays positive, whatever it does within an element (Zhang and Shu, J. Comput. Phys. 229 (2010)).
    """
    coefficients, _ = _moments(table, a, b, p)
    rows = table.at(_knots(table, a, b))
    off = legendre.legvander(np.linspace(-1.0, 1.0, 50), p)[:, 1:] @ coefficients[1:]
    for sign in (-1.0, 1.0):
        most, bound = (sign * off).max(axis=0, initial=TINY), (sign * rows).max(axis=0)
        room = bound + 0.1 * abs(bound) - sign * coefficients[0]  # a tenth beyond a bound
        coefficients[1:] *= np.clip(room / most, 0.0, 1.0)
    return coefficients


def _moments(table: Table, a: float, b: float, p: int) -> tuple[np.ndarray, float]:
    """Legendre coefficients (p + 1, m) of a table on an element, and the integral of the square of what they miss."""
    ends = _knots(table, a, b)
    # exact for cubics times the polynomials
    x, w = legendre.leggauss(p // 2 + 3)
    half = np.diff(ends)[:, None] / 2
    s, weights = (ends[:-1, None] + half * (1 + x)).ravel(), (half * w).ravel()
    basis, values = legendre.legvander((2 * s - a - b) / (b - a), p), table.at(s)
    coefficients = (2 * np.arange(p + 1)[:, None] + 1) * ((basis * weights[:, None]).T @ values) / (b - a)
    return coefficients, float(weights @ ((values - basis @ coefficients) ** 2).sum(axis=1))


def readable(form: Any, mesh: Any, known: TableFunctions | None = None) -> Any:
    """Return a form, or an expression, with what is ``known`` for tables, and constants on ``mesh`` for its numbers."""
    if not isinstance(form, (ufl.Form, Expr)):
        return form
    if known is None or known.function is None:  # to look for numbers takes a third of the time of a map
        wholes = [x.integrand() for x in form.integrals()] if isinstance(form, ufl.Form) else [form]
        if all(float(x) in KEPT for whole in wholes for x in parts(whole) if isinstance(x, FloatValue)):
            return form
    return map_integrand_dags(_Readable(mesh, known), form, compress=False)


class _Readable(MultiFunction):
    """Maps entries of tables to what is ``known`` of them, and numbers to constants, one for each value."""

    expr = MultiFunction.reuse_if_untouched

    def __init__(self, mesh: Any, known: TableFunctions | None) -> None:
        super().__init__()
        self.known, self.constant = known, cache(lambda value: fem.Constant(mesh, value))

    def variable(self, o: Any, at: Any, label: Any) -> Any:
        if self.known is not None and isinstance(o, Entry):
            return self.known.value(o)
        return self.reuse_if_untouched(o, at, label)

    def float_value(self, number: Any) -> Any:
        return number if float(number) in KEPT else self.constant(float(number))

    def power(self, o: Any, base: Any, exponent: Any) -> Any:
        """Keep an exponent, by which UFL differentiates, as it is."""
        given = o.ufl_operands[1]
        return self.reuse_if_untouched(o, base, given if isinstance(given, FloatValue) else exponent)

    def bessel_function(self, o: Any, order: Any, argument: Any) -> Any:
        """Keep the order, too."""
        return self.reuse_if_untouched(o, o.ufl_operands[0], argument)
