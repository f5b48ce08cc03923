"""The functions of a scene, tried before any computation: with numbers, as expressions of UFL, and across a plane.

In the equations each constant is an expression that stands for any number of its range.  A function that branches by
the value of a constant (``c.on == 1``, ``in``, ``if c.on``, a key of a dictionary) takes one branch for numbers and may
take another there.  So the function and its expression are compared at the same constants and states.  The symbols in
the expression are what the function depends on: constants, components of the state, the arclength.

Of a planar rod, functions of the constants are zero across the plane; functions of the state, and the stored energy,
have one value at two states that are each other's image by the plane.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Iterator, Sized
from dataclasses import dataclass
from itertools import chain, product
from math import inf, isfinite, isnan, nan
from numbers import Real
from typing import TYPE_CHECKING, Any

import numpy as np
import ufl

from rodfem.errors import SceneError
from rodfem.expressions import Symbol, differentiated, evaluated, parts
from rodfem.forms.kinematics import UNDEFORMED
from rodfem.problem.arguments import check_scalar, check_vector, number_of, plain, takes
from rodfem.problem.functions import (
    LOG_OF_UFL,
    SIDES,
    STATES,
    Constants,
    Place,
    Role,
    derived,
    functions_of,
    inside,
    places_at,
    some_places,
)
from rodfem.tolerances import NEGLIGIBLE

if TYPE_CHECKING:
    from rodfem.problem.scene import Scene

OF_PLACES = ("f(x, c)", "of(x, c)", "W(v, k, c)")  # calls of functions of a place
SAME = 1e-9  # difference of two values of a function, over the larger one, below which they are equal
ASIDE = 1e-3
"""Displacement over length, strain or rotation out of the plane, to either side, at which energies are tried."""


def symbols(scene: Scene, names: Container[str] | None = None) -> Constants:
    """Constants as a function of them meets them in the equations: those with the ``names`` (all) as expressions."""
    values = vars(scene.constants()).items()
    return Constants(**{n: x if names is not None and n not in names else Symbol.named(f"c.{n}") for n, x in values})


def check_function(what: str, function: Any, role: Role) -> None:
    """Raise :class:`SceneError` for what is no function of its arguments, nor a constant in the place of one."""
    if not callable(function):
        if role.call == "f(c)" and (isinstance(function, Real) if role.size == 0 else isinstance(function, Sized)):
            return
        method = ", as section.energy(rod) is" if callable(getattr(function, "energy", None)) else ""
        raise SceneError(f"The {what} is {function!r}: give a function {role.call}{method}.")
    if not takes(function, role.arguments):
        meanings = f", where {role.meanings}" if role.meanings else ""
        raise SceneError(f"The {what} is no function of {role.arguments} argument(s): give {role.call}{meanings}.")


def check_functions(scene: Scene) -> None:
    """Raise :class:`SceneError` for a function of a scene that is wrong with numbers, or another as an expression."""
    for trial in _trials(scene):
        trial.compare()
        if not trial.role.placed and "c.s" in trial.names:
            words = "asks for the arclength c.s, but does not vary along the rod: write the number."
            raise SceneError(f"The {trial.what} {words}")


def expressions_of(scene: Scene) -> Iterator[Any]:
    """What functions of a scene return for symbols of its constants."""
    for trial in sorted(_trials(scene), key=lambda trial: trial.of_place):
        yield from (e for e in trial.expressions[1] if e is not None)


def names_in(scene: Scene, *calls: str) -> set[str]:
    """Names of the constants and components of the state in what functions of a scene that are called so return."""
    return {name for trial in _trials(scene) if trial.role.call in calls for name in trial.names}


def asked_for(scene: Scene) -> set[str]:
    """Names of the constants in the equations of a scene."""
    names = names_in(scene, "f(c)", "f(x, c)", "W(v, k, c)")
    return {name.removeprefix("c.") for name in names if name.startswith("c.")}


def names_in_inertia(scene: Scene) -> set[str]:
    """Names of the constants in what masses and rotary inertias, or drag, return."""
    functions = (f for owner in (scene.inertia, *scene.attachments) for f in functions_of(owner, nested=False))
    own = ((what, f, role) for what, f, role in functions if role.call == "f(c)" and role.load is None)
    return {name for each in own for name in _Trial(scene, *each, None).names}


def is_placed(scene: Scene) -> bool:
    """Whether a function of a place, a spring or a constraint, depends on where the rod is."""
    return any(trial.asks_where for trial in _trials(scene) if trial.role.call == "f(x, c)")


def floats(scene: Scene) -> bool:
    """Whether nothing holds the rod where it is: no end, no spring, no constraint."""
    held = scene.closed or any(len(end.fixed(scene.constants())) for end in scene.sides)
    return not (held or is_placed(scene))


def needs_centreline(scene: Scene) -> str:
    """Say what in a scene needs the centreline as a field, in words; empty where nothing does."""
    return next((what for what, needs in chain(_needs(scene), _asking(scene)) if needs), "")


def _needs(scene: Scene) -> Iterator[tuple[str, bool]]:
    attached = [x for x in scene.attachments if scene.is_inside(x.s)]
    yield "the mass of a rod under a load without potential", not scene.conservative
    yield "a distributed force", scene.distributed is not None
    yield "what is attached along the rod", any(x.force or x.mass for x in attached)
    yield "the mass of the rod", scene.inertia.rho_A(scene.constants()) != 0
    floating = floats(scene) and not all(scene.plain)
    yield "a rod that nothing holds, with more than dead forces at its ends,", floating


def _asking(scene: Scene) -> Iterator[tuple[str, bool]]:
    for owner in (*(part.of for part in scene.parts if part.s is None or scene.is_inside(part.s)), scene.ordinate):
        for what, function, role in functions_of(owner, nested=False):
            of_place = role.call in ("f(x, c)", "of(x, c)")
            yield f"the {what}", of_place and _Trial(scene, what, function, role, None).asks_where


def _trials(scene: Scene) -> Iterator[_Trial]:
    for what, function, role in functions_of(scene):
        if role.call in OF_PLACES or (role.call == "f(c)" and role.size is not None):
            yield from (_Trial(scene, what, function, role, s) for s in _places(scene, function, role))


def _places(scene: Scene, function: Any, role: Role) -> list[float | None]:
    """Arclengths at which something acts, numbers in the equations too; None for what is a function of them."""
    if role.along or not role.placed or role.call == "W(v, k, c)":
        return [None]
    at = [x.s for x in scene.parts if x.s is not None and any(function is f for f in vars(x.of).values())]
    return [*dict.fromkeys(at)] or [None]


@dataclass(frozen=True)
class _Trial:
    """A function of a scene, ``what`` it is in words, and the arclength at which it acts, None along the rod."""

    scene: Scene
    what: str
    function: Callable[..., Any]
    role: Role
    s: float | None

    @property
    def of_place(self) -> bool:
        """Whether it is a function of a place."""
        return self.role.call in OF_PLACES

    @property
    def names(self) -> set[str]:
        """Names of the constants and components of the state that its expressions depend on: ``c.P``, ``x.r[0]``."""
        every = (part for e in self.expressions[1] if e is not None for part in parts(e))
        return {part.name for part in every if isinstance(part, Symbol)}

    @property
    def asks_where(self) -> bool:
        """Whether it depends on where the rod is."""
        return any(name.startswith(("x.r", "x.dr")) for name in self.names)

    def compare(self) -> None:
        """Raise :class:`SceneError` for a value of the expression that is not the one of the function of numbers."""
        load, found = self.scene.load, list(self._found())
        size = max((abs(x) for _, x, _ in found if isfinite(x)), default=0.0)
        for symbolic, number, there in found:
            least = SAME * max(abs(number), min(abs(symbolic), size)) + NEGLIGIBLE * size
            if isnan(symbolic) or not isfinite(number) or abs(symbolic - number) <= least:
                continue
            name = next((x for x in self.scene.parameters if x != load), load)
            raise SceneError(
                f"The {self.what} is {number:.10g} as a function of numbers and {symbolic:.10g} as an expression of "
                f"its constants, at {load} = {vars(there)[load]:g}: do not compare constants by ==, in or if, nor use "
                f"them as keys; write ufl.conditional(ufl.eq(c.{name}, 1), ..., ...)."
            )

    def _found(self) -> Iterator[tuple[float, float, Constants]]:
        """Values of expression and function, nan if UFL has none, inf if undefined, and the constants there."""
        for there in self._constants():
            try:
                numbers = self._called(there)
            except SceneError:
                if self.of_place:  # it may be undefined: the rod need not take the state
                    continue
                raise
            self._check(numbers)
            c, expressions = self.expressions
            for name, symbol in vars(c).items():
                if isinstance(symbol, Symbol):
                    symbol.value = vars(there)[name]
            yield from ((*_pair(e, x), there) for e, x in zip(expressions, numbers, strict=True))

    def _constants(self) -> Iterator[Constants]:
        scene = self.scene
        s = inside(scene.interval)[0] if self.s is None and self.of_place else self.s
        yield from (scene.constants(load, s) for load in (None, *scene.loads()))
        if self.role.along and not self.of_place:
            yield from (scene.constants(s=place) for place in scene.samples())

    def _called(self, c: Constants, wrap: Callable[[Any], Any] | None = None) -> list[Any]:
        """Components of what the function returns for constants, and a state whose vectors pass through ``wrap``."""
        if self.of_place:
            return [of_state(self.function, self.role, some_places(self.scene, wrap, c.s), c)]
        values = self.function(c)
        if self.role.size:
            check_vector(self.what, values, self.role.size)
        return list(values) if self.role.size else [values]

    def _check(self, values: list[Any]) -> None:
        """Check kinds, and that constants are finite."""
        for i, value in enumerate(values):
            what = f"component {i + 1} of the {self.what}" if self.role.size else self.what
            if value is None and self.role.gaps:
                continue
            if not self.role.size:
                check_scalar(what, value)
            if not self.of_place and not isfinite(number_of(value)):
                raise SceneError(f"The {what} is {value}: return a finite real number.")

    @property
    def expressions(self) -> tuple[Constants, list[Any]]:
        """Constants as the equations have them, and what the function makes of them; derived once."""
        key = (self.role, self.s, self.scene.length, *self.scene.parameters)
        return derived(self.function, key, self._symbolic)

    def _symbolic(self) -> tuple[Constants, list[Any]]:
        c = symbols(self.scene, None if self.s is None else self.scene.parameters)
        if self.s is not None:
            c.s = self.s
        before = "" if self.role.call == "W(v, k, c)" else "x."
        names = (f"{before}{name}" for name in ("q", "r", "v", "k", "dr"))

        def symbolic(vector: Any) -> Any:
            name, size = next(names), vector.ufl_shape[0]
            return ufl.as_vector([Symbol.named(f"{name}[{i}]", float(vector[i])) for i in range(size)])

        found = self._called(c, symbolic)
        if self.of_place:
            self._check(found)
        return c, [e if e is None else differentiated(ufl.as_ufl(e)) for e in found]


def of_state(function: Callable[..., Any], role: Role, places: tuple[Place, Place], c: Constants) -> Any:
    """Value of a function of a place, or of the strains, at a point or along the rod."""
    point, rod = places
    return function(rod.v, rod.k, c) if role.call == "W(v, k, c)" else function(rod if role.along else point, c)


def _pair(expression: Any, value: Any) -> tuple[float, float]:
    """Values of an expression and of a function; of two that are None nan, of one that is None none that agree."""
    if expression is None or value is None:
        return (nan, nan) if expression is value else (inf, 0.0)
    silent, LOG_OF_UFL.disabled = LOG_OF_UFL.disabled, True
    try:
        return plain(evaluated(expression)), number_of(value)
    except (ArithmeticError, ValueError):
        return inf, number_of(value)
    except Exception:  # of UFL's own, too, for a function that it does not evaluate
        return nan, number_of(value)
    finally:
        LOG_OF_UFL.disabled = silent


# --- the plane of a planar rod


def check_plane(scene: Scene) -> None:
    """Raise :class:`SceneError` for what moves a planar rod out of its plane, or pushes it out."""
    if scene.normal is not None:
        for c in map(scene.constants, scene.loads()):
            _check_ends(scene, scene.normal, c)
        for what, function, role in functions_of(scene):
            if role.load is not None and role.call == "f(c)":
                _check_load(scene, what, function, [i for i in range(3) if (i == scene.normal) != role.load.moment])
        _check_functions_of_states(scene, scene.normal)


def _check_ends(scene: Scene, normal: int, c: Constants) -> None:
    left, right = (end.support(c)[normal] for end in scene.sides)
    if left is not None and right is not None and abs(float(left) - float(right)) > NEGLIGIBLE * scene.length:
        held = f"at {float(left):g} and {float(right):g} along {scene.planar}"
        raise SceneError(f"The ends are held {held}, across which the rod is planar: hold both at the same.")
    for side, end in zip(SIDES, scene.sides, strict=True):
        frame = np.array([float(x) for x in end.frame(c) or ()])
        if frame.size and abs(np.delete(frame[1:], normal)).max() > NEGLIGIBLE * np.linalg.norm(frame):
            raise SceneError(f"The rotation of the {side} end leaves the plane across {scene.planar}: turn about it.")


def _check_load(scene: Scene, what: str, function: Callable[..., Any], out: list[int]) -> None:
    """Try a load, whose components ``out`` push out of the plane, at loads and arclengths."""
    for load, s in product(scene.loads(), scene.samples()):
        values = [float(x) for x in function(scene.constants(load, s))]
        if any(values[i] for i in out):
            where = f"its plane across {scene.planar}, with {values}"
            raise SceneError(f"The {what} pushes the rod out of {where}: leave that component out, or planar.")


def _check_functions_of_states(scene: Scene, normal: int) -> None:
    functions = [found for found in functions_of(scene) if found[2].call in ("f(x, c)", "W(v, k, c)")]
    for state, c in _tried(scene):
        sides = [_side(scene, normal, state, c.s, sign) for sign in (1.0, -1.0)]
        for what, function, role in functions:
            one, other = (_defined(function, role, places, c) for places in sides)
            if abs(one - other) > NEGLIGIBLE * max(abs(one), abs(other)):
                where = f"its plane across {scene.planar}, as its two sides are not alike to it"
                raise SceneError(f"The {what} pushes the rod out of {where}: leave that out, or planar.")


def _tried(scene: Scene) -> Iterator[tuple[int, Constants]]:
    """States, by their numbers, and constants at which functions of a state are tried."""
    yield from ((state, scene.constants()) for state in range(len(STATES)))
    for c in (*map(scene.constants, scene.loads()), *(scene.constants(s=s) for s in scene.samples())):
        yield 0, c


def _side(scene: Scene, normal: int, state: int, s: float, sign: float) -> tuple[Place, Place]:
    """A point and a place along the rod, in one of :data:`STATES` moved into the plane and then aside."""
    q, r, v, k = (np.array(x) for x in STATES[state])
    out = np.arange(3) == normal
    free = np.isin(np.arange(3), scene.free_strains)
    # generic: no motion is another's opposite
    aside = sign * ASIDE * np.random.default_rng(0).uniform(0.5, 1.0, (4, 3))
    turned = np.append(q[0], np.where(out, q[1:], 0.0))
    turned /= np.linalg.norm(turned)
    turned[1:] += np.where(out, 0.0, aside[0])
    strains = np.where(out, free * aside[2], np.where(free, v, UNDEFORMED))
    return places_at(scene.length, s, (turned, np.where(out, aside[1], r), strains, np.where(out, k, aside[3])))


def _defined(function: Callable[..., Any], role: Role, places: tuple[Place, Place], c: Constants) -> float:
    """Value of a function, zero if it is undefined: at a state that the rod need not take."""
    try:
        value = number_of(of_state(function, role, places, c))
    except SceneError:
        return 0.0
    return value if isfinite(value) else 0.0
