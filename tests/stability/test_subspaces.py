"""Invariant subspaces improved by compiled code, against dense linear algebra."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.linalg import eig

from rodfem.linalg.chain import Elimination, sequence
from rodfem.stability.subspaces import LEFT, RIGHT, Subspaces

pytestmark = pytest.mark.alone
N, P, BAND = 45, 5, 4
SHIFT = -0.3


@dataclass
class Pencil:
    """A banded pencil without symmetry, its mass without every third row, and ``nu = 1 / (mu - a)`` in order."""

    stiffness: np.ndarray
    mass: np.ndarray

    @property
    def spectrum(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Values, and left and right vectors."""
        nu, left, right = eig(self.mass, self.stiffness - SHIFT * self.mass, left=True)
        order = np.argsort(-abs(nu))
        return nu[order], left[:, order].conj(), right[:, order]

    def factors(self) -> Elimination:
        """Those of ``S - a M``."""
        shifted = sp.csr_matrix(self.stiffness - SHIFT * self.mass)
        pattern = shifted.indptr, shifted.indices
        out = Elimination("lu", *pattern, sequence(*pattern, np.zeros(0, dtype=int)))
        out.factor(shifted.data)
        return out


def pencil() -> Pencil:
    """Eigenvalues far apart, a few of them complex."""
    rng = np.random.default_rng(3)
    near = abs(np.subtract.outer(range(N), range(N))) <= BAND
    stiffness = np.diag(1.0 + 0.5 * np.arange(N) ** 2) + np.where(near, 0.4 * rng.normal(size=(N, N)), 0.0)
    massive = np.arange(N) % 3 > 0
    half = np.where(near, 0.1 * rng.normal(size=(N, N)), 0.0) + np.eye(N)
    half[~massive] = 0.0
    banded = np.where(near, half @ half.T, 0.0)
    return Pencil(stiffness, banded)


def made(given: Pencil, vectors: tuple[np.ndarray, np.ndarray] | None = None) -> Subspaces:
    """Bases with the pencil's factors, begun with any vectors, or with these."""
    mass = sp.csr_matrix(given.mass)
    spaces = Subspaces(mass, P)
    spaces.take(mass, given.factors())
    rng = np.random.default_rng(5)
    for side in (RIGHT, LEFT):
        spaces.bases[side][:] = rng.normal(size=(N, P)) if vectors is None else vectors[side]
    return spaces


def test_one_step_on_either_side() -> None:
    """Bases, projections and changes are those of the formulas, in dense matrices."""
    given = pencil()
    spaces, mass = made(given), given.mass
    shifted = given.stiffness - SHIFT * mass
    for side in (RIGHT, LEFT):
        x, y = (basis.copy() for basis in spaces.bases)
        spaces.improve(side)
        overlap = y.T @ mass @ x
        if side == RIGHT:
            step = np.linalg.solve(shifted, mass @ x)
            projected = y.T @ mass @ step
            expected, before = step @ np.linalg.solve(projected, overlap), x
        else:
            step = np.linalg.solve(shifted.T, mass @ y)
            projected = step.T @ mass @ x
            expected, before = step @ np.linalg.solve(projected.T, overlap.T), y
        change = expected - before
        assert spaces.overlap == pytest.approx(overlap, rel=1e-10, abs=1e-11)
        assert spaces.matrix == pytest.approx(np.linalg.solve(overlap, projected), rel=1e-8, abs=1e-10)
        assert spaces.bases[side] == pytest.approx(expected, rel=1e-8, abs=1e-8)
        assert spaces.changes[side] == pytest.approx(change.T @ mass @ change, rel=1e-7, abs=1e-8)


@pytest.mark.parametrize("known", range(1, 7))
def test_prediction_is_a_polynomial_of_least_squares(known: int) -> None:
    """At loads in any order; what it misses of the next power."""
    spaces, rng = made(pencil()), np.random.default_rng(6)
    past, distances = rng.normal(size=(6, N, P)), -rng.permutation(6)[:known] - rng.random(known)
    missed = spaces.predict(LEFT, 2, distances, past)
    degree = min(2, known - 1)
    fitted = np.polyfit(distances, past[:known].reshape(known, -1), degree)[-1].reshape(N, P)
    assert spaces.bases[LEFT] == pytest.approx(fitted, rel=1e-9, abs=1e-9)
    assert missed == pytest.approx(abs(np.polyfit(distances, distances**3, degree)[-1]), rel=1e-9)


def test_converges_to_dense_eigenvalues_and_the_probes_see_the_next() -> None:
    given = pencil()
    spaces, (nu, _, _) = made(given), given.spectrum
    for _ in range(60):
        spaces.improve(RIGHT)
        spaces.improve(LEFT)
    found = np.linalg.eigvals(spaces.matrix)
    assert abs(np.sort_complex(found) - np.sort_complex(nu[:P])).max() < 1e-11 * abs(nu[0])
    assert spaces.outside == pytest.approx(abs(nu[P]), rel=0.05)


@pytest.mark.parametrize("missing", range(P))
def test_the_probes_see_an_eigenvalue_that_is_missing(missing: int) -> None:
    """The next eigenvalue is followed instead of a greater one: the probes grow by the one that is missing."""
    given = pencil()
    nu, left, right = given.spectrum
    assert abs(nu[: P + 1].imag).max() == 0.0
    chosen = [i for i in range(P + 1) if i != missing]
    spaces = made(given, (right[:, chosen].real, left[:, chosen].real))
    seen = []
    for _ in range(5):  # round-off does not bring the missing one into the bases meanwhile
        spaces.improve(RIGHT)
        seen.append(spaces.outside)
    assert max(seen) == pytest.approx(abs(nu[missing]), rel=0.1)
