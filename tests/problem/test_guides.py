"""Guides of an end, straight and round: against closed forms, the elastica by shooting, and the plain hinge."""

from collections.abc import Callable
from math import cos, hypot, radians, sin
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rodfem import Discretization, InputError, Ordinate, Plan, Scene, Solver, at, run, trace
from rodfem.forms.energy import bending_and_twist
from rodfem.output.glyphs import Look
from rodfem.output.render import read_state
from rodfem.output.style import STEEL
from rodfem.problem.ends import End, circular_guide, clamped, sliding, sliding_hinge

E2 = (0.0, 1.0, 0.0)
TAN = 4.493409457909064**2
"""Load of a clamped and hinged column, with tan x = x: times EI / l^2."""
TILT = radians(35.0)
BENT = 2.0
"""Curvature of a rod that is bent from the start."""
INCLINED = (sin(TILT), 0.0, cos(TILT))


def push(c: Any) -> Any:
    return -c.P


def column(left: End, right: End, span: tuple[float, float] = (0.0, 30.0), **more: Any) -> Scene:
    energy = more.pop("energy", lambda v, k, c: bending_and_twist(k, (10.0, 1.0, 1.0)))
    return Scene("column", (0.0, 1.0), "unshearable and inextensible", energy, {"P": 0.0}, "P", (left, right),
                 Ordinate("middle", s=0.5, of=lambda r, q: hypot(r[0], r[1])), span, **more)  # fmt: skip


ON = (0.0, 0.0, 0.0)


def critical(scene: Scene, formulation: str) -> float:
    plan = Plan(depth=0, error_bars=False)
    (straight,) = trace(scene, Discretization(formulation, 8, 6), plan).branches
    return next(float(s.point.load) for s in straight.special if s.kind == "branch point")


def top(c: Any) -> tuple[float, float, float]:
    return (0.0, 0.0, 1.0)


@pytest.mark.long
@pytest.mark.parametrize("formulation", ["reduced", "pointwise"])
def test_a_turned_frame_gives_equal_numbers(formulation: str) -> None:
    """All is turned: the clamp, the held directors and the guide, which has three components then."""
    turn = Rotation.from_rotvec([-0.5, 0.4, 0.3])
    q: Any = tuple(np.roll(turn.as_quat(), 1).tolist())
    along: Any = tuple(turn.apply(INCLINED).tolist())
    at: Any = tuple(turn.apply([0.0, 0.0, 1.0]).tolist())
    assert min(map(abs, along)) > 0.1
    right = sliding_hinge(E2, along, lambda c: at, q, force=push)
    scene = column(clamped(rotation=q), right, start=lambda s: np.tile(q, (len(s), 1)))
    assert critical(scene, formulation) == pytest.approx(TAN * cos(TILT), rel=1e-8)


@pytest.mark.long
@pytest.mark.short
@pytest.mark.parametrize("formulation", ["reduced", "pointwise"])
def test_bent_rod_on_an_inclined_guide(formulation: str) -> None:
    """Curved in its undeformed state, so that it bends from the start: against shooting."""
    scene = column(
        clamped(), sliding_hinge(E2, INCLINED, top, force=push), (0.0, 12.0), planar="e2",
        energy=lambda v, k, c: bending_and_twist((k[0], k[1] - BENT, k[2]), (10.0, 1.0, 1.0)),
    )  # fmt: skip
    solver = Solver(scene, Discretization(formulation, 8, 6))
    point = solver.equilibrium(2.0)
    for load in (4.0, 6.0, 8.0):
        point = solver.equilibrium(load, guess=point)
    sample = solver.equilibria.shape.sample(point.x)
    np.testing.assert_allclose(sample["r"][-1, [0, 2]], (-0.0255342991556, 0.9635332415574), atol=1e-8)


@pytest.mark.long
def test_it_is_stored_and_drawn_as_what_it_is(folder: Path) -> None:
    right = sliding_hinge((0.0, 2.0, 0.0), INCLINED, top, force=push)
    run(column(clamped(), right, (0.0, 1.0)), Discretization("reduced", 4, 4), Plan(error_bars=False), folder,
        figures=False, quiet=True)  # fmt: skip
    with h5py.File(folder / "states.h5") as file:
        end = file["branches/straight/supports/right end"]
        assert end.attrs["kind"] == "hinge" and end.attrs["held"].tolist() == [False, True, False]
        np.testing.assert_allclose(end.attrs["guide"], INCLINED)
        np.testing.assert_allclose(end["force"][-1], -np.array(INCLINED))
        assert file["branches/straight/fb1"][-1] == pytest.approx(np.tan(TILT))
    state = read_state(folder / "states.h5", "straight", 0)
    rails = [x.points for x in state.solids(Look(0.01, state.view())) if x.color == STEEL]
    assert len(rails) == 2
    for points in rails:
        longest = np.linalg.svd(points - points.mean(axis=0))[2][0]
        assert abs(longest @ INCLINED) == pytest.approx(1.0, abs=1e-3)


@pytest.mark.few(7)
@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: circular_guide(-1.0), "radius -1"),
        (lambda: circular_guide(1.0, "z"), "across 'z'"),
        (lambda: column(clamped(), circular_guide(1.0, "e1", lambda c: ON), planar="e2"), "leaves the plane across e2"),
        (lambda: sliding_hinge(E2, (0.0, 0.0, 0.0)), "slides is zero"),
        (
            lambda: column(clamped(), sliding_hinge(E2, INCLINED, top, force=(0.0, 0.0, -1.0))),
            "give one number along its",
        ),
        (lambda: sliding_hinge(E2, (0.0, 1.0)), "along is .*: give 3 numbers"),  # type: ignore[arg-type]
        (lambda: column(clamped(), sliding_hinge(E2, (0.0, 0.6, 0.8), top), planar="e2"), "leaves the plane across e2"),
        (lambda: column(clamped(), sliding_hinge(E2, INCLINED, lambda c: (0.0, None, 1.0))), "has no place"),
        (lambda: column(*[sliding_hinge(E2, INCLINED, force=push)] * 2), "can drift away along e1"),
    ],
)
def test_mistakes(make: Callable[[], object], words: str) -> None:
    with pytest.raises(InputError, match=words):
        make()


def test_a_clamp_slides_along_an_inclined_line_by_an_equation() -> None:
    """As the same rod turned, whose line is an axis."""

    def push_along(c: Any) -> tuple[Any, ...]:
        return (0.0, -c.P * sin(TILT), -c.P * cos(TILT))

    turned = (cos(TILT / 2), sin(TILT / 2), 0.0, 0.0)
    line = at(1.0, lambda x, c: cos(TILT) * x.r[1] - sin(TILT) * (x.r[2] - 1))
    load, tip = (0.0, 500.0), (0.0, -sin(TILT), None)
    inclined = column(clamped(), sliding((0.0, None, None), force=push_along), load, constraints=(line,), planar="e1")
    upright = column(clamped(rotation=turned), sliding(tip, turned, lambda c: (0.0, 0.0, -c.P)), load, planar="e1")
    assert critical(inclined, "auto") == pytest.approx(critical(upright, "auto"), rel=1e-9)
