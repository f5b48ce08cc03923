"""Rods that may turn freely, families of states at each load; sweeps of masses that depend on the load."""

import re
from collections.abc import Callable
from math import cos, pi, sin
from typing import Any

import numpy as np
import pytest
import ufl
from classics import SUPPORTS, column, push
from closed_forms import elastica

from rodfem import Diagram, Discretization, End, Inertia, Ordinate, Plan, Ring, clamped, free, pinned, trace


def swept(turned: float, second: float) -> Diagram:
    """A strip on a pin under a follower thrust, ``turned`` by an angle, on a foundation of stiffnesses 60 and another.

    The ``second`` one is that along e2.
    """
    half = np.array([cos(turned / 2), 0.0, 0.0, sin(turned / 2)])
    rod = column(
        "strip", (pinned(), free(follower=push)), (0.0, 30.0), ordinate=Ordinate("x", s=0.5, of=lambda r, q: r[0]),
        potential=lambda x, c: (60 * x.r[0] ** 2 + second * x.r[1] ** 2) / 2,
        inertia=Inertia(lambda c: 1.0, lambda c: [1e-3] * 3), start=lambda s: half + 0 * np.asarray(s)[:, None],
    )  # fmt: skip
    return trace(rod, Discretization(elements=4, degree=5), Plan(depth=0, error_bars=False))


@pytest.mark.long
@pytest.mark.usefixtures("few_loads")
def test_loads_of_one_state_of_a_family_are_said_to_be_that() -> None:
    """By what angle the strip is turned decides at which load it flutters; on alike springs it does not."""
    straight, turned = swept(0.0, 20.0), swept(0.7, 20.0)
    assert abs(straight.special("flutter")[0].point.load - turned.special("flutter")[0].point.load) > 1.0
    for found in (straight, turned):
        assert "1 frequency stays zero that no symmetry of the scene explains (torsion)" in found.warnings[-1]
    straight, turned = swept(0.0, 60.0), swept(0.7, 60.0)
    loads = [found.special("flutter")[0].point.load for found in (straight, turned)]
    assert loads[0] == pytest.approx(loads[1], rel=1e-8)
    assert not [words for found in (straight, turned) for words in found.warnings if "no symmetry" in words]


MESH = Discretization("auto", 4, 4)


def dented(load: float, width: float) -> Callable[[Any], Any]:
    """One, but minus one nearer to a ``load`` than the ``width``."""
    return lambda c: 1 - 2 * ufl.conditional(ufl.lt(abs(c.P - load), width), 1.0, 0.0)


def slender(mass: Callable[[Any], Any]) -> Inertia:
    return Inertia(rho_A=mass, rho_I=lambda c: (0.0, 0.0, 0.0))


@pytest.mark.ranks
@pytest.mark.long
@pytest.mark.parametrize(
    ("mass", "spectrum", "words"),
    [
        pytest.param(
            dented(2.4674, 0.1), 3, "A mass or rotary inertia of -1 at P = 2.* is negative", marks=pytest.mark.alone
        ),
        (lambda c: (c.P - 1.25) ** 2, 3, "no eigenvalues .*, and at P = 1.25 this one has none"),
        pytest.param(dented(2.4674, 0.1), 0, "end of range", marks=pytest.mark.alone),  # the index is none of the mass
    ],
)
def test_a_branch(mass: Callable[[Any], Any], spectrum: int, words: str) -> None:
    scene = column("branch", SUPPORTS["clamped-free"], (0.0, 5.0), inertia=slender(mass))
    diagram = trace(scene, MESH, Plan(spectrum=spectrum, at=(1.25,), depth=0, error_bars=False))
    assert re.search(words, diagram[0].ended)
    assert (diagram[0].points[-1].load < 2.4) == (spectrum > 0)


def wound(s: np.ndarray, torsion: float) -> np.ndarray:
    """Quaternions of the one turn of a helix of length one, from the frame of its normal, binormal and tangent on."""
    w, angle = 2 * pi, pi * np.asarray(s)
    axis = np.array([0.0, np.sqrt(w**2 - torsion**2), torsion]) / w
    return np.concatenate([np.cos(angle)[:, None], np.sin(angle)[:, None] * axis], axis=1)


@pytest.mark.ranks
def test_helices_of_one_turn_of_a_family_at_each_load() -> None:
    """Between clamps a turn apart a helix of ``C = 3 B`` nutates once a turn: ``k^2 + t^2 (C/B - 2)^2 = (2 pi)^2``.

    All of these states have the energy of the helix, ``((2 pi)^2 + (C/B - 1) t^2) / 2``.
    """

    def place(c: Any) -> tuple[Any, ...]:
        return 0.0, ufl.sqrt(4 * pi**2 - c.t**2) * c.t / (4 * pi**2), c.t**2 / (4 * pi**2)

    helix = column(
        "helix", (clamped(), clamped(place, (-1.0, 0.0, 0.0, 0.0))), (1.0, 5.0), load="t",
        constants={"t": 1.0, "B2": 1.0, "C": 3.0}, ordinate=Ordinate("x", s=0.5, of=lambda r, q: r[0]),
        start=lambda s: wound(s, 1.0),
    )  # fmt: skip
    found = trace(helix, Discretization(elements=8), depth=0)
    points = found[0].points
    assert found[0].ended == "end of range"
    assert [p.energy - p.load**2 for p in points] == pytest.approx([2 * pi**2] * len(points), abs=1e-11)
    assert [p.negative for p in points] == [0] * len(points)
    assert "1 eigenvalue stays zero that no symmetry of the scene explains" in found.notes[0]
    assert not any("not resolved" in words for words in found.warnings)


def half_turn(ends: Any) -> Diagram:
    """A strip of ``C = 0.8 B1``, closed with half a turn."""

    def start(s: np.ndarray) -> np.ndarray:
        a, b = np.pi * np.asarray(s), np.pi * np.asarray(s) / 2
        return np.stack([np.cos(a) * np.cos(b), np.sin(a) * np.sin(b), np.sin(a) * np.cos(b), np.cos(a) * np.sin(b)], 1)

    strip = column(
        "strip", ends, (1.5, 6.0), load="B2", constants={"B2": 1.5, "C": 0.8}, start=start,
        ordinate=Ordinate("energy", s=None, of=lambda x, c: x.k[0] ** 2),
    )  # fmt: skip
    found = trace(strip, Discretization(elements=16), depth=0, at=(2.0,), error_bars=False)
    assert found[0].ended == "end of range"
    (asked,) = [s.point for s in found[0].special if s.point.load == 2.0]
    assert asked.energy == pytest.approx(30.29087644785, abs=1e-10)  # by shooting
    assert {p.negative for p in found[0].points} == {0}
    return found


@pytest.mark.ranks
def test_a_ring_with_half_a_turn_slides_along_itself() -> None:
    """Its section looks alike after half a turn: rotations and that motion are its four zero eigenvalues."""
    found = half_turn(Ring(turn=pi))
    assert {p.zero for p in found[0].points} == {4} and not found.warnings
    assert found.notes == ["closed rod: linking number 0.5, twist 0.4986, writhe 0.0014"]


@pytest.mark.ranks
def test_one_branch_of_a_circle_of_states_that_no_symmetry_explains() -> None:
    """A rod that bends alike in all directions while it does not twist: guided, it buckles at ``4 pi^2`` in any."""
    guided = End(position=(0.0, 0.0, None), rotation=(1.0, 0.0, 0.0, 0.0), force=lambda c: (0.0, 0.0, -c.P))
    rod = column(
        "guided", (clamped(), guided), (35.0, 45.0), ordinate=Ordinate("middle", s=0.5, of=lambda r, q: r[0]),
        energy=lambda v, k, c: (k[0] ** 2 + k[1] ** 2 + k[2] ** 2) / 2 - 0.05 * k[1] ** 2 * k[2] ** 2,
    )  # fmt: skip
    found = trace(rod, Discretization(elements=6, degree=4), depth=1, error_bars=False)
    (special,) = found.special("branch point")
    assert special.point.load == pytest.approx(4 * pi**2, rel=1e-7)
    assert [branch.name for branch in found] == ["straight", "branch 1"]
    assert "2 directions at once: a circle of states" in found.in_words()


def test_a_round_cantilever_is_followed_from_its_circle() -> None:
    """The straight rod's border has both modes of the circle, one of which a phase condition keeps on the branch."""
    rod = column("round", SUPPORTS["clamped-free"], (0.0, 4.0), constants={"B2": 1.0})
    branch = trace(rod, depth=1)["branch 1"]
    assert branch.ended == "end of range"
    assert abs(branch.points[-1].ordinate - elastica(4.0)[1]) <= branch.special[-1].ordinate_error
