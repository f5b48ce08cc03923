"""Deflation against what exploring finds, and against integration of the rod's initial value problem."""

from dataclasses import replace
from itertools import combinations

import classics
import hemitropic_cases
import numpy as np
import pytest
from demo_cases import explored, scene
from literature.test_cord import default
from rescaled import DNA, rescaled

from rodfem import Diagram, Discretization, InputError, Plan, Point, Solver, pinned, trace
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.deflation.search import NEW, Deflation, equilibria_at, turned_state
from rodfem.deflation.symmetries import mirrors

COILED = np.array(
    [
        (7.381013579979367, 0.8762574079079647),
        (18.61973229479929, 0.579331427053113),
        (38.650541761818474, 0.44710092896044085),
        (94.82911014010055, 1.1198422685232607),
        (168.1427190632373, 0.6709172055055818),
        (255.75335808341504, 0.7393649494036123),
    ]
)
"""Energies and ordinates of equilibria of the cord at 40, by shooting."""


def ruler() -> Diagram:
    return explored("ruler", "reduced", at=(5.95, 6.0, 6.05))


def only(points: list[Point], **values: float) -> Point:
    """The one point with these values."""
    (p,) = [p for p in points if all(abs(getattr(p, name) - v) < 1e-8 for name, v in values.items())]
    return p


def force(follower: BranchSolver, x: object) -> float:
    """Size of the equations' residual at a state, without phase conditions."""
    out = follower.system.new_vector()
    follower.system.set_phase(None)
    follower.system.at(x).residual(out)
    return float(out.norm())


@pytest.mark.long
def test_cord() -> None:
    """From the straight state alone: all that exploring finds, and whatever else is found is an equilibrium."""
    found = default()
    known = equilibria_at(found.solvers[0], found.branches, 40.0)
    assert len(known) == 4
    search = Deflation(found.solvers[0], 40.0, [p for p in known if abs(p.ordinate) < 1e-9])
    new = search.run(24)
    for p in known:
        if abs(p.ordinate) > 1e-9:
            match = only(new, energy=p.energy, ordinate=p.ordinate)
            assert (match.negative, match.zero) == (p.negative, p.zero)
    assert not [p for p in new if abs(p.ordinate) < 1e-9]
    for p in new:
        assert abs(COILED - (p.energy, p.ordinate)).max(axis=1).min() < 1e-4
    assert search.tries.count(NEW) == len(new)
    assert len(search.tries) == 24


@pytest.mark.long
def test_ring_in_its_plane() -> None:
    """Moved, turned, or run around along itself it is the same ring: a circle, and beyond 3 the pressed one."""
    follower = Solver(classics.pressed_ring(), Discretization("auto", 12, 6)).equilibria
    found = Deflation(follower, 4.0).run(10)
    assert sorted(p.negative for p in found) == [0, 2]
    circle, pressed = sorted(found, key=lambda p: -p.negative)
    assert circle.energy == pytest.approx(np.pi, rel=1e-9)
    assert (circle.zero, pressed.zero) == (3, 4)  # two translations, a rotation; and the shift, which a circle turns by


@pytest.mark.few(1)
@pytest.mark.parametrize("planar", [None, "e1"])
def test_a_column_that_hangs(planar: str | None) -> None:
    """Between pins, one of which slides: turned over, what pressed the column pulls it straight, at any load."""
    solver = Solver(replace(classics.euler("pinned-pinned"), planar=planar))
    standing = solver.equilibrium(5.0)
    (hangs,) = (p for p in solver.search(5.0, [standing], tries=3) if p.stable)
    r = solver.equilibria.shape.sample(hangs.x)["r"]
    assert r[-1] == pytest.approx([0.0, 0.0, -1.0], abs=1e-9)
    assert hangs.energy == pytest.approx(0.0, abs=1e-12)


def test_known_state_at_another_load() -> None:
    with pytest.raises(InputError, match=r"not 6\.5"):
        Deflation(ruler().solvers[0], 6.5, hemitropic_cases.user_points(ruler()["plane"], 6.0))


@pytest.mark.ranks
@pytest.mark.few(1)
@pytest.mark.parametrize("units", [(1.0, 1.0), DNA[:2]], ids=["1", "DNA"])
@pytest.mark.parametrize("formulation", ["reduced", "pointwise"])
def test_mirrors_are_those_of_the_equations(formulation: str, units: tuple[float, float]) -> None:
    expected = {"cord": {(1, -1, 1), (1, 1, -1), (1, -1, -1)}, "ruler": {(1, -1, 1)}}
    for name, signs in expected.items():
        follower = Solver(rescaled(scene(name), *units), Discretization(formulation)).equilibria
        found = mirrors(follower.shape, follower.start(5.0))
        assert {m.signs for m in found} == signs
        x = turned_state(follower.system, follower.start(5.0), 1.0, [1, 2])
        for mirror in found:
            image = mirror(follower.shape, x)
            assert follower.system.distance(mirror(follower.shape, image), x) < 1e-12
            if formulation == "reduced" or not mirror.reversal:  # a reversal may move the reaction to the other end
                assert force(follower, image) == pytest.approx(force(follower, x), rel=1e-12)


@pytest.mark.ranks
@pytest.mark.long
def test_deflated_iteration_ends_at_the_same_step_in_all_units() -> None:
    """Twelve tries of a coil, in three systems of units far from its own."""
    counts = []
    for length, force in (DNA[:2], (1e-3, 1e6), (1.0, 1e15)):
        solver = Solver(rescaled(scene("cord"), length, force), Discretization("reduced", 8, 5)).equilibria
        counts.append([])
        for number in range(12):
            x = turned_state(solver.system, solver.start(25.0), 0.1 + 0.12 * number, [1, number])
            newton = Deflation(solver, 25.0)
            newton.flow(x)
            counts[-1].append(newton.approach(x).iterations)
    assert counts[0] == counts[1] == counts[2]


@pytest.mark.ranks
def test_guesses_do_not_depend_on_ranks() -> None:
    system = ruler().solvers[0].system
    straight = ruler().solvers[0].start(1.0)
    x = turned_state(system, straight, 1.0, [0, 7])
    q = ruler().solvers[0].shape.sample(x)["q"]
    assert q[0] == pytest.approx([1, 0, 0, 0], abs=1e-15)
    assert np.linalg.norm(q, axis=1) == pytest.approx(1, abs=1e-14)
    assert q[24] == pytest.approx([0.80094931574151, -0.54006580455896, 0.24587627411001, -0.07971184], abs=1e-8)


@pytest.mark.few(1)
@pytest.mark.parametrize("planar", ["e2", None])
def test_quaternions_of_opposite_signs_are_one_rotation(planar: str | None) -> None:
    """And so are angles a turn apart: of a rod between hinges no state has the shape and rotations of another."""
    hinges = pinned(), pinned(classics.ON_AXIS, classics.push)
    scene = classics.column("hinges", hinges, (0.0, 9.0), planar=planar, constants={"B1": 9.0, "B2": 1.0})
    diagram = trace(scene, Discretization("auto", 8, 6), Plan(depth=0, error_bars=False))
    states = [*diagram.at(5.0), *diagram.search(5.0, tries=60 if planar else 24, seed=1)]
    shapes = [diagram.solvers[0].shape.sample(p.x) for p in states]
    for one, other in combinations(shapes, 2):
        turned = abs((one["q"] * other["q"]).sum(axis=1))  # the cosine of half the angle between them
        assert abs(one["r"] - other["r"]).max() > 1e-6 or turned.min() < 1 - 1e-9


def test_states_of_the_mesh_alone_are_not_offered_as_stable() -> None:
    """An elastica at twenty times its critical load on two linear elements: the richer mesh has other strains."""
    rod, mesh = (
        classics.column("elastica", classics.SUPPORTS["clamped-free"], (0.0, 50.0)),
        Discretization("reduced", 2, 1),
    )
    found = [p for p in Solver(rod, mesh).search(50.0, tries=6) if not p.negative]
    assert found and all(p.stable is None and "not resolved by this mesh" in repr(p) for p in found)
    plan = Plan((0.0, 50.0), at=(50.0,), tries=6, depth=0)
    diagram = trace(rod, mesh, plan)
    said = [w for w in diagram.warnings if "found at P = 50 was not followed: The richer mesh has another state" in w]
    assert said and [b.name for b in diagram] == ["straight"]
    assert "coexist" not in diagram.in_words() and said[0] in diagram.in_words()
    assert [p.stable for p in diagram.again(depth=1, tries=0).at(50.0) if not p.negative] == [None]
