"""The pencil of a state, ``(K C; C^t 0) x = mu (M 0; 0 0) x``, and its blocks.

``K`` (m, m) is the second derivative of the whole Lagrangian in rotation, strain and centreline, ``C`` (m, p) its
derivative in those and the multipliers (each column the gradient of one constraint), ``M`` (m, m) the kinetic metric.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse as sp
from petsc4py import PETSc

from rodfem.errors import ConvergenceError, SceneError
from rodfem.linalg.matrices import gathered
from rodfem.linalg.orthogonal import combine
from rodfem.problem.validation import trouble_with_inertia
from rodfem.tolerances import NEGLIGIBLE

if TYPE_CHECKING:
    from rodfem.fem.state import State
    from rodfem.fem.system import System


class PencilMatrices:
    """Matrices of a pencil, allocated once, which the states of one system share."""

    def __init__(self, system: System) -> None:
        self.system = system
        self.matrix, self.mass = system.state_matrix(), system.metric_matrix()

    @cached_property
    def sizes(self) -> PETSc.Vec:
        """Natural size of each unknown; of a drift, the multiplier of ``g.Mx = 0`` with ``g.Mg = 1``, its own."""
        units = self.system.scene.units
        drift = float(np.sqrt(units.energy * units.omega2))
        return self.system.vector(self.system.fields.sizes, [drift] * len(self.system.drifts))


def in_units(system: System, matrix: PETSc.Mat, mass: PETSc.Mat, sizes: PETSc.Vec) -> tuple[PETSc.Mat, PETSc.Mat]:
    """Matrices of a ``system``'s pencil for unknowns and eigenvalues in units of their natural ``sizes``.

    Round-off makes finite eigenvalues of the infinite ones if multipliers have large units; and what is near, far or
    zero is a number of order one.  Where all units are one they are ``matrix`` and ``mass``.
    """
    units = system.scene.units
    if units.ordinary:
        return matrix, mass
    scaled = matrix.copy(), mass.copy()
    for each, size in zip(scaled, (units.energy, units.energy / units.omega2), strict=True):
        each.diagonalScale(sizes, sizes)
        each.scale(1.0 / size)
    return scaled


def scale_in_units(system: System) -> float:
    """Size of the least eigenvalue of a ``system``'s pencil in units of natural sizes, up to a number about one."""
    units = system.scene.units
    return system.stiffness_scale if units.ordinary else system.stiffness_scale / units.energy


def least_eigenvalue(system: System) -> float:
    """Size of the least eigenvalue ``mu = omega^2`` of a ``system``, up to a number about one."""
    units = system.scene.units
    return system.stiffness_scale / system.scene.length if units.ordinary else scale_in_units(system) * units.omega2


def assemble_pencil(system: System, x: PETSc.Vec, matrix: PETSc.Mat, mass: PETSc.Mat) -> State:
    """Assemble tangent ``matrix`` and kinetic ``mass`` of a ``system`` at the state ``x``, without phase conditions."""
    if system.equations.massless:
        raise SceneError("A rod without inertia has no eigenvalues mu = omega^2: give it a mass or a rotary inertia.")
    if system.scene.inertia_depends_on_load and (trouble := trouble_with_inertia(system.scene, system.scalar(x))):
        raise ConvergenceError(trouble)
    state = system.at(x)
    for target, form in ((matrix, system.equations.jacobian), (mass, system.equations.kinetic)):
        target.zeroEntries()
        state.assemble_into(target, form)
    if system.has_scalars:
        for index in (system.load_index, *system.drifts):  # no part of the pencil: an infinite eigenvalue each
            matrix.setValue(index, index, _one(system, index), addv=True)
    matrix.assemble()
    mass.assemble()
    if mass.norm(PETSc.NormType.INFINITY) == 0.0:
        raise ConvergenceError(
            f"A rod without inertia has no eigenvalues mu = omega^2, and at {system.scene.load} = "
            f"{system.scalar(x):g} this one has none: give it more, or another range."
        )
    return state


def _one(system: System, index: int) -> float:
    """Entry on the diagonal that is one in units of natural sizes: a greater one hides all others from a norm."""
    units = system.scene.units
    return 1.0 if units.ordinary else units.energy / float(system.sizes.getValue(index).real) ** 2


def symmetry_modes(system: System, x: PETSc.Vec) -> dict[int, PETSc.Vec]:
    """Generators at ``x`` of the symmetries that it breaks, by the global number of their drift scalars."""
    system.set_phase(x)
    if not system.phase.count:
        return {}
    generators = system.at(x).generators
    broken = system.phase.broken.items()
    return {system.drifts[i]: system.new_vector(weights @ generators) for i, weights in broken}


def weighed_modes(
    system: System, modes: dict[int, PETSc.Vec], mass: PETSc.Mat
) -> dict[int, tuple[PETSc.Vec, PETSc.Vec]]:
    """Basis ``g`` of the symmetry modes that is orthonormal in the mass, and ``M g``."""
    given, scaled = list(modes.values()), mass
    if not given:
        return {}
    if not system.scene.units.ordinary:  # rotations and positions have masses of different units
        scaled = mass.copy()
        scaled.diagonalScale(system.sizes, system.sizes)
    least, images = NEGLIGIBLE * scaled.norm(PETSc.NormType.INFINITY), [mass * mode for mode in given]
    out = {}
    squares, turn = np.linalg.eigh([[np.real(g.dot(m)) for m in images] for g in given])
    for index, square, weights in zip(modes, squares, turn.T, strict=True):
        mode, image = combine(given, weights), combine(images, weights)
        if square < least * system.norm(mode) ** 2:
            image = system.metric * mode
            square = float(np.real(image.dot(mode)))
        mode.scale(1.0 / np.sqrt(square))
        image.scale(1.0 / np.sqrt(square))
        out[index] = mode, image
    return out


def exclude_modes(system: System, modes: dict[int, PETSc.Vec], matrix: PETSc.Mat, mass: PETSc.Mat) -> list[PETSc.Vec]:
    """Add to a pencil ``matrix``, ``mass`` the constraints ``g.Mx = 0`` for symmetry ``modes`` g, by drift scalars.

    ``g`` being an eigenvector of ``mu = 0``, the rest of the spectrum is unchanged, and the inertia counts it.  Returns
    the basis of the modes of :func:`weighed_modes`.
    """
    found = weighed_modes(system, modes, mass)
    for index, (_, image) in found.items():
        own = np.arange(*image.getOwnershipRange(), dtype=PETSc.IntType)
        if system.has_scalars:
            matrix.setValue(index, index, -_one(system, index), addv=True)
        matrix.setValues([index], own, image.array_r, addv=True)
        matrix.setValues(own, [index], image.array_r, addv=True)
    matrix.assemble()
    return [mode for mode, _ in found.values()]


@dataclass(frozen=True)
class Pencil:
    """Blocks ``K`` (m, m), ``C`` (m, p), ``M`` (m, m) of a state; every rank has all of them.

    For each field ``where`` has its rows in ``K`` and ``C`` (``q``, ``v``, ``r``, ``ends``: positions of ends that
    move), or columns of ``C`` (``eta``, ``n``, and ``scalars``: a constant contact force, moments at ends, multipliers
    of integral constraints).  ``place`` (p,) is the arclength of the middle of a constraint's cell, nan for one of the
    whole rod.
    """

    K: sp.csr_matrix
    C: sp.csr_matrix
    M: sp.csr_matrix
    where: dict[str, np.ndarray]
    place: np.ndarray


class Blocks(PencilMatrices):
    """Makes the :class:`Pencil` of states of one system, with multipliers of the ``norms`` of quaternions or without.

    ``rows`` and ``columns`` are the global numbers of unknowns and multipliers, ascending, ``numbers`` those of each
    field.
    """

    def __init__(self, system: System, *, norms: bool = True) -> None:
        super().__init__(system)
        self.numbers: dict[str, np.ndarray] = {}
        self.where: dict[str, np.ndarray] = {}
        self.rows = self._numbered("ends", multiplier=False)
        self.columns = self._numbered("scalars", multiplier=True, left_out="" if norms else "eta")
        self.place = self._places()

    def _numbered(self, last: str, *, multiplier: bool, left_out: str = "") -> np.ndarray:
        """Global numbers of the unknowns, or multipliers, but for a field ``left_out``; ``last`` names the scalars."""
        f = self.system.fields
        names = [b.name for b in f.blocks if b.multiplier == multiplier and b.name != left_out]
        numbers = {name: np.unique(self.system.whole(f.number[f.dofs[name]].ravel())) for name in names}
        numbers = {name: n[n >= 0] for name, n in numbers.items()}
        scalars = [f.scalars[x.name] for x in f.unknown_scalars if x.multiplier == multiplier]
        numbers[last] = np.array(scalars, dtype=int)
        out = np.sort(np.concatenate(list(numbers.values()))).astype(int)
        self.numbers |= numbers
        self.where |= {name: np.searchsorted(out, n) for name, n in numbers.items()}
        return out

    def own(self, numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Which of some global ``numbers`` are rows of this rank, and their places in its part of a vector."""
        begin, end = self.matrix.getOwnershipRange()
        mine = (numbers >= begin) & (numbers < end)
        return mine, numbers[mine] - begin

    def _places(self) -> np.ndarray:
        """Arclength of the middle of the first cell of each constraint, nan for a scalar force, (p,)."""
        f = self.system.fields
        place = np.full(len(self.columns), np.inf)
        for name in (b.name for b in f.blocks if b.multiplier):
            numbers = f.number[f.dofs[name]]
            middle = np.broadcast_to(f.vertices.mean(axis=1)[:, None, None], numbers.shape)
            mine = np.isin(numbers, self.columns)
            np.minimum.at(place, np.searchsorted(self.columns, numbers[mine]), middle[mine])
        place = np.min(self.system.comm.allgather(place), axis=0)
        return np.where(np.isinf(place), np.nan, place)

    def assemble(self, x: PETSc.Vec, *, scaled: bool = False) -> Pencil:
        """Blocks at the state ``x``; ``scaled``: in units of natural sizes."""
        assemble_pencil(self.system, x, self.matrix, self.mass)
        matrices = self.matrix, self.mass
        if scaled:
            matrices = in_units(self.system, *matrices, self.sizes)
        S, M = (gathered(A).real[self.rows] for A in matrices)
        return Pencil(S[:, self.rows], S[:, self.columns], M[:, self.rows], dict(self.where), self.place)
