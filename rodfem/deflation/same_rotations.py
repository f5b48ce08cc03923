"""Other unknowns for the same rod: quaternions of the opposite sign, angles of a planar rod a full turn apart.

``q`` and ``-q`` are one rotation, and so are an angle and that angle and ``2 pi``.  An end at which one of them is
given tells them apart all along the rod.  Where nothing holds a rotation both solve the equations, and are one state.
"""

from __future__ import annotations

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from rodfem.fem.system import System

TURNS = 2 * np.pi * np.array([1.0, -1.0, 2.0, -2.0])
"""By how much the angles of equal states of a planar rod may differ: a search winds it up no farther."""


def same_rotations(system: System, x: PETSc.Vec) -> list[PETSc.Vec]:
    """States of other unknowns, but of the rotations of ``x``, that the ``system`` has; none of a closed rod.

    Angles of a planar rod are one or two turns to either side.
    """
    f, state = system.fields, system.at(x)
    field = "angle" if "angle" in f.dofs else "q"
    held = bool((f.number[f.dofs[field]] < 0).any())
    if system.scene.closed or system.comm.allreduce(held, op=MPI.LOR):
        return []
    values = state.named[field]
    others = [-values] if field == "q" else [values + turn for turn in TURNS]
    out = [system.vector(f.filled(state.named | state.scalars | {field: other}), state.drifts) for other in others]
    for image in out:
        system.set_load(image, system.scalar(x))
    return out
