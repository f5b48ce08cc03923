"""Formulations of a rod: a class derived from :class:`Formulation` each, registered by name in :data:`FORMULATIONS`."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import ufl

from rodfem.errors import Argument, InputError, Remedy
from rodfem.forms import lagrangian
from rodfem.problem.contribution import UNIT, Block, Group, Motion, Unknown
from rodfem.problem.end import LETTERS, SIDES
from rodfem.problem.local_state import needs_centreline

if TYPE_CHECKING:
    from rodfem.fem.equations import Equations
    from rodfem.fem.fields import Fields
    from rodfem.fem.shape import Shape
    from rodfem.fem.state import NodalValues
    from rodfem.modes.perturbation import Motions
    from rodfem.problem.local_state import Constants, Place
    from rodfem.problem.scene import Scene

CONTACT_FORCE = "n"
"""Name of the contact force: a field, or the beginning of the names of scalars."""


class Formulation(ABC):
    """Which unknowns a rod has in addition to rotations and strains, its Lagrangian in them, and where they say it is.

    ``name`` is that in files and options, ``words`` are what is unknown, and ``centreline`` says whether that is a
    field, ``r``.
    """

    name: ClassVar[str]
    words: ClassVar[str]
    centreline: ClassVar[bool]

    def refusal(self, scene: Scene) -> str:
        """Why it does not apply to a scene, in words that follow its name; empty if it does."""
        return ""

    def blocks(self, degree: int) -> list[Block]:
        """Fields in addition to rotations and strains, for a rotation of this degree."""
        return []

    def unknowns(self, scene: Scene) -> list[Unknown]:
        """Scalar unknowns in addition to those of the parts of the scene."""
        return []

    def left_out(self, scene: Scene) -> list[str]:
        """What is no unknown, each with the reason."""
        return []

    @abstractmethod
    def integrand(self, equations: Equations, W: Any, along: Place) -> Any:
        """Integrand of the Lagrangian of the rod with the stored energy ``W``: see :mod:`rodfem.forms.lagrangian`."""

    @abstractmethod
    def contact_force(self, equations: Equations) -> list[Any]:
        """Components of the contact force in space (3,)."""

    @abstractmethod
    def position(self, equations: Equations, c: Constants, at: Callable[[Any], Any], side: int | None) -> Any:
        """Position (3,) where ``at`` restricts a field to, None if there is none.

        It is one in the ``equations``, where the constants are ``c``; ``side`` is 0 or 1 at an end.
        """

    @abstractmethod
    def sums(self, shape: Shape, state: NodalValues, integral: np.ndarray, value: np.ndarray) -> np.ndarray:
        """Share of this rank in the position at a place without its offset (3,), or in that and the chord (2, 3).

        ``integral`` are weights (2, points) of slopes in their integrals to the place and over the rod, ``value``
        (nodes,) of nodal values in the value there; ``shape`` has the nodes, ``state`` the values.
        """

    @abstractmethod
    def nodal(self, shape: Shape, state: NodalValues) -> tuple[np.ndarray, np.ndarray]:
        """Positions of the nodes (m, 3) without their offset, and the chord (3,)."""

    @abstractmethod
    def offset(self, fields: Fields, state: NodalValues, s: np.ndarray, chord: np.ndarray) -> np.ndarray:
        """Offset of the positions of a ``state`` on ``fields`` at the arclengths ``s`` (...,): (..., 3) or (3,).

        ``chord`` (3,) is the difference of its ends.
        """

    @abstractmethod
    def store(self, shape: Shape, out: np.ndarray, r: np.ndarray, ends: tuple[Any, Any]) -> None:
        """Write positions ``r`` (cells, nodes, 3) above the lift, and those of the ``ends``, into local values ``out``.

        ``shape`` has the owned cells and their nodes.
        """

    @abstractmethod
    def displacement(self, motions: Motions, state: NodalValues, change: NodalValues) -> np.ndarray:
        """Displacement of the nodes (m, 3) in a change of the state."""


class Pointwise(Formulation):
    """Centreline and contact force are fields.

    It applies to all scenes; the field ``r`` is measured from the lift of the ends' positions.
    """

    name, words, centreline = "pointwise", "all fields", True

    def blocks(self, degree: int) -> list[Block]:
        """Centreline and contact force."""
        return [Block("r", 3, degree, True, False), Block(CONTACT_FORCE, 3, degree - 1, False, True)]

    def integrand(self, equations: Equations, W: Any, along: Place) -> Any:
        """With ``r' = R v`` at each point."""
        return lagrangian.pointwise(W, along.R, along.v, along.dr, equations.unknowns.n)

    def contact_force(self, equations: Equations) -> list[Any]:
        """A field."""
        return [equations.unknowns.n[i] for i in range(3)]

    def position(self, equations: Equations, c: Constants, at: Callable[[Any], Any], side: int | None) -> Any:
        """Known everywhere."""
        return at(equations.unknowns.r) + equations.lift(c)

    def sums(self, shape: Shape, state: NodalValues, integral: np.ndarray, value: np.ndarray) -> np.ndarray:
        """No chord is needed."""
        return value @ state.values("r")[shape.cells].reshape(-1, 3)

    def nodal(self, shape: Shape, state: NodalValues) -> tuple[np.ndarray, np.ndarray]:
        """Values of the field."""
        r = shape.nodal(state.values("r")[shape.cells])
        return r, r[-1] - r[0]

    def offset(self, fields: Fields, state: NodalValues, s: np.ndarray, chord: np.ndarray) -> np.ndarray:
        """The lift."""
        return fields.lift(s, state.constants())

    def store(self, shape: Shape, out: np.ndarray, r: np.ndarray, ends: tuple[Any, Any]) -> None:
        """In the field."""
        out[shape.system.fields.dofs["r"][shape.cells][:, shape.order]] = r

    def displacement(self, motions: Motions, state: NodalValues, change: NodalValues) -> np.ndarray:
        """Values of the field."""
        return motions.nodal(change.values("r")[motions.cells])


class Reduced(Formulation):
    """No centreline, and a contact force that is constant along the rod.

    It applies where nothing acts along the rod, and nothing there asks where the rod is.  The centreline is recovered
    by integrating ``r' = R v`` with the quadrature of the weak form, so that it closes exactly where the integral
    constraints say it does, and is as accurate as the pointwise one.
    """

    name, words, centreline = "reduced", "no centreline, the contact force as scalars", False

    def refusal(self, scene: Scene) -> str:
        """What needs the centreline."""
        reason = needs_centreline(scene)
        return reason and f"has no centreline, which {reason} needs"

    def unknowns(self, scene: Scene) -> list[Unknown]:
        """Scalar unknowns in the place of fields.

        Components ``n1``.. of a constant contact force, positions ``a1``.., ``b1``.. of the left and right end where
        other than dead forces act on it.
        """
        c, inside = scene.constants(), [i for i in range(3) if i != scene.normal]
        force = Group(
            CONTACT_FORCE,
            "contact force",
            "position of the ends along e{}",
            Motion.VECTOR,
            lambda c: [scene.known_force(i, c) for i in range(3)],
        )
        out = [Unknown(force, i, UNIT[i]) for i in inside if scene.known_force(i, c) is None]
        for side, end in enumerate(scene.sides):
            if not scene.plain[side]:
                place = Group(LETTERS[side], f"position of the {SIDES[side]} end", "", Motion.POSITION, end.held)
                out += [Unknown(place, i, UNIT[i]) for i in inside if end.held(c)[i] is None]
        return out

    def left_out(self, scene: Scene) -> list[str]:
        """Centreline and field of the contact force, and which components of that are known."""
        lines = [
            "centreline r and the field of contact force: no force acts along the rod, "
            "so that the contact force is constant"
        ]
        known = [f"n{i + 1}" for i in range(3) if scene.known_force(i, scene.constants()) is not None]
        if known:
            lines.append(f"contact force {', '.join(known)}: a dead force at an end that is free to move there")
        return lines

    def integrand(self, equations: Equations, W: Any, along: Place) -> Any:
        """With the integral of ``r' = R v``."""
        force = self.contact_force(equations)
        left, right = self._ends(equations, equations.constants)
        chord = [0.0 if x is None or y is None else y - x for x, y in zip(left, right, strict=True)]
        return lagrangian.reduced(W, along.R, along.v, ufl.as_vector(force), ufl.as_vector(chord) / equations.length)

    def contact_force(self, equations: Equations) -> list[Any]:
        """Unknown scalars, and what dead forces prescribe."""
        scene, scalars, c = equations.fields.scene, equations.unknowns.scalars, equations.constants
        return [scalars.get(f"n{i + 1}", scene.known_force(i, c) or 0.0) for i in range(3)]

    def position(self, equations: Equations, c: Constants, at: Callable[[Any], Any], side: int | None) -> Any:
        """Known at an end that is held or whose position is a scalar unknown."""
        r = [None] if side is None else self._ends(equations, c)[side]
        return None if None in r else ufl.as_vector(r)

    def _ends(self, equations: Equations, c: Constants) -> list[list[Any]]:
        return [_end_position(side, equations.fields.scene, c, equations.unknowns.scalars) for side in range(2)]

    def sums(self, shape: Shape, state: NodalValues, integral: np.ndarray, value: np.ndarray) -> np.ndarray:
        """Integrals of the slope."""
        return integral @ shape.slopes(state).reshape(-1, 3)

    def nodal(self, shape: Shape, state: NodalValues) -> tuple[np.ndarray, np.ndarray]:
        """Integrals of the slope."""
        before, inside, chord = shape.integrals(shape.slopes(state))
        return shape.joined(before + inside), chord

    def offset(self, fields: Fields, state: NodalValues, s: np.ndarray, chord: np.ndarray) -> np.ndarray:
        """Position of the left end."""
        return _left_end(fields.scene, state.constants(), state.scalars, chord, float)

    def store(self, shape: Shape, out: np.ndarray, r: np.ndarray, ends: tuple[Any, Any]) -> None:
        """In the scalar positions of the ends."""
        fields = shape.system.fields
        for i, unknown in enumerate(fields.unknown_scalars):
            if unknown.group.motion is Motion.POSITION:
                out[fields.copies[:, i]] = ends[LETTERS.index(unknown.group.name)][unknown.component]

    def displacement(self, motions: Motions, state: NodalValues, change: NodalValues) -> np.ndarray:
        """Integral of the change of slope; of a ring without its mean."""
        scene = motions.system.scene
        before, inside, chord = motions.integrals(motions.slope_changes(state, change))
        r = motions.joined(before + inside)
        r = r + _left_end(scene, scene.constants(), change.scalars, chord, lambda held: 0.0)
        return r - motions.mean(r) if scene.closed else r


def _end_position(
    side: int, scene: Scene, c: Constants, scalars: Mapping[str, Any], given: Callable[[Any], Any] = lambda x: x
) -> list[Any]:
    """Position of the end on one ``side``: ``given(held)``, a scalar unknown by its name, or None (known force there).

    Across the plane of a planar rod an end that nothing holds is where the plane is: at zero.
    """
    letter = LETTERS[side]
    return [
        given(x) if x is not None else scalars.get(f"{letter}{i + 1}", 0.0 if i == scene.normal else None)
        for i, x in enumerate(scene.sides[side].held(c))
    ]


def _left_end(
    scene: Scene, c: Constants, scalars: Mapping[str, Any], chord: np.ndarray, given: Callable[[Any], Any]
) -> np.ndarray:
    """Position (3,) of the left end: where it is held, or else a ``chord`` back from where the right end is."""
    left, right = (_end_position(side, scene, c, scalars, given) for side in range(2))
    return np.array([a if a is not None else (b or 0.0) - d for a, b, d in zip(left, right, chord, strict=True)])


AUTO = "auto"
"""Not a formulation: the first that applies is chosen."""
FORMULATIONS: dict[str, Formulation] = {made.name: made for made in (Reduced(), Pointwise())}


def names() -> tuple[str, ...]:
    """Return what a discretisation may ask for."""
    return AUTO, *FORMULATIONS


def chosen(name: str, scene: Scene) -> Formulation:
    """Formulation of that name, or the first that applies; raises :class:`InputError` where it does not apply."""
    refusals = {other: made.refusal(scene) for other, made in FORMULATIONS.items()}
    first = next(other for other, refusal in refusals.items() if not refusal)
    if refusals.get(name):
        remedy = Remedy("use {}", Argument("Discretization", "formulation", first))
        raise InputError(f"The {name} formulation {refusals[name]}", remedy)
    return FORMULATIONS[first if name == AUTO else name]
