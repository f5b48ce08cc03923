"""States of a search that are far from the rod's: what is measured at them is no other state's."""

from __future__ import annotations

import numpy as np
import pytest
import ufl

from rodfem import Discretization, Ordinate, Scene, Solver, clamped, free
from rodfem.continuation.first_equilibrium import examined, is_stable
from rodfem.errors import ConvergenceError
from rodfem.fem.newton import NewtonResult
from rodfem.stability.near_zero import decide


def stiffening(load: float) -> Scene:
    """A cantilever that stiffens as ``cosh``, with a force at its tip."""
    return Scene(
        "stiffening", (0.0, 1.0), "unshearable and inextensible", lambda v, k, c: sum(ufl.cosh(x) - 1 for x in k),
        {"P": 0.0}, "P", (clamped(), free(lambda c: (c.P, 0.0, 0.0))),
        Ordinate("x", s=1.0, of=lambda r, q: r[0]), (0.0, load),
    )  # fmt: skip


@pytest.mark.long
@pytest.mark.alone
def test_the_band_of_a_far_state_is_not_kept() -> None:
    """At curvatures of 100 the stiffness is 1e43, and all eigenvalues of such a state are round-off of one another."""
    solver = Solver(stiffening(1.0), Discretization(elements=4, degree=4)).equilibria
    system, x = solver.system, solver.start(0.5)
    far = x.copy()
    far.array[:] += 30 * np.sin(np.arange(len(far.array)))
    system.set_load(far, 0.5)
    with pytest.raises(ConvergenceError, match="out of all proportion"):
        is_stable(solver, far)
    assert examined(solver, far, NewtonResult(True, 1, 0.0, 0.0)) == (NewtonResult(False, 1, 0.0, 0.0), False)
    assert is_stable(solver, x)
    assert decide(solver.inertia.at(x)).band < 1e-3
    assert system.verification.norm < 1e6
