"""Stability in space of the states of a planar rod."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from petsc4py import PETSc

from rodfem.errors import SceneError
from rodfem.stability.inertia import Index, Inertia
from rodfem.system import System


class InSpace:
    """Counts the index of planar states among all perturbations in space.

    The same fields and forms serve: a planar rod only does without the numbers of what would leave its plane.
    """

    def __init__(self, planar: System) -> None:
        """Allocate the system of the same rod in space; raises :class:`SceneError` where its loads leave the plane."""
        self.planar = planar
        scene = replace(planar.scene, planar=None)
        fields = planar.fields
        self.system = System(scene, fields.discretization, planar.comm, planar.clock, fields.mesh)
        self.inertia = Inertia(self.system)

    def lift(self, x: PETSc.Vec) -> PETSc.Vec:
        """State in space of the planar state ``x``."""
        self.planar.bring(x)
        old, new = self.planar.fields, self.system.fields
        new.u.x.array[:] = 0.0
        for name, dofs in old.dofs.items():
            new.u.x.array[new.dofs[name]] = old.u.x.array[dofs]
        places = {u.name: i for i, u in enumerate(new.unknown_scalars)}
        for i, unknown in enumerate(old.unknown_scalars):
            if unknown.name in places:
                new.u.x.array[new.copies[:, places[unknown.name]]] = old.u.x.array[old.copies[:, i]]
        new.u.x.array[new.copies[:, -1]] = old.u.x.array[old.copies[:, -1]]
        return self.system.take()

    def count(self, x: PETSc.Vec) -> Index:
        """Index in space of the planar equilibrium ``x``; raises :class:`SceneError` where it is none in space."""
        state = self.lift(x)
        self.system.set_phase(state)
        residual, scale = self.system.new_vector(), self.planar.new_vector()
        self.system.residual(state, residual)
        self.planar.residual(x, scale)
        out = residual.norm()
        if out > 1e-6 * max(1.0, np.sqrt(self.system.fields.unknowns)) and out > 1e3 * scale.norm():
            raise SceneError(
                f"A force or moment pushes the rod out of its plane across {self.planar.scene.planar}: "
                "leave planar out of the scene."
            )
        return self.inertia.count(state)
