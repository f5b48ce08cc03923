"""Bases of a right and a left invariant subspace, which compiled code (``followed.c``) improves one side at a time."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from rodfem.errors import ConvergenceError
from rodfem.linalg.chain import Elimination
from rodfem.linalg.compiled import Memory, buffer, module

RIGHT, LEFT = 0, 1
"""The sides."""
PROBES = 4
"""Vectors that look for eigenvalues outside: as many as are solved for at once."""
FRESH = 0.1
"""Size of the random part of a probe over that which has been iterated."""
LANES = 8
"""The width of a row of vectors is a multiple of this."""
SINGULAR, NO_ROOM = 1, 2


class Subspaces:
    """Bases of the right and the left invariant subspace of ``p`` eigenvalues of ``B = (S - a M)^-1 M``.

    Attributes
    ----------
    bases
        Those of both sides, (n, p) each, to be written to.
    changes
        Products, in the mass, of what the vectors of each side changed by when they were improved last, (p, p) each.
    overlap, matrix
        ``N = Y^t M X`` and ``T = N^-1 Y^t M B X``, (p, p), before the last step.
    """

    def __init__(self, mass: sp.csr_matrix, p: int) -> None:
        """Allocate all arrays; the probes are random, and as large as vectors of the bases in the ``mass``."""
        compiled = module("stability/followed")
        self.lib, self.ffi, self._memory = compiled.lib, compiled.ffi, Memory(compiled.ffi)
        n, width = mass.shape[0], -(-(p + PROBES) // LANES) * LANES
        self._factors: Elimination | None = None
        f = self._spaces = self.ffi.new("Spaces *")
        f.n, f.p, f.probes, f.width, f.share = n, p, PROBES, width, FRESH
        sides = self._both("basis", n, width)
        self.bases = [block[:, :p] for block in sides]
        self.changes = [block[:p, :p] for block in self._both("change", width, width)]
        self._both("image", n, width)
        random = np.random.default_rng(1).normal(size=(n, PROBES))
        random /= np.sqrt((random * (mass @ random)).sum(axis=0))
        sides[RIGHT][:, p : p + PROBES] = self._named("fresh", n, PROBES)[:] = random
        self.overlap, self.matrix = (self._named(name, width, width)[:p, :p] for name in ("overlap", "matrix"))
        self._combined = [self._named(name, n, width) for name in ("block", "mapped")]
        self._coefficients = np.zeros((p, width))
        for name in ("columns", "solved"):
            self._named(name, n, width)
        self._named("small", 3, width, width)
        self._memory.point(f, heavy=np.zeros(n, dtype=np.int32))

    def _both(self, name: str, *shape: int) -> list[np.ndarray]:
        """Arrays of both sides."""
        arrays = [np.zeros(shape), np.zeros(shape)]
        for side, array in enumerate(arrays):
            getattr(self._spaces, name)[side] = self._memory.array((name, side), array)
        return arrays

    def _named(self, name: str, *shape: int) -> np.ndarray:
        array = np.zeros(shape)
        self._memory.point(self._spaces, **{name: array})
        return array

    def take(self, mass: sp.csr_matrix, factors: Elimination) -> None:
        """Use these factors of ``S - a M`` and this mass from now on."""
        f = self._spaces
        self._memory.point(f, starts=mass.indptr, indices=mass.indices, mass=mass.data)
        if factors is not self._factors:
            f.solve[RIGHT], f.solve[LEFT] = factors.address("solve"), factors.address("solve_transposed")
            f.factors, self._factors = factors.pointer, self._memory.keep("factors", factors)

    def predict(self, side: int, degree: int, distances: np.ndarray, past: np.ndarray) -> float:
        """Let the basis of a ``side`` be what a polynomial fitted to some others has at distance zero.

        They are the first ones of the ``past`` (any, n, p), at ``distances`` (k,), at most eight, and the polynomial is
        of that ``degree`` at most.  Returns what it misses of the next power of the distance.
        """
        given = (buffer(self.ffi, x) for x in (distances, past))
        return float(self.lib.predict(self._spaces, side, len(distances), degree, *given))

    def combined(self, w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Combinations (n, k) of the right basis with coefficients ``w`` (p, k), and ``M`` times them; k is p at most.

        They are real where ``w`` is.
        """
        if np.iscomplexobj(w):
            real, imaginary = self.combined(w.real), self.combined(w.imag)
            return real[0] + 1j * imaginary[0], real[1] + 1j * imaginary[1]
        count = w.shape[1]
        self._coefficients[:, :count] = w
        self.lib.combine(self._spaces, count, buffer(self.ffi, self._coefficients))
        vectors, images = (block[:, :count].copy() for block in self._combined)
        return vectors, images

    def improve(self, side: int) -> None:
        """Make a step of inverse iteration on one side, and of the probes where it is the right one.

        Raises :class:`ConvergenceError` where the bases do not determine each other, and :class:`MemoryError` where
        there is no room for solutions.
        """
        status = self.lib.improve(self._spaces, side)
        if status == SINGULAR:
            raise ConvergenceError("The right and the left invariant subspace are orthogonal to each other.")
        if status == NO_ROOM:
            raise MemoryError("No memory for solutions with many columns.")

    @property
    def outside(self) -> float:
        """Size of the greatest eigenvalue of ``B`` outside, as the probes have it."""
        return float(self._spaces.outside)
