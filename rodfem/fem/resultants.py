r"""Strains, contact force and contact moment of a state, element by element.

Both follow from the density ``L(r, r', R, k, ...)`` of the Lagrangian of the rod and its constraints, without loads::

    n = dL/dr',        m_i = dL/dk_i.

Of a rod without constraints along it ``n`` is the multiplier of ``r' = R v``, and ``m_i = dW/dk_i``: see
:mod:`rodfem.forms.lagrangian`.  A constraint along the rod, or of an integral over it, adds its reactions: ``n`` and
``m`` are those of the balances of force and moment, not of the stored energy alone.  Like the strains ``v`` and ``k``
they are given along the directors (Antman, Nonlinear Problems of Elasticity, 2005, chapter 8).
"""

from __future__ import annotations

from typing import Any

import numpy as np
import ufl
from petsc4py import PETSc

from rodfem.fem.shape import Shape
from rodfem.problem.constraint import Constraint
from rodfem.problem.roles import derived

NAMES = ("strain", "curvature", "force", "moment")
"""Of the fields, as files have them."""


class Resultants:
    """Evaluates strains, contact force and moment of the states of one system; collective over its ranks."""

    def __init__(self, shape: Shape) -> None:
        """Derive and compile them for the system of a ``shape``."""
        self.shape, count = shape, shape.system.fields.discretization.degree
        self.places = np.linspace(0.0, 1.0, count) if count > 1 else np.array([0.5])
        e = shape.system.equations
        self._evaluate = derived(e, "resultants", lambda: e.evaluated(ufl.as_vector(self._components()), self.places))

    def at(self, x: PETSc.Vec) -> dict[str, np.ndarray]:
        """Components along the directors by their :data:`NAMES` at the state ``x``, (elements, points, 3) each.

        ``strain`` has ``v``, nondimensional, ``curvature`` ``k``, one over length, ``force`` ``n`` and ``moment``
        ``m``.  ``points`` (elements, points) has the arclengths: as many in each element as the degree of the rotation,
        at equal distances, ends included where there is more than one.  The derivative of the rotation jumps from
        element to element, by as much as it is accurate.
        """
        values = self.shape.system.at(x).evaluate(self._evaluate)
        whole = self.shape.from_left(values.reshape(len(values), -1, len(NAMES), 3))
        points = self.shape.from_left(self.shape.start[:, None] + self.shape.size[:, None] * self.places)
        return {"points": points} | {name: whole[:, :, i] for i, name in enumerate(NAMES)}

    def _components(self) -> list[Any]:
        """Strain, curvature, force and moment as expressions of the state, one after the other."""
        e, fields, scene = self.shape.system.equations, self.shape.system.fields, self.shape.system.scene
        f, c, along = e.unknowns, e.constants, e.along(ufl.variable)
        density = scene.energy(along.v, along.k, c)
        for part in scene.parts:
            if isinstance(part.of, Constraint) and part.s is None:
                site, _ = e.site(part, f, (f, f), along)
                density += sum(part.of.lagrangian(site))
        force = ufl.as_vector(fields.formulation.contact_force(e, f, c))
        if "dr" in vars(along):
            force += ufl.diff(density, along.dr)
        force, moment = ufl.dot(ufl.transpose(along.R), force), ufl.diff(density, along.k)
        return [vector[i] for vector in (along.v, along.k, force, moment) for i in range(3)]
