"""The reduced formulation: no centreline, and a contact force that is constant along the rod.

The centreline is recovered by integrating ``r' = R v`` with the quadrature of the weak form, so that it closes exactly
where the integral constraints say it does, and is as accurate as the pointwise one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import ufl

from rodfem.fem.formulation import CONTACT_FORCE, Formulation
from rodfem.forms import lagrangian
from rodfem.problem.contribution import UNIT, Group, Motion, Unknown
from rodfem.problem.end import LETTERS, SIDES
from rodfem.problem.local_state import needs_centreline

if TYPE_CHECKING:
    from rodfem.fem.equations import Equations
    from rodfem.fem.fields import Fields
    from rodfem.fem.shape import Shape
    from rodfem.fem.values import NodalValues
    from rodfem.modes.perturbation import Motions
    from rodfem.problem.local_state import Constants, Place
    from rodfem.problem.scene import Scene


class Reduced(Formulation):
    """It applies where nothing acts along the rod, and nothing there asks where the rod is."""

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

    def integrand(self, equations: Equations, f: Any, c: Constants, W: Any, along: Place) -> Any:
        """With the integral of ``r' = R v``."""
        scene = equations.fields.scene
        force = self.contact_force(equations, f, c)
        left, right = end_positions(scene, c, f.scalars)
        chord = [0.0 if x is None or y is None else y - x for x, y in zip(left, right, strict=True)]
        return lagrangian.reduced(W, along.R, along.v, ufl.as_vector(force), ufl.as_vector(chord) / equations.length)

    def contact_force(self, equations: Equations, f: Any, c: Constants) -> list[Any]:
        """Unknown scalars, and what dead forces prescribe."""
        scene = equations.fields.scene
        return [f.scalars.get(f"n{i + 1}", scene.known_force(i, c) or 0.0) for i in range(3)]

    def position(self, equations: Equations, f: Any, c: Constants, at: Callable[[Any], Any], side: int | None) -> Any:
        """Known at an end that is held or whose position is a scalar unknown."""
        r = [None] if side is None else end_positions(equations.fields.scene, c, f.scalars)[side]
        return None if None in r else ufl.as_vector(r)

    def sums(self, shape: Shape, state: NodalValues, integral: np.ndarray, value: np.ndarray) -> np.ndarray:
        """Integrals of the slope."""
        return integral @ shape.slopes(state).reshape(-1, 3)

    def nodal(self, shape: Shape, state: NodalValues) -> tuple[np.ndarray, np.ndarray]:
        """Integrals of the slope."""
        before, inside, chord = shape.integrals(shape.slopes(state))
        return shape.joined(before + inside), chord

    def offset(self, fields: Fields, state: NodalValues, s: np.ndarray, chord: np.ndarray) -> np.ndarray:
        """Position of the left end."""
        return left_end(fields.scene, state.constants(), state.scalars, chord, float)

    def store(self, shape: Shape, out: np.ndarray, c: Constants, r: np.ndarray, ends: tuple[Any, Any]) -> None:
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
        r = r + left_end(scene, scene.constants(), change.scalars, chord, lambda held: 0.0)
        return r - motions.mean(r) if scene.closed else r


def end_positions(
    scene: Scene, c: Constants, scalars: Mapping[str, Any], given: Callable[[Any], Any] = lambda x: x
) -> list[list[Any]]:
    """Positions of the ends of a ``scene``: ``given(held)``, a scalar unknown, or None (known force there).

    ``c`` are the constants, ``scalars`` the values of the scalar unknowns by name.  Across the plane of a planar rod an
    end that nothing holds is where the plane is: at zero.
    """
    return [end_position(side, scene, c, scalars, given) for side in range(2)]


def end_position(
    side: int, scene: Scene, c: Constants, scalars: Mapping[str, Any], given: Callable[[Any], Any] = lambda x: x
) -> list[Any]:
    """Position of the end on one ``side``: see :func:`end_positions` for ``scene``, ``c``, ``scalars``, ``given``."""
    letter = LETTERS[side]
    return [
        given(x) if x is not None else scalars.get(f"{letter}{i + 1}", 0.0 if i == scene.normal else None)
        for i, x in enumerate(scene.sides[side].held(c))
    ]


def left_end(
    scene: Scene, c: Constants, scalars: Mapping[str, Any], chord: np.ndarray, given: Callable[[Any], Any]
) -> np.ndarray:
    """Position (3,) of the left end: where it is held, or else a ``chord`` back from where the right end is.

    ``scene``, ``c``, ``scalars`` and ``given`` are as for :func:`end_positions`.
    """
    left = end_position(0, scene, c, scalars, given)
    if None not in left:
        return np.array(left)
    right = end_position(1, scene, c, scalars, given)
    return np.array([a if a is not None else (b or 0.0) - d for a, b, d in zip(left, right, chord, strict=True)])
