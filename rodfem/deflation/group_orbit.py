r"""Distance from a set of equilibria, each with all that the continuous symmetries of its scene make of it.

A symmetry moves a state with a velocity that is affine in it, ``D(y) = L y + D(0)``.  ``L`` has the eigenvalues 0 and
``+-i w``, ``w = 1`` for vectors under a rotation of space, and ``w = 1/2`` or 1 for quaternions; a translation, or the
turning of a rod in its plane, moves positions or angles by a constant.  The orbit of a state is therefore ::

    exp(a X) y = y + a u_0 + sum_w ( sin(w a) u_w / w + (1 - cos(w a)) L u_w / w^2 ),    w = 1/2, 1,

with the parts ``u_0``, ``u_w`` of ``D(y)`` of each frequency, polynomials in ``L``.  The square of its distance from a
state is a function of ``a`` alone, given the products of these six vectors, and least at the nearest point.

Other unknowns may stand for the same rod: ``q`` and ``-q`` are one rotation, and so are an angle and that angle and
``2 pi``.  An end at which one of them is given tells them apart all along the rod.  Where nothing holds a rotation both
solve the equations, and are one state.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from rodfem.fem.system import System
from rodfem.linalg.orthogonal import combine, orthonormalize
from rodfem.tolerances import NEGLIGIBLE

FREQUENCIES = (0.5, 1.0)
STILL = 1e-20
"""Squared norm of a part of the velocity, relative to that of the state, below which it is round-off."""


class Orbit:
    """The states that one continuous symmetry makes of a state: a circle, a line, or a helix of states."""

    def __init__(
        self, system: System, y: PETSc.Vec, symmetry: int, seen: Callable[[PETSc.Vec], PETSc.Vec] = lambda x: x
    ) -> None:
        """Split the velocity of ``y`` by frequency; distances are those of what is ``seen`` of states, a projection.

        ``symmetry`` is the number of one of the ``system``'s.
        """
        zero = system.at(system.new_vector()).generator(symmetry)
        powers = [system.at(y).generator(symmetry)]
        for _ in range(5):
            powers.append(system.at(powers[-1]).generator(symmetry) - zero)
        half, one = (w**2 for w in FREQUENCIES)
        # L^2 is -w^2 on the part of frequency w: polynomials in L^2 that are 1 on one part and 0 on the others
        of_half = np.array([one, 1.0]) / (-half * (one - half))
        of_one = np.array([half, 1.0]) / (-one * (half - one))
        on_half, turned_half = (combine([powers[i], powers[i + 2]], of_half) for i in (2, 3))
        on_one, turned_one = (combine([powers[i], powers[i + 2]], of_one) for i in (2, 3))
        steady = combine([powers[0], on_half, on_one], np.array([1.0, -1.0, -1.0]))
        self.parts = [y, steady, on_half, turned_half, on_one, turned_one]
        images = [system.metric * seen(part) for part in self.parts]
        self.products = np.array([[p.dot(image) for image in images] for p in self.parts])
        self.moves_on = self.products[1, 1] > STILL * self.products[0, 0]

    @staticmethod
    def weights(a: np.ndarray | float, derivative: int = 0) -> np.ndarray:
        """Weights of the six parts at one amount, (6,), or at amounts (m,), (6, m); or their first two derivatives."""
        a = np.asarray(a, dtype=float)
        one = np.ones_like(a)
        rows = [(one, 0 * a, 0 * a)[derivative], (a, one, 0 * a)[derivative]]
        for w in FREQUENCIES:
            rows.append((np.sin(w * a) / w, np.cos(w * a), -w * np.sin(w * a))[derivative])
            rows.append(((1 - np.cos(w * a)) / w**2, np.sin(w * a) / w, np.cos(w * a))[derivative])
        return np.array(rows)

    def at(self, amount: float) -> PETSc.Vec:
        """State at an amount of the symmetry: an angle, or a length."""
        return combine(self.parts, self.weights(amount))

    def amount(self, image: PETSc.Vec) -> float:
        """Amount for the state nearest to ``x``, given the metric times ``x``: the best of many, refined."""
        G, c = self.products, np.array([part.dot(image) for part in self.parts])
        start = (c[1] - G[0, 1]) / G[1, 1] if self.moves_on else 0.0
        amounts = start + np.linspace(-2 * np.pi, 2 * np.pi, 96, endpoint=False)
        w = self.weights(amounts)
        a = float(amounts[np.argmin(np.einsum("im,ij,jm->m", w, G, w) - 2 * c @ w)])
        for _ in range(6):
            w, slope, bend = (self.weights(a, i) for i in range(3))
            toward = w @ G - c
            curvature = slope @ G @ slope + toward @ bend
            if curvature <= 0:
                break
            a -= float(toward @ slope / curvature)
        return a


def same_rotations(system: System, x: PETSc.Vec) -> list[PETSc.Vec]:
    """States of other unknowns, but of the rotations of ``x``, that the ``system`` has; none of a closed rod.

    Angles of a planar rod are one or two turns to either side.
    """
    f, state = system.fields, system.at(x)
    field = "angle" if "angle" in f.dofs else "q"
    held = bool((f.number[f.dofs[field]] < 0).any())
    if system.scene.closed or system.comm.allreduce(held, op=MPI.LOR):
        return []
    values = state.named[field]
    others = [-values] if field == "q" else [values + 2 * np.pi * turn for turn in (1, -1, 2, -2)]
    out = [system.vector(f.filled(state.named | state.scalars | {field: other}), state.drifts) for other in others]
    for image in out:
        system.set_load(image, system.scalar(x))
    return out


class Orbits:
    """A set of states, each standing for its orbit under all continuous symmetries of the scene.

    The shift of a closed rod along itself is not among them: a mesh has it approximately only.
    """

    def __init__(self, system: System) -> None:
        self.system = system
        self.states: list[PETSc.Vec] = []
        self.orbits: list[dict[int, Orbit]] = []
        self.rotations: list[int] = []
        self.translations: list[PETSc.Vec] = []
        some = system.new_vector()
        some.set(1.0)
        zero, ones = system.at(system.new_vector()), system.at(some)
        for i, symmetry in enumerate(system.symmetries):
            if not symmetry.along:
                constant = zero.generator(i)
                if constant.norm() > 0 and (ones.generator(i) - constant).norm() < NEGLIGIBLE * constant.norm():
                    self.translations.append(constant)
                else:
                    self.rotations.append(i)
        orthonormalize(self.translations, system.metric)
        self._weighed = [system.metric * t for t in self.translations]

    def add(self, y: PETSc.Vec) -> None:
        """Add a state, and the other unknowns that it may have."""
        for each in (y, *same_rotations(self.system, y)):
            self.states.append(each)
            self.orbits.append({i: self._orbit(each, i) for i in self.rotations[:1]})

    def nearest(self, x: PETSc.Vec) -> list[tuple[float, PETSc.Vec]]:
        """Distance of each orbit from ``x``, and ``x`` minus the nearest state of the orbit.

        Exact for translations and one rotation; for more of them the angles are found in turn, three times.
        """
        system = self.system
        image = system.metric * self._still(x)
        found = []
        for y, orbits in zip(self.states, self.orbits, strict=True):
            for turn in range(3 * len(self.rotations) if len(self.rotations) > 1 else len(self.rotations)):
                i = self.rotations[turn % len(self.rotations)]
                orbit = orbits[i] if turn == 0 else self._orbit(y, i)
                y = orbit.at(orbit.amount(image))
            apart = self._still(x - y)
            found.append((system.norm(apart), apart))
        return found

    def _orbit(self, y: PETSc.Vec, symmetry: int) -> Orbit:
        return Orbit(self.system, y, symmetry, self._still)

    def _still(self, x: PETSc.Vec) -> PETSc.Vec:
        """Part of ``x`` across all translations."""
        out = x.copy()
        for t, weighed in zip(self.translations, self._weighed, strict=True):
            out.axpy(-weighed.dot(x), t)
        return out
