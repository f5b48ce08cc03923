"""Bases of a right and a left invariant subspace, which compiled code (``followed.c``) improves one side at a time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from rodfem.errors import ConvergenceError
from rodfem.linalg.chain import Elimination
from rodfem.linalg.compiled import module

RIGHT, LEFT = 0, 1
"""The sides."""
PROBES = 4
"""Vectors that look for eigenvalues outside: as many as are solved for at once."""
FRESH = 0.1
"""Size of the random part of a probe over that which has been iterated."""
LANES = 8
"""The width of a row of vectors is a multiple of this."""
SINGULAR, NO_ROOM = 1, 2
FUNCTIONS = """
int improve(Spaces *f, int side);
double predict(Spaces *f, int side, int known, int degree, const double *distances, const double *past);
void combine(Spaces *f, int count, const double *w);
"""


def declarations() -> str:
    """The structure and the function of the code, for cffi."""
    code = Path(__file__).with_name("followed.c").read_text()
    return code[code.index("typedef struct {") : code.index("#define AT(")] + FUNCTIONS


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
        compiled = module("followed", declarations(), Path(__file__).parent)
        self.lib, self.ffi = compiled.lib, compiled.ffi
        n, width = mass.shape[0], -(-(p + PROBES) // LANES) * LANES
        self._kept: list[Any] = []
        self._factors: Elimination | None = None
        f = self._spaces = self.ffi.new("Spaces *")
        f.n, f.p, f.probes, f.width, f.share = n, p, PROBES, width, FRESH
        sides = [self._doubles(f.basis, side, n, width) for side in (RIGHT, LEFT)]
        self.bases = [block[:, :p] for block in sides]
        self.changes = [self._doubles(f.change, side, width, width)[:p, :p] for side in (RIGHT, LEFT)]
        for side in (RIGHT, LEFT):
            self._doubles(f.image, side, n, width)
        random = np.random.default_rng(1).normal(size=(n, PROBES))
        random /= np.sqrt((random * (mass @ random)).sum(axis=0))
        sides[RIGHT][:, p : p + PROBES] = self._named("fresh", n, PROBES)[:] = random
        self.overlap, self.matrix = (self._named(name, width, width)[:p, :p] for name in ("overlap", "matrix"))
        self._combined = [self._named(name, n, width) for name in ("block", "mapped")]
        self._coefficients = np.zeros((p, width))
        for name in ("columns", "solved"):
            self._named(name, n, width)
        self._named("small", 3, width, width)
        f.heavy = self._pointer(np.zeros(n, dtype=np.int32), "int")

    def _pointer(self, array: np.ndarray, kind: str = "double") -> Any:
        self._kept.append(array)
        return self.ffi.cast(f"{kind} *", array.ctypes.data)

    def _doubles(self, pointers: Any, place: int, *shape: int) -> np.ndarray:
        array = np.zeros(shape)
        pointers[place] = self._pointer(array)
        return array

    def _named(self, name: str, *shape: int) -> np.ndarray:
        array = np.zeros(shape)
        setattr(self._spaces, name, self._pointer(array))
        return array

    def take(self, mass: sp.csr_matrix, factors: Elimination) -> None:
        """Use these factors of ``S - a M`` and this mass from now on."""
        f = self._spaces
        self._mass = mass
        f.starts, f.indices = (self.ffi.cast("int *", x.ctypes.data) for x in (mass.indptr, mass.indices))
        f.mass = self.ffi.cast("double *", mass.data.ctypes.data)
        if factors is not self._factors:
            f.solve[RIGHT], f.solve[LEFT] = factors.address("solve"), factors.address("solve_transposed")
            f.factors, self._factors = factors.pointer, factors

    def predict(self, side: int, degree: int, distances: np.ndarray, past: np.ndarray) -> float:
        """Let the basis of a ``side`` be what a polynomial fitted to some others has at distance zero.

        They are the first ones of the ``past`` (any, n, p), at ``distances`` (k,), at most eight, and the polynomial is
        of that ``degree`` at most.  Returns what it misses of the next power of the distance.
        """
        given = (self.ffi.cast("double *", x.ctypes.data) for x in (distances, past))
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
        self.lib.combine(self._spaces, count, self.ffi.cast("double *", self._coefficients.ctypes.data))
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
