"""The equations of a scene on its fields: Lagrangian, weak form, Jacobian and metrics as compiled dolfinx forms."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import dolfinx.mesh
import numpy as np
import ufl
from dolfinx import fem

from forms import inertia, lagrangian
from forms.kinematics import curvature, strain
from forms.rotation import rotation
from rodfem.compat import compile_forms
from rodfem.fields import Fields


class Equations:
    """Compiled forms of one scene on one :class:`~rodfem.fields.Fields`.

    All numbers of a scene are dolfinx Constants, so that nothing is compiled again for other values.  Every
    parameter is ``p = base + direction * load`` with the scalar unknown ``load``: any of them can be varied.

    Attributes
    ----------
    residual, jacobian
        First and second derivative of the Lagrangian in all fields and scalars.
    metric
        ``(4/l) int dq.dq + (1/l^3) int dr.dr``, the squared size of a change of state (about the mean square rotation).
    kinetic
        Kinetic metric of the spectrum, ``int rho_A dr.dr + w . rho_I w`` with the spin ``w``.
    energy
        Stored energy ``int W ds``.
    """

    def __init__(self, fields: Fields) -> None:
        """Derive and compile the forms."""
        self.fields, scene = fields, fields.scene
        mesh, k = fields.mesh, fields.discretization.degree
        self.names = list(scene.parameters)
        self.base = fem.Constant(mesh, np.array([p.value for p in scene.parameters.values()]))
        self.direction = fem.Constant(mesh, np.zeros(len(self.names)))
        self.vary(scene.load)
        self.ends = fem.Constant(mesh, np.array(scene.interval, dtype=float))
        length = self.ends[1] - self.ends[0]

        u, test, trial = fields.u, ufl.TestFunction(fields.space), ufl.TrialFunction(fields.space)
        dx = ufl.dx(domain=mesh, metadata={"quadrature_degree": self.quadrature_degree(k)})
        dx_nodes = ufl.dx(domain=mesh, metadata={"quadrature_degree": 2 * k - 1, "quadrature_rule": "GLL"})

        f = self._named(ufl.split(u))
        c = self._constants(f.scalars)
        v = strain(scene.free_strains, self._components(f.v, len(scene.free_strains)))
        W, R = scene.energy(v, curvature(f.q, f.q.dx(0)), c), rotation(f.q)
        if fields.discretization.formulation == "reduced":
            force = [scene.known_force(i, c) for i in range(3)]
            for position, i in enumerate(fields.forces):
                force[i] = f.scalars[position]
            integrand = lagrangian.reduced(W, R, v, ufl.as_vector(force), self._chord(c) / length)
        else:
            known = ufl.as_vector([scene.known_force(i, c) or 0.0 for i in range(3)])
            integrand = lagrangian.pointwise(W, R, v, (f.r + self._lift(c)).dx(0), f.n, known)
        L = integrand * dx + lagrangian.unit_norm(f.mu, f.q) * dx_nodes
        a, b = self._named(ufl.split(test)), self._named(ufl.split(trial))
        first = ufl.derivative(L, u, test)
        for end, ds in zip(scene.ends, end_measures(mesh, scene.interval), strict=True):
            if end.follower is not None:  # no potential: its virtual work enters the weak form
                first -= ufl.dot(ufl.dot(R, ufl.as_vector(end.follower(c))), a.r) * ds
        second = ufl.derivative(first, u, trial)
        metric = inertia.rotation_metric(a.q, b.q) / length
        if f.r is not None:
            metric += ufl.dot(a.r, b.r) / length**3
        kinetic = inertia.rotary(f.q, a.q, b.q, tuple(scene.inertia.rho_I(c)))
        if f.r is not None:
            kinetic += inertia.translational(a.r, b.r, scene.inertia.rho_A(c))
        forms = [first, second, W * dx, metric * dx, kinetic * dx]
        self.residual, self.jacobian, self.energy, self.metric, self.kinetic = compile_forms(forms)

    @staticmethod
    def quadrature_degree(degree: int) -> int:
        """Gauss degree ``2k``, and the midpoint rule for k = 1, as in Kumar & Healey (2010)."""
        return 1 if degree == 1 else 2 * degree

    def vary(self, parameter: str) -> None:
        """Make the scalar unknown ``load`` stand for ``parameter``; all others keep their values."""
        chosen = np.array([name == parameter for name in self.names])
        values = np.array([p.value for p in self.fields.scene.parameters.values()])
        self.base.value[:] = np.where(chosen, 0.0, values)
        self.direction.value[:] = chosen

    def _named(self, parts: Any) -> SimpleNamespace:
        found = SimpleNamespace(q=None, mu=None, v=None, r=None, n=None, scalars=parts[-1])
        for block, part in zip(self.fields.blocks, parts, strict=False):
            setattr(found, block.name, part)
        found.scalars = self._components(parts[-1], len(self.fields.forces) + 1)
        return found

    @staticmethod
    def _components(part: Any, size: int) -> list[Any]:
        return [] if part is None else [part] if size == 1 else [part[i] for i in range(size)]

    def _constants(self, scalars: list[Any]) -> SimpleNamespace:
        load = scalars[-1]
        values = {name: self.base[i] + self.direction[i] * load for i, name in enumerate(self.names)}
        return SimpleNamespace(s=ufl.SpatialCoordinate(self.fields.mesh)[0], **values)

    def _chord(self, c: SimpleNamespace) -> Any:
        """Difference of the ends' positions where both are held, zero elsewhere."""
        left, right = (end.held(c) for end in self.fields.scene.ends)
        return ufl.as_vector([0.0 if a is None or b is None else b - a for a, b in zip(left, right, strict=True)])

    def _lift(self, c: SimpleNamespace) -> Any:
        """Linear in s and equal to the ends' positions: the unknown ``r`` is what comes on top, zero where held."""
        x = (c.s - self.ends[0]) / (self.ends[1] - self.ends[0])
        left, right = (end.held(c) for end in self.fields.scene.ends)
        lift = [b if a is None else a if b is None else (1 - x) * a + x * b for a, b in zip(left, right, strict=True)]
        return ufl.as_vector([value + 0 * x for value in lift])


def end_measures(mesh: Any, interval: tuple[float, float]) -> list[Any]:
    """Measures of the left and of the right end of the rod."""
    found = [dolfinx.mesh.locate_entities_boundary(mesh, 0, lambda x, s=s: np.isclose(x[0], s)) for s in interval]
    values = np.repeat(np.array([1, 2], dtype=np.int32), [len(points) for points in found])
    points = np.concatenate(found).astype(np.int32)
    order = np.argsort(points)
    tags = dolfinx.mesh.meshtags(mesh, 0, points[order], values[order])
    return [ufl.Measure("ds", domain=mesh, subdomain_data=tags)(tag) for tag in (1, 2)]
