"""The reported energy is the potential of the discrete equations: it changes by the work of what moves the ends."""

import numpy as np
import pytest
from classics import bow

from rodfem import Discretization, Solver

NODES, WEIGHTS = np.polynomial.legendre.leggauss(8)


@pytest.mark.long
@pytest.mark.parametrize("formulation", ["reduced", "pointwise"])
@pytest.mark.parametrize("mesh", [(24, 1), (5, 2), (6, 5)])
def test_energy_of_a_bow(mesh: tuple[int, int], formulation: str) -> None:
    """Its ends come nearer by ``d``, against the thrust: Castigliano's theorem, on coarse meshes as well."""
    solver = Solver(bow(), Discretization(formulation, *mesh))
    thrust, first, last = solver.equilibria.system.fields.scalars["g1"], 0.2, 0.25
    point = solver.equilibrium(first)
    energies, work = [point.energy], 0.0
    for t, w in zip(NODES, WEIGHTS, strict=True):
        point = solver.equilibrium(first + (last - first) * (1 + t) / 2, guess=point)
        work += w * (last - first) / 2 * abs(point.x[thrust])
    energies.append(solver.equilibrium(last, guess=point).energy)
    assert abs(np.diff(energies)[0]) == pytest.approx(work, rel=1e-12)
