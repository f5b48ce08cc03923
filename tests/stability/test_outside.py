"""Bounds of the eigenvalues outside of two invariant subspaces, against all of them by dense linear algebra."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp
from stability.test_subspaces import P, Pencil, pencil

from rodfem.stability.outside import enclosed

pytestmark = pytest.mark.alone


def bases(given: Pencil, chosen: list[int]) -> tuple[np.ndarray, np.ndarray]:
    """Right and left vectors of chosen eigenvalues, the former orthonormal in the mass."""
    nu, left, right = given.spectrum
    assert abs(nu[: P + 2].imag).max() == 0.0
    x = right[:, chosen].real
    return x @ np.linalg.inv(np.linalg.cholesky(x.T @ given.mass @ x)).T, left[:, chosen].real


def test_all_that_is_outside_is_bounded() -> None:
    given = pencil()
    nu, _, _ = given.spectrum
    x, y = bases(given, list(range(P)))
    found = enclosed(x, y, sp.csr_matrix(given.mass), given.factors())
    assert found is not None
    assert np.sort(found.nu.real) == pytest.approx(np.sort(nu[:P].real), rel=1e-10)
    assert abs(nu[P]) < found.outside < abs(nu[P - 1])
    assert found.doubt < 1e-20 and found.proves(P)
    # the norm, from its definition: C in coordinates that are orthonormal in the mass
    heavy = np.flatnonzero(np.diag(given.mass))
    m = given.mass[np.ix_(heavy, heavy)]
    half = np.linalg.cholesky(m).T
    inverse = np.linalg.inv(given.stiffness + 0.3 * given.mass)[np.ix_(heavy, heavy)]
    across = np.eye(len(heavy)) - x[heavy] @ np.linalg.solve(y[heavy].T @ m @ x[heavy], y[heavy].T @ m)
    c = half @ across @ inverse @ m @ across @ np.linalg.inv(half)
    assert found.outside == pytest.approx(min(np.linalg.norm(c), np.sqrt(np.linalg.norm(c @ c))), rel=1e-10)


@pytest.mark.parametrize("missing", range(P))
def test_nothing_is_proved_where_an_eigenvalue_is_missing(missing: int) -> None:
    """The next eigenvalue instead of a greater one: the bound is not below the one that is missing."""
    given = pencil()
    nu, _, _ = given.spectrum
    x, y = bases(given, [i for i in range(P + 1) if i != missing])
    found = enclosed(x, y, sp.csr_matrix(given.mass), given.factors())
    assert found is not None
    assert found.outside >= abs(nu[missing]) * (1 - 1e-12)
    for number in range(missing + 1, P + 1):
        assert not found.proves(number)


def test_nothing_is_proved_of_bases_that_are_not_invariant() -> None:
    given = pencil()
    x, y = bases(given, list(range(P)))
    rng = np.random.default_rng(7)
    for size, proved in ((0.1, False), (1e-4, True)):
        u, v = (basis + size * rng.normal(size=basis.shape) for basis in (x, y / np.linalg.norm(y, axis=0)))
        found = enclosed(u, v, sp.csr_matrix(given.mass), given.factors())
        assert found is not None and found.proves(P) == proved
