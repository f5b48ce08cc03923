"""Contact forces and moments against statics: balances of which the stored energy knows nothing."""

from dataclasses import replace
from itertools import pairwise

import classics
import numpy as np
import pytest
from problem.test_docs import scenes

import rodfem
from rodfem import Discretization, Scene, Solver
from rodfem.forms.energy import bending_and_twist
from rodfem.output.states import Profiles
from rodfem.problem.quaternions import directors

ELEMENTS, DEGREE, LOAD = 6, 5, 2.0
FORCE = (0.6 * LOAD, 0.8 * LOAD, -LOAD)
BOWED = classics.column(
    "bowed", (rodfem.clamped(), rodfem.free(lambda c: (0.6 * c.P, 0.8 * c.P, -c.P))), (0.0, 2.0),
    energy=lambda v, k, c: bending_and_twist((k[0], k[1] - 1.0, k[2]), (1.0, 2.0, 0.7)),
    ordinate=scenes()["heavy"].ordinate,
)  # fmt: skip
"""Bent in one plane where no load acts, and pulled out of it at its tip: it twists."""
SCENES = {
    "bowed": BOWED,
    "stretching": replace(
        BOWED,
        rod="flexible",
        energy=lambda v, k, c: BOWED.energy(v, k, c) + 20.0 * (v[0] ** 2 + 2.0 * v[1] ** 2 + (v[2] - 1.0) ** 2),
    ),
    "untwistable": replace(BOWED, constraints=(rodfem.everywhere(lambda x, c: x.k[2], strain=True),)),
}


def at_vertices(scene: Scene, formulation: str = "auto") -> dict[str, np.ndarray]:
    """Arclength, position, contact force and moment in space, torque, at both ends of each element (E, 2, ...)."""
    solver = Solver(scene, Discretization(formulation, ELEMENTS, DEGREE))
    x = solver.equilibrium(LOAD).x
    sample, found = solver.equilibria.shape.sample(x), solver.equilibria.resultants.at(x)
    s, r, q = (np.stack([sample[key][:-1:DEGREE], sample[key][DEGREE::DEGREE]], 1) for key in ("s", "r", "q"))
    assert np.allclose(found["points"][:, [0, -1]], s)
    R = directors(q / np.linalg.norm(q, axis=-1, keepdims=True))
    n, m = (np.einsum("epij,epj->epi", R, found[name][:, [0, -1]]) for name in ("force", "moment"))
    return {"s": s, "r": r, "n": n, "m": m, "torque": found["moment"][:, [0, -1], 2]}


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "formulation"), [("bowed", "pointwise"), ("stretching", "reduced"), ("untwistable", "reduced")]
)
def test_a_dead_force_is_carried_along_the_rod(name: str, formulation: str) -> None:
    """``n`` is the force at the free end, ``m`` its moment; a rod that cannot twist carries a torque all the same."""
    found = at_vertices(SCENES[name], formulation)
    lever = found["r"][-1, 1] - found["r"]
    assert np.allclose(found["n"], FORCE, atol=1e-6)
    assert np.allclose(found["m"], np.cross(lever, found["n"]), atol=1e-4)
    assert abs(found["torque"]).max() > 0.2 and abs(found["m"]).max() > 1.0


@pytest.mark.long
def test_a_distributed_force_adds_up_along_the_rod() -> None:
    """``n' = -f``, and ``n = 0`` at the free end."""
    found = at_vertices(scenes()["heavy"])
    assert np.allclose(found["n"], LOAD * (1.0 - found["s"])[..., None] * [0.0, 0.0, -1.0], atol=1e-9)


def test_profiles_of_polynomials() -> None:
    """Values at nodes are exact, and a jump counts where nothing acts."""
    ends = np.array([0.0, 0.5, 0.7, 1.0])
    points = ends[:-1, None] + np.diff(ends)[:, None] * np.linspace(0.0, 1.0, 3)
    s = np.unique(np.concatenate([np.linspace(a, b, 5) for a, b in pairwise(ends)]))
    smooth, step = (np.repeat(y[..., None], 3, axis=2) for y in (points**2 - points, (points > 0.5) * 1.0))
    step[1, 0] = 1.0
    profiles = Profiles(points, {"k": smooth, "m": step})
    assert np.allclose(profiles.at_nodes("k", s)[:, 1], s**2 - s)
    assert profiles.at_nodes("m", s)[s == 0.5] == pytest.approx(0.5)
    assert (profiles.jump("m"), profiles.jump("m", [0.5])) == (1.0, 0.0) and profiles.jump("k") < 1e-15
