"""Variational problems of one angle along a rod, by hand: UFL forms become small dense arrays of numpy.

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

ELEMENTS, DEGREE = 8, 4
"""Discretisation of an angle."""
LATEST = 32
"""Number of forms whose compiled code is kept."""


def angle(a: float = 0.0, b: float = 1.0) -> fem.Function:
    """Angle of a rod from arclength ``a`` to ``b``: a continuous field, zero to begin with.

    Its nodal values are ``theta.x.array`` of shape (n,).
    """
    mesh = compat.interval_mesh(MPI.COMM_SELF, ELEMENTS, a, b)
    space, _ = compat.mixed_space(mesh, [(True, DEGREE, 1)]).sub(0).collapse()
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
    return compat.compile_forms([form])[0]
