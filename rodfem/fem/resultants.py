r"""Strains, contact force and moment along a state, components along the directors.

Inside an element they follow from the strains.  A derivative of the rotation is most accurate at the Gauss points of as
many places as the degree, two orders more than at the ends of the element.  At these the equations themselves give the
force ``n`` and the moment ``m`` that the element hands on: for any variation ``theta`` of its rotation

    int (m . theta' - (r' x n) . theta - ...) ds = [m . theta],

so that the element's own part of the residual, at the rotation of its end, is ``m`` there, and at its position ``n``:
as accurate as the loads that the equations balance (Wheeler, Numer. Math. 21 (1973) 104-122).  They are equal in
neighbours, where nothing acts between them.  Force and moment are the polynomials through both.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import ufl
from numpy.polynomial import legendre
from petsc4py import PETSc

from rodfem.fem.quadrature_check import Pieces
from rodfem.fem.shape import Shape
from rodfem.problem.constraint import Constraint
from rodfem.problem.quaternions import directors, product
from rodfem.problem.roles import derived

NAMES = ("strain", "curvature", "force", "moment")
"""Of the fields, as files have them."""
AXES = np.eye(4)[1:]
"""Unit vectors as quaternions."""


class Resultants:
    """Evaluates strains, contact force and moment of the states of one system; collective over its ranks."""

    def __init__(self, shape: Shape) -> None:
        """Derive and compile them for the system of a ``shape``."""
        self.shape, count = shape, shape.system.fields.discretization.degree
        gauss = (legendre.leggauss(count)[0] + 1) / 2
        self.nodes = np.array([0.0, *gauss, 1.0])
        self.places = np.linspace(0.0, 1.0, count) if count > 1 else np.array([0.5])
        e = shape.system.equations
        self._evaluate = derived(e, "resultants", lambda: e.evaluated(ufl.as_vector(self._components()), self.nodes))
        self._pieces = derived(e, Pieces, lambda: Pieces(e))

    def at(self, x: PETSc.Vec) -> dict[str, np.ndarray]:
        """Components along the directors by their :data:`NAMES` at the state ``x``, (elements, points, 3) each.

        ``strain`` has ``v``, nondimensional, ``curvature`` ``k``, one over length, ``force`` ``n`` and ``moment``
        ``m``.  ``points`` (elements, points) has the arclengths: as many in each element as the degree of the rotation,
        at equal distances, ends included where there is more than one.  Strain and curvature jump from element to
        element, by as much as they are accurate.
        """
        points = self.shape.from_left(self.shape.start[:, None] + self.shape.size[:, None] * self.places)
        return {"points": points} | self._values(x, self.places)

    def _values(self, x: PETSc.Vec, places: np.ndarray) -> dict[str, np.ndarray]:
        """All fields at ``places`` (p,) in [0, 1] of each element from left to right, (elements, p, 3)."""
        values = self.shape.system.at(x).evaluate(self._evaluate)
        whole = self.shape.from_left(values.reshape(len(values), -1, len(NAMES), 3))
        for i, ends in enumerate(self.ends(x)):
            whole[:, [0, -1], 2 + i] = np.where(np.isfinite(ends), ends, whole[:, [0, -1], 2 + i])
        inside, every = _basis(self.nodes[1:-1], places), _basis(self.nodes, places)
        strains = np.einsum("pn,enij->epij", inside, whole[:, 1:-1, :2])
        forces = np.einsum("pn,enij->epij", every, whole[:, :, 2:])
        return dict(zip(NAMES, np.moveaxis(np.concatenate([strains, forces], axis=2), 2, 0), strict=True))

    def ends(self, x: PETSc.Vec) -> tuple[np.ndarray, np.ndarray]:
        """Contact force and moment at both ends of each element by its residual, (elements, 2, 3); nan: not known.

        Of a planar rod the components in the plane and about its normal are; without a centreline no force is.
        """
        system, pieces, order = self.shape.system, self._pieces, self.shape.order[[0, -1]]
        fields, state, outwards = system.fields, system.at(x), np.array([-1.0, 1.0])[:, None]
        system.equations.take(state.line)
        local = state.local[pieces.dofs]
        residual = pieces.vectors(system.equations.residual, local, 1)[0]
        rows = pieces.rows[fields.turning.name][order]
        q = fields.turning.quaternion(local[:, rows])
        weights = fields.turning.functional(local[:, rows], residual[:, rows])
        turned = product(q[..., None, :], AXES)  # changes of q, doubled, with turns about the directors
        moment = outwards * np.einsum("ceij,cej->cei", turned, weights) / 2
        if (normal := system.scene.normal) is not None:
            moment[..., [i for i in range(3) if i != normal]] = np.nan
        force = np.full(moment.shape, np.nan)
        if "r" in pieces.rows:
            across = outwards * residual[:, pieces.rows["r"][order]]
            force = np.einsum("ceij,cei->cej", directors(q), across)
        return self.shape.from_left(force), self.shape.from_left(moment)

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


def _basis(nodes: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Values of the Lagrange polynomials of ``nodes`` (n,) at ``places`` (p,), both in [0, 1]: (p, n)."""
    values, own = (legendre.legvander(2 * x - 1, len(nodes) - 1) for x in (places, nodes))
    return np.asarray(values @ np.linalg.inv(own))
