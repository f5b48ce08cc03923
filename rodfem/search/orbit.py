r"""Distance from a set of equilibria, each with all that the continuous symmetries of its scene make of it.

A generator ``X`` of :mod:`forms.symmetry` acts linearly on the nodal values of the fields, with eigenvalues 0 and
``+-i w``, ``w = 1`` for vectors under a rotation of space, and ``w = 1/2`` or 1 for quaternions.  The orbit of a state
is therefore a trigonometric polynomial in the angle ::

    exp(a X) y = y_0 + sum_w (cos(w a) y_w + sin(w a) X y_w / w),    w = 1/2, 1,

with the projections ``y_w`` polynomials in ``X``, and so is the product of the orbit with a state, whose greatest value
gives the nearest point: the metric is unchanged by the symmetry.
"""

from __future__ import annotations

import numpy as np
from petsc4py import PETSc

from rodfem.system import System, combine

FREQUENCIES = np.array([0.5, 1.0])
ANGLES = np.linspace(0.0, 4 * np.pi, 96, endpoint=False)


class Orbit:
    """The circle of states that one continuous symmetry makes of a state."""

    def __init__(self, system: System, y: PETSc.Vec, symmetry: int) -> None:
        """Split ``y`` by frequency."""
        powers = [y]
        for _ in range(5):
            powers.append(system.generator(powers[-1], symmetry))
        half, one = FREQUENCIES**2
        # X^2 is -w^2 on the part of frequency w: polynomials in X^2 that are 1 on one part and 0 on the others
        on_half = combine([powers[2], powers[4]], np.array([one, 1.0]) / (-half * (one - half)))
        on_one = combine([powers[2], powers[4]], np.array([half, 1.0]) / (-one * (half - one)))
        turned_half = combine([powers[3], powers[5]], np.array([one, 1.0]) / (-half * (one - half)) / FREQUENCIES[0])
        turned_one = combine([powers[3], powers[5]], np.array([half, 1.0]) / (-one * (half - one)) / FREQUENCIES[1])
        still = combine([y, on_half, on_one], np.array([1.0, -1.0, -1.0]))
        self.parts = [still, on_half, turned_half, on_one, turned_one]

    @staticmethod
    def weights(angle: np.ndarray | float) -> np.ndarray:
        """Weights of the five parts at one angle, (5,), or at angles of shape (m,): (5, m)."""
        a, b = (w * np.asarray(angle) for w in FREQUENCIES)
        return np.array([np.ones_like(a), np.cos(a), np.sin(a), np.cos(b), np.sin(b)])

    def at(self, angle: float) -> PETSc.Vec:
        """State at an angle."""
        return combine(self.parts, self.weights(angle))

    def angle(self, image: PETSc.Vec) -> float:
        """Angle of the state nearest to ``x``, given the metric times ``x``: the best of many angles, refined."""
        c = np.array([part.dot(image) for part in self.parts])
        a = float(ANGLES[np.argmax(c @ self.weights(ANGLES))])
        w = np.array([0.0, *np.repeat(FREQUENCIES, 2)])
        for _ in range(4):
            value = c * self.weights(a)
            slope = w[1::2] @ (c[2::2] * self.weights(a)[1::2] - c[1::2] * self.weights(a)[2::2])
            bend = -(w * w) @ value
            if bend >= 0:
                break
            a -= float(slope / bend)
        return a


class Orbits:
    """A set of states, each standing for its orbit under all continuous symmetries of the scene."""

    def __init__(self, system: System) -> None:
        """Start with none."""
        self.system = system
        self.states: list[PETSc.Vec] = []
        self._orbits: list[Orbit | None] = []

    def add(self, y: PETSc.Vec) -> None:
        """Add a state."""
        self.states.append(y)
        self._orbits.append(Orbit(self.system, y, 0) if self.system.drifts else None)

    def nearest(self, x: PETSc.Vec) -> list[tuple[float, PETSc.Vec]]:
        """Distance of each orbit from ``x``, and ``x`` minus the nearest state of the orbit.

        For one symmetry the nearest state is exact; for more of them the angles are found in turn, three times.
        """
        system = self.system
        image = system.metric * x
        found = []
        for y, orbit in zip(self.states, self._orbits, strict=True):
            if orbit is not None:
                y = orbit.at(orbit.angle(image))
                for turn in range(2 * len(system.drifts) if len(system.drifts) > 1 else 0):
                    other = Orbit(system, y, (turn + 1) % len(system.drifts))
                    y = other.at(other.angle(image))
            apart = x.copy()
            apart.axpy(-1.0, y)
            found.append((system.norm(apart), apart))
        return found
