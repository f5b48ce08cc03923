"""Eigenvalues ``mu = omega^2`` that were found at a state, the names of their motions, and groups of equal ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from mpi4py import MPI

from rodfem.fem.system import System
from rodfem.problem.local_state import floats
from rodfem.stability import mode_type
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
    :mod:`rodfem.stability.mode_type`.  ``vectors`` (n, k) are complex, or real where all eigenvalues are, with the n
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


def named(
    system: System, rows: Sequence[tuple[Frequencies, np.ndarray]], number: int | None = None
) -> list[Frequencies]:
    """Frequencies of some states, each given with the rotation field there, with the names of their motions.

    Only the first ``number`` are named, where that is given.  A multiple eigenvalue has one name, that of its invariant
    subspace: its vectors are any in it, bending about d1 in one state and about d2 in the next.
    """
    blocks: list[np.ndarray] = []
    owners: list[np.ndarray] = []
    counts: list[int] = []
    together = [
        [g for g in groups(found.values, found.far, ALIKE) if number is None or g[0] < number] for found, _ in rows
    ]
    count = 0
    for (found, _), of_row in zip(rows, together, strict=True):
        sizes = [len(group) for group in of_row]
        vectors = found.vectors[:, [j for group in of_row for j in group]]
        owner = np.repeat(np.arange(count, count + len(of_row)), sizes)
        first = 0
        for group in of_row if max(sizes) > 1 else ():
            here = slice(first, first := first + len(group))
            vectors[:, here] = orthonormal(system.comm, vectors[:, here], found.weighed[:, group])
        parts = [vectors.real, vectors.imag] if np.iscomplexobj(vectors) else [vectors]
        blocks += parts
        owners += [owner] * len(parts)
        counts.append(len(parts) * len(owner))
        count += len(of_row)
    squares, moved, columns = np.zeros((count, 3)), np.zeros(count), np.concatenate(blocks, axis=1)
    turned = np.repeat(np.stack([field for _, field in rows]), counts, axis=0)
    np.add.at(squares, np.concatenate(owners), mode_type.squares(system, turned, columns))
    np.add.at(moved, np.concatenate(owners), mode_type.displacements(system, columns))
    names = iter(mode_type.names(mode_type.of_all(squares, moved)))
    out, floating = [], floats(system.scene)
    for (found, _), of_row in zip(rows, together, strict=True):
        kinds = [""] * len(found.values)
        for group, name in zip(of_row, names, strict=False):
            rigid = floating and abs(found.values[group]).max() < STILL * found.far
            for j in group:
                kinds[j] = mode_type.RIGID if rigid else name
        out.append(replace(found, kinds=tuple(kinds)))
    return out


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
