r"""What the symmetries of a scene make of its equilibria: mirror images, reversals, and orbits.

A reflection or half turn of space is ``S = diag(s1, s2, s3)`` with signs ``s_i``; together with the same reflection of
the directors, and perhaps with a reversal of the rod (``sigma = -1``, otherwise 1), it carries a state to ::

    R -> S R S,   r -> S r,   v -> sigma S v,   k -> sigma det(S) S k,   n -> sigma S n,   eta -> eta,

in quaternions ``(q0, vec q) -> (q0, det(S) S vec q)``, fields being read from the other end where the rod is reversed.
A stretch stays positive only if ``s3 = sigma``, which leaves seven candidates other than the identity.  With ``F`` the
residual of the equations and ``T`` the map, ``T`` is a symmetry of the discrete problem if and only if ``F(T x) . T y =
F(x) . y`` for all ``x`` and ``y``.  One smooth state without any symmetry of its own and one direction decide that to
round-off, at the cost of two residuals.

A continuous symmetry moves a state with a velocity that is affine in it, ``D(y) = L y + D(0)``.  ``L`` has the
eigenvalues 0 and ``+-i w``, ``w = 1`` for vectors under a rotation of space, and ``w = 1/2`` or 1 for quaternions; a
translation, or the turning of a rod in its plane, moves positions or angles by a constant.  The orbit of a state is ::

    exp(a X) y = y + a u_0 + sum_w ( sin(w a) u_w / w + (1 - cos(w a)) L u_w / w^2 ),    w = 1/2, 1,

with the parts ``u_0``, ``u_w`` of ``D(y)`` of each frequency, polynomials in ``L``.  The square of its distance from a
state is a function of ``a`` alone, given the products of these six vectors, and least at the nearest point.

Other unknowns may stand for the same rod: ``q`` and ``-q`` are one rotation, and so are an angle and that angle and
``2 pi``.  An end at which one of them is given tells them apart all along the rod.  Where nothing holds a rotation both
solve the equations, and are one state.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from math import inf

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from rodfem.fem.shape import Shape, interpolated
from rodfem.fem.state import State
from rodfem.fem.system import System
from rodfem.linalg.orthogonal import combine, orthonormalize
from rodfem.tolerances import NEGLIGIBLE


@dataclass(frozen=True)
class Mirror:
    """The map of ``signs`` (s1, s2, s3), with a reversal of the rod or not; applies to states of a system."""

    signs: tuple[int, int, int]
    reversal: bool

    def in_words(self) -> str:
        """The map in words."""
        axes = [f"e{i + 1}" for i, sign in enumerate(self.signs) if sign < 0]
        kept = [f"e{i + 1}" for i, sign in enumerate(self.signs) if sign > 0]
        words = {1: f"reflection along {axes[0]}", 2: f"half turn about {''.join(kept)}", 3: "inversion"}[len(axes)]
        return words + (", ends exchanged" if self.reversal else "")

    def weights(self, system: System, field: str) -> np.ndarray:
        """Signs of the components of a field, ``n`` for those of the contact force."""
        s = np.array(self.signs, dtype=float)
        axial, scene = s.prod() * s, system.scene
        if field == "eta":
            return np.ones(1)
        if field in ("q", "angle"):
            return np.append(1.0, axial) if field == "q" else axial[[scene.normal or 0]]
        signs = s if field == "r" or not self.reversal else -s
        return signs[list(scene.free_strains)] if field == "v" else signs

    def __call__(self, shape: Shape, x: PETSc.Vec) -> PETSc.Vec:
        """Image of the state ``x``; drift scalars of the image are zero."""
        system, f, state = shape.system, shape.system.fields, shape.system.at(x)
        named, ends = state.parts, sum(system.scene.interval) - f.all_vertices[::-1]
        for block in f.blocks:
            weights = self.weights(system, block.name)
            named[block.name] = state.values(block.name) * weights
            if self.reversal:
                table = shape.from_left(state.local[shape.natural[block.name]])[::-1, ::-1] * weights
                table = table - _misfit(state, table) if block.name == "r" else table
                named[block.name] = interpolated(table, ends, f.coordinates(block.degree))
        named |= {f"n{i + 1}": state.scalars[f"n{i + 1}"] * float(self.weights(system, "n")[i]) for i in f.forces}
        return system.vector(f.filled(named))


def _misfit(state: State, table: np.ndarray) -> np.ndarray:
    """Translation (3,) by which a centreline, given in elements from left to right, misses the ends that are held."""
    (left, right), shift = state.fields.scene.sides, np.zeros(3)
    for end, r in ((right, table[-1, -1]), (left, table[0, 0])):  # the left end has the last word
        shift = np.where([p is not None for p in end.support(state.constants())], r, shift)
    return shift


def candidates(system: System) -> list[Mirror]:
    """Maps that may be symmetries, the identity left out.

    None of a scene with constraints all along the rod: what a mirror does to their multipliers is not known.
    """
    if any(block.along for block in system.fields.blocks):
        return []
    signs = [s for s in product((1, -1), repeat=3) if s != (1, 1, 1)]
    return [Mirror((s1, s2, s3), reversal=s3 < 0) for s1, s2, s3 in signs]


def mirrors(shape: Shape, x: PETSc.Vec, among: Sequence[Mirror] | None = None) -> list[Mirror]:
    """Discrete symmetries of the equations at the load of ``x``, among all :func:`candidates` unless given."""
    system = shape.system
    among = candidates(system) if among is None else among
    if not among:
        return []
    phase = system.phase
    system.set_phase(None)
    base = _generic_state(system, x, 1)
    other = _generic_state(system, base, 2)
    reference, scale = _work(system, base, other)
    works = [(mirror, _work(system, mirror(shape, base), mirror(shape, other))[0]) for mirror in among]
    system.phase = phase
    return [mirror for mirror, work in works if abs(work - reference) < NEGLIGIBLE * scale]


def _generic_state(system: System, like: PETSc.Vec, seed: int) -> PETSc.Vec:
    """Add to a state ``like`` smooth changes of all fields that no symmetry leaves alone; clamps stay."""
    f = system.fields
    return system.vector(system.at(like).local + 0.2 * f.wave(seed) * f.sizes)


def _work(system: System, x: PETSc.Vec, y: PETSc.Vec) -> tuple[float, float]:
    """``F(x) . (y - x)``, and the product of the norms in natural sizes."""
    equations, change = system.new_vector(), y - x
    system.at(x).residual(equations)
    scale = system.in_units(equations, 1).norm() * system.in_units(change, -1).norm()
    return float(equations.dot(change)), float(scale)


class Orbit:
    """The states that one continuous symmetry makes of a state: a circle, a line, or a helix of states."""

    def __init__(
        self, system: System, y: PETSc.Vec, symmetry: int, seen: Callable[[PETSc.Vec], PETSc.Vec] = lambda x: x
    ) -> None:
        """Split the velocity of ``y`` by one ``symmetry``; distances are those of what is ``seen`` of states."""
        zero = system.at(system.new_vector()).generator(symmetry)
        powers = [system.at(y).generator(symmetry)]
        for _ in range(5):
            powers.append(system.at(powers[-1]).generator(symmetry) - zero)
        # L^2 is -w^2 on the part of frequency w: polynomials in L^2 that are 1 on one part and 0 on the others
        of_half, of_one = np.array([1.0, 1.0]) / (-0.25 * 0.75), np.array([0.25, 1.0]) / 0.75
        on_half, turned_half = (combine([powers[i], powers[i + 2]], of_half) for i in (2, 3))
        on_one, turned_one = (combine([powers[i], powers[i + 2]], of_one) for i in (2, 3))
        steady = combine([powers[0], on_half, on_one], np.array([1.0, -1.0, -1.0]))
        self.parts = [y, steady, on_half, turned_half, on_one, turned_one]
        images = [system.metric * seen(part) for part in self.parts]
        self.products = np.array([[p.dot(image) for image in images] for p in self.parts])

    @staticmethod
    def weights(a: np.ndarray | float, derivative: int = 0) -> np.ndarray:
        """Weights of the six parts at one amount, (6,), or at amounts (m,), (6, m); or their first two derivatives."""
        a = np.asarray(a, dtype=float)
        one = np.ones_like(a)
        rows = [(one, 0 * a, 0 * a)[derivative], (a, one, 0 * a)[derivative]]
        for w in (0.5, 1.0):
            rows.append((np.sin(w * a) / w, np.cos(w * a), -w * np.sin(w * a))[derivative])
            rows.append(((1 - np.cos(w * a)) / w**2, np.sin(w * a) / w, np.cos(w * a))[derivative])
        return np.array(rows)

    def at(self, amount: float) -> PETSc.Vec:
        """State at an amount of the symmetry: an angle, or a length."""
        return combine(self.parts, self.weights(amount))

    def amount(self, image: PETSc.Vec) -> float:
        """Amount for the state nearest to ``x``, given the metric times ``x``: the best of many, refined."""
        G, c = self.products, np.array([part.dot(image) for part in self.parts])
        moves_on = G[1, 1] > 1e-20 * G[0, 0]  # squared norms: less is round-off
        start = (c[1] - G[0, 1]) / G[1, 1] if moves_on else 0.0
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


class Orbits:
    """A set of states, each standing for its orbit under all continuous symmetries of the scene.

    The shift of a closed rod along itself is not among them: a mesh has it approximately only.
    """

    def __init__(self, system: System) -> None:
        self.system = system
        self.states: list[PETSc.Vec] = []
        self.rotations, self.translations = list[int](), list[PETSc.Vec]()
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
        self._orbits: list[dict[int, Orbit]] = []
        self._weighed = [system.metric * t for t in self.translations]

    def add(self, y: PETSc.Vec) -> None:
        """Add a state, and the other unknowns that it may have."""
        for each in (y, *_same_rotations(self.system, y)):
            self.states.append(each)
            self._orbits.append({i: self._orbit(each, i) for i in self.rotations[:1]})

    def distance(self, x: PETSc.Vec) -> float:
        """Distance of a state from the nearest orbit; infinite where there is none."""
        return min((d for d, _ in self.nearest(x)), default=inf)

    def nearest(self, x: PETSc.Vec) -> list[tuple[float, PETSc.Vec]]:
        """Distance of each orbit from ``x``, and ``x`` minus the nearest state of the orbit.

        Exact for translations and one rotation; for more of them the angles are found in turn, three times.
        """
        image, found = self.system.metric * self._remainder(x), []
        turns = self.rotations * (3 if len(self.rotations) > 1 else 1)
        for y, orbits in zip(self.states, self._orbits, strict=True):
            for turn, i in enumerate(turns):
                orbit = self._orbit(y, i) if turn else orbits[i]
                y = orbit.at(orbit.amount(image))
            apart = self._remainder(x - y)
            found.append((self.system.norm(apart), apart))
        return found

    def _orbit(self, y: PETSc.Vec, symmetry: int) -> Orbit:
        return Orbit(self.system, y, symmetry, self._remainder)

    def _remainder(self, x: PETSc.Vec) -> PETSc.Vec:
        """Part of ``x`` across all translations."""
        out = x.copy()
        for t, weighed in zip(self.translations, self._weighed, strict=True):
            out.axpy(-weighed.dot(x), t)
        return out


def _same_rotations(system: System, x: PETSc.Vec) -> list[PETSc.Vec]:
    """States of other unknowns, but of the rotations of ``x``, angles up to two turns apart; none of a closed rod."""
    f, state = system.fields, system.at(x)
    field = "angle" if "angle" in f.dofs else "q"
    held = bool((f.number[f.dofs[field]] < 0).any())
    if system.scene.closed or system.comm.allreduce(held, op=MPI.LOR):
        return []
    values = state.parts[field]
    others = [-values] if field == "q" else [values + 2 * np.pi * turn for turn in (1, -1, 2, -2)]
    out = [system.vector(f.filled(state.parts | state.scalars | {field: other}), state.drifts) for other in others]
    for image in out:
        system.set_load(image, system.scalar(x))
    return out
