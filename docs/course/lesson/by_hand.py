"""Variational problems of one field or a few along a rod, by hand: UFL forms become small dense arrays of numpy.

Each rank has the whole rod.  A lesson states an energy, differentiates it with :func:`ufl.derivative`, and does the
linear algebra itself.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from mpi4py import MPI
from numpy.typing import NDArray

from rodfem import compat
from rodfem.fem import form_compiler

ELEMENTS, DEGREE = 8, 4
"""Discretisation of an angle."""
LATEST = 32
"""Number of forms whose compiled code is kept."""


def angle(a: float = 0.0, b: float = 1.0, elements: int = ELEMENTS, degree: int = DEGREE) -> fem.Function:
    """Angle of a rod from arclength ``a`` to ``b``: a continuous field, zero to begin with.

    On so many ``elements`` of a ``degree``.  Its nodal values are ``theta.x.array`` of shape (n,).
    """
    mesh = compat.interval_mesh(MPI.COMM_SELF, elements, a, b)
    space, _ = compat.mixed_space(mesh, [(True, degree, 1)]).sub(0).collapse()
    return fem.Function(space, dtype=compat.REAL)


def constant(theta: fem.Function, value: float) -> fem.Constant:
    """Number in the forms of ``theta`` that can be changed: ``P.value = 2.0``."""
    return fem.Constant(theta.function_space.mesh, compat.REAL(value))


def nodes(theta: fem.Function) -> NDArray[np.float64]:
    """Arclengths of the nodes, in the order of the nodal values: (n,)."""
    return np.asarray(theta.function_space.tabulate_dof_coordinates())[:, 0]


def assemble(form: ufl.Form) -> Any:
    """Numbers of a form: a float for an energy, (n,) for its first variation, (n, n) for its second."""
    compiled, rank = _compiled(form), len(form.arguments())
    if rank == 0:
        return float(fem.assemble_scalar(compiled))
    return np.array(fem.assemble_vector(compiled).array) if rank == 1 else compat.local_table(compiled).toarray()


@lru_cache(maxsize=LATEST)
def _compiled(form: ufl.Form) -> Any:
    """Compiled form, which reads its functions and constants when it is assembled."""
    return form_compiler.compile_forms([form])[0]


def fields(number: int, a: float = 0.0, b: float = 1.0) -> tuple[fem.Function, NDArray[np.int32]]:
    """Several fields along a rod from ``a`` to ``b``, and the numbers of their nodal values: (number, n).

    They are ``u[0]``, ``u[1]``, ... in forms. ``u.x.array[at[i]]`` has the values of field i at :func:`arclengths`.
    """
    mesh = compat.interval_mesh(MPI.COMM_SELF, ELEMENTS, a, b)
    space = compat.mixed_space(mesh, [(True, DEGREE, number)])
    at = []
    for i in range(number):
        part, numbers = space.sub(0).sub(i).collapse()
        inside = np.ravel(numbers).astype(np.int32)  # in newer releases a list of one array
        s = np.asarray(part.tabulate_dof_coordinates())[:, 0]
        at.append(inside[np.argsort(s)])
    return fem.Function(space, dtype=compat.REAL), np.array(at)


def arclengths(a: float = 0.0, b: float = 1.0) -> NDArray[np.float64]:
    """Arclengths of the nodes of :func:`fields`, in the order of the rod: (n,)."""
    return np.sort(nodes(angle(a, b)))


def spins(q: fem.Function, at: NDArray[np.int32]) -> NDArray[np.float64]:
    """Changes ``theta q / 2`` of a field ``q`` of quaternions with the spins ``theta`` of its inner nodes, as columns.

    ``at`` is that of :func:`fields`.  Shape (4 n, 3 (n - 2)): both ends are held.
    """
    a, b, c, d = q.x.array[at]
    changes = np.array([[-b, a, -d, c], [-c, d, a, -b], [-d, -c, b, a]]) / 2
    nodes = np.arange(at.shape[1])
    T = np.zeros((at.size, 3, nodes.size))
    for axis, change in enumerate(changes):
        T[at, axis, nodes] = change
    return T[:, :, 1:-1].reshape(at.size, -1)
