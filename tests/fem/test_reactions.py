"""Reactions and profiles against statics and a shooting solution: forces and moments of the whole rod balance."""

import csv
import json
from collections.abc import Callable
from dataclasses import replace
from math import cos, pi, sin
from pathlib import Path
from typing import Any

import classics
import numpy as np
import pytest
import ufl
from problem.test_docs import scenes
from scipy.special import ellipe, ellipk

import rodfem
from rodfem import Attachment, Discretization, Ordinate, Plan, Scene, clamped, elastic, free, hinged, pinned
from rodfem.forms.energy import bending_and_twist, hemitropic
from rodfem.output.states import to_csv

TIP = (0.15, 0.1, 0.9)
FORCE = (0.4, -0.3, 0.2)


MIDDLE = Ordinate("middle", s=0.5, of=lambda r, q: r[0])


def turned(angle: Any) -> tuple[Any, ...]:
    return (ufl.cos(angle / 2), 0.0, ufl.sin(angle / 2), 0.0)


def bowed(half: Callable[[Any], Any]) -> Callable[[np.ndarray], np.ndarray]:
    """A start that is turned by twice an angle about e2."""
    return lambda s: np.stack([np.cos(half(s)), 0 * s, np.sin(half(s)), 0 * s], axis=1)


LEFT: dict[str, Any] = {
    "clamped": clamped(),
    "pinned": pinned(lambda c: (0.0, 0.0, 0.0)),
    "hinged": hinged((0.0, 1.0, 0.0), lambda c: (0.0, 0.0, 0.0)),
    "sprung": elastic(lambda c: 1e3, lambda c: 5.0),
}
RIGHT: dict[str, Any] = {
    "clamped": clamped(lambda c: TIP, lambda c: turned(0.5 * c.P)),
    "pinned": pinned(lambda c: (TIP[0], TIP[1] + 0.05 * c.P, TIP[2])),
    "guided": rodfem.sliding_hinge((0.0, 1.0, 0.0), (0.6, 0.0, 0.8), lambda c: TIP, lambda c: turned(0.2 * c.P)),
    "sliding": rodfem.sliding(lambda c: (0.15, 0.1, None), force=lambda c: (0.0, 0.0, -c.P)),
}


def rod(left: Any, right: Any, formulation: str = "auto") -> rodfem.Point:
    """The rod between two ends, pulled aside at 0.4, at the end of its range."""
    scene = classics.column(
        "reactions", (left, right), (0.0, 1.5), rod="flexible", ordinate=MIDDLE, start=bowed(lambda s: 0.25 * s),
        energy=lambda v, k, c: (
            bending_and_twist(k, (1.0, 1.5, 0.8)) + 50.0 * (v[0] ** 2 + v[1] ** 2 + 2.0 * (v[2] - 1.0) ** 2)
        ),
        attachments=() if formulation == "reduced" else (Attachment(0.4, force=lambda c: [c.P * x for x in FORCE]),),
    )  # fmt: skip
    diagram = rodfem.trace(scene, Discretization(formulation), Plan(depth=0, error_bars=False))
    return diagram[0].points[-1]


def about_the_origin(r: np.ndarray, force: np.ndarray, moment: np.ndarray) -> np.ndarray:
    return np.append(force, moment + np.cross(r, force))


@pytest.mark.parametrize("formulation", ["reduced", "pointwise"])
@pytest.mark.parametrize(
    ("left", "right"), [("clamped", "clamped"), ("clamped", "pinned"), ("hinged", "guided"), ("hinged", "sliding")]
)
def test_forces_and_moments_balance(left: str, right: str, formulation: str) -> None:
    point = rod(LEFT[left], RIGHT[right], formulation)
    found, r = point.reactions, point.profile([0.0, 0.4, 1.0]).r
    push = np.array([0.0, 0.0, -point.load]) if right == "sliding" else np.zeros(3)
    total = about_the_origin(r[0], *found.left) + about_the_origin(r[2], found.right.force + push, found.right.moment)
    for attached in found.attached:
        assert np.allclose(np.concatenate(attached), [*(point.load * np.array(FORCE)), 0.0, 0.0, 0.0], atol=1e-8)
        total += about_the_origin(r[1], *attached)
    assert len(found.attached) == (formulation == "pointwise") and np.allclose(total, 0.0, atol=1e-8)
    assert abs(found.left.force).max() > 0.1


def test_supports_resist_what_they_hold_alone() -> None:
    """A pin has no moment, a hinge none about its axis, a guide no force along it, a spring end no support."""
    pin = rod(LEFT["pinned"], RIGHT["guided"]).reactions
    hinge = rod(LEFT["hinged"], RIGHT["sliding"]).reactions
    assert abs(pin.left.moment).max() < 1e-8 and abs(hinge.left.moment[1]) < 1e-8 < abs(hinge.left.moment).max()
    assert abs(pin.right.force @ [0.6, 0.0, 0.8]) < 1e-8 < abs(pin.right.force).max()
    assert abs(hinge.right.force[2]) < 1e-8
    sprung = rod(LEFT["sprung"], RIGHT["clamped"])
    assert np.allclose(np.concatenate(sprung.reactions.left), 0.0, atol=1e-7)
    assert abs(sprung.force[0]).max() > 0.1  # the spring is a load


def test_a_turning_clamp_has_the_moment_that_does_its_work() -> None:
    """``dV = moment . dangle``: the difference of the potential of two states at neighbouring angles of the clamp."""
    scene = classics.column(
        "turning", (clamped(rotation=lambda c: turned(c.a)), clamped((0.2, 0.0, 0.9))), (0.0, 1.0), load="a",
        energy=lambda v, k, c: bending_and_twist(k, (1.0, 1.5, 0.8)), constants={"a": 0.0}, ordinate=MIDDLE,
        start=bowed(lambda s: 0.5 * np.sin(pi * s)),
    )  # fmt: skip
    solver, h = rodfem.Solver(scene), 1e-4
    middle = solver.equilibrium(0.5, solver.equilibrium(0.25, solver.equilibrium(0.0)))
    above, below = solver.equilibrium(0.5 + h, middle), solver.equilibrium(0.5 - h, middle)
    work = (above.potential - below.potential) / (2 * h)
    assert middle.reactions.left.moment[1] == pytest.approx(work, rel=1e-6)
    assert abs(work) > 0.1


def cable() -> Scene:
    """Power cable of 300 m: EI = 1e4 N m2, EA = 3e8 N, 250 N/m, clamped level at the sea bed, pinned 90 m up."""
    return Scene(
        "cable", (0.0, 300.0), "unshearable",
        lambda v, k, c: 1.5e8 * (v[2] - 1) ** 2 + 5e3 * (k[0] ** 2 + k[1] ** 2 + k[2] ** 2), {"x": 170.0}, "x",
        (clamped(), pinned(lambda c: (90.0, 0.0, c.x))), Ordinate("height", s=150.0, of=lambda r, q: r[0]),
        (170.0, 171.0), distributed=(-250.0, 0.0, 0.0), planar="e2",
        start=bowed(lambda s: 0.6 - 1.05 * np.cos(pi * s / 300.0)),
    )  # fmt: skip


def test_the_moment_at_a_clamp_of_a_boundary_layer() -> None:
    """A layer of 0.8 m in an element of 6 m; right by scipy's solve_bvp, tolerance 1e-8."""
    right, errors = -18267.15072958902, []
    for elements in (24, 48):
        diagram = rodfem.trace(cable(), Discretization(elements=elements), Plan(at=(170.0,), depth=0, error_bars=False))
        point = diagram.at(170.0)[0]
        assert point.moment[0, 1] == pytest.approx(-point.reactions.left.moment[1], rel=1e-12)
        errors.append(abs(point.moment[0, 1] / right - 1))
    assert errors[0] < 0.035 and errors[1] < 0.002  # 0.19 and 0.023 by the curvature there


def test_the_moment_at_a_clamp_is_within_its_bar_in_memory_and_in_files(tmp_path: Path) -> None:
    """The mesh that resolves the ordinate of the cable bounds the error of the moment, too; right as above."""
    plan = Plan(at=(170.0,), span=(170.0, 170.0 + 1e-3), depth=0)
    diagram = rodfem.trace(cable(), Discretization(elements=96), plan)
    (special,) = [s for s in diagram[0].special if s.kind == "user"]
    moment, bar = -special.point.reactions.left.moment[1], special.errors["reactions"][0, 1, 1]
    assert special.resolved and abs(moment + 18267.15072958902) < bar < 1e-5 * abs(moment)
    diagram.save(tmp_path)
    entry = json.loads((tmp_path / "diagram.json").read_text())["branches"][0]
    row = entry["special"][0]["row"]
    assert entry["special"][0]["errors"]["reactions"][0][1][1] == bar
    assert entry["columns"]["reactions"][row][0][1][1] == -moment
    again = rodfem.load(tmp_path, cable())[0].special[0]
    assert again.errors["reactions"][0, 1, 1] == bar
    assert -again.point.reactions.left.moment[1] == pytest.approx(moment, rel=1e-9)
    to_csv(tmp_path, tmp_path)
    lines = list(csv.DictReader((tmp_path / "rows.csv").read_text().splitlines()))
    assert float(lines[row]["reaction moment e₂, left end"]) == -moment


@pytest.mark.parametrize("elements", [2, 4])
def test_what_follows_from_a_state_is_within_its_bar(elements: int) -> None:
    """The elastica of 20 degrees at its tip, by elliptic integrals: energy, and the moment at the clamp."""
    modulus = sin(pi / 18)  # of half the angle of the tip
    load = float(ellipk(modulus**2)) ** 2
    scene = classics.column(
        "elastica", classics.SUPPORTS["clamped-free"], (load, load + 0.1), planar="e2", constants={"B2": 1.0},
        ordinate=Ordinate("tip", s=1.0, of=lambda r, q: r[0]), start=bowed(lambda s: 0.17 * np.sin(s)),
    )  # fmt: skip
    diagram = rodfem.trace(scene, Discretization(elements=elements, degree=3), Plan(at=(load,), depth=0))
    special = next(s for s in diagram[0].special if s.kind == "user")
    moment = 2 * modulus * load**0.5
    energy = load * (2 * float(ellipe(modulus**2)) / load**0.5 - 1 - cos(pi / 9))
    found, bars = special.point, special.errors
    assert abs(abs(found.reactions.left.moment[1]) - moment) < bars["reactions"][0, 1, 1] < 1e-2
    assert abs(found.energy - energy) < bars["energy"] < 1e-2


def test_profiles_of_a_helix() -> None:
    """A hemitropic rod that is free at one end, under a moment along its axis, is straight: by Hooke's law alone."""
    law = {"stretching": 10.0, "coupling": -1.0, "twisting": 1.0, "bending": 1.0}
    scene = classics.column(
        "twisted", (clamped(), free(lambda c: (0.0, 0.0, c.P))), (0.0, 1.0), rod="flexible", interval=(0.0, 2.0),
        energy=lambda v, k, c: hemitropic(v, k, **law) + 50.0 * (v[0] ** 2 + v[1] ** 2), ordinate=MIDDLE,
    )  # fmt: skip
    point = rodfem.Solver(scene).equilibrium(1.0)
    stretch, twist = np.linalg.solve([[10.0, -1.0], [-1.0, 1.0]], [1.0, 0.0])
    places = np.array([0.0, 0.3, 1.1, 2.0])
    found = point.profile(places)
    assert np.allclose(found.r, places[:, None] * [0.0, 0.0, 1.0 + stretch], atol=1e-9)
    assert np.allclose(found.curvature, [0.0, 0.0, twist], atol=1e-9)
    assert np.allclose(found.force_in_space, [0.0, 0.0, 1.0], atol=1e-9) and abs(found.moment).max() < 1e-9
    turn = twist * places
    assert np.allclose(found.directors[:, 0], np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1), atol=1e-8)
    assert point.s[[0, -1]].tolist() == [0.0, 2.0] and np.allclose(point.r[-1], found.r[-1])
    with pytest.raises(rodfem.InputError, match="from 0 to 2"):
        point.profile([2.1])


BOWED = classics.column(
    "bowed", (clamped(), free(lambda c: (0.6 * c.P, 0.8 * c.P, -c.P))), (0.0, 2.0), ordinate=MIDDLE,
    energy=lambda v, k, c: bending_and_twist((k[0], k[1] - 1.0, k[2]), (1.0, 2.0, 0.7)),
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


def at_two(scene: Scene, formulation: str = "auto") -> rodfem.Point:
    """The equilibrium at a load of 2."""
    return rodfem.Solver(scene, Discretization(formulation, 6, 5)).equilibrium(2.0)


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "formulation"), [("bowed", "pointwise"), ("stretching", "reduced"), ("untwistable", "reduced")]
)
def test_a_dead_force_is_carried_along_the_rod(name: str, formulation: str) -> None:
    """``n`` is the force at the free end, ``m`` its moment; a rod that cannot twist carries a torque all the same."""
    point = at_two(SCENES[name], formulation)
    assert np.allclose(point.force_in_space, [1.2, 1.6, -2.0], atol=1e-6)
    assert np.allclose(point.moment_in_space, np.cross(point.r[-1] - point.r, point.force_in_space), atol=1e-4)
    assert abs(point.moment[:, 2]).max() > 0.2 and abs(point.moment).max() > 1.0


@pytest.mark.long
def test_a_distributed_force_adds_up_along_the_rod() -> None:
    """``n' = -f``, and ``n = 0`` at the free end."""
    point = at_two(scenes()["heavy"])
    assert np.allclose(point.force_in_space, 2.0 * (1.0 - point.s)[:, None] * [0.0, 0.0, -1.0], atol=1e-9)
