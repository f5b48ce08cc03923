"""Bad input ends with one sentence and status 2, before anything is computed."""

from dataclasses import fields, replace
from math import cos, pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import ufl

from rodfem import Attachment, InputError, Plan, SceneError, at, integral, load_json, run, trace
from rodfem.fem.fields import Discretization, Fields
from rodfem.problem import contribution, ends
from rodfem.problem.ends import End, Ring, clamped, elastic, free, hinged, pinned, sliding
from rodfem.problem.scene import Inertia, Ordinate, Parameter, Scene

pytestmark = pytest.mark.versions


def ordinate(s: float = 0.0) -> Ordinate:
    return Ordinate("nothing", s=s, of=lambda r, q: 0.0)


GOOD: dict[str, Any] = {
    "name": "cantilever",
    "interval": (0.0, 1.0),
    "rod": "flexible",
    "energy": lambda v, k, c: 0.5 * (v[0] ** 2 + v[1] ** 2 + (v[2] - 1) ** 2 + k[0] ** 2 + k[1] ** 2 + c.B * k[2] ** 2),
    "parameters": {"F": Parameter(0.0), "B": Parameter(2.0)},
    "load": "F",
    "ends": (clamped(), free(lambda c: (0, 0, c.F))),
    "ordinate": ordinate(),
    "span": (0.0, 1.0),
}


ZERO = (0.0, 0.0, 0.0)
RIGID: dict[str, Any] = {"rod": "unshearable and inextensible"}
Ends = tuple[End, End]


def held(left: End | None = None, right: End | None = None) -> dict[str, Ends]:
    return {"ends": (left or clamped(), right or free())}


def hump(c: Any) -> Any:
    return c.F * (1 - c.F)


BEAM = Inertia(rho_A=lambda c: 1.0)
ACROSS, ABOUT = (lambda c: (0.0, hump(c), 0.0)), (lambda c: (hump(c), 0.0, 0.0))
PUSHED = free(follower=lambda c: (0.0, 0.0, -c.F))
TURNED = sliding(lambda c: (0.0, 0.0, None), lambda c: (ufl.cos(hump(c)), ufl.sin(hump(c)), 0.0, 0.0))
OFF_PLANE: list[tuple[dict, str]] = [
    (held(right=free(moment=ABOUT)), "moment on the right end pushes the rod out"),
    (held(right=free(follower_moment=ABOUT)), "follower moment on the right end pushes the rod out"),
    (held(right=free(follower=ACROSS)) | {"inertia": BEAM}, "follower force on the right end pushes the rod out"),
    ({"attachments": (Attachment(0.5, follower=ACROSS),), "inertia": BEAM}, "at s = 0.5 pushes the rod out"),
    ({"follower": ACROSS, "inertia": BEAM}, "distributed follower force pushes the rod out"),
    ({"distributed": lambda c: (0.0, hump(c) * (c.s - 0.5), 0.0)}, "distributed force pushes the rod out"),
    (held(right=TURNED), "rotation of the right end leaves the plane"),
    # energies that prefer one side of the plane; of a load without potential nothing else would tell
    (
        {"energy": lambda v, k, c: GOOD["energy"](v, k, c) + 1e-6 * c.F * k[0] * k[1]},
        "stored energy pushes the rod out of its plane",
    ),
    ({"potential": lambda x, c: c.F * x.r[1]} | held(right=PUSHED) | {"inertia": BEAM}, "potential along the rod push"),
    (held(right=End(energy=lambda x, c: hump(c) * x.R[1, 2])), "energy of the right end pushes"),
]
"""Scenes of a rod that is planar across e2 with something off that plane, at loads inside of the range alone too."""


@pytest.mark.few(73)
@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"interval": (1.0, 0.0)}, "interval"),
        ({"rod": "stiff"}, "kind of rod"),
        ({"load": "G"}, "not a parameter"),
        ({"parameters": {"F": Parameter(0.0), "B": Parameter(2.0, admissible=(3.0, 4.0))}}, "admissible"),
        ({"parameters": {"F": Parameter(0.0), "B": Parameter(-2.0)}}, "not convex"),
        ({"ordinate": ordinate(2.0)}, "not on the rod"),
        ({"span": (0.3, 0.3)}, "empty"),
        # names
        ({"parameters": {"F": 0.0, "s": 1.0}}, "cannot have the name 's'"),
        ({"parameters": {"F": Parameter(0.0)}}, "^The stored energy asks for a constant 'B': add it"),
        (
            {"energy": lambda v, k, c: (1 - c.S) * k[0] ** 2},
            r"^The stored energy asks for a constant 'S': .*, or choose one of c\.B, c\.F, c\.s \(the arclength\)",
        ),
        (
            {"energy": lambda v, k, c: c["B"] * k[0] ** 2},
            r"energy fails with TypeError.*subscriptable.*, as c\.P",
        ),
        ({"energy": lambda v, k, c: c.s.x * k[0] ** 2}, r"'x'\\?\".*: v\[0\].* c\.s, numbers or expressions of UFL"),
        ({"energy": lambda v, k, c, s: (1 - s) * k[0] ** 2}, r"give W\(v, k, c\), where .* the arclength, c\.s"),
        ({"potential": lambda x, c: x.z}, "potential along the rod asks for 'z' of a place: it has"),
        ({"constraints": (at(0.5, lambda x, c: x.k[0]),)}, "asks for 'k' of a place: it has"),
        # functions
        ({"energy": lambda v, k, c: None}, "energy is None: return"),
        ({"energy": None}, "energy is None: give a function"),
        ({"inertia": 1.0}, "inertia is 1.0: give one"),
        ({"start": lambda s: (cos(s), 0.0, 0.0, 0.0)}, "start fails with TypeError.*array of arclengths"),
        # kinds
        ({"constraints": at(0.5, lambda x, c: x.r[0])}, r"constraints=\(at\("),
        ({"attachments": Attachment(0.5, mass=1.0)}, r"attachments=\(Attachment\("),
        ({"breaks": 0.5}, r"breaks=\(0.5,\)"),
        ({"parameters": ["F", "B"]}, "give a dictionary"),
        ({"parameters": {"F": Parameter(0.0, admissible=(1.0, -1.0)), "B": 2.0}}, "give the lower bound first"),
        ({"ordinate": Ordinate("r", s=0.0, of=lambda r, q: r)}, "ordinate fails with TypeError.*returns a number"),
        # sizes and shapes
        ({"energy": lambda v, k, c: k}, "energy has the shape"),
        ({"potential": lambda x, c: x.r}, "potential along the rod has the shape"),
        ({"constraints": (at(0.5, lambda x, c: x.r),)}, "constraint has the shape"),
        ({"distributed": lambda c: (0, 1)}, "distributed force has 2"),
        ({"start": lambda s: np.zeros((4, len(s)))}, r"start has the shape \(4, 1001\)"),
        # clamps that contradict themselves
        (held(clamped(rotation=(1.0, 0.0, 0.0))), "rotation of the left end has 3"),  # type: ignore[arg-type]
        (held(clamped(rotation=(0.0, 0.0, 0.0, 0.0))), "zero quaternion"),
        (held(clamped(rotation=lambda c: (0, 0, 0, c.F))), "zero quaternion"),
        ({"planar": "e2"} | held(clamped(rotation=(1.0, 0.0, 0.0, 1.0))), "leaves the plane across e2"),
        (held(hinged((0.0, 0.0, 0.0))), "no axis"),
        (held(End(position=lambda c: ZERO, hinge=(1.0, 0.0, 0.0))), "a hinge but no rotation"),
        ({"states": "branch 2.13"}, "'branch 2.13', a name which others are given: choose another"),
        # loads on what is held
        (held(End(position=lambda c: ZERO, follower=lambda c: ZERO)), "whose position is held"),
        (held(right=End(rotation=(1.0, 0.0, 0.0, 0.0), moment=lambda c: ZERO)), "whose directors are held"),
        (held(right=replace(hinged((0.0, 0.0, 1.0)), moment=lambda c: (c.F, 0.0, 1.0))), "across the axis of"),
        # nothing that holds, or nothing that gives way
        ({"ends": (pinned(lambda c: (0, 0, None)), pinned(lambda c: (0, 0, None)))}, "drift away along e3"),
        (
            {"ends": (free(), pinned(lambda c: (None, 0, 0))), "constraints": (integral(lambda x, c: x.k[2]),)},
            "along e1",
        ),
        (RIGID | held(right=clamped(lambda c: (0, 0, 1.2))), "only 1 long"),
        (RIGID | held(right=clamped(lambda c: (0, 0, 0.5 + 4 * c.F * (1 - c.F)))), "At F = .* only 1 long"),
        # rings
        ({"ends": (clamped(),)}, "not two of the kind End"),
        ({"ends": Ring()}, "no straight start"),
        ({"ends": Ring(odd=False), "start": lambda s: turns(s, 1)}, r"Ring\(odd=True\)"),
        ({"ends": Ring(odd=True), "start": lambda s: turns(s, 2)}, r"Ring\(odd=False\)"),
        # places
        ({"attachments": (Attachment(1.5, force=lambda c: ZERO),)}, "attachment at s = 1.5 is not on the rod"),
        ({"attachments": (Attachment(1 - 3e-9, force=lambda c: ZERO),)}, "the end at s = 1 are 3e-09 apart"),
        ({"planar": "e3"}, "planar across 'e3'"),
        ({"planar": "e2"} | held(right=clamped(lambda c: (0.0, 0.2, 0.9))), "held at 0 and 0.2 along e2"),
        (
            {"planar": "e2"} | held(right=free(force=lambda c: (0.0, c.F, 0.0))),
            "force on the right end pushes the rod out",
        ),
        (
            {"planar": "e2"} | held(right=End(moment=lambda c: (0.0, 1.0, c.F))),
            "moment on the right end pushes the rod out",
        ),
        # what is zero at both ends of the range, from 0 to 1, and not inside
        *(({"planar": "e2"} | change, words) for change, words in OFF_PLANE),
        ({"planar": "e2"} | held(right=clamped(lambda c: (0.0, hump(c), 1.0))), "held at 0 and 0.* along e2"),
        ({"ends": (free(), free(lambda c: (0.0, 0.0, hump(c))))}, "At F = 0.* add up to .* nothing holds the rod"),
        (held(right=free(lambda c: (0.0, 0.0, ufl.sqrt(0.1 - hump(c))))), "component 3 of the force on the right end"),
    ],
)
def test_mistakes(change: dict, words: str, capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(InputError, match=words) as raised:
        Scene(**(GOOD | change))
    message = str(raised.value)
    assert message.endswith(".") and "\n" not in message
    assert capfd.readouterr() == ("", "")


def test_an_attachment_has_something() -> None:
    with pytest.raises(InputError, match=r"Nothing is attached at s = 0.5: .*a mass.*breaks=\(0.5,\)"):
        Attachment(0.5)


def test_parameters_that_nothing_feels() -> None:
    scene = Scene(**(GOOD | {"parameters": {"F": 0.0, "B": 2.0, "G": 1.0}}))
    for load, locus, kind, words in (
        ("G", None, SceneError, "depends on its load 'G'"),
        ("F", ("G", 0.0, 2.0), InputError, "depends on 'G'"),
    ):
        with pytest.raises(kind, match=words):
            Plan((0.0, 1.0), locus=locus).check(scene.varying(load, (0.0, 1.0)))


@pytest.mark.long
@pytest.mark.short
def test_a_rod_squeezed_to_nothing() -> None:
    """The energy is written in v3, not in v3 - 1: without a load the rod has no length."""
    scene = Scene(**(GOOD | {"energy": lambda v, k, c: ufl.dot(v, v) + ufl.dot(k, k)}))
    with pytest.raises(SceneError, match=r"squeezed to a stretch.*v\[2\] - 1"):
        trace(scene, Discretization("reduced", 4, 2), Plan(error_bars=False))


def turns(s: np.ndarray, count: int) -> np.ndarray:
    """So many turns about e2 in all."""
    return np.stack([np.cos(pi * count * s), 0 * s, np.sin(pi * count * s), 0 * s], axis=1)


@pytest.mark.few(10)
@pytest.mark.parametrize(
    ("change", "words"),
    [
        (held(right=free(follower=lambda c: (0, 0, c.F))), "give it an inertia"),
        (
            held(right=clamped(lambda c: (0, 0, 1))) | {"inertia": Inertia(rho_I=lambda c: (1.0, -2.0, 1.0))},
            "-2 is negative",
        ),
        ({"inertia": Inertia(rho_A=lambda c: 1 - 2 * c.F)}, "of -1 at F = 1 is negative: .* a range of F"),
        ({"inertia": Inertia(rho_A=lambda c: 0.2 - hump(c))}, "of -0.0.* at F = 0.* is negative"),
        ({"attachments": (Attachment(0.5, mass=lambda c: 1 - 2 * c.F),)}, "of -1 at F = 1 is negative"),
        (
            held(right=free(follower=lambda c: (0, 0, c.F))) | {"inertia": Inertia(rho_A=lambda c: 1 - c.F)},
            "give it an inertia at F = 1",
        ),
        (
            {"planar": "e2", "start": lambda s: np.stack([np.cos(s), np.sin(s), 0 * s, 0 * s], axis=1)},
            "leaves the plane",
        ),
    ],
)
def test_inertia_and_plane(change: dict, words: str) -> None:
    with pytest.raises(SceneError, match=words):
        Scene(**(GOOD | change))


def test_a_plan_of_another_range_is_checked_over_it() -> None:
    """A mass is positive up to F = 2: the scene ends before, a plan after."""
    scene = Scene(**(GOOD | {"inertia": Inertia(rho_A=lambda c: 2 - c.F)}))
    Plan((0.0, 2.0)).check(scene)
    with pytest.raises(SceneError, match="of -1 at F = 3 is negative"):
        Plan((0.0, 3.0)).check(scene)
    scene = Scene(**(GOOD | {"inertia": Inertia(rho_A=lambda c: 2 - c.F)} | {"span": (0.0, 2.0)}))
    Plan((0.5, 1.0)).check(scene)


def test_a_start_that_jumps() -> None:
    """Any mesh makes a twist of it; one that is steep, or changes the signs of quaternions, does not jump."""

    def turned(angle: Any) -> Any:
        return np.stack([np.cos(angle / 2), np.sin(angle / 2), 0 * angle, 0 * angle], axis=1)

    for start in (lambda s: turned(pi * (s > 0.33)), lambda s: turned(3 * s + 0.4 * (s >= 0.5))):
        with pytest.raises(SceneError, match=r"start jumps by (3.14|0.4) radian at s = 0\.(33|5)\b"):
            Scene(**(GOOD | {"start": start}))
    for start in (
        lambda s: turned(np.arctan((s - 0.3) / 1e-5)),
        lambda s: turned(40 * pi * s),
        lambda s: turned(s) * np.where(s < 0.4, 1.0, -1.0)[:, None],
    ):
        Scene(**(GOOD | {"start": start}))


def test_a_start_of_any_size_is_a_rotation() -> None:
    scene = Scene(**(GOOD | {"start": lambda s: 1e9 * turns(s, 1)}))
    s = np.linspace(0, 1, 5)
    assert scene.start is not None and scene.start(s) == pytest.approx(turns(s, 1), abs=1e-15)
    with pytest.raises(SceneError, match="no rotation everywhere"):
        Scene(**(GOOD | {"start": lambda s: np.zeros((len(s), 4))}))


def test_scenes_that_are_no_mistakes() -> None:
    """Held by a spring only; ends farther apart than a rod that may stretch or shear; closed after two turns.

    An inertia that vanishes at an end of the range; a clamp in its plane but for round-off.
    """
    Scene(**(GOOD | {"inertia": Inertia(rho_A=lambda c: 1 - c.F)}))
    turned = lambda c: (ufl.cos(c.F), 1e-17 * c.F, ufl.sin(c.F), 0.0)  # noqa: E731
    alike = lambda x, c: c.F * (x.r[1] ** 2 * x.r[0] + x.R[1, 2] ** 2)  # noqa: E731
    Scene(**(GOOD | {"planar": "e2", "potential": alike}))
    Scene(**(GOOD | {"planar": "e2"} | held(*[clamped(lambda c: (0.0, c.F, 0.0))] * 2)))
    Scene(**(GOOD | {"planar": "e2"} | held(right=sliding(lambda c: (None, 0.0, None), turned))))
    Scene(**(GOOD | {"ends": (elastic(lambda c: 1.0), free())}))
    for rod in ("flexible", "unshearable", "inextensible"):
        Scene(**(GOOD | {"rod": rod} | held(right=clamped(lambda c: (0, 0, 1.2)))))
    Scene(**(GOOD | {"ends": Ring(odd=False), "start": lambda s: turns(s, 2)}))


@pytest.mark.few(1)
@pytest.mark.parametrize(
    ("change", "what"),
    [
        ({"distributed": lambda c: (0, 0, c.F)}, "a distributed force"),
        ({"potential": lambda x, c: x.r[0] ** 2}, "the potential along the rod"),
        ({"attachments": (Attachment(0.5, force=lambda c: (0, 0, c.F)),)}, "what is attached along the rod"),
        ({"constraints": (at(0.5, lambda x, c: x.r[0]),)}, "the constraint"),
        (
            held(right=free(follower=lambda c: (0, 0, c.F))) | {"inertia": Inertia(rho_A=lambda c: 1.0)},
            "a load without potential",
        ),
    ],
)
def test_no_centreline(change: dict, what: str) -> None:
    scene = Scene(**(GOOD | change))
    with pytest.raises(InputError, match=f"{what} needs: use Discretization.formulation=.pointwise.."):
        Fields(scene, Discretization("reduced", 4, 3))
    assert Fields(scene, Discretization("auto", 4, 3)).discretization.formulation == "pointwise"


def test_fewer_elements_than_pieces() -> None:
    scene = Scene(**(GOOD | {"breaks": (0.1, 0.2, 0.3, 0.4)}))
    with pytest.raises(InputError, match=r"5 pieces between joints.*use more than 4 elements"):
        Fields(scene, Discretization("auto", 4, 3))


def raising(*_: object) -> Any:
    return 1 / 0


def takes_functions(owner: type) -> list[str]:
    """Fields of a dataclass that are annotated as functions."""
    words = ("Callable", "Given", "OfPlace")
    return [f.name for f in fields(owner) if any(word in str(f.type) for word in words)]


STATED = [End, ends.SlidingHinge, Attachment, contribution.Constraint, contribution.Integral, Inertia, Ordinate, Scene]
EVERY = sorted({(owner.__name__, name) for owner in STATED for name in takes_functions(owner)})


def with_function(owner: str, name: str) -> Scene:
    """A scene with a function that raises in one field of one of its parts."""
    moving = clamped(rotation=lambda c: (1, 0, 0, 0))
    if owner in ("End", "SlidingHinge"):
        end = getattr(ends, owner)(**{name: raising})
        return Scene(**(GOOD | {"ends": (end, moving) if "tion" in name else (clamped(), end)}))
    parts: dict[str, Any] = {
        "Inertia": lambda: {"inertia": Inertia(**{name: raising})},
        "Ordinate": lambda: {"ordinate": Ordinate("nothing", 0.0, raising)},
        "Attachment": lambda: {"attachments": (Attachment(0.5, **{name: raising}),)},
        "Constraint": lambda: {"constraints": (at(0.5, raising),)},
        "Integral": lambda: {"constraints": (integral(**({"of": lambda x, c: x.k[2]} | {name: raising})),)},
        "Scene": lambda: {name: raising},
    }
    return Scene(**(GOOD | parts[owner]()))


@pytest.mark.parametrize(("owner", "name"), EVERY)
def test_no_function_of_a_scene_is_forgotten(owner: str, name: str) -> None:
    """Whatever a dataclass of a scene takes as a function may raise: that is a sentence, and names the function."""
    with pytest.raises(SceneError, match=r"^The .* fails with ZeroDivisionError, 'division by zero'"):
        with_function(owner, name).ordinate.of(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))


@pytest.mark.long
def test_a_plan_without_a_range_takes_the_scenes(folder: Path) -> None:
    rod = Scene(**(GOOD | {"span": (0.0, 0.3)}))
    for plan, rows in ((Plan(error_bars=False), []), (Plan(at=(0.1,), error_bars=False), [0.1])):
        branches = run(rod, Discretization("reduced", 4, 3), plan, folder, figures=False, quiet=True)
        assert branches[0].points[-1].load == 0.3
        assert [s.point.load for s in branches[0].special if s.kind == "user"] == rows
    assert load_json(folder / "diagram.json")["range"] == [0.0, 0.3]
    with pytest.raises(InputError, match="outside the range 0 to"):
        Plan(at=(1.0,)).check(rod)


@pytest.mark.long
@pytest.mark.short
def test_constraints_that_repeat_each_other() -> None:
    """Named where no first equilibrium can be found: twice the same one, and one on what an end holds."""
    for constraints, words in (
        (
            (at(1.0, lambda x, c: x.r[1]), at(1.0, lambda x, c: 2 * x.r[1])),
            "constraint 1 of the scene and constraint 2",
        ),
        ((at(0.0, lambda x, c: x.r[1]),), "constraint 1 of the scene"),
    ):
        rod = Scene(**(GOOD | {"constraints": constraints}))
        with pytest.raises(SceneError, match=f"depend on one another .{words}"):
            trace(rod, Discretization("pointwise", 4, 6), Plan(error_bars=False))
