"""The equations of a scene on its fields: Lagrangian, weak form, Jacobian and metrics as compiled forms."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from copy import copy
from functools import cached_property
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import dolfinx.mesh
import numpy as np
import ufl
from dolfinx import fem
from mpi4py import MPI

from rodfem.expressions import apply_algebra_lowering, extract_type
from rodfem.fem import form_compiler
from rodfem.fem.assembly import Assembler, Cells, Places
from rodfem.fem.fields import FEW, Discretization, Fields
from rodfem.fem.known import TableFunctions, readable
from rodfem.fem.state import Line, load_line
from rodfem.forms import inertia, lagrangian
from rodfem.forms.kinematics import curvature, strain
from rodfem.forms.rotation import rotation
from rodfem.problem.contribution import Site
from rodfem.problem.functions import Constants, Place, derived, place
from rodfem.tolerances import same_place

if TYPE_CHECKING:
    from rodfem.problem.scene import Part, Scene


class Equations:
    """Compiled forms of one scene on one :class:`~rodfem.fem.fields.Fields`.

    All numbers of a scene are dolfinx Constants, so that nothing is compiled again for other values: parameters, and
    those that its functions have in them.  Every parameter is ``p = base + direction * load`` with the scalar unknown
    ``load``: any of them can be varied.

    ``metric`` is ``(4/l) int dq.dq + (1/l^3) int dr.dr``, the squared size of a change of state (about the mean square
    rotation), ``kinetic`` that of the spectrum, ``int rho_A dr.dr + w . rho_I w`` with the spin ``w``; it may be
    ``massless``, or ``even``: without the arclength.  ``potential`` is the Lagrangian without the constraints at nodes,
    at an equilibrium the total potential energy, None if a load has none; ``loads`` are its parts that act on the rod.
    ``uniform`` equations have no arclength, no turn between joined ends, and nothing that acts at inner points.
    ``register`` says what the forms read now, of whichever scene: the ``line`` taken last, and the ``values`` that were
    put there since then.
    """

    def __init__(self, fields: Fields) -> None:
        forms = self._derive(fields)
        self.register = SimpleNamespace(line=None, values=None)
        self.derived: dict[Hashable, Any] = {}  # shared, as the forms are
        self.cells = Cells.of(fields)
        compiled = form_compiler.compile_forms(list(forms.values()), fields.mesh.comm)
        self._assemblers = [Assembler(form, self.cells, self.known, int(fields.copies[0, -1])) for form in compiled]
        self.jacobian, self.residual, self.energy, self.metric, self.kinetic = self._assemblers[:5]
        others = dict(zip(forms, self._assemblers, strict=True)).get
        self.potential, self.ordinate = others("potential"), others("ordinate")
        self.loads = [form for form in (others("loads"), others("dead forces")) if form is not None]
        self.local_places = Places(self.cells.dofs)

    @classmethod
    def of(cls, scene: Scene, discretization: Discretization, comm: MPI.Comm) -> Equations:
        """Equations of a ``scene``, with mesh and forms of another one that has the same functions, where there are.

        What depends on the constants is each scene's own.  Of a small system the forms live as long as the functions.
        """
        recent = derived(scene.energy, "equations", list[Equations])
        for known in recent:
            f = known.fields
            alike = (f.asked, f.comm) == (discretization, comm) and f.scene.alike(scene)
            if alike and (fields := f.bound(scene)):
                break
        else:
            known = cls(Fields(scene, discretization, comm))
            fields = known.fields.bound(scene)
            assert fields is not None
            if fields.unknowns <= FEW:
                recent[:] = [known, *recent[:7]]
        out = copy(known)
        out.fields, out.line = fields, load_line(scene)
        return out

    def _derive(self, fields: Fields) -> dict[str, Any]:
        """Forms in UFL by the names of the attributes that they become."""
        self.fields, scene = fields, fields.scene
        mesh, k = fields.mesh, fields.discretization.degree
        self.names, self.line = list(scene.parameters), load_line(scene)
        self.base, self.direction = fem.Constant(mesh, self.line.origin), fem.Constant(mesh, self.line.direction)
        self.ends = fem.Constant(mesh, np.array(scene.interval, dtype=float))
        self.length = self.ends[1] - self.ends[0]
        u, test, trial = fields.u, ufl.TestFunction(fields.space), ufl.TrialFunction(fields.space)
        dx = ufl.dx(domain=mesh, metadata={"quadrature_degree": self.quadrature_degree(k)})
        self.measures = point_measures(mesh, [*scene.interval, *scene.joints])
        self.known = TableFunctions(fields, self.quadrature_degree(k) // 2)
        f = self.unknowns = self._parts(ufl.split(u))
        c = self.constants = self._constants(f.load)
        along = self.rod_place()
        W = scene.energy(along.v, along.k, c)
        a, b = self._parts(ufl.split(test), f.turned), self._parts(ufl.split(trial), f.turned)
        sites = [(part.of, *self.site(part, f, (a, b), along)) for part in scene.parts]
        acting = [x for x in sites if not x[0].nodal]
        acting.sort(key=lambda x: x[2] is not None)  # first along the rod, then at points
        loads = _terms("lagrangian", acting, dx)
        potential = fields.formulation.integrand(self, W, along) * dx + sum(loads)
        L = potential + self._nodal(sites)
        work = sum(_terms("virtual_work", sites, dx))
        first = ufl.derivative(self.compilable(L), u, test) - self.compilable(work)
        kinetic = self._kinetic(a, b, sites, dx)
        self.massless = apply_algebra_lowering(kinetic).empty()
        self.even = not extract_type(kinetic, ufl.SpatialCoordinate)
        places = extract_type(first, ufl.SpatialCoordinate) or scene.joints or self.known.tables
        self.uniform = not (places or scene.sides[1].turn)
        others = {"energy": W * dx, "metric": self._metric(a, b) * dx, "kinetic": kinetic}
        if scene.conservative:
            others |= {"potential": potential} | ({"loads": sum(loads)} if loads else {})
            others |= fields.formulation.dead_forces(self, along, dx)
        others |= self._ordinate(along, dx)
        derivatives = {"jacobian": ufl.derivative(first, u, trial), "residual": first}
        self._forms = derivatives | {name: self.compilable(x) for name, x in others.items()}
        return self._forms

    @property
    def adjoint(self) -> Assembler:
        """Derivative of ``y.F + w.S v - w.M m`` in the unknown, a linear form, compiled once, when it is asked for."""
        return derived(self, "adjoint", self._adjoint)

    def _adjoint(self) -> Assembler:
        y, w, v, m = self.fields.changes
        one, two, mass = (self._forms[name] for name in ("residual", "jacobian", "kinetic"))
        form = ufl.action(one, y) + ufl.action(ufl.action(two, v), w)
        form -= 0 if self.massless else ufl.action(ufl.action(mass, m), w)
        derivative = ufl.derivative(form, self.fields.u, ufl.TestFunction(self.fields.space))
        (compiled,) = form_compiler.compile_forms([derivative], self.fields.comm)
        self._assemblers.append(Assembler(compiled, self.cells, self.known, int(self.fields.copies[0, -1])))
        self._assemblers[-1].pack_constants()
        return self._assemblers[-1]

    def _ordinate(self, along: Place, dx: Any) -> dict[str, Any]:
        """Ordinate of a scene that has an integral for one."""
        ordinate, c = self.fields.scene.ordinate, self.constants
        return {} if ordinate.places else {"ordinate": (0.0 * c.s + ordinate.of(along, c)) * dx}

    def _nodal(self, sites: list[Any]) -> Any:
        """Constraints at nodes, zero at an equilibrium.

        The potential does not have them: in a functional FFCx 0.5 takes, next to a rule of the same degree, the points
        of that rule for both.
        """
        f, rule = self.unknowns, {"quadrature_degree": 2 * self.fields.discretization.degree - 1}
        dx = ufl.dx(domain=self.fields.mesh, metadata=rule | {"quadrature_rule": "GLL"})
        out = 0 if f.eta is None else lagrangian.unit_norm(f.eta, f.q) * dx
        for nodal in (x for x in sites if x[0].nodal):
            out += sum(_terms("lagrangian", [nodal], dx))
        return out

    def _metric(self, a: Any, b: Any) -> Any:
        """Integrand of the squared size of a change of state."""
        planar = self.fields.scene.normal is not None
        metric = (a.turned * b.turned if planar else inertia.rotation_metric(a.q, b.q)) / self.length
        if a.r is not None:
            return metric + ufl.dot(a.r, b.r) / self.length**3
        # the strains stand for the centreline: without them a rod that stretches would not move
        return metric if a.v is None else metric + ufl.inner(a.v, b.v) / self.length

    def _kinetic(self, a: Any, b: Any, sites: list[Any], dx: Any) -> Any:
        """Kinetic metric of the spectrum."""
        f, c, own = self.unknowns, self.constants, self.fields.scene.inertia
        kinetic = inertia.rotary(f.q, a.q, b.q, tuple(own.rho_I(c))) * dx
        if f.r is not None and own.along:
            kinetic += inertia.resistive(self.rod_place().d3, a.r, b.r, own.rho_A(c), own.along(c)) * dx
        elif f.r is not None:
            kinetic += inertia.translational(a.r, b.r, own.rho_A(c)) * dx
        return kinetic + sum(_terms("kinetic", sites, dx))

    @classmethod
    def compile_ahead(cls, fields: Fields) -> None:
        """Begin to compile in the background what another instance finds then in the cache."""
        form_compiler.compile_ahead(list(cls.__new__(cls)._derive(fields).values()))

    def take(self, line: Line) -> None:
        """Let the constants of the forms be the parameters of a ``line``."""
        if line is self.register.line:
            return
        self.base.value[:], self.direction.value[:] = line.origin, line.direction
        self.known.take(line)
        for form in self._assemblers:
            form.pack_constants()
        self.register.line, self.register.values = line, None

    def compilable(self, form: Any) -> Any:
        """A form, or an expression, with what is known in the place of tables, and constants in that of numbers."""
        return readable(form, self.fields.mesh, self.known)

    def evaluated(self, vector: Any, points: np.ndarray) -> Callable[[], np.ndarray]:
        """Compile a vector in UFL at ``points`` (m,) in [0, 1] of each of this rank's elements."""
        fields = self.fields
        return form_compiler.expression(self.compilable(vector), points[:, None], fields.mesh, fields.owned_cells)

    def rod_place(self, wrap: Callable[[Any], Any] = lambda x: x) -> Place:
        """Place of the functions that hold all along the rod; slope and curvatures pass through ``wrap``."""
        f, c, scene = self.unknowns, self.constants, self.fields.scene
        v = strain(scene.free_strains, self.components(f.v, len(scene.free_strains)))
        k = wrap(curvature(f.q, f.q.dx(0)))
        r = self.fields.formulation.position(self, c, lambda field: field, None)
        slope = {} if r is None else {"dr": wrap(r.dx(0)), "tangent": wrap(ufl.dot(rotation(f.q), v))}
        return place(f.q, rotation(f.q), c.s, r, v=v, k=k, length=scene.length, **slope)

    def site(self, part: Part, f: Any, variations: Any, along: Place) -> tuple[Site, Any]:
        """State where a ``part`` of the scene is, and the measure of its terms, None along the rod.

        ``f`` are fields and scalars by name, ``variations`` two changes of them, ``along`` is the place along the rod.
        """
        fields, scene = self.fields, self.fields.scene
        names = [x.name for x in part.of.unknowns(part.number, scene.normal, fields.formulation.centreline)]
        blocks = [f.fields[b.name] for b in part.of.blocks(part.number, fields.discretization.degree)]
        if part.s is None:
            x, c, at, measure = along, self.constants, lambda expression: expression, None
        else:
            x, c, at, measure = self._place(f, part.s)
        free = [i for i, p in enumerate(part.of.support(c)) if p is None and i != scene.normal]
        y = [at(f.scalars[name]) for name in names] + blocks
        first, second = (SimpleNamespace(r=None if v.r is None else at(v.r), q=at(v.q)) for v in variations)
        return Site(x, c, y, at(f.turned), scene.normal, free, first, second, self._whole), measure

    @cached_property
    def _whole(self) -> Any:
        """Angle by which a closed planar rod turns in all at the scene's start; None for others."""
        scene, turning = self.fields.scene, self.fields.turning
        if not scene.closed or scene.normal is None:
            return None
        first, last = turning.start(scene.start, np.array(scene.interval), scene.interval)[:, 0]
        return fem.Constant(self.fields.mesh, 2 * np.pi * np.round((last - first) / (2 * np.pi)))

    def _place(self, f: Any, s: float) -> tuple[Place, Any, Any, Any]:
        """Place at arclength ``s``, the constants there, what restricts a field to it, and its measure."""
        scene = self.fields.scene
        measure, inside = self.measures(s)

        def at(expression: Any) -> Any:
            return expression("+") if inside else expression

        q, c = at(f.q), self._constants(at(f.load), s)
        side = None if inside else int(abs(s - scene.interval[1]) < abs(s - scene.interval[0]))
        r = self.fields.formulation.position(self, c, at, side)
        return place(q, rotation(q), s, r, length=scene.length), c, at, measure

    @staticmethod
    def quadrature_degree(degree: int) -> int:
        """Gauss degree twice the degree, and the midpoint rule for linear elements, as in Kumar & Healey (2010)."""
        return 1 if degree == 1 else 2 * degree

    def _parts(self, parts: Any, at: Any = None) -> SimpleNamespace:
        """Fields and scalars of a mixed function by name; ``r`` and ``n`` are None where there are none.

        ``turned`` is the field of the rotation, ``q`` the quaternion that it stands for; of a variation its change
        where the field is ``at``.
        """
        fields = {block.name: part for block, part in zip(self.fields.blocks, parts, strict=False)}
        values = self.components(parts[-1], len(self.fields.unknown_scalars) + 1)
        scalars = {x.name: value for x, value in zip(self.fields.unknown_scalars, values, strict=False)}
        named = {name: fields.get(name) for name in ("eta", "v", "r", "n")}
        turning = self.fields.turning
        turned = fields[turning.name]
        q = turning.expression(turned) if at is None else turning.variation(at, turned)
        return SimpleNamespace(**named, q=q, turned=turned, fields=fields, scalars=scalars, load=values[-1])

    @staticmethod
    def components(part: Any, size: int) -> list[Any]:
        """Components of a part of a mixed function, of so many; none where there is no such part."""
        return [] if part is None else [part] if size == 1 else [part[i] for i in range(size)]

    def _constants(self, load: Any, s: float | None = None) -> Constants:
        """Named constants as functions of the load, along the rod or at arclength ``s``."""
        values = {name: self.base[i] + self.direction[i] * load for i, name in enumerate(self.names)}
        place = ufl.SpatialCoordinate(self.fields.mesh)[0]
        self.known.names |= {value: name for name, value in {"s": place, **values}.items()}
        return Constants(s=place if s is None else s, **values)

    def lift(self, c: Constants) -> Any:
        """Linear in s and equal to the ends' positions: the unknown ``r`` is what comes on top, zero where held."""
        x = (c.s - self.ends[0]) / self.length
        return ufl.as_vector([(1 - x) * a + x * b + 0 * x for a, b in self.fields.scene.end_positions(c)])


def _terms(name: str, sites: list[Any], dx: Any) -> list[Any]:
    """Terms that parts of a scene have of that name, at their sites."""
    return [term * (measure or dx) for of, site, measure in sites for term in getattr(of, name)(site)]


def point_measures(mesh: Any, points: list[float]) -> Any:
    """``measures(s)``, that of the vertex at ``s`` and whether it is inside the rod; the first points are the ends."""
    length = abs(points[1] - points[0])
    mesh.topology.create_connectivity(0, 1)

    def tagged(chosen: list[tuple[int, float]]) -> Any:
        found = [dolfinx.mesh.locate_entities(mesh, 0, lambda x, s=s: same_place(x[0], s, length)) for _, s in chosen]
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
