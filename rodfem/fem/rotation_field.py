"""Rotation parametrisations: a unit quaternion at each node, or one angle for planar rods."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rodfem.forms.rotation import IDENTITY, turn, turn_change
from rodfem.problem.quaternions import of_vector, product
from rodfem.problem.validation import PLACES

Start = Callable[[np.ndarray], np.ndarray] | None
TURN = 2 * np.pi
"""Period of a rotation as a function of its angle: quaternions of opposite signs are one rotation."""


@dataclass(frozen=True)
class QuaternionField:
    """Rotation as a quaternion ``q`` of four components, whose unit norm is a constraint."""

    name = "q"
    size = 4

    def expression(self, value: Any) -> Any:
        """Quaternion of the field, as a UFL expression."""
        return value

    def variation(self, value: Any, change: Any) -> Any:
        """Change of the quaternion with the field, as a UFL expression."""
        return change

    def quaternion(self, values: np.ndarray) -> np.ndarray:
        """Quaternions (..., 4) of values of the field (..., size)."""
        return values

    def change(self, values: np.ndarray, change: np.ndarray) -> np.ndarray:
        """Changes of quaternions (..., 4) of changes of the field (..., size)."""
        return change

    def functional(self, values: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """Weights (..., 4) of changes of quaternions, of weights (..., size) of changes of the field."""
        return weights

    def turned(self, values: np.ndarray, vector: np.ndarray) -> np.ndarray:
        """Values (..., size) turned by rotation vectors (..., 3) along the directors."""
        return product(values, of_vector(vector))

    def normalised(self, values: np.ndarray) -> np.ndarray:
        """Values of unit quaternions."""
        return np.asarray(values / np.linalg.norm(values, axis=-1, keepdims=True))

    def start(self, start: Start, s: np.ndarray, interval: tuple[float, float]) -> np.ndarray:
        """Values (m, size) at arclengths (m,) of a scene's start, a straight rod without one.

        The signs that the start gives its quaternions are a matter of choice: they are made to be continuous along the
        rod from its left end.
        """
        if start is None:
            return np.tile(IDENTITY, (s.size, 1))
        every, place = np.unique(np.append(np.linspace(*interval, PLACES), s), return_inverse=True)
        values = np.asarray(start(every), dtype=float)
        signs = np.cumprod(np.where((values[1:] * values[:-1]).sum(axis=1) < 0, -1.0, 1.0))
        return np.asarray((values * np.append(1.0, signs)[:, None])[place.ravel()[PLACES:]])

    def clamp(self, rotation: Sequence[float], start: Start, s: float, interval: tuple[float, float]) -> np.ndarray:
        """Value (size,) at an end at ``s`` that is clamped with a unit quaternion, or its negative: next to the start.

        ``rotation`` (4,) is that quaternion; ``start`` is the first guess, ``interval`` the arclengths of the ends.
        """
        value = np.array(rotation)
        return np.asarray(-value if value @ self.start(start, np.array([s]), interval)[0] < 0 else value)


@dataclass(frozen=True)
class AngleField:
    """The angle about the normal of the plane, e1 or e2 (``normal`` 0 or 1), from the undeformed state.

    It is not confined to one turn: rotations tell angles apart up to ``2 pi``, and the number of whole turns is that of
    the scene's start.
    """

    normal: int
    name = "angle"
    size = 1

    def expression(self, value: Any) -> Any:
        """Quaternion of the field, as a UFL expression."""
        return turn(value, self.normal)

    def variation(self, value: Any, change: Any) -> Any:
        """Change of the quaternion with the field, as a UFL expression."""
        return turn_change(value, change, self.normal)

    def quaternion(self, values: np.ndarray) -> np.ndarray:
        """Quaternions (..., 4) of values of the field (..., size)."""
        q = np.zeros((*values.shape[:-1], 4))
        q[..., 0], q[..., self.normal + 1] = np.cos(values[..., 0] / 2), np.sin(values[..., 0] / 2)
        return q

    def change(self, values: np.ndarray, change: np.ndarray) -> np.ndarray:
        """Changes of quaternions (..., 4) of changes of the field (..., size)."""
        return self.quaternion(values + np.pi) * change / 2

    def functional(self, values: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """Weights (..., 4) of changes of quaternions, of weights (..., size) of changes of the field."""
        return 4 * self.change(values, weights)

    def turned(self, values: np.ndarray, vector: np.ndarray) -> np.ndarray:
        """Values (..., size) turned by rotation vectors (..., 3), of which the component along the normal counts."""
        return np.asarray(values + vector[..., [self.normal]])

    def normalised(self, values: np.ndarray) -> np.ndarray:
        """Values as they are."""
        return values

    def start(self, start: Start, s: np.ndarray, interval: tuple[float, float]) -> np.ndarray:
        """Values (m, size) at arclengths (m,) of a scene's start, continuous along the rod from its left end."""
        if start is None:
            return np.zeros((s.size, 1))
        every, place = np.unique(np.append(np.linspace(*interval, PLACES), s), return_inverse=True)
        angles = np.unwrap(self._angle(np.asarray(start(every), dtype=float)), period=TURN)
        return np.asarray(angles[place.ravel()[PLACES:], None])

    def clamp(self, rotation: Sequence[float], start: Start, s: float, interval: tuple[float, float]) -> np.ndarray:
        """Value (size,) at an end at ``s`` that is clamped with a unit quaternion: the one next to the start.

        ``rotation`` (4,) is that quaternion; ``start`` is the first guess, ``interval`` the arclengths of the ends.
        """
        angle = self._angle(np.array(rotation))
        near = self.start(start, np.array([s]), interval)[0]
        return np.asarray(angle + TURN * np.round((near - angle) / TURN))

    def _angle(self, q: np.ndarray) -> np.ndarray:
        return np.asarray(2 * np.arctan2(q[..., self.normal + 1], q[..., 0]))


Turning = QuaternionField | AngleField
