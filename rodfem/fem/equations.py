"""The equations of a scene on its fields: Lagrangian, weak form, Jacobian and metrics as compiled dolfinx forms."""

from __future__ import annotations

from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import dolfinx.mesh
import numpy as np
import ufl
from dolfinx import fem
from ufl.algorithms.analysis import extract_type
from ufl.algorithms.apply_algebra_lowering import apply_algebra_lowering

from forms import inertia, lagrangian, loads
from forms.kinematics import curvature, strain
from forms.rotation import rotation
from rodfem import compat
from rodfem.fem.fields import Fields, across
from rodfem.fem.parameters import load_line
from rodfem.problem.ends import Constants, Place, Ring
from rodfem.problem.local_state import place

if TYPE_CHECKING:
    from rodfem.fem.state import Evaluation


class Equations:
    """Compiled forms of one scene on one :class:`~rodfem.fem.fields.Fields`.

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
    massless
        Whether that is without any term.
    energy
        Stored energy ``int W ds``.
    ordinate
        Ordinate of the scene where that is an integral over the rod, else None.
    line
        Parameters that the scalar unknown ``load`` stands for unless an evaluation says otherwise: the scene's load.
    held
        Evaluation whose values are where the forms read them: see :mod:`rodfem.fem.state`.
    uniform
        Whether the equations do not have the arclength in them, and nothing acts at points inside the rod.
    """

    def __init__(self, fields: Fields) -> None:
        """Derive and compile the forms."""
        self.fields, scene = fields, fields.scene
        mesh, k = fields.mesh, fields.discretization.degree
        self.names, self.line = list(scene.parameters), load_line(scene)
        self.base, self.direction = fem.Constant(mesh, self.line.origin), fem.Constant(mesh, self.line.direction)
        self.held: Evaluation | None = None
        self.ends = fem.Constant(mesh, np.array(scene.interval, dtype=float))
        length = self.length = self.ends[1] - self.ends[0]

        u, test, trial = fields.u, ufl.TestFunction(fields.space), ufl.TrialFunction(fields.space)
        dx = ufl.dx(domain=mesh, metadata={"quadrature_degree": self.quadrature_degree(k)})
        dx_nodes = ufl.dx(domain=mesh, metadata={"quadrature_degree": 2 * k - 1, "quadrature_rule": "GLL"})
        self.measures = point_measures(mesh, [*scene.interval, *scene.joints])

        f = self.unknowns = self._named(ufl.split(u))
        c = self.constants = self._constants(f.load)
        v = strain(scene.free_strains, self._components(f.v, len(scene.free_strains)))
        along = self._along(f, c, v)
        W = scene.energy(v, along.k, c)
        L = (self._rod(f, c, W, along) + self._along_loads(f, c, along)) * dx
        if f.eta is not None:
            L += lagrangian.unit_norm(f.eta, f.q) * dx_nodes
        for i, constraint in enumerate(x for x in scene.constraints if x.kind == "pointwise"):
            L += f.fields[f"p{i}"] * constraint.of(along, c) * (dx_nodes if constraint.continuous else dx)
        L += self._points(f)

        a, b = self._named(ufl.split(test), f.turned), self._named(ufl.split(trial), f.turned)
        first = ufl.derivative(L, u, test) - self._virtual_work(f, a, c, dx)
        second = ufl.derivative(first, u, trial)
        metric = (inertia.rotation_metric(a.q, b.q) if scene.normal is None else a.turned * b.turned) / length
        if f.r is not None:
            metric += ufl.dot(a.r, b.r) / length**3
        kinetic = inertia.rotary(f.q, a.q, b.q, tuple(scene.inertia.rho_I(c))) * dx
        if f.r is not None:
            kinetic += inertia.translational(a.r, b.r, scene.inertia.rho_A(c)) * dx
        kinetic += self._attached_inertia(f, a, b)
        self.massless = apply_algebra_lowering(kinetic).empty()
        self.uniform = not extract_type(first, ufl.SpatialCoordinate) and not scene.joints
        forms = [first, second, W * dx, metric * dx, kinetic]
        if not scene.ordinate.places:
            forms.append((0.0 * c.s + scene.ordinate.of(along, c)) * dx)
        self.residual, self.jacobian, self.energy, self.metric, self.kinetic, *more = compat.compile_forms(forms)
        self.ordinate: Any = more[0] if more else None

    # --- the functional --------------------------------------------------------------------------------------------

    def _along(self, f: Any, c: Any, v: Any) -> Place:
        """Place of the functions that hold all along the rod."""
        k, R = curvature(f.q, f.q.dx(0)), rotation(f.q)
        more = {"v": v, "k": k, "length": self.fields.scene.length}
        if f.r is None:
            return place(f.q, R, c.s, **more)
        r = f.r + self._lift(c)
        return place(f.q, R, c.s, r, dr=r.dx(0), **more)

    def _rod(self, f: Any, c: Any, W: Any, along: Place) -> Any:
        """Integrand of the rod itself: see :mod:`forms.lagrangian`."""
        if f.r is not None:
            return lagrangian.pointwise(W, along.R, along.v, along.dr, f.n)
        scene = self.fields.scene
        force = [f.scalars.get(f"n{i + 1}", scene.known_force(i, c) or 0.0) for i in range(3)]
        left, right = self._ends(f, c)
        chord = [0.0 if x is None or y is None else y - x for x, y in zip(left, right, strict=True)]
        return lagrangian.reduced(W, along.R, along.v, ufl.as_vector(force), ufl.as_vector(chord) / self.length)

    def _ends(self, f: Any, c: Any) -> list[list[Any]]:
        """Positions of the ends in the reduced formulation: held, a scalar unknown, or None (known force there).

        Across the plane of a planar rod an end that nothing holds is where the plane is: at zero.
        """
        scene = self.fields.scene
        return [
            [
                x if x is not None else f.scalars.get(f"{letter}{i + 1}", 0.0 if i == scene.normal else None)
                for i, x in enumerate(end.held(c))
            ]
            for letter, end in zip("ab", scene.sides, strict=True)
        ]

    def _along_loads(self, f: Any, c: Any, along: Place) -> Any:
        """Potential of what acts along the rod, and integral constraints with their multipliers."""
        scene = self.fields.scene
        out = 0.0 * c.s
        if scene.distributed is not None:
            out += loads.dead(along.r, scene.distributed(c))
        if scene.potential is not None:
            out += scene.potential(along, c)
        for name, constraint in self._scalar_constraints():
            if constraint.kind == "integral":
                out += f.scalars[name] * constraint.of(along, c)
        return out

    def _scalar_constraints(self) -> list[tuple[str, Any]]:
        scalar = [x for x in self.fields.scene.constraints if x.kind != "pointwise"]
        return [(f"g{i + 1}", x) for i, x in enumerate(scalar)]

    def _points(self, f: Any) -> Any:
        """What acts at points: ends, attachments, constraints; each with the measure of its point."""
        scene, out = self.fields.scene, 0
        for side, (letter, end) in enumerate(zip("ab", scene.sides, strict=True)):
            s = scene.interval[side]
            x, c, _, ds = self._at(f, s)
            free = [i for i, p in enumerate(end.held(c)) if p is None]
            if end.force is not None and (f.r is not None or not scene.plain(side)):
                out += -sum(end.applied(c)[i] * x.r[i] for i in free if i != scene.normal) * ds
            if end.energy is not None:
                out += end.energy(x, c) * ds
            if scene.normal is not None:
                moments = [
                    moment(c)[scene.normal] for moment in (end.moment, end.follower_moment) if moment is not None
                ]
                out += sum(-moment * f.turned * ds for moment in moments)
            if end.turned is not None:
                g = loads.misalignment(x.q, end.turned(c))
                for i, direction in enumerate(across(end.hinge, scene.normal)):
                    out += f.scalars[f"m{letter}{i + 1}"] * ufl.dot(g, ufl.as_vector(direction)) * ds
        for attachment in scene.attachments:
            x, c, _, measure = self._at(f, attachment.s)
            if attachment.force is not None:
                out += loads.dead(x.r, attachment.force(c)) * measure
            if attachment.energy is not None:
                out += attachment.energy(x, c) * measure
        for name, constraint in self._scalar_constraints():
            if constraint.kind == "point":
                x, c, at, measure = self._at(f, constraint.s)
                out += at(f.scalars[name]) * constraint.of(x, c) * measure
        if isinstance(scene.ends, Ring):
            out += self._closure(f, scene.ends.sign)
        return out

    def _closure(self, f: Any, sign: float) -> Any:
        """Both ends of a ring joined: ``q(l) = +-q(0)`` and, with a centreline, ``r(l) = r(0)``.

        In a plane the angle grows by the whole number of turns that the scene's start makes.
        """

        def closing(letter: str) -> list[tuple[str, Any]]:
            return [(name, x) for name, x in f.scalars.items() if name[0] == letter]

        scene, turned = self.fields.scene, f.turned if f.turned.ufl_shape else ufl.as_vector([f.turned])
        out = 0
        if scene.normal is not None:
            first, last = self.fields.turning.start(scene.start, np.array(scene.interval), scene.interval)[:, 0]
            whole = fem.Constant(self.fields.mesh, 2 * np.pi * np.round((last - first) / (2 * np.pi)))
            sign = 1.0
            out += -f.scalars["t1"] * whole * self.measures(scene.interval[1])[0]
        for s, weights in zip(scene.interval, ((-sign, -1.0), (1.0, 1.0)), strict=True):
            ds = self.measures(s)[0]
            out += weights[0] * sum(x * turned[int(name[1]) - 1] for name, x in closing("t")) * ds
            if f.r is not None:
                out += weights[1] * sum(x * f.r[int(name[1]) - 1] for name, x in closing("f")) * ds
        return out

    def _at(self, f: Any, s: float) -> tuple[Place, Any, Any, Any]:
        """Place at arclength ``s``, the constants there, what restricts a field to it, and its measure."""
        scene = self.fields.scene
        measure, inside = self.measures(s)

        def at(expression: Any) -> Any:
            return expression("+") if inside else expression

        q, c = at(f.q), self._constants(at(f.load), s)
        if f.r is not None:
            return place(q, rotation(q), s, at(f.r) + self._lift(c), length=scene.length), c, at, measure
        if not inside:
            r = self._ends(f, c)[int(abs(s - scene.interval[1]) < abs(s - scene.interval[0]))]
            if None not in r:
                return place(q, rotation(q), s, ufl.as_vector(r), length=scene.length), c, at, measure
        return place(q, rotation(q), s, length=scene.length), c, at, measure

    def _virtual_work(self, f: Any, a: Any, c: Any, dx: Any) -> Any:
        """Virtual work of the loads that have no potential, in the variation ``a``."""
        scene, work = self.fields.scene, 0
        if scene.follower is not None:
            work += loads.follower_work(rotation(f.q), scene.follower(c), a.r) * dx
        for end, s in zip(scene.sides, scene.interval, strict=True):
            _, c, _, ds = self._at(f, s)
            if end.follower is not None:
                work += loads.follower_work(rotation(f.q), end.follower(c), a.r) * ds
            if scene.normal is not None:
                continue
            if end.moment is not None:
                work += loads.moment_work(f.q, end.moment(c), a.q) * ds
            if end.follower_moment is not None:
                work += loads.follower_moment_work(f.q, end.follower_moment(c), a.q) * ds
        for attachment in scene.attachments:
            if attachment.follower is not None:
                x, c, at, measure = self._at(f, attachment.s)
                work += loads.follower_work(x.R, attachment.follower(c), at(a.r)) * measure
        return work

    def _attached_inertia(self, f: Any, a: Any, b: Any) -> Any:
        """Kinetic metric of masses at points."""
        out = 0
        for attachment in self.fields.scene.attachments:
            x, c, at, measure = self._at(f, attachment.s)
            if attachment.mass is not None and f.r is not None:
                out += inertia.translational(at(a.r), at(b.r), attachment.mass(c)) * measure
            if attachment.rotary_inertia is not None:
                out += inertia.rotary(x.q, at(a.q), at(b.q), tuple(attachment.rotary_inertia(c))) * measure
        return out

    # --- names -----------------------------------------------------------------------------------------------------

    @staticmethod
    def quadrature_degree(degree: int) -> int:
        """Gauss degree ``2k``, and the midpoint rule for k = 1, as in Kumar & Healey (2010)."""
        return 1 if degree == 1 else 2 * degree

    def _named(self, parts: Any, at: Any = None) -> SimpleNamespace:
        """Fields and scalars of a mixed function by name; ``r`` and ``n`` are None where there are none.

        ``turned`` is the field of the rotation, ``q`` the quaternion that it stands for; of a variation its change
        where the field is ``at``.
        """
        fields = {block.name: part for block, part in zip(self.fields.blocks, parts, strict=False)}
        values = self._components(parts[-1], len(self.fields.unknown_scalars) + 1)
        scalars = {x.name: value for x, value in zip(self.fields.unknown_scalars, values, strict=False)}
        named = {name: fields.get(name) for name in ("eta", "v", "r", "n")}
        turning = self.fields.turning
        turned = fields[turning.name]
        q = turning.expression(turned) if at is None else turning.variation(at, turned)
        return SimpleNamespace(**named, q=q, turned=turned, fields=fields, scalars=scalars, load=values[-1])

    @staticmethod
    def _components(part: Any, size: int) -> list[Any]:
        return [] if part is None else [part] if size == 1 else [part[i] for i in range(size)]

    def _constants(self, load: Any, s: float | None = None) -> Constants:
        """Named constants as functions of the load, along the rod or at arclength ``s``."""
        values = {name: self.base[i] + self.direction[i] * load for i, name in enumerate(self.names)}
        return Constants(s=ufl.SpatialCoordinate(self.fields.mesh)[0] if s is None else s, **values)

    def _lift(self, c: Constants) -> Any:
        """Linear in s and equal to the ends' positions: the unknown ``r`` is what comes on top, zero where held."""
        x = (c.s - self.ends[0]) / self.length
        left, right = (end.held(c) for end in self.fields.scene.sides)
        lift = []
        for a, b in zip(left, right, strict=True):
            pair = (b, b) if a is None else (a, a) if b is None else (a, b)
            lift.append(0.0 if pair == (None, None) else (1 - x) * pair[0] + x * pair[1])
        return ufl.as_vector([value + 0 * x for value in lift])


def point_measures(mesh: Any, points: list[float]) -> Any:
    """Measures of points: ``measures(s)`` gives that of the vertex at ``s`` and whether it is inside the rod.

    The first two points are the ends.
    """
    tolerance = 1e-9 * abs(points[1] - points[0])
    mesh.topology.create_connectivity(0, 1)

    def tagged(chosen: list[tuple[int, float]]) -> Any:
        found = [
            dolfinx.mesh.locate_entities(mesh, 0, lambda x, s=s: np.isclose(x[0], s, rtol=0, atol=tolerance))
            for _, s in chosen
        ]
        values = np.repeat(np.array([tag for tag, _ in chosen], dtype=np.int32), [len(v) for v in found])
        vertices = np.concatenate(found).astype(np.int32)
        order = np.argsort(vertices)
        return dolfinx.mesh.meshtags(mesh, 0, vertices[order], values[order])

    numbered = list(enumerate(points, start=1))
    ds = ufl.Measure("ds", domain=mesh, subdomain_data=tagged(numbered[:2]))
    dS = ufl.Measure("dS", domain=mesh, subdomain_data=tagged(numbered[2:])) if len(points) > 2 else None

    def measures(s: float) -> tuple[Any, bool]:
        tag, _ = min(numbered, key=lambda p: abs(p[1] - s))
        return (ds(tag), False) if tag <= 2 or dS is None else (dS(tag), True)

    return measures
