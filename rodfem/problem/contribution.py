"""Contributions of a part of a scene to its problem: scalar unknowns, loads, terms of the Lagrangian, virtual work.

An end, an attachment, a constraint, and the scene itself with what acts along the rod, are each a
:class:`Contribution`.  Unknowns, equations, words and checks of a discretised scene are those of its contributions.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from copy import copy
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import ufl

from rodfem.errors import InputError
from rodfem.expressions import differentiated, evaluated
from rodfem.forms import energy, inertia, loads
from rodfem.forms.kinematics import UNDEFORMED
from rodfem.forms.rotation import IDENTITY
from rodfem.problem.arguments import convert, finite, number_of, optional, reals, yes_or_no
from rodfem.problem.functions import (
    STATES,
    Constants,
    Given,
    OfPlace,
    Place,
    Role,
    functions_of,
    inside,
    place,
    places_at,
    role_field,
)
from rodfem.problem.quaternions import directors
from rodfem.problem.setting import AXIS, HELD
from rodfem.problem.unknowns import Block, Group, Motion, Unknown
from rodfem.tolerances import SAME_PLACE

if TYPE_CHECKING:
    from rodfem.problem.scene import Scene


@dataclass(frozen=True)
class Site:
    """Expressions of the state where a contribution is, of which it makes its terms; ``y`` are its own unknowns.

    ``turned`` is the field of the rotation, quaternion (4,) or angle, ``normal`` the component across the plane of a
    planar rod, ``free`` are components of the position that move.  ``first`` and ``second`` are variations with ``r``
    (3,), if there is a centreline, and ``q`` (4,).  ``whole`` is the angle by which a closed planar rod turns in all.
    """

    x: Place
    c: Constants
    y: Sequence[Any]
    turned: Any
    normal: int | None
    free: Sequence[int]
    first: Any
    second: Any
    whole: Any = None


Term = Callable[[Site, Any], Any]


@dataclass(frozen=True)
class Load:
    """A kind of load: its ``potential`` in space, that ``in_plane`` if it is another, or else its virtual ``work``."""

    potential: Term | None = None
    in_plane: Term | None = None
    work: Term = lambda at, value: 0
    moment: bool = False

    def potential_in(self, *, planar: bool) -> Term | None:
        """Potential of a planar rod, or of one in space, None where there is none."""
        return (planar and self.in_plane) or self.potential


def _felt(at: Site, force: Any) -> Any:
    """Potential of a dead force in the free directions; None where it is the contact force of the reduced rod."""
    return -sum(force[i] * at.x.r[i] for i in at.free) if "r" in vars(at.x) and at.free else None


def _about_normal(at: Site, moment: Any) -> Any:
    """Minus moment times angle: in a plane all moments are about its normal."""
    return -moment[at.normal] * at.turned


POTENTIAL = Load(lambda at, value: value)
DEAD = Load(lambda at, force: loads.dead(at.x.r, force))
DEAD_AT_END = Load(_felt)
FOLLOWER = Load(work=lambda at, force: loads.follower_work(at.x.R, force, at.first.r))
MOMENT = Load(
    in_plane=_about_normal, work=lambda at, moment: loads.moment_work(at.x.q, moment, at.first.q), moment=True
)
FOLLOWER_MOMENT = Load(
    in_plane=_about_normal, work=lambda at, moment: loads.follower_moment_work(at.x.q, moment, at.first.q), moment=True
)


class Contribution:
    """Part of a scene; one without unknowns contributes its loads, and nothing else."""

    nodal = False  # whether its terms along the rod are collocated at nodes

    def unknowns(self, number: int, normal: int | None, centreline: bool) -> list[Unknown]:
        """Scalar unknowns of contribution ``number`` of its kind; ``centreline``: whether that is a field."""
        return []

    def blocks(self, number: int, degree: int) -> list[Block]:
        """Fields that it adds, for a rotation of this degree."""
        return []

    def support(self, c: Constants) -> list[Any]:
        """Position there: three expressions, None where it is free."""
        return [None] * 3

    def lagrangian(self, at: Site) -> Iterator[Any]:
        """Terms of the Lagrangian: those of loads with a potential."""
        for _, function, role in functions_of(self, nested=False):
            potential = role.load and role.load.potential_in(planar=at.normal is not None)
            term = potential and potential(at, function(at.x, at.c) if role.arguments == 2 else function(at.c))
            if term is not None:
                yield term

    def virtual_work(self, at: Site) -> Iterator[Any]:
        """Virtual work of loads without a potential."""
        for _, function, role in functions_of(self, nested=False):
            if role.load and role.load.potential_in(planar=at.normal is not None) is None:
                yield role.load.work(at, function(at.c))

    def kinetic(self, at: Site) -> Iterator[Any]:
        """Terms of the kinetic metric."""
        return iter(())


@dataclass(frozen=True)
class Attachment(Contribution):
    """Something attached at arclength ``s``.

    A dead ``force(c)``, a ``follower(c)`` force by its components along the directors, a potential ``energy(x, c)`` (a
    spring), a ``mass(c)``, a ``rotary_inertia(c)`` (3,) about the directors; or constants.
    """

    s: float
    force: Given = role_field(Role("force of an attachment", "f(c)", 3, load=DEAD))
    follower: Given = role_field(lambda x: Role(f"follower force at s = {x.s:g}", "f(c)", 3, load=FOLLOWER))
    energy: OfPlace | None = role_field(Role("energy of an attachment", "f(x, c)", 0, load=POTENTIAL))
    mass: Given = role_field(Role("mass of an attachment", "f(c)", 0))
    rotary_inertia: Given = role_field(Role("rotary inertia of an attachment", "f(c)", 3))

    def __post_init__(self) -> None:
        """Check the place, and that there is something; raises :class:`InputError`."""
        convert(self, s=finite(0.5))
        if all(value is None for name, value in vars(self).items() if name != "s"):
            raise InputError(
                f"Nothing is attached at s = {self.s:g}: give the attachment a force, a follower force, an energy, a "
                f"mass or a rotary inertia; a joint of two elements is breaks=({self.s:g},)."
            )

    def kinetic(self, at: Site) -> Iterator[Any]:
        """Mass, where there is a centreline, and rotary inertia."""
        if self.mass is not None and at.first.r is not None:
            yield inertia.translational(at.first.r, at.second.r, self.mass(at.c))
        if self.rotary_inertia is not None:
            yield inertia.rotary(at.x.q, at.first.q, at.second.q, tuple(self.rotary_inertia(at.c)))


MULTIPLIERS = Group("g", "constraint {} of the scene", Motion.MIXED)


@dataclass(frozen=True)
class Constraint(Contribution):
    """An equation ``of(x, c) = 0`` with a multiplier of its own, at arclength ``s`` or, where that is None, of the rod.

    Made by :func:`integral`, :func:`at` and :func:`everywhere`.
    """

    of: OfPlace = field(metadata={"role": lambda x: Role("constraint", "f(x, c)", 0, along=x.s is None)})
    s: float | None = None
    letter: ClassVar[str] = "g"  # begins the name of its multiplier: those of one letter are numbered together

    def __post_init__(self) -> None:
        convert(self, s=optional(finite(0.5)))

    @property
    def words(self) -> str:
        """What it is, for pictures, in which it has no place."""
        return f"constraint at s = {self.s:g}"

    @property
    def places(self) -> tuple[float, ...]:
        """Arclengths at which elements meet for it."""
        return () if self.s is None else (self.s,)

    def unknowns(self, number: int, normal: int | None, centreline: bool) -> list[Unknown]:
        """One scalar multiplier."""
        return [Unknown(MULTIPLIERS, number)]

    def lagrangian(self, at: Site) -> Iterator[Any]:
        """Multiplier times equation."""
        yield at.y[0] * self.value(at.x, at.c)

    def value(self, x: Place, c: Constants) -> Any:
        """Expression that is zero; of an integral the integrand."""
        return self.of(x, c)


@dataclass(frozen=True)
class Integral(Constraint):
    """An integral over the rod that ``equals(c)``, which is spread over the rod."""

    equals: Given = role_field(Role("value of an integral constraint", "f(c)", 0, placed=False), lambda c: 0.0)
    words = "integral constraint"

    def value(self, x: Place, c: Constants) -> Any:
        """Integrand of the integral that is zero."""
        return self.of(x, c) - self.equals(c) / x.length


@dataclass(frozen=True)
class Tendon(Integral):
    """A tendon, a constraint on its length: the multiplier is the tension, which is given, or else an unknown.

    Made by :func:`tendon`.
    """

    equals: Given = role_field(Role("length of a tendon", "f(c)", 0, placed=False))
    tension: Given = role_field(Role("tension of a tendon", "f(c)", 0, placed=False))
    interval: tuple[float, ...] = ()
    words = "tendon"

    @property
    def places(self) -> tuple[float, ...]:
        """Arclengths of its ends, unless it is as long as the rod."""
        return self.interval

    def unknowns(self, number: int, normal: int | None, centreline: bool) -> list[Unknown]:
        """Tension, unless it is given."""
        return [] if self.tension is not None else super().unknowns(number, normal, centreline)

    def lagrangian(self, at: Site) -> Iterator[Any]:
        """Tension times length."""
        yield at.y[0] * self.value(at.x, at.c) if self.tension is None else self.tension(at.c) * self.of(at.x, at.c)


@dataclass(frozen=True)
class Everywhere(Constraint):
    """A constraint all along the rod, whose multiplier is a field."""

    nodal: bool = False  # of positions or rotations: its multiplier is continuous, the equation collocated at nodes
    letter, words = "p", "constraint all along the rod"

    def unknowns(self, number: int, normal: int | None, centreline: bool) -> list[Unknown]:
        """No scalar."""
        return []

    def blocks(self, number: int, degree: int) -> list[Block]:
        """Multiplier, of the degree of the field that is constrained."""
        return [Block(f"{self.letter}{number + 1}", 1, degree if self.nodal else degree - 1, self.nodal, True, True)]


MEAN = Group("h", "surface {} of the scene", Motion.MIXED)


@dataclass(frozen=True)
class Surface(Everywhere):
    r"""A surface ``g(r) = 0`` for a rod whose sections do not shear: the tangent ``t = R v``, a director, is in it.

    With a pressure ``p`` as the multiplier of ``g(r) = 0`` along the rod the constraints depend on ``r' = R v``: they
    prescribe ``grad g . t = 0`` of rotations that are continuous, and held at clamps.  That is a constraint of its own
    which no pressure in a space of functions balances: ``p`` has couples at the ends, derivatives of Dirac's delta, and
    its inf-sup constant vanishes with the mesh.  With ``p = h / l - u'``

        int p g(r) ds = h / l int g ds + int u dg/ds ds - [u g],        dg/ds = grad g . R v + dg/ds at fixed r,

    and ``u`` is the multiplier of that constraint of rotations: collocated at the nodes that no clamp holds it is as
    independent of all others as the unit norm of the quaternion.  The scalar ``h`` keeps a rod on its surface that
    neither end holds there (``floating``); of one that both ends hold a constant ``u`` is no force, and one node
    follows from the others (``spare``).  ``tangent`` says of each end whether it is held in the surface.  ``grad g . t
    = 0`` makes the contact force ``n - u grad g`` for the multiplier ``n`` of ``r' = R v``.
    """

    floating: bool = False
    spare: bool = False
    tangent: tuple[bool, bool] = (False, False)

    def unknowns(self, number: int, normal: int | None, centreline: bool) -> list[Unknown]:
        """Mean pressure, where no end holds the rod on the surface."""
        return [Unknown(MEAN, number)] if self.floating else []

    def blocks(self, number: int, degree: int) -> list[Block]:
        """Multiplier ``u`` of the tangent's constraint."""
        return [Block(f"u{number + 1}", 1, degree, True, True, True, tangent=self.tangent, spare=self.spare)]

    def lagrangian(self, at: Site) -> Iterator[Any]:
        """Terms of both multipliers."""
        x, r = at.x, ufl.variable(at.x.r)
        g = ufl.as_ufl(self.of(place(x.q, x.R, x.s, r, length=x.length), at.c))
        yield at.y[-1] * (g.dx(0) + ufl.dot(ufl.diff(g, r), x.tangent - at.x.r.dx(0)))
        if self.floating:
            yield at.y[0] * g / x.length


def acting(constraint: Constraint, scene: Scene) -> Constraint:
    """A constraint as it acts on the rod of a scene."""
    if not (isinstance(constraint, Everywhere) and constraint.nodal) or {0, 1} & {*scene.free_strains}:
        return constraint
    turns, moves = (np.array([_slope(constraint, scene, x, y) for x in STATES[:2]]).any(axis=0) for y in ("q", "r"))
    if turns.any() or not moves.any():
        return constraint
    held = [[x is not None for x in end.support(scene.constants())] for end in scene.sides]
    on_it = (np.array(held) | (np.arange(3) == scene.normal) | ~moves).all(axis=1)
    tangent = _in_surface(constraint, scene, 0), _in_surface(constraint, scene, 1)
    spare = bool(scene.closed | on_it.all())
    return Surface(constraint.of, nodal=True, floating=not on_it.any(), spare=spare, tangent=tangent)


def _slope(constraint: Constraint, scene: Scene, state: Sequence[Any], name: str) -> np.ndarray:
    """Derivative of a constraint in ``r`` (3,) or ``q`` (4,) at one of :data:`STATES`."""
    x = places_at(scene.length, inside(scene.interval)[0], state, ufl.variable)[1]
    slope = differentiated(ufl.diff(ufl.as_ufl(constraint.of(x, scene.constants())), getattr(x, name)))
    return np.array([float(evaluated(slope, (i,))) for i in range(4 if name == "q" else 3)])


def _in_surface(constraint: Constraint, scene: Scene, side: int) -> bool:
    """Whether an end holds its tangent in the surface: by a clamp, or a hinge whose axis is across the surface."""
    end, c = scene.sides[side], scene.constants()
    if scene.closed or end.turning != AXIS:  # the right end of a ring has the tangent of the left one
        return end.turning == HELD or (scene.closed and side == 1)
    d = directors(np.array([number_of(x) for x in end.frame(c)]))
    r = [0.0 if x is None else number_of(x) / scene.length for x in end.support(c)]
    try:
        normal = _slope(constraint, scene, (IDENTITY, r, UNDEFORMED, (0.0, 0.0, 0.0)), "r")
    except ArithmeticError:  # at no place of the surface
        return True
    return abs(float(normal @ np.cross(d @ end.hinge, d[:, 2]))) <= SAME_PLACE * float(np.linalg.norm(normal))


def integral(of: OfPlace, equals: Given = 0.0) -> Constraint:
    """Constrain ``int of(x, c) ds = equals(c)``: a total twist, say.  The multiplier is one scalar."""
    return Integral(of, equals=equals)


def at(s: float, of: OfPlace) -> Constraint:
    """Constrain ``of(x, c) = 0`` at arclength ``s``: a point kept on a plane, say.  The multiplier is one scalar."""
    return Constraint(of, s)


def tendon(
    tension: Given = None, *, at: Any, length: Given = None, interval: tuple[float, float] | None = None
) -> Constraint:
    """Let a tendon slide through the rod at ``at``, one of the ``constraints`` of a scene.

    It is pulled with a ``tension(c)``, or has the ``length(c)``, and a tension that is an unknown: ``g1``, if it is the
    first of the constraints.  ``at`` are its coordinates along ``d1`` and ``d2``, two numbers or a function of ``c``
    with ``c.s``, ``interval`` the arclengths between which it runs.  Contact force and moment are those of rod and
    tendon together.  Raises :class:`InputError` unless it has a tension or a length.
    """
    if (tension is None) == (length is None):
        raise InputError(f"A tendon has the tension {tension} and the length {length}: give one of the two.")
    at = at if callable(at) else reals("at", at, (0.0, 0.01), 2, finite)
    run = () if interval is None else reals("interval", interval, (0.0, 0.2), 2, finite)
    if run and not run[0] < run[1]:
        raise InputError(f"A tendon runs from s = {run[0]:g} to {run[1]:g}: give the lesser arclength first.")

    def of(x: Place, c: Constants) -> Any:
        varied, slope = copy(c), (0.0, 0.0)
        if callable(at):
            varied.s = ufl.variable(ufl.as_ufl(c.s))
            slope = tuple(ufl.diff(ufl.as_ufl(y), varied.s) for y in at(varied))
        taut = energy.tendon(x.v, x.k, 1.0, at(varied) if callable(at) else at, slope)
        return ufl.conditional(ufl.And(ufl.ge(x.s, run[0]), ufl.le(x.s, run[1])), taut, 0.0 * taut) if run else taut

    return Tendon(of, equals=length, tension=tension, interval=run)


def everywhere(of: OfPlace, *, strain: bool) -> Constraint:
    """Constrain ``of(x, c) = 0`` all along the rod; ``strain`` says whether it is one of strains or of positions.

    A function of ``x.r`` is a surface, which acts on the rod by ``-p1`` times its gradient, a force per length: states
    have ``p1`` (:class:`Surface`).
    """
    return Everywhere(of, nodal=not yes_or_no("strain", strain))
