r"""Strains, contact force and moment along a state, components along the directors, and reactions.

Inside an element they follow from the strains.  A derivative of the rotation is most accurate at the Gauss points of as
many places as the degree, two orders more than at the ends of the element.  At these the equations themselves give the
force ``n`` and the moment ``m`` that the element hands on: for any variation ``theta`` of its rotation

    int (m . theta' - (r' x n) . theta - ...) ds = [m . theta],

so that the element's own part of the residual, at the rotation of its end, is ``m`` there, and at its position ``n``:
as accurate as the loads that the equations balance (Wheeler, Numer. Math. 21 (1973) 104-122).  They are equal in
neighbours, where nothing acts between them.  Force and moment are the polynomials through both.

With ``V`` the potential energy of rod and loads the support of an end does the work ``dV`` in a motion of that end: a
force ``dV/dr``, a moment ``dV/dtheta``.  Multipliers of hinges and guides act for the support, and are left out of
``V``.  These are rows of the discrete equations that are not solved, because the end is held: they are as accurate as
those that are.  Loads at the end, springs there too, are part of ``V``.

On a surface (:class:`~rodfem.problem.contribution.Surface`) the residual has the multiplier of ``r' = R v`` for the
force, to which that of the surface is added; what the surface does to an end of the rod is part of the reaction there.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import ufl
from numpy.polynomial import legendre
from petsc4py import PETSc

from rodfem.fem.checks import Pieces
from rodfem.fem.state import NodalValues
from rodfem.problem.contribution import Constraint
from rodfem.problem.functions import LETTERS, derived
from rodfem.problem.quaternions import directors, product
from rodfem.tolerances import SAME_PLACE

if TYPE_CHECKING:
    from rodfem.fem.shape import Shape

NAMES = ("strain", "curvature", "force", "moment")
"""Of the fields, as files have them."""


@dataclass(frozen=True)
class Profile:
    """An equilibrium along the rod, at m arclengths ``s`` (m,).

    ``r`` is the centreline, components in space (m, 3), ``directors`` d1, d2, d3 as rows (m, 3, 3).  All others are
    components along the directors (m, 3): ``strain`` ``v``, nondimensional, ``curvature`` ``k``, one over length, and
    the contact ``force`` ``n`` and ``moment`` ``m`` by which what is beyond s acts.
    """

    s: np.ndarray
    r: np.ndarray
    directors: np.ndarray
    strain: np.ndarray
    curvature: np.ndarray
    force: np.ndarray
    moment: np.ndarray

    @property
    def force_in_space(self) -> np.ndarray:
        """Contact force, components in space (m, 3)."""
        return self.in_space(self.force)

    @property
    def moment_in_space(self) -> np.ndarray:
        """Contact moment, components in space (m, 3)."""
        return self.in_space(self.moment)

    def in_space(self, components: np.ndarray) -> np.ndarray:
        """Components in space of vectors (m, 3) along the directors."""
        return np.asarray(np.einsum("sij,si->sj", self.directors, components))

    def __repr__(self) -> str:
        return f"<Profile at {len(self.s)} arclengths from {self.s[0]:.6g} to {self.s[-1]:.6g}>"


class Resultants:
    r"""Evaluates strains, contact force and moment of the states of one system; collective over its ranks.

    Inside an element both follow from the density ``L(r, r', R, k, ...)`` of the Lagrangian of the rod and its
    constraints, without loads::

        n = dL/dr',        m_i = dL/dk_i.

    Of a rod without constraints along it ``n`` is the multiplier of ``r' = R v``, and ``m_i = dW/dk_i``: see
    :mod:`rodfem.forms.lagrangian`.  A constraint along the rod, or of an integral over it, adds its reactions: ``n``
    and ``m`` are those of the balances of force and moment, not of the stored energy alone (Antman, Nonlinear Problems
    of Elasticity, 2005, chapter 8).
    """

    def __init__(self, shape: Shape) -> None:
        self.shape, count = shape, shape.system.fields.discretization.degree
        gauss = (legendre.leggauss(count)[0] + 1) / 2
        self.nodes = np.array([0.0, *gauss, 1.0])
        self.places = np.linspace(0.0, 1.0, count) if count > 1 else np.array([0.5])
        e = shape.system.equations
        self._evaluate = derived(e, "resultants", lambda: e.evaluated(ufl.as_vector(self._components()), self.nodes))
        self._pieces = derived(e, Pieces, lambda: Pieces(e))

    def at(self, x: PETSc.Vec) -> dict[str, np.ndarray]:
        """Fields by their :data:`NAMES` at the state ``x``, (elements, points, 3) each, as a :class:`Profile` has them.

        ``points`` (elements, points) has the arclengths, as many in each element as the degree of the rotation, at
        equal distances. Strain and curvature jump from element to element, by as much as they are accurate.
        """
        points = self.shape.from_left(self.shape.start[:, None] + self.shape.size[:, None] * self.places)
        elements = np.repeat(np.arange(len(points)), points.shape[1])
        found = self.on_elements(x, points.ravel(), elements[None])
        return {"points": points} | {name: getattr(found, name).reshape(*points.shape, 3) for name in NAMES}

    def profile(self, x: PETSc.Vec, s: np.ndarray | None = None) -> Profile:
        """Shape, strains, force and moment at the state ``x``, at the nodes or at arclengths ``s`` (m,).

        Where two elements meet it is the mean of both: force and moment have half of what acts there.
        """
        s = self.shape.sample(x)["s"] if s is None else np.asarray(s, dtype=float)
        return self.on_elements(x, s, self._elements(s))

    def _elements(self, s: np.ndarray) -> np.ndarray:
        """Elements (2, m) to the left and to the right of arclengths."""
        starts = self.shape.from_left(self.shape.start)
        return np.array([np.clip(np.searchsorted(starts, s, side) - 1, 0, None) for side in ("left", "right")])

    def _mean(self, nodes: np.ndarray, table: np.ndarray, s: np.ndarray, elements: np.ndarray) -> np.ndarray:
        """Mean of what the polynomials of ``elements`` (k, m) through a ``table`` at their ``nodes`` are at ``s``."""
        start, size = (self.shape.from_left(y) for y in (self.shape.start, self.shape.size))
        each = [np.einsum("mn,mnij->mij", _basis(nodes, (s - start[e]) / size[e]), table[e]) for e in elements]
        return np.asarray(np.mean(each, axis=0))

    def on_elements(self, x: PETSc.Vec, s: np.ndarray, elements: np.ndarray) -> Profile:
        """The same at places of given ``elements`` (k, m), of which it is the mean."""
        shape, sample, whole = self.shape, self.shape.sample(x), self.table(x)
        start, size = (shape.from_left(y) for y in (shape.start, shape.size))
        degree, first = len(shape.nodes) - 1, elements[0]
        basis = _basis(shape.nodes, (s - start[first]) / size[first])
        own = degree * first[:, None] + np.arange(degree + 1)
        r, q = (np.einsum("mn,mni->mi", basis, sample[name][own]) for name in ("r", "q"))
        strains = self._mean(self.nodes[1:-1], whole[:, 1:-1, :2], s, elements)
        forces = self._mean(self.nodes, whole[:, :, 2:], s, elements)
        return Profile(s, r, np.swapaxes(directors(q), -1, -2), *strains.swapaxes(0, 1), *forces.swapaxes(0, 1))

    def table(self, x: PETSc.Vec) -> np.ndarray:
        """All fields at the nodes of the polynomials of each element from left to right, (elements, nodes, 4, 3)."""
        return derived(self.shape.system.at(x), "resultants", lambda: self._tabulated(x))

    def _tabulated(self, x: PETSc.Vec) -> np.ndarray:
        whole = self._values(x)
        force, moment = self.ends(x)
        for i, ends in enumerate((force + whole[:, [0, -1], 4:].sum(axis=2), moment)):
            whole[:, [0, -1], 2 + i] = np.where(np.isfinite(ends), ends, whole[:, [0, -1], 2 + i])
        return whole[:, :, : len(NAMES)]

    def _values(self, x: PETSc.Vec) -> np.ndarray:
        """The same, and what constraints add to the force, by the strains of the nodes alone."""
        values = self.shape.smooth(self.shape.system.at(x)).evaluate(self._evaluate)
        return self.shape.from_left(values.reshape(len(values), len(self.nodes), -1, 3))

    def ends(self, x: PETSc.Vec) -> tuple[np.ndarray, np.ndarray]:
        """Contact force and moment at both ends of each element by its residual, (elements, 2, 3); nan: not known.

        Of a planar rod the components in the plane and about its normal are; without a centreline no force is.
        """
        system, pieces, order = self.shape.system, self._pieces, self.shape.order[[0, -1]]
        fields, state = system.fields, self.shape.smooth(system.at(x))
        outwards = np.array([-1.0, 1.0])[:, None]
        system.equations.take(state.line)
        local = state.local[pieces.dofs]
        residual = pieces.vectors(system.equations.residual, local, 1)[0]
        rows = pieces.rows[fields.turning.name][order]
        q = fields.turning.quaternion(local[:, rows])
        weights = fields.turning.functional(local[:, rows], residual[:, rows])
        turned = product(q[..., None, :], turns())  # changes of q, doubled, with turns about the directors
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
        f, c, along = e.unknowns, e.constants, e.rod_place(ufl.variable)
        density = scene.energy(along.v, along.k, c)
        for part in scene.parts:
            if isinstance(part.of, Constraint) and part.s is None:
                site, _ = e.site(part, f, (f, f), along)
                density += sum(part.of.lagrangian(site))
        force = ufl.as_vector(fields.formulation.contact_force(e))
        if "dr" in vars(along):
            force += ufl.diff(density, along.dr)
        vectors, turned = [along.v, along.k, force, ufl.diff(density, along.k)], ufl.transpose(along.R)
        if fields.surfaces:  # the part that no residual has
            vectors.append(-ufl.diff(density, along.tangent))
            vectors[2] += vectors[4]
            vectors[4] = ufl.dot(turned, vectors[4])
        vectors[2] = ufl.dot(turned, vectors[2])
        return [vector[i] for vector in vectors for i in range(3)]


class Reaction(NamedTuple):
    """Force and moment on the rod, components in space, both (3,)."""

    force: np.ndarray
    moment: np.ndarray


class Reactions(NamedTuple):
    """Reactions of the ``left`` and ``right`` supports, and of what is attached inside, from left to right."""

    left: Reaction
    right: Reaction
    attached: tuple[Reaction, ...]

    @property
    def all(self) -> np.ndarray:
        """Force and moment of each, (k, 2, 3), in this order."""
        return np.array([self.left, self.right, *self.attached])


def reactions(resultants: Resultants, x: PETSc.Vec) -> Reactions:
    """All reactions at the equilibrium ``x``; collective."""
    shape = resultants.shape
    scene, starts, sides = shape.system.scene, shape.from_left(shape.start), np.array([[-1.0], [1.0]])
    R, whole = directors(shape.sample(x)["q"][[0, -1]]), resultants.table(x)[[0, -1], [0, -1]]
    contact = sides * np.einsum("sij,skj->ksi", R, whole[:, 2:])  # (2, side, 3)
    surface = np.zeros((2, 3))
    if shape.system.fields.surfaces:
        surface = contact[0] - sides * np.einsum("sij,sj->si", R, resultants.ends(x)[0][[0, -1], [0, 1]])
    left, right = (_of_support(resultants, x, i, contact[:, i]) for i in range(2))
    left, right = (r._replace(force=r.force + own) for r, own in zip((left, right), surface, strict=True))
    places = np.array(sorted({a.s for a in scene.attachments if scene.is_inside(a.s)}))
    if not len(places):
        return Reactions(left, right, ())
    after = np.searchsorted(starts, places - SAME_PLACE * scene.length)
    below, above = (resultants.on_elements(x, places, after[None] - back) for back in (1, 0))
    jumps = (below.force_in_space - above.force_in_space, below.moment_in_space - above.moment_in_space)
    return Reactions(left, right, tuple(map(Reaction, *jumps)))


def _of_support(resultants: Resultants, x: PETSc.Vec, side: int, contact: np.ndarray) -> Reaction:
    """Force and moment of the support of an end, where no row of the equations has them those of the ``contact``."""
    shape = resultants.shape
    system, fields, scene = shape.system, shape.system.fields, shape.system.scene
    if scene.closed:
        return Reaction(np.zeros(3), np.zeros(3))

    def summed(mine: Any) -> Any:
        return system.whole(np.asarray(mine)[None]).sum(axis=0)

    state, (force, moment) = shape.smooth(system.at(x)), contact.copy()
    local = state.local.copy()
    for unknown, copies in zip(fields.unknown_scalars, fields.copies.T, strict=False):
        if unknown.group.name in {"m" + LETTERS[side], "f" + LETTERS[side]}:  # moments of a hinge, forces of a guide
            local[copies] = 0.0
    work = NodalValues(state.equations, local, state.line).covector()
    cell, node = int((shape.start if side == 0 else -shape.start).argmin()), shape.order[-side]
    mine = np.isclose(shape.start[cell] + side * shape.size[cell], scene.interval[side])
    turned = fields.dofs[fields.turning.name][cell, node]
    q, weights = fields.turning.quaternion(local[turned]), fields.turning.functional(local[turned], work[turned])
    known = slice(None) if scene.normal is None else scene.normal
    moment[known] = summed(mine * product(turns(), q) @ weights / 2)[known]
    if "r" in fields.dofs:
        return Reaction(summed(mine * work[fields.dofs["r"][cell, node]]), moment)
    rows = dict(zip(fields.scalars, fields.copies.T, strict=False))
    for i in (i for i, held in enumerate(scene.sides[side].support(state.constants())) if held is None):
        force[i] = summed(work[rows.get(f"{LETTERS[side]}{i + 1}", [])].sum())
    return Reaction(force, moment)


def turns() -> np.ndarray:
    """Unit vectors as quaternions (3, 4): ``product`` with one is twice the change of a quaternion by that turn."""
    return np.eye(4)[1:]


def _basis(nodes: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Values of the Lagrange polynomials of ``nodes`` (n,) at ``places`` (p,), both in [0, 1]: (p, n)."""
    own = np.eye(len(nodes), dtype=bool)  # the product of each polynomial goes over all other nodes
    apart = np.where(own, 1.0, places[:, None, None] - nodes)
    return np.asarray(apart.prod(axis=-1) / np.where(own, 1.0, nodes[:, None] - nodes).prod(axis=-1))
