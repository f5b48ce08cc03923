"""Round-off of eigenvalues that meet, against errors of a dense matrix's entries drawn at random."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import classics
import numpy as np
import pytest
import rescaled

from rodfem import Discretization, Parameter, Scene, Solver
from rodfem.diagram.held import at_load
from rodfem.linalg.matrices import gathered
from rodfem.stability.cluster import Measured, cluster_of, measure
from rodfem.stability.cluster_noise import noise_of
from rodfem.stability.inertia import EPS, NOISE
from rodfem.stability.nonsymmetric import NonsymmetricPencil, NonsymmetricSolver

pytestmark = pytest.mark.alone

RELATIVE, DRAWS = 1e-9, 60


def nearly_met(scene: Scene, load: float, size: int) -> tuple[NonsymmetricPencil, Measured]:
    """The ``size`` left-most eigenvalues of a rod a little below its flutter load."""
    solver = Solver(scene, Discretization("pointwise", 2, 4)).equilibria
    x, _ = solver.first(load)
    pencil = NonsymmetricSolver(solver.system).at(at_load(solver, x, load))
    found = pencil.near(size + 2, 0.0)
    return pencil, measure(pencil, cluster_of(pencil, found, list(range(size))))


def equal() -> Scene:
    """A rod that bends alike in all planes: its flutter load is that of two pairs at once."""
    return replace(classics.beck(), parameters={**classics.beck().parameters, "B2": Parameter(1.0)})


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
