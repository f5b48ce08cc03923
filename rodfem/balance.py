r"""Why a rod has no equilibrium at a load: loads that move it as a whole, in a way that nothing holds.

The equations ``F(x)`` are orthogonal to every motion at an equilibrium.  A rigid motion ``g`` strains nothing, so that
``g.F`` is the work of the loads alone, but for the sign: their resultant in a direction or about an axis, at the state
``x``, which no deformation has to have changed.  Where the supports leave ``g`` free it must vanish.
"""

from __future__ import annotations

import numpy as np
from petsc4py import PETSc

from forms.symmetry import AXES, cross, left
from rodfem.continuation import Equilibria
from rodfem.fields import LOAD
from rodfem.symmetries import add_change

BALANCED = 1e-8
"""Resultants smaller than this, of what bends the rod to its own length, are round-off."""
FREE = 1e-10
"""Motion of what is held, relative, below which a motion is free."""


def no_equilibrium(solver: Equilibria, x: PETSc.Vec, load: float) -> str:
    """Say that there is none at ``load``, found from ``x``, and why if the loads are not balanced."""
    name = f"{solver.system.scene.load} = {load:g}"
    moved = unbalanced(solver, x, load)
    if moved:
        return f"There is no equilibrium at {name}: {moved}: balance the loads, or hold an end against that."
    return f"No equilibrium at {name}: use a smaller range."


def unbalanced(solver: Equilibria, x: PETSc.Vec, load: float) -> str:
    """How the loads move the rod at ``x`` as a whole where nothing holds it, in words; empty where they do not."""
    system, fields = solver.system, solver.system.fields
    if "r" not in fields.dofs:
        return ""
    x = x.copy()
    system.set_load(x, load)
    system.set_phase(None)
    residual = system.new_vector()
    system.residual(x, residual)
    motions, names, held, reactions = _rigid_motions(solver), [], [], []
    work = np.zeros(len(motions))
    u = fields.u.x.array
    for i, (name, change) in enumerate(motions):
        names.append(name)
        held.append(float(system.comm.allreduce((change[fields.number < 0] ** 2).sum())))
        state = u.copy()
        u[:] = change
        motion = system.take()
        u[:] = state
        work[i] = -np.real(motion.dot(residual))
        image = system.jacobian(solver.axis) * motion
        scalars = [n for n in system.scalars if n != LOAD and not n.startswith("drift")]
        reactions.append(sum(abs(system.scalar(image, n)) for n in scalars))
    free = [i for i in range(len(motions)) if held[i] < FREE and reactions[i] < FREE]
    scale = float(np.linalg.eigvalsh(system.scene.stiffness()[-3:, -3:])[0]) / system.scene.length
    worst = max(free, key=lambda i: abs(work[i]), default=None)
    if worst is None or abs(work[worst]) < BALANCED * scale:
        return ""
    return f"the loads {names[worst]} {work[worst]:.4g}, and no support resists"


def _rigid_motions(solver: Equilibria) -> list[tuple[str, np.ndarray]]:
    """Words, and changes (local values) of the state last brought, of translations and rotations of the whole rod."""
    fields, out = solver.system.fields, []
    for i, axis in enumerate(AXES):
        change = np.zeros(len(fields.u.x.array))
        add_change(fields, "r", np.zeros((3, 3)), np.array(axis), change)
        out.append((f"push the whole rod along e{i + 1} with a force of", change))
        change = np.zeros(len(fields.u.x.array))
        add_change(fields, "r", np.array(cross(axis)), np.zeros(3), change)
        if fields.scene.normal is None:
            add_change(fields, "q", np.array(left(axis)), np.zeros(4), change)
        elif fields.scene.normal == i:
            add_change(fields, "angle", np.zeros((1, 1)), np.ones(1), change)
        else:
            continue
        out.append((f"turn the whole rod about e{i + 1} with a moment of", change))
    return out
