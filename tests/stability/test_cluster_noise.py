"""Round-off of eigenvalues that meet, against errors of a dense matrix's entries drawn at random."""

from collections.abc import Callable
from dataclasses import replace

import classics
import numpy as np
import pytest
import rescaled

from rodfem import Discretization, Parameter, Scene, Solver
from rodfem.continuation.first_equilibrium import first_equilibrium
from rodfem.diagram.equilibria import at_load
from rodfem.linalg.matrices import EPS, gathered
from rodfem.stability.cluster import Cluster, Measured, measure, noise_of, real_span
from rodfem.stability.inertia import NOISE
from rodfem.stability.nonsymmetric import NonsymmetricPencil, NonsymmetricSolver

RELATIVE, DRAWS = 1e-9, 60


def nearly_met(scene: Scene, load: float, size: int) -> tuple[NonsymmetricPencil, Measured]:
    """The ``size`` left-most eigenvalues of a rod a little below its flutter load."""
    solver = Solver(scene, Discretization("pointwise", 2, 4)).equilibria
    x, _ = first_equilibrium(solver, load)
    pencil = NonsymmetricSolver(solver.system).at(at_load(solver, x, load))
    found = pencil.nearest(size + 2, 0.0)
    cluster = Cluster(real_span(pencil, found.vectors[:, :size]), float(found.values[:size].real.mean()))
    return pencil, measure(pencil, cluster)


def equal() -> Scene:
    """A rod that bends alike in all planes: its flutter load is that of two pairs at once."""
    return replace(classics.beck(), parameters={**classics.beck().parameters, "B2": Parameter(1.0)})


@pytest.mark.few(1)
@pytest.mark.parametrize(
    ("make", "size"),
    [(classics.beck, 2), (lambda: rescaled.rescaled(classics.beck(), 1e-2, 1e4), 2), (equal, 4)],
    ids=["two of them", "in other units", "two pairs"],
)
def test_noise_of_eigenvalues_that_meet(make: Callable[[], Scene], size: int) -> None:
    """Standard deviations of the mean and of D, by the eigenvalues of the whole pencil."""
    pencil, measured = nearly_met(make(), 19.0, size)
    S, M = (gathered(a).toarray() for a in (pencil.matrix, pencil.mass))
    random, means, discriminants = np.random.default_rng(1), [], []
    for _ in range(DRAWS):
        inverses = np.linalg.eigvals(np.linalg.solve(S * (1 + RELATIVE * random.normal(size=S.shape)), M))
        own = 1 / inverses[np.argsort(-abs(inverses))[:size]]
        means.append(own.mean().real)
        discriminants.append(((own - own.mean()) ** 2).mean().real)
    noise = noise_of(pencil, measured)
    scale = RELATIVE / (NOISE * EPS)
    assert np.std(means) == pytest.approx(scale * noise.mean, rel=0.3)
    assert np.std(discriminants) == pytest.approx(scale * noise.discriminant, rel=0.3)


def test_what_an_eigensolver_leaves_open() -> None:
    """Errors that are given to the mean, and to D, of two eigenvalues."""
    pencil, measured = nearly_met(classics.beck(), 19.0, 2)
    own, mean = noise_of(pencil, measured), measured.cluster.mean
    assert own.mean_left < 1e-9 * mean and own.discriminant_left < 1e-9 * measured.discriminant
    shifted = replace(measured, cluster=replace(measured.cluster, mean=mean * (1 + 1e-6)))
    assert (left := noise_of(pencil, shifted)).mean_left == pytest.approx(1e-6 * mean, rel=1e-3)
    assert left.of_mean >= left.mean + left.mean_left  # as large a one may be left again
    off = replace(measured, discriminant=measured.discriminant * (1 + 1e-6))
    assert (left := noise_of(pencil, off)).discriminant_left == pytest.approx(1e-6 * measured.discriminant, rel=1e-3)
    assert left.of_discriminant >= left.discriminant + left.discriminant_left
