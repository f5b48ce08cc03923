"""Classical problems of the stability of rods against closed forms, frequency equations and values from literature."""

from collections.abc import Callable
from dataclasses import replace
from math import cos, pi, sqrt, tan

import classics
import closed_forms
import numpy as np
import pytest
from classics import FORMULATIONS, column, explore, sweep
from closed_forms import HEAVY, TORQUE, elastica
from scipy.linalg import expm
from scipy.optimize import brentq, fsolve
from scipy.special import ellipe, ellipk

from rodfem import Discretization, End, Ordinate, Plan, Ring, Scene, Solver, clamped, free, trace
from rodfem.stability.nonsymmetric import NonsymmetricSolver


def root(f: Callable[[float], float], a: float, b: float) -> float:
    return float(brentq(f, a, b, xtol=1e-15, rtol=1e-14))


# --- where a straight or circular state becomes unstable ------------------------------------------------------------

EULER = {
    "clamped-free": [2.46740110, 2 * 2.46740110, 9 * 2.46740110, 18 * 2.46740110],
    "pinned-pinned": [9.86960440, 2 * 9.86960440, 4 * 9.86960440],
    "clamped-pinned": [20.1907285564, 2 * 20.1907285564],
    "clamped-clamped": [39.4784176044],
    "hinged-clamped": [20.1907285564],  # the hinge about d1 leaves free what is bent about d1 only
}


@pytest.mark.few(1)
@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize("supports", EULER)
def test_euler(supports: str, formulation: str) -> None:
    found = explore(classics.euler(supports), formulation)
    assert found.loads() == pytest.approx(EULER[supports], rel=4e-9)
    for i, s in enumerate(found.special()):
        assert (s.negative_before, s.negative_after, s.multiplicity) == (i, i + 1, 1)


PI2 = pi**2
E1 = PI2 / 4
"""Euler's load of a cantilever."""
GA, EA = 50.0, 200.0


def stiff_and_weak(f: Callable[[float, float], float], a: float, b: float) -> list[float]:
    """Loads ``EI w^2`` with ``f(w, EI) = 0`` for both stiffnesses of a column."""
    return [EI * root(lambda w, EI=EI: f(w, EI), a, b) ** 2 for EI in (1.0, 2.0)]  # type: ignore[misc]


BOTH, CENTRELINE = FORMULATIONS, ("pointwise",)
Critical = tuple[Callable[[], Scene], tuple[str, ...], int, list[float]]
"""Scene, formulations, number of modes at each load, loads."""


def critical(
    scene: Callable[[], Scene], *loads: float, modes: int = 1, formulations: tuple[str, ...] = BOTH
) -> Critical:
    return scene, formulations, modes, list(loads)


def pointwise(scene: Callable[[], Scene], *loads: float, modes: int = 1) -> Critical:
    """Of a scene that needs the centreline."""
    return critical(scene, *loads, modes=modes, formulations=CENTRELINE)


CRITICAL: dict[str, Critical] = {
    "haringx": critical(
        lambda: classics.shearable("flexible", GA, EA), root(lambda p: p * (1 - p / EA + p / GA) - E1, 0.0, 4.0)
    ),
    "haringx without stretch": critical(
        lambda: classics.shearable("inextensible", GA, EA), (sqrt(1 + PI2 / GA) - 1) * GA / 2
    ),
    "timoshenko": critical(lambda: classics.timoshenko(GA), E1 / (1 + E1 / GA)),
    "heavy": pointwise(classics.heavy, HEAVY),
    "foundation": pointwise(classics.winkler, PI2 + 300 / PI2, 4 * PI2 + 75 / PI2, 2 * PI2 + 300 / PI2),
    "tip spring": critical(
        classics.tip_spring, *stiff_and_weak(lambda w, EI: tan(w) / w - 1 + EI * w * w / 10, 1.6, 4.0)
    ),
    "foot spring": critical(classics.foot_spring, *stiff_and_weak(lambda w, EI: EI * w * tan(w) - 3, 0.1, 1.5)),
    "point load": pointwise(lambda: classics.point_load(0.4), E1 / 0.16),
    "stepped": critical(
        lambda: classics.stepped(0.3), root(lambda p: tan(0.3 * sqrt(p / 2)) * tan(0.7 * sqrt(p)) - sqrt(2), 2.0, 4.4)
    ),
    "greenhill": critical(classics.greenhill, TORQUE / 2, modes=2),
    "michell": critical(classics.michell, *(2 * pi * sqrt(n * n - 1) / 1.5 for n in (2, 3)), modes=2),
    "ring of intrinsic twist": critical(classics.ring, *(sqrt(n * n - 1) / 1.5 for n in (2, 3)), modes=2),
    # before that the end turns by a, C a = M cos a = T: the straight rod is unstable where T = pi + 2 a
    "semi-tangential": critical(classics.semi_tangential, 1.25 * pi / cos(pi / 8), modes=2),
    "lateral": critical(classics.lateral, 4.62463226448),
    "pressed ring": pointwise(classics.pressed_ring, 3.0, modes=2),
    "pressed arch": pointwise(lambda: classics.arch(1.0, dead=False), PI2 - 1),
    # f'' + p f = a cos s, f'(-1) = f'(1) = 0, and the integral of f cos s vanishes
    "arch under dead load": pointwise(lambda: classics.arch(1.0, dead=True), 9.624799960338407),
    "tip on a plane": critical(classics.tip_on_plane, PI2 / 2, 20.1907285564),
    "middle on a line": pointwise(classics.middle_on_line, 4 * PI2),
    "no mean deflection": pointwise(classics.no_mean_deflection, TORQUE**2),
    "no mean curvature": critical(classics.no_mean_curvature, PI2, 2 * PI2),
    "in a plane": pointwise(classics.on_plane, PI2 / 2),
    "turning in a plane": pointwise(classics.turning_in_plane, 2 * PI2, 8 * PI2),
    "bent about one axis": critical(classics.unbendable, PI2 / 2),
}


def test_values_in_the_literature() -> None:
    assert pytest.approx(8.98681891582, rel=1e-12) == TORQUE
    assert pytest.approx(7.8373474389, rel=1e-10) == HEAVY


@pytest.mark.few(4)
@pytest.mark.parametrize(
    ("name", "formulation"),
    [
        pytest.param(name, f, marks=[pytest.mark.short] if name == "pressed ring" else [])
        for name, expected in CRITICAL.items()
        for f in expected[1]
    ],
)
def test_critical_loads(name: str, formulation: str) -> None:
    scene, _, modes, expected = CRITICAL[name]
    found = explore(scene(), formulation, elements=12 if "ring" in name or name == "michell" else 8)
    assert found.loads() == pytest.approx(expected, rel=1e-9)
    for i, s in enumerate(found.special()):
        assert (s.negative_before, s.negative_after, s.multiplicity) == (i * modes, (i + 1) * modes, modes)
    assert found.branches[0].ended == "end of range"


# --- bent states ----------------------------------------------------------------------------------------------------


@pytest.mark.few(1)
@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_elastica(formulation: str) -> None:
    assert elastica(1.5 * E1) == pytest.approx((0.3635882249, 0.7885758057), rel=1e-9)
    stops = (1.5 * E1, 8.0, 20.0)
    found = explore(classics.elastica(20.0), formulation, depth=1, stops=stops)
    assert len(found.branches) == 3
    for P in stops:
        for branch, EI in ((1, 1.0), (2, 2.0)):
            if EI * E1 < P:
                r = found.sample(branch, P)["r"][-1]
                miss = np.array([r[2], np.hypot(r[0], r[1])]) - elastica(P / EI)
                assert abs(miss).max() < 1e-9
    assert [b.points[-1].negative for b in found.branches] == [2, 0, 1]


@pytest.mark.few(1)
@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_bow(formulation: str) -> None:
    """Pinned ends at a prescribed distance: the multiplier is the thrust of the elastica."""
    d = 0.2
    m = root(lambda m: 2 * float(ellipe(m) / ellipk(m)) - 1 - d, 1e-3, 1 - 1e-6)
    w = 2 * float(ellipk(m))
    found = explore(classics.bow(), formulation, stops=(d,))
    assert abs(found.sample(0, d)["g1"]) == pytest.approx(w * w, rel=1e-8)
    (user,) = found.special("user")
    assert user.point.energy == pytest.approx(2 * w * w * (float(ellipe(m) / ellipk(m)) - 1 + m), rel=1e-9)
    assert {p.negative for p in found.branches[0].points} == {0}


@pytest.mark.few(1)
@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_bathe_and_bolourchi(formulation: str) -> None:
    r = explore(classics.bathe(), formulation).sample()["r"][-1]
    assert r[[0, 2, 1]] == pytest.approx([15.68480053, 47.15043857, 53.47485879], rel=1e-9)


@pytest.mark.long
@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_helix_of_any_pitch(formulation: str) -> None:
    """A helix is a solution for any pitch; what holds it is a force and a moment along its axis."""
    curvature, C, stops = 3.0, 0.6, (0.5, 2.0, 4.0)
    found = explore(classics.helix(curvature), formulation, stops=stops)
    for t in stops:
        state = found.sample(0, t)
        miss = state["q"] - classics.helix_directors(state["s"], curvature, t)
        force = np.array([0.0, curvature, t]) * t * (C - 1)
        n = np.array([[state[f"n{i}"] for i in (1, 2, 3)]]) if formulation == "reduced" else state["n"]
        assert abs(miss).max() < 1e-9
        assert abs(n - force).max() < 1e-7


@pytest.mark.few(1)
@pytest.mark.parametrize("formulation", FORMULATIONS[::-1])
def test_extension_of_a_helical_spring(formulation: str) -> None:
    """A helix under every force along its axis, of curvature and torsion that its two equilibrium equations give."""
    k0, t0, C, stops = 6.0, 2.0, 0.8, (5.0, 15.0, 30.0)
    found = explore(classics.spring(k0, t0), formulation, stops=stops)
    for F in stops:

        def equations(x: np.ndarray, F: float = F) -> list[float]:
            w3 = np.hypot(*x) ** 3
            return [x[0] - k0 + F * x[0] * x[1] / w3, C * (x[1] - t0) - F * x[0] ** 2 / w3]

        curvature, torsion = fsolve(equations, [k0, t0], xtol=1e-14)
        w = np.hypot(curvature, torsion)
        r = found.sample(0, F)["r"]
        assert r[-1, 2] == pytest.approx(torsion / w, abs=1e-9)
        assert abs(np.hypot(r[:, 0], r[:, 1]) - curvature / w**2).max() < 1e-9
    assert {p.negative for p in found.branches[0].points} == {0}


LOOP = {  # by the distance of its ends
    0.5: (-22.8752897663477, 26.76366138220319, 0.8972434433368319, 8.152406305851263),
    1.1: (-7.386083923281583, 13.363343964246726, -2.2527950851609977, 7.522862407368433),
}


@pytest.mark.few(1)
@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_clamped_loop(formulation: str) -> None:
    """Twisted by four radian until its ends pass: force and moment along and across the axis, by shooting."""
    found = explore(classics.loop(), formulation, elements=16, stops=tuple(LOOP))
    for point in (special.point for special in found.special("user")):
        n, m = point.force_in_space[0], point.moment_in_space[0]
        invariants = n[2], np.hypot(n[0], n[1]), m[2], np.hypot(m[0], m[1])
        assert invariants == pytest.approx(LOOP[point.load], rel=1e-8)


# --- planar rods ----------------------------------------------------------------------------------------------------


@pytest.mark.few(1)
@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_planar_column(formulation: str) -> None:
    """Bent about its stiff axis, the weak one being across: stable in the plane, unstable in space."""
    found = explore(classics.planar_column(), formulation, depth=1)
    assert found.loads() == pytest.approx([2 * E1], rel=1e-9)
    for p in found.branches[0].points:
        if abs(p.load - 2 * E1) > 1e-6:
            assert (p.negative, p.negative_in_space) == (int(p.load > 2 * E1), (p.load > E1) + (p.load > 2 * E1))
    assert {(p.negative, p.negative_in_space) for p in found.branches[1].points[1:]} == {(0, 1)}
    r = found.sample(1)["r"][-1]
    assert (r[2], abs(r[0])) == pytest.approx(elastica(12.0 / 2), abs=1e-9)
    assert r[1] == 0


@pytest.mark.long
@pytest.mark.parametrize("planar", ["e2", None])
def test_hanging_cable(planar: str | None) -> None:
    """Straight and too long at first, it finds down; but for what its stiffness does it is a catenary."""
    a = root(lambda a: a * np.sinh(0.4 / a) - 0.5, 0.2, 2.0)
    sag = a * (np.cosh(0.4 / a) - 1)
    found = explore(classics.chain(planar), elements=12, stops=(1e-4, 1e-5))
    (branch,) = found.branches
    assert {p.negative for p in branch.points} == {0}
    misses = [s.point.ordinate - sag for s in found.special("user")]
    assert abs(misses[1]) < 2e-6
    assert misses[0] / misses[1] == pytest.approx(10.0, rel=0.05)


# --- loads without a potential --------------------------------------------------------------------------------------


@pytest.mark.few(1)
@pytest.mark.parametrize(
    ("tip", "middle", "span", "about"),
    [
        (0.0, 0.0, (15.0, 25.0), (20.0, 120.0)),
        (0.3, 0.5, (10.0, 25.0), None),
    ],
    ids=["Beck", "two masses"],
)
def test_flutter_with_masses(
    tip: float, middle: float, span: tuple, about: tuple | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rodfem.diagram.sweep.LOADS", 6)
    scene = classics.beck(tip, middle, span)
    assert not scene.conservative
    (flutter,) = sweep(scene).special("flutter")
    P, mu = closed_forms.flutter(*(about or (flutter.point.load, flutter.omega2)), mass=tip, middle=middle)
    assert (flutter.point.load, flutter.omega2) == pytest.approx((P, mu), rel=1e-9)
    assert (flutter.negative_before, flutter.negative_after) == (0, 2)


@pytest.mark.long
@pytest.mark.parametrize("kind", ["moment", "follower_moment"])
def test_torque_on_a_cantilever(kind: str) -> None:
    """Nicolai's paradox: where both stiffnesses are equal there is flutter, however small the torque."""
    scene = classics.torque(kind)
    assert not scene.conservative
    solver = Solver(scene, Discretization("pointwise", 4, 6)).equilibria
    x = solver.start(0.0)
    for T in (0.3, 0.6, 0.9):
        x, outcome = solver.at_load(x, T)
        assert outcome.converged
        values = NonsymmetricSolver(solver.system).at(x).nearest(4, -1e-3).values

        def frequency(mu: complex, T: float = T) -> complex:  # w'''' - i T w''' = mu w, where w = x + i y
            A = np.eye(4, k=1, dtype=complex)
            A[3, 0], A[3, 3] = mu, 1j * T
            y = expm(A)[:, 2:]
            moment = y[2] - (1j * T * y[1] if kind == "moment" else 0)
            return complex(np.linalg.det(np.array([moment, y[3] - 1j * T * y[2]])))

        for mu in values:
            h = 1e-6 * abs(mu)
            misses = [abs(frequency(m) / (frequency(m + h) - frequency(m - h)) * 2 * h) for m in (mu, mu.conjugate())]
            assert min(misses) < 1e-7 * abs(mu)
        assert abs(values.imag).min() > 1e-3


def test_torque_on_an_oblong_cantilever(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nicolai: with two stiffnesses flutter begins at a torque of its own.  Twisting is 1e6 times as stiff.

    ``1.5 x'''' + T y''' = mu x`` and ``y'''' - T x''' = mu y``, clamped, without moment and force at the free end.
    """
    monkeypatch.setattr("rodfem.diagram.sweep.LOADS", 6)
    ends = clamped(), free(follower_moment=lambda c: (0.0, 0.0, c.P))
    scene = column("oblong", ends, (0.5, 0.95), inertia=classics.BEAM, constants={"B2": 1.5, "C": 1e6})
    assert sweep(scene).loads("flutter") == pytest.approx([0.8049507259848409], rel=2e-7)


@pytest.mark.parametrize("kind", ["moment", "follower_moment"])
def test_torque_about_the_axis_of_a_hinge(kind: str) -> None:
    """Greenhill between tangents that are held: tan x = x, T = 2 x; the potential is minus the torque times T/C."""
    hinge = End((0.0, 0.0, None), (1.0, 0.0, 0.0, 0.0), hinge=(0.0, 0.0, 2.0), **{kind: lambda c: (0.0, 0.0, c.P)})
    scene = column("hinge", (clamped(), hinge), (8.0, 10.0), constants={"B2": 1.0, "C": 2.0})
    straight = trace(scene, plan=Plan(depth=0))["straight"]
    assert [x.point.load for x in straight.special[:-1]] == pytest.approx([8.986818915818128], rel=1e-10)
    assert [(p.negative, p.conjugate) for p in straight.points[:: len(straight.points) - 1]] == [
        (0, pytest.approx(4.0)),
        (2, pytest.approx(5.0)),
    ]


@pytest.mark.filterwarnings("error")
def test_where_a_twisted_ring_meets_its_circle_again() -> None:
    """2 - 2/sqrt(3) by Michell; a twist of round-off alone raises no warning of numpy's."""
    twist = Ordinate("twist", s=None, of=lambda x, c: x.k[2] / (2 * pi))
    ring = replace(classics.ring(), span=(0.0, 1.5), ends=Ring(), ordinate=twist)
    diagram = trace(ring, Discretization(elements=8, degree=6), Plan(depth=1))
    special = diagram["branch 1"].special[-1]
    assert special.resolved and not diagram.warnings
    assert abs(special.point.load - (2 - 2 / sqrt(3))) <= special.error_estimate < 1e-7
