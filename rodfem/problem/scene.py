"""The statement of a problem: a rod, its ends, its loads, and the ordinate to record.

A :class:`Scene` is plain immutable data without meshes or matrices.  Functions in it receive a namespace ``c`` of
named constants (``c.lam``, ``c.C``, ...; ``c.s`` is the arclength) and work on UFL expressions and on numbers alike.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from keyword import iskeyword
from math import inf, isfinite
from numbers import Real
from typing import Any, ClassVar, NamedTuple

import numpy as np
import ufl

from rodfem.errors import SceneError
from rodfem.expressions import differentiated, evaluated, parts
from rodfem.forms.kinematics import RODS, UNDEFORMED, strain
from rodfem.problem.arguments import Check, a, convert, finite, interval, optional, plain, real, text
from rodfem.problem.contribution import DEAD, FOLLOWER, POTENTIAL, Attachment, Constraint, Contribution, acting
from rodfem.problem.ends import End, Ring
from rodfem.problem.functions import (
    Constants,
    Given,
    OfPlace,
    Role,
    changes,
    derived,
    functions_of,
    guarded,
    inside,
    role_field,
)
from rodfem.problem.table import Entry, Table
from rodfem.problem.trials import (
    check_function,
    expressions_of,
    names_in,
    names_in_inertia,
    needs_centreline,
    symbols,
)
from rodfem.problem.units import Units, units_of
from rodfem.problem.validation import check_scene
from rodfem.tolerances import NEGLIGIBLE, SAME_PLACE, TINY, same_place

GIVEN = re.compile(r"branch \d+(\.\d+)*|detached( \d+(\.\d+)*)?|found \d+ at .*")
"""Names that branches are given as they are found."""


@dataclass(frozen=True)
class Parameter:
    """A named constant of a scene.

    ``value`` is where it starts, ``label`` its TeX name without dollars, ``admissible`` the open interval that makes
    sense for it, ``words`` what it is, for the axes of pictures ("end shortening"), and ``unit`` the name of its unit
    ("N"), where it has one.  Any parameter can be the one that a continuation varies.
    """

    value: float
    label: str = ""
    admissible: tuple[float, float] = (-inf, inf)
    words: str = ""
    unit: str = ""

    def __post_init__(self) -> None:
        words = dict.fromkeys(("label", "words", "unit"), text("P"))
        convert(self, value=real(1.0), admissible=interval(0.0, inf, real), **words)

    def check(self, name: str, value: float) -> None:
        """Raise :class:`SceneError` unless ``value`` is a finite number inside the admissible interval."""
        low, high = self.admissible
        if not low < high:
            raise SceneError(f"No {name} is admissible between {low:g} and {high:g}: give the lower bound first.")
        if not isfinite(value):
            raise SceneError(f"{name} = {value:g} is not a finite number: give one.")
        if not low < value < high:
            raise SceneError(f"{name} = {value:g} is outside its admissible range: choose {low:g} < {name} < {high:g}.")


def _massless(c: Constants) -> float:
    return 0.0


def _one(c: Constants) -> float:
    return 1.0


def _of_three(of: Callable[[Constants], float]) -> Callable[[Constants], tuple[float, ...]]:
    return lambda c: (of(c),) * 3


_no_rotary, _unit_rotary = _of_three(_massless), _of_three(_one)


def _given(self: Inertia | Drag) -> str:
    """Names of the functions that are not those by default, for ``repr``: functions have no text worth reading."""
    names = (f.name for f in fields(self) if getattr(self, f.name) not in (f.default, _no_rotary))
    return f"{type(self).__name__}({', '.join(f'{name}=...' for name in names)})"


@dataclass(frozen=True, repr=False)
class Inertia:
    """Mass ``rho_A(c)`` and rotary inertia ``rho_I(c)`` about the directors, both per unit length.

    Only frequencies need them, and the stability of states under loads without a potential.  Of a rod with a mass and
    no ``rho_I`` the rotary inertia is zero, as of a slender one; without either it is one, by which eigenvalues count.
    """

    order: ClassVar[int] = 2  # of the equations of motion in time
    words: ClassVar[str] = "eigenvalues mu = omega^2"
    along: ClassVar[None] = None
    rho_A: Given = role_field(Role("mass per length", "f(c)", 0, along=True), _massless)
    rho_I: Given = role_field(Role("rotary inertia per length", "f(c)", 3, along=True), _unit_rotary)

    __repr__ = _given

    def __post_init__(self) -> None:
        """Give a rod with a mass no rotary inertia but its own."""
        if self.rho_A is not _massless and self.rho_I is _unit_rotary:
            object.__setattr__(self, "rho_I", _no_rotary)

    def others(self, c: Constants) -> tuple[Any, ...]:
        """What else there is than ``rho_A``."""
        return tuple(self.rho_I(c))


@dataclass(frozen=True, repr=False)
class Drag:
    """Drag of a rod in a viscous fluid, in the place of its inertia: motions ``D x' = -K x``, not ``M x'' = -K x``.

    Force over velocity, per length, ``across(c)`` the rod and ``along(c)`` it (None: as across), and moment over the
    rate of ``turning(c)`` (3,) about the directors.  Eigenvalues ``mu`` of ``K x = mu D x`` are rates of decay: a state
    is unstable where the real part of one is negative, and flutters where that of a complex pair passes through zero.
    """

    order: ClassVar[int] = 1
    words: ClassVar[str] = "rates of decay mu"
    across: Given = role_field(Role("drag across the rod per length", "f(c)", 0, along=True), _one)
    along: Given = role_field(Role("drag along the rod per length", "f(c)", 0, along=True))
    turning: Given = role_field(Role("drag of turning per length", "f(c)", 3, along=True), _no_rotary)

    __repr__ = _given
    rho_A = property(lambda self: self.across)  # in the place of a mass, and of a rotary inertia
    rho_I = property(lambda self: self.turning)

    def others(self, c: Constants) -> tuple[Any, ...]:
        """What else there is than ``rho_A``."""
        return (*self.turning(c), *([self.along(c)] if self.along else []))


AT_A_POINT = Role("ordinate", "of(r, q)", hint="it gets arrays r (3,) and q (4,) and returns a number", returns=plain)
ALONG_THE_ROD = Role("ordinate along the rod", "of(x, c)", along=True)


@dataclass(frozen=True)
class Ordinate:
    """The number that a bifurcation diagram shows against the load: at a point, or an integral over the rod.

    ``name`` says it in words, ``label`` in TeX, for the axis of a figure, and ``unit`` names its unit ("m").  At the
    arclength ``s`` it is ``of(r, q)`` of the centreline ``r`` (3,) and the unit quaternion ``q`` (4,) there, numpy
    arrays.  Without ``s`` it is the integral of ``of(x, c)``, a UFL expression of the state along the rod as in a
    scene's ``potential`` (see :mod:`rodfem.problem.ends`): its energy, ``lambda x, c: W(x.v, x.k, c)``, or its twist,
    ``x.k[2] / (2 * pi)``.
    """

    name: str
    s: float | None
    of: Callable[[Any, Any], Any] = field(metadata={"role": lambda x: ALONG_THE_ROD if x.s is None else AT_A_POINT})
    label: str = ""
    unit: str = ""

    def __post_init__(self) -> None:
        word = text("tip")
        convert(self, name=word, label=word, unit=word, s=optional(finite(1.0)))

    @property
    def places(self) -> tuple[float, ...]:
        """Arclengths at which the state is evaluated for it."""
        return () if self.s is None else (self.s,)


def rotations(values: Any) -> np.ndarray:
    """Quaternions of unit norm of an array; what is so but for round-off, zero, or not finite, stays as it is."""
    if np.iscomplexobj(values):
        raise TypeError("complex numbers")
    q = np.asarray(values, dtype=float)
    if q.ndim != 2:
        return q
    norm = np.linalg.norm(q, axis=1)
    other = np.isfinite(norm) & (norm > 0) & (abs(norm - 1) > NEGLIGIBLE)
    return np.where(other[:, None], q / np.where(other, norm, 1.0)[:, None], q)


START = Role("start", "start(s)", hint="it gets an array of arclengths (m,) and returns one (m, 4)", returns=rotations)


class Part(NamedTuple):
    """A contribution to a scene, its number among those of its kind, and its arclength, None along the whole rod."""

    of: Contribution
    number: int
    s: float | None


def _folder(name: str, value: Any) -> str:
    """Check for the name of a scene or a branch."""
    word: str = text("column")(name, value)
    if word in ("", ".", "..") or set(word) & set("/\\\n\0"):
        raise SceneError(f"The name {word!r} cannot be that of a folder: give a text without slashes.")
    if name == "states" and GIVEN.fullmatch(word):
        raise SceneError(f"states is {word!r}, a name which others are given: choose another, as 'straight'.")
    return word


def _two_ends(name: str, value: Any) -> Any:
    if not isinstance(value, (tuple, list, Ring)) or [isinstance(x, End) for x in value] != [True, True]:
        raise SceneError("The ends are not two of the kind End: give them as in (clamped(), free()), or a Ring().")
    return value


def _parameters(name: str, value: Any) -> dict[str, Parameter]:
    made = {}
    for n, p in a(Mapping, "a dictionary, as in {'P': Parameter(0.0)}")(name, value).items():
        if not isinstance(n, str) or not n.isidentifier() or iskeyword(n) or n == "s" or n.startswith("__"):
            raise SceneError(f"A parameter cannot have the name {n!r}: choose another (s is the arclength).")
        made[n] = p if isinstance(p, Parameter) else Parameter(real(0.0)(n, p))
    return made


def _tuple_of(kind: type, example: str) -> Check:
    """Check for a tuple of objects of a class."""

    def check(name: str, value: Any) -> Any:
        for x in a((tuple, list), f"a tuple, as in {name}={example}")(name, value):
            a(kind, example)(f"One of the {name}", x)
        return tuple(map(float, value)) if kind is Real else value

    return check


KINDS: dict[str, Check] = {
    "name": _folder,
    "title": text("column"),
    "states": optional(_folder),
    "ends": _two_ends,
    "parameters": _parameters,
    "inertia": a((Inertia, Drag), "one, as in Inertia(rho_A=1.0) or Drag(across=1.0)"),
    "ordinate": a(Ordinate, "an Ordinate(name, s, of)"),
    "attachments": _tuple_of(Attachment, "(Attachment(0.5, mass=1.0),)"),
    "constraints": _tuple_of(Constraint, "(at(1.0, lambda x, c: x.r[0]),)"),
    "breaks": _tuple_of(Real, "(0.5,)"),
    "interval": interval(0.0, 1.0, real),
    "span": interval(0.0, 1.0, real),
}
"""Checks of the fields of a scene that are no functions."""


class Stated(type):
    """Class whose ``dir``, and so ``help`` and completion, has its fields and what its ``PUBLIC`` names."""

    def __dir__(cls) -> list[str]:
        return sorted([*getattr(cls, "__dataclass_fields__", ()), *getattr(cls, "PUBLIC", ()), "__init__"])


@dataclass(frozen=True)
class Scene(Contribution, metaclass=Stated):
    """A boundary value problem for one rod, as a person states it.

    Parameters
    ----------
    name, title
        Used for folders and headings.
    interval
        Arclength of the two ends in the reference state.
    rod
        One of the keys of :data:`rodfem.forms.kinematics.RODS`: which strains are free.
    energy
        Stored energy ``W(v, k, c)`` per unit length.  Strains that the kind of rod keeps undeformed count for nothing
        in it, which the terminal says.
    parameters
        Named constants, each a :class:`Parameter` or a number; ``load`` names the one that is varied.
    ends
        Left and right :class:`~rodfem.problem.ends.End`, or a :class:`~rodfem.problem.ends.Ring`.
    ordinate
        What to record in addition to the load.
    inertia
        Kinetic metric of the spectrum, or a :class:`Drag`; unit rotary inertia by default, which serves to count.
    distributed
        ``distributed(c)``, dead force per unit length (3,), a function of ``c.s`` if wanted; gravity, say.
    follower
        ``follower(c)``, force per unit length by its components along the directors.  Not conservative.
    potential
        ``potential(x, c)``, potential energy per unit length of what else acts along the rod: an elastic foundation, a
        pressure.
    attachments, constraints
        What is attached along the rod; tendons, and equations that it must fulfil: see :mod:`rodfem.problem.ends`.
    breaks
        Arclengths at which the material or the loads jump: element boundaries are put there.
    planar
        ``"e1"`` or ``"e2"``: the rod moves only in the plane across that axis.  Rotations about it, two displacements,
        two forces and two strains are all that is left; the index in space is recorded, too.
    start
        Quaternion(s) of a first guess, ``start(s)`` of shape (m,) -> (m, 4); by default the
        natural shape if that fits between the ends, or a straight rod.
    span
        Default range of the load, from where the continuation starts to where it ends.
    states
        Name of the first branch; by default ``straight`` if its states are, ``ring`` for a closed rod, and
        ``first branch`` for any other.
    """

    PUBLIC = ("varying", "in_space", "constants", "stiffness", "length", "conservative", "without_potential")

    name: str
    interval: tuple[float, float]
    rod: str
    energy: Callable[[Any, Any, Constants], Any] = field(metadata={"role": Role("stored energy", "W(v, k, c)")})
    parameters: Mapping[str, Any]  # Parameter or float as given, Parameter as kept: dataclasses have one type for both
    load: str
    ends: tuple[End, End] | Ring = field(metadata={"places": ("left", "right")})
    ordinate: Ordinate
    span: tuple[float, float]
    title: str = ""
    inertia: Inertia | Drag = Inertia()
    distributed: Given = role_field(Role("distributed force", "f(c)", 3, along=True, load=DEAD))
    follower: Given = role_field(Role("distributed follower force", "f(c)", 3, along=True, load=FOLLOWER))
    potential: OfPlace | None = role_field(Role("potential along the rod", "f(x, c)", 0, along=True, load=POTENTIAL))
    attachments: tuple[Attachment, ...] = ()
    constraints: tuple[Constraint, ...] = ()
    breaks: tuple[float, ...] = ()
    planar: str | None = None
    start: Callable[[np.ndarray], np.ndarray] | None = role_field(START)
    states: str | None = None

    def __post_init__(self) -> None:
        convert(self, **KINDS)
        for what, function, role in functions_of(self):
            check_function(what, function, role)
        for field_name, value in changes(self, guarded).items():
            object.__setattr__(self, field_name, value)
        self._check_values()
        check_scene(self)

    def __dir__(self) -> list[str]:
        return dir(type(self))

    def _check_values(self) -> None:
        """Raise :class:`SceneError` for a rod without a length, an unknown kind or load, or a constant out of range."""
        a, b = self.interval
        if not (isfinite(a) and isfinite(b) and a < b):
            raise SceneError(f"The rod's interval ({a:g}, {b:g}) is empty: give two finite ends, the left one first.")
        if not isinstance(self.rod, str) or self.rod not in RODS:
            raise SceneError(f"Unknown kind of rod {self.rod!r}: choose one of {', '.join(map(repr, RODS))}.")
        if not isinstance(self.load, str) or self.load not in self.parameters:
            raise SceneError(f"The load {self.load!r} is not a parameter: choose one of {', '.join(self.parameters)}.")
        for name, parameter in self.parameters.items():
            parameter.check(name, parameter.value)
        self.check_span(self.span)

    def check_span(self, span: tuple[float, float]) -> None:
        """Raise :class:`SceneError` unless a range of loads is admissible, and checked as the scene's own."""
        for value in span:
            self.parameters[self.load].check(self.load, value)
        if span[0] == span[1]:
            raise SceneError(f"The range of {self.load} from {span[0]:g} to {span[1]:g} is empty: give two loads.")
        if abs(span[1] - span[0]) <= NEGLIGIBLE * max(map(abs, span)) + TINY:
            what = f"The range of {self.load} from {span[0]:.17g} to {span[1]:.17g}"
            raise SceneError(f"{what} is as narrow as round-off: choose others.")
        if tuple(span) != self.span:
            replace(self, span=span)

    # --- other scenes

    def varying(self, load: str = "", span: tuple[float, float] | None = None, /, **values: float) -> Scene:
        """Return the same scene with another parameter as its ``load``, over ``span``, and other constants.

        What is left out stays.  Scenes that are made so from one another, or by :func:`dataclasses.replace`, have the
        same functions: forms are derived and compiled once for all of them.

        Raises :class:`SceneError` for a name that is no parameter's.
        """
        unknown = [name for name in values if name not in self.parameters]
        if unknown:
            raise SceneError(f"{unknown[0]!r} is not a parameter: choose one of {', '.join(self.parameters)}.")
        parameters = {n: replace(p, value=values.get(n, p.value)) for n, p in self.parameters.items()}
        return replace(self, load=load or self.load, span=span or self.span, parameters=parameters)

    def check_constant(self, name: str) -> None:
        """Raise :class:`SceneError` for what is no parameter, or the load."""
        if name not in self.parameters or name == self.load:
            others = ", ".join(sorted(self.parameters.keys() - {self.load}))
            choose = f"choose one of {others}" if others else "there is none, so add one"
            raise SceneError(f"{name!r} is no constant of the scene apart from its load: {choose}.")

    def in_space(self) -> Scene:
        """Return the same rod, free to leave its plane."""
        return replace(self, planar=None)

    def alike(self, other: Scene) -> bool:
        """Whether another scene has the same functions and all else: values of constants, load and range may differ."""
        own = {"interval", "parameters", "load", "span"}  # another scene has its own objects there
        same = all(getattr(self, f.name) is getattr(other, f.name) for f in fields(self) if f.name not in own)
        return same and self.interval == other.interval and [*self.parameters] == [*other.parameters]

    # --- parts and places

    @property
    def sides(self) -> tuple[End, End]:
        """The two ends."""
        left, right = self.ends
        return left, right

    @property
    def closed(self) -> bool:
        """Whether the two ends are joined to each other."""
        return self.sides[0].closed

    @cached_property
    def parts(self) -> list[Part]:
        """All that contributes but the stored energy; multipliers that are fields are numbered by themselves."""
        out = [Part(self, 0, None), *(Part(end, i, self.interval[i]) for i, end in enumerate(self.sides))]
        out += [Part(x, i, x.s) for i, x in enumerate(self.attachments)]
        for i, x in enumerate(self.constraints):
            out.append(Part(acting(x, self), sum(y.letter == x.letter for y in self.constraints[:i]), x.s))
        return out

    @cached_property
    def tables(self) -> list[tuple[Table, str]]:
        """Tables that its functions call, each with the name of what it is called with, as ``s``."""
        entries = (part for e in expressions_of(self) for part in parts(e) if isinstance(part, Entry))
        calls = dict.fromkeys((e.table, e.ufl_operands[0].name.removeprefix("c.")) for e in entries)
        for table, name in calls:
            value = vars(self.constants())[name]
            table.check(name, self.interval if name == "s" else self.span if name == self.load else (value, value))
        return list(calls)

    @property
    def normal(self) -> int | None:
        """Component (0 or 1) across the plane of a planar rod, None for a rod in space."""
        return None if self.planar is None else int(self.planar[1]) - 1

    @property
    def length(self) -> float:
        """Reference length of the rod."""
        return self.interval[1] - self.interval[0]

    @property
    def free_strains(self) -> tuple[int, ...]:
        """Components of ``v`` that are unknowns."""
        return RODS[self.rod]

    @property
    def joints(self) -> tuple[float, ...]:
        """Arclengths inside the rod that must be element boundaries, in ascending order; one for what is one place."""
        tendons = (s for x in self.constraints for s in x.places)
        return self._distinct({*self.breaks, *(part.s for part in self.parts if part.s is not None), *tendons})

    @property
    def stops(self) -> tuple[float, ...]:
        """Loads at which a piecewise linear path has a corner: a branch has a row there, and no step across."""
        return tuple(sorted({load for table, name in self.tables if name == self.load for load in table.corners}))

    @property
    def vertices(self) -> tuple[float, ...]:
        """Joints, and the knots of piecewise linear tables where these are few: there elements of a mesh meet."""
        knots = {s for table, name in self.tables if name == "s" for s in table.corners}
        return self._distinct({*self.joints, *(knots if len(knots) < 64 else ())})  # of more an element has several

    def _distinct(self, places: set[float]) -> tuple[float, ...]:
        """Places inside the rod in ascending order, one for what is one place."""
        inner = [s for s in sorted(places) if self.is_inside(s)]
        return tuple(s for i, s in enumerate(inner) if not i or not same_place(inner[i - 1], s, self.length))

    def is_inside(self, s: float) -> bool:
        """Whether an arclength is inside the rod, not at an end."""
        close = SAME_PLACE * self.length
        return self.interval[0] + close < s < self.interval[1] - close

    def samples(self) -> list[float]:
        """Arclengths at which the material is checked: nine from end to end, and both sides of all breaks."""
        a, b = self.interval
        eps = 1e-6 * self.length  # to either side of a jump
        return sorted({*np.linspace(a + eps, b - eps, 9).tolist(), *(s + d for s in self.joints for d in (-eps, eps))})

    def loads(self) -> list[float]:
        """Loads at which all that depends on the load is checked: both ends of the range, then some inside."""
        return [*self.span, *inside(self.span)]

    def constants(self, load: float | None = None, s: float | None = None) -> Constants:
        """Namespace of all parameters as numbers, at ``load`` and at the arclength ``s`` (default: the mid-point)."""
        values = {name: p.value for name, p in self.parameters.items()}
        if load is not None:
            values[self.load] = load
        return Constants(s=sum(self.interval) / 2 if s is None else s, **values)

    @cached_property
    def needs_centreline(self) -> str:
        """What needs the centreline as a field, in words; empty where nothing does."""
        return needs_centreline(self)

    # --- loads, inertia, units

    @cached_property
    def conservative(self) -> bool:
        """Whether all loads have a potential, so that stability is a matter of the second variation alone."""
        return not self.without_potential()

    def without_potential(self, *, in_space: bool = False) -> list[str]:
        """Loads that have no potential, in words; for a planar rod those that have none while it stays in its plane."""
        planar = self.planar is not None and not in_space
        return [
            what for what, _, role in functions_of(self) if role.load and role.load.potential_in(planar=planar) is None
        ]

    def require_potential(self, what: str) -> None:
        """Raise :class:`SceneError` where ``what`` needs that all loads have a potential, and one has none."""
        if lacking := ", ".join(self.without_potential()):
            raise SceneError(f"{what} needs a scene whose loads all have a potential: {lacking} has none.")

    @cached_property
    def plain(self) -> tuple[bool, bool]:
        """Whether dead forces are all that loads the left end, and the right: they are the contact force there."""
        parts = [x.s for x in self.parts if x.s is not None]
        here = [sum(bool(same_place(s, end, self.length)) for s in parts) for end in self.interval]
        left, right = (side.dead and number == 1 for side, number in zip(self.sides, here, strict=True))
        return left, right

    def end_positions(self, c: Constants) -> list[tuple[Any, Any]]:
        """Component by component the positions of both ends; that of the other end, or zero, where one is free."""
        held = zip(*(end.support(c) for end in self.sides), strict=True)
        pairs = [(right, right) if left is None else (left, left if right is None else right) for left, right in held]
        return [(0.0, 0.0) if pair == (None, None) else pair for pair in pairs]

    def known_force(self, component: int, c: Constants) -> Any | None:
        """Component of the contact force that a dead end force prescribes, or None where it is an unknown."""
        for side, sign in ((1, 1), (0, -1)):
            force = self.sides[side].contact_force(c)[component]
            if self.plain[side] and force is not None:
                return sign * force
        return None

    @property
    def has_inertia(self) -> bool:
        """Whether the scene states masses or inertias of its own, apart from the unit rotary inertia that counts by."""
        return self.inertia != Inertia() or any(x.mass or x.rotary_inertia for x in self.attachments)

    @cached_property
    def inertia_depends_on_load(self) -> bool:
        """Whether a mass or a rotary inertia, along the rod or attached to it, is a function of the load."""
        return f"c.{self.load}" in names_in_inertia(self)

    @cached_property
    def units(self) -> Units:
        """Natural sizes of the rod's numbers."""
        return units_of(self)

    # --- the stored energy

    def energy_depends_on(self, *names: str) -> bool:
        """Whether the stored energy is a function of one of the parameters ``names``, or of the arclength ``s``."""
        return not names_in(self, "W(v, k, c)").isdisjoint(f"c.{name}" for name in names)

    def energy_at(self, v: np.ndarray, k: np.ndarray, c: Constants) -> float:
        """Stored energy per length where the strains (3,) differ by ``v`` and ``k`` from the undeformed ones."""
        strains = [UNDEFORMED[i] + float(v[i]) for i in range(3)]
        W = self.energy(ufl.as_vector(strains), ufl.as_vector([float(x) for x in k]), c)
        return float(ufl.as_ufl(W)(()))

    @cached_property
    def ignored_strains(self) -> tuple[int, ...]:
        """Components of ``v`` that the stored energy depends on, but that the kind of rod keeps undeformed."""
        names = names_in(self, "W(v, k, c)")
        return tuple(i for i in range(3) if i not in self.free_strains and f"v[{i}]" in names)

    def stiffness(self, s: float | None = None) -> np.ndarray:
        """Second derivative of ``W`` in the m free strains and ``k`` at the undeformed state, (m + 3, m + 3)."""
        return derived(self, ("stiffness", s), lambda: self._stiffness_at(s))

    def _stiffness_at(self, s: float | None) -> np.ndarray:
        c, hessian = derived(self.energy, ("hessian", self.rod, *self.parameters), self._hessian)
        for name, value in vars(self.constants(s=s)).items():
            getattr(c, name).value = value
        out = np.zeros((len(self.free_strains) + 3,) * 2)
        for i, j in zip(*np.tril_indices(len(out)), strict=True):
            out[i, j] = out[j, i] = float(evaluated(hessian, (int(i), int(j))))
        return out

    def _hessian(self) -> tuple[Constants, Any]:
        """Second derivative of ``W`` in the strains of :meth:`stiffness`, and the symbols of its constants."""
        c = symbols(self)
        return c, differentiated(self.second_derivative([UNDEFORMED[i] for i in self.free_strains] + [0.0] * 3, c)[1])

    def second_derivative(self, values: list[Any], c: Constants) -> tuple[Any, Any]:
        """A variable in UFL of these ``values`` of the m free strains and ``k``, and the second derivative of ``W``."""
        m, x = len(self.free_strains), ufl.variable(ufl.as_vector(values))
        v, k = strain(self.free_strains, [x[i] for i in range(m)]), ufl.as_vector([x[m + i] for i in range(3)])
        return x, ufl.diff(ufl.diff(ufl.as_ufl(self.energy(v, k, c)), x), x)
