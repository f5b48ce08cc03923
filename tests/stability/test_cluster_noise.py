"""Round-off of eigenvalues that meet, and what an eigensolver leaves open of them."""

from dataclasses import replace

import classics
import pytest

from rodfem import Discretization, Solver
from rodfem.diagram.equilibria import at_load
from rodfem.stability.cluster import Cluster, measure, noise_of, real_span
from rodfem.stability.nonsymmetric import NonsymmetricSolver


def test_what_an_eigensolver_leaves_open() -> None:
    """Errors that are given to the mean, and to D, of two eigenvalues."""
    solver = Solver(classics.beck(), Discretization("pointwise", 2, 4)).equilibria
    pencil = NonsymmetricSolver(solver.system).at(at_load(solver, solver.start(10.0), 19.0))
    found = pencil.nearest(4, 0.0)
    cluster = Cluster(real_span(pencil, found.vectors[:, :2]), float(found.values[:2].real.mean()))
    measured = measure(pencil, cluster)
    own, mean = noise_of(pencil, measured), measured.cluster.mean
    assert own.mean_left < 1e-9 * mean and own.discriminant_left < 1e-9 * measured.discriminant
    shifted = replace(measured, cluster=replace(measured.cluster, mean=mean * (1 + 1e-6)))
    assert (left := noise_of(pencil, shifted)).mean_left == pytest.approx(1e-6 * mean, rel=1e-3)
    assert left.of_mean >= left.mean + left.mean_left  # as large a one may be left again
    off = replace(measured, discriminant=measured.discriminant * (1 + 1e-6))
    assert (left := noise_of(pencil, off)).discriminant_left == pytest.approx(1e-6 * measured.discriminant, rel=1e-3)
    assert left.of_discriminant >= left.discriminant + left.discriminant_left
