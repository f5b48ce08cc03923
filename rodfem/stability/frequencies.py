"""Eigenvalues ``mu = omega^2`` that were found at a state, the names of their motions, and groups of equal ones."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from mpi4py import MPI

from rodfem.fem.system import System
from rodfem.problem.local_state import floats
from rodfem.stability import motion_names
from rodfem.stability.spectrum import REAL

MULTIPLE = 1e-8
"""Eigenvalues that differ by less than this, relative, are one that is multiple."""
ALIKE = 1e-6
"""Eigenvalues that differ by less than this, relative, have one name: where another is near the shift, digits go."""
STILL = 1e-10
"""Share of the farthest eigenvalue below which one is zero."""
SLOW = 1e4
"""Times the slowest two eigenvalues, or their natural size, that others are far at most."""
NEAR_ZERO = 1e-2
"""Share of the farthest eigenvalue below which differences of others are relative to this share."""
EPS = float(np.finfo(float).eps)


@dataclass(frozen=True)
class Frequencies:
    """Eigenvalues ``values`` (k,), ``mu = omega^2``, in ascending order of real parts, and their ``errors`` (k,).

    Errors are those of ``1 / (mu - shift)`` over the greatest.  ``kinds`` names the motion of each: see
    :mod:`rodfem.stability.motion_names`.  ``vectors`` (n, k) are complex, or real where all eigenvalues are, with the n
    unknowns of this rank, ``weighed`` (n, k) are their products with the mass, and ``one`` is the natural size of the
    eigenvalues.  The rod is ``floating`` where nothing holds it: it has zero eigenvalues.  Of a rod that is held and
    has slow motions, as a stiff one on soft springs, the ``floor`` is what round-off makes of zero; it is infinite
    elsewhere.
    """

    values: np.ndarray
    errors: np.ndarray
    kinds: tuple[str, ...] = ()
    vectors: np.ndarray = field(default_factory=lambda: np.zeros((0, 0), dtype=complex))
    weighed: np.ndarray = field(default_factory=lambda: np.zeros((0, 0), dtype=complex))
    one: float = 1.0
    floating: bool = False
    floor: float = np.inf

    @property
    def far(self) -> float:
        """Size of an eigenvalue beside which others are zero: the greatest one, but for a light rod with heavy bodies.

        That has a few slow motions, and others whose eigenvalues are 1e10 times as great.
        """
        sizes = np.sort(abs(self.values))
        greatest = float(sizes[-1]) if len(sizes) else 0.0
        return greatest if self.floating else min(greatest, SLOW * self.natural)

    @property
    def natural(self) -> float:
        """Natural size of the slowest motions: that of the two slowest eigenvalues, and at least that of bending.

        Where slow motions are told from round-off it is theirs alone.
        """
        slowest = float(np.sort(abs(self.values))[:2].max(initial=0.0))
        return max(slowest, self.one if np.isinf(self.floor) else self.floor)

    @property
    def noise(self) -> float:
        """Magnitude below which an eigenvalue counts as zero."""
        least = REAL * float(abs(self.values).min(initial=np.inf))
        return min(max(REAL * self.one, least), max(self.floor, least))

    def still(self) -> int:
        """Number of eigenvalues that are zero: of rigid motions, and their partners in Jordan blocks."""
        return int((abs(self.values) < STILL * self.far).sum())


def in_order(found: Frequencies) -> Frequencies:
    """Frequencies by their real parts."""
    values = found.values
    order = np.lexsort((values.imag, np.round(values.real / min(found.one, found.natural), 6)))
    kinds = tuple(found.kinds[i] for i in order) if found.kinds else ()
    vectors, weighed = found.vectors[:, order], found.weighed[:, order]
    return replace(
        found, values=values[order], errors=found.errors[order], kinds=kinds, vectors=vectors, weighed=weighed
    )


def named(system: System, found: Frequencies, turned: np.ndarray, number: int | None = None) -> Frequencies:
    """Frequencies ``found`` at a state of a ``system``, with names of their motions; ``turned`` is its rotation field.

    Only the first ``number`` are named, where that is given.  A multiple eigenvalue has one name, that of its invariant
    subspace: its vectors are any in it, bending about d1 in one state and about d2 in the next.
    """
    together = [g for g in groups(found.values, found.far, ALIKE) if number is None or g[0] < number]
    owner = np.repeat(np.arange(len(together)), list(map(len, together)))
    vectors = np.concatenate([_spanning(system, found, group) for group in together], axis=1)
    squares, moved = np.zeros((len(together), 3)), np.zeros(len(together))
    for part in (vectors.real, vectors.imag) if np.iscomplexobj(vectors) else (vectors,):
        np.add.at(squares, owner, motion_names.squares(system, turned, part))
        np.add.at(moved, owner, motion_names.displacements(system, part))
    kinds, floating = [""] * len(found.values), floats(system.scene)
    for group, name in zip(together, motion_names.names_of(motion_names.of_all(squares, moved)), strict=True):
        rigid = floating and abs(found.values[group]).max() < STILL * found.far
        for j in group:
            kinds[j] = motion_names.RIGID if rigid else name
    return replace(found, kinds=tuple(kinds))


def _spanning(system: System, found: Frequencies, group: list[int]) -> np.ndarray:
    """Vectors (n, k) of a ``group`` of k equal eigenvalues, orthonormal in the mass where there are several."""
    vectors = found.vectors[:, group]
    return orthonormal(system.comm, vectors, found.weighed[:, group]) if len(group) > 1 else vectors


def groups(values: np.ndarray, far: float, tolerance: float = MULTIPLE) -> list[list[int]]:
    """Places of eigenvalues in groups of equal ones, in the order of the first of each.

    They differ by less than the ``tolerance``, relative; those near zero are compared with what is ``far`` from it.
    """
    out: list[list[int]] = []
    least = NEAR_ZERO * min(abs(values).max(initial=0.0), far)
    sizes = tolerance * np.maximum(abs(values), least)
    if (abs(values[:, None] - values) < sizes[:, None]).sum() <= len(values):  # no two of them
        return [[i] for i in range(len(values))]
    for i, value in enumerate(values):
        for group in out:
            if abs(value - values[group[0]]) < tolerance * max(abs(value), least):
                group.append(i)
                break
        else:
            out.append([i])
    return out


def product(comm: MPI.Comm, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """``a^* b`` of the rows of all ranks of ``comm``: (k, m) for (n, k) and (n, m)."""
    mine = a.conj().T @ b
    return np.asarray(mine if comm.size == 1 else comm.allreduce(mine))


def squares(comm: MPI.Comm, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Products (k,) of each column of ``a`` (n, k) with the same of ``b``, real parts, of all ranks of ``comm``."""
    mine = np.sum(a.conj() * b, axis=0).real
    return np.asarray(mine if comm.size == 1 else comm.allreduce(mine))


def orthonormal(comm: MPI.Comm, vectors: np.ndarray, weighed: np.ndarray) -> np.ndarray:
    """Basis of the span of complex vectors (n, k), orthonormal in the mass; ``weighed`` are their products with it.

    Zero for what has no mass, as a light rod where a parameter takes it away.  The ranks of ``comm`` share the rows.
    """
    parts, turn = np.linalg.eigh(product(comm, vectors, weighed))
    sizes = np.maximum(parts, EPS * parts[-1])
    return np.asarray(vectors @ (turn / np.sqrt(np.where(sizes > 0.0, sizes, np.inf))))
