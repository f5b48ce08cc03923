"""A state at many places along the rod, as values of the symbols of a local state."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.polynomial import legendre
from petsc4py import PETSc

from rodfem import compat
from rodfem.fem.fields import LOAD
from rodfem.fem.shape import Shape
from rodfem.problem.pointwise import LocalState, Places


class StateAlong:
    """State ``x`` of the system of a ``shape``, from which the values of ``symbols`` are taken; on every rank alike.

    Attributes
    ----------
    ends
        Ends of the elements from left to right.
    degree
        Degree of the elements.
    """

    def __init__(self, shape: Shape, x: PETSc.Vec, symbols: LocalState) -> None:
        """Gather the state; collective."""
        self._sample, self._symbols = shape.sample(x), symbols
        self._constants = vars(shape.system.line.constants(float(self._sample[LOAD])))
        self.elements = int(self._sample["elements"])
        self.degree = (len(self._sample["s"]) - 1) // self.elements
        self.ends: np.ndarray = np.asarray(self._sample["s"][:: self.degree])

    def __call__(self, t: np.ndarray, first: int = 0, last: int | None = None) -> Places:
        """Values at places ``t`` in [0, 1] of the elements from ``first`` to before ``last``: (elements * places,)."""
        last, sample, at = self.elements if last is None else last, self._sample, self._symbols
        cells = np.arange(first, last)[:, None] * self.degree + np.arange(self.degree + 1)
        ends = self.ends[first : last + 1]
        size = np.diff(ends)[:, None]
        values, slopes = _basis(self.degree, t)
        q, r = np.asarray(sample["q"])[cells], np.asarray(sample["r"])[cells]
        out = {at.s: (ends[:-1, None] + size * t).ravel()}
        out |= {symbol: np.full(len(out[at.s]), self._constants[name]) for name, symbol in at.parameters.items()}
        turned = _named(at.q, np.einsum("tn,eni->iet", values, q))
        out |= turned | at.curvatures(turned, (np.einsum("tn,eni->iet", slopes, q) / size).reshape(4, -1))
        out |= _named(at.r, np.einsum("tn,eni->iet", values, r))
        if at.v:
            strains, _ = _basis(self.degree - 1, t)
            out |= _named(at.v, np.einsum("tn,eni->iet", strains, np.asarray(sample["v"])[first:last]))
        return out


def _named(symbols: list[Any], values: np.ndarray) -> Places:
    return dict(zip(symbols, values.reshape(len(symbols), -1), strict=True))


def _basis(degree: int, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Values and slopes of the polynomials of the nodes, from left to right, at places of an element: (t, nodes)."""
    powers = np.linalg.inv(legendre.legvander(2 * np.sort(compat.nodes(degree)) - 1, degree))
    slopes = 2 * legendre.legder(powers, axis=0) if degree else np.zeros_like(powers)
    return legendre.legval(2 * t - 1, powers).T, legendre.legval(2 * t - 1, slopes).T
