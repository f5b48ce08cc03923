"""Mistakes in Python: each is refused in one sentence that names it, before anything is computed."""

import math
from collections.abc import Callable
from dataclasses import fields, replace
from fractions import Fraction
from functools import lru_cache
from logging import getLogger
from math import cos, pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import ufl
from classics import column

import rodfem
from rodfem import (
    Attachment,
    Discretization,
    End,
    Event,
    IndexStepControl,
    Inertia,
    InputError,
    Ordinate,
    Parameter,
    Plan,
    Ring,
    Scene,
    SceneError,
    StepControl,
    at,
    clamped,
    elastic,
    everywhere,
    free,
    hinged,
    integral,
    load_json,
    pinned,
    run,
    section,
    sliding,
    sliding_hinge,
    trace,
)
from rodfem.diagram import solver
from rodfem.fem.fields import Fields
from rodfem.forms import loads
from rodfem.forms.energy import bending_and_twist
from rodfem.problem.contribution import Constraint, Integral
from rodfem.problem.ends import SlidingHinge

pytestmark = pytest.mark.versions

NAN, INF = math.nan, math.inf
TIP = free(force=lambda c: (0, 0, -c.P))


class Computed(Exception):
    """The system of a scene was about to be set up."""


@pytest.fixture
def stop(monkeypatch: pytest.MonkeyPatch) -> None:
    def compute(*_: object, **__: object) -> None:
        raise Computed

    monkeypatch.setattr(solver, "System", compute)


def scene(**changes: Any) -> Scene:
    """A column that is right but for the changes."""
    good: dict[str, Any] = {
        "name": "column",
        "interval": (0.0, 1.0),
        "rod": "unshearable and inextensible",
        "energy": lambda v, k, c: bending_and_twist(k, (1.0, 1.0, 0.5)),
        "parameters": {"P": Parameter(0.0)},
        "load": "P",
        "ends": (clamped(), TIP),
        "ordinate": Ordinate("tip", s=1.0, of=lambda r, q: r[0]),
        "span": (0.0, 3.0),
    }
    return Scene(**(good | changes))


def right(**named: Any) -> tuple[End, End]:
    return clamped(), End(**({"force": lambda c: (0, 0, -c.P)} | named))


def left(position: Any = (0, 0, 0), rotation: Any = (1, 0, 0, 0)) -> tuple[End, End]:
    return clamped(lambda c: position, rotation), TIP


def numbers(**named: Any) -> dict[str, Any]:
    return {"parameters": {"P": 0.0} | named}


def tip(of: Any, s: Any = 1.0, name: Any = "tip", label: Any = "") -> dict[str, Any]:
    return {"ordinate": Ordinate(name, s, of, label)}


def stiff(b: Any, k: Any) -> Any:
    return bending_and_twist(k, (b, b, b))


SCENES: list[tuple[dict[str, Any] | Callable[[], dict[str, Any]], str]] = [
    # forces that do no work
    (
        {"ends": (pinned(), pinned(lambda c: (0, 0, None), lambda c: (1 + c.P, 0, -c.P)))},
        "A force acts on the right end in a direction in which its position is held",
    ),
    # names, numbers, pairs
    ({"title": 3}, "title is 3"),
    *(({"interval": x}, r"interval(\[\d\])? is") for x in (None, (1.0,), "01", {0.0, 1.0}, (0, 10**400))),
    ({"interval": (1e16, 1e16 + 2), "ordinate": Ordinate("tip", 1e16, lambda r, q: 0.0)}, "short for its arclengths"),
    *(({"span": x}, r"span(\[\d\])? is") for x in ((True, False), (0, 1j))),
    *(({"span": x}, "range of P from .* round-off") for x in ((1.0, 1.0 + 3e-16),)),
    ({"rod": ["unshearable"]}, "kind of rod"),
    ({"load": ["P"]}, "is not a parameter"),
    *((numbers(**{name: 1.0}), "cannot have the name") for name in ("lambda", "__class__", "a/b")),
    *((numbers(B=x), "B is") for x in (True, 10**400, 1j, "1")),
    (lambda: numbers(B=Parameter(1.0, label=3)), "label is 3"),  # type: ignore[arg-type]
    (lambda: numbers(B=Parameter(1.0, "", (0,))), "admissible is"),  # type: ignore[arg-type]
    ({"ends": iter(())}, "not two of the kind End"),
    ({"breaks": ("0.5",)}, "One of the breaks is"),
    (lambda: {"attachments": (Attachment(True, mass=lambda c: 1.0),)}, "s is True"),
    # what functions of the constants return
    *(({"ends": left((x, 0, 0))}, "component 1 of the position") for x in (NAN, "a", 1j, False, np.zeros(1))),
    *(({"ends": left(x)}, "position of the left end") for x in ("abc", {0: 0, 1: 0, 2: 0}, {1, 2, 3}, 3)),
    *(({"ends": left(rotation=x)}, "rotation of the left end") for x in ("1000", (1j, 0, 0, 0), (INF, 0, 0, 0))),
    ({"ends": left(rotation=lambda c: (1j, 0, 0, 0))}, "component 1 of the rotation"),
    *(({"ends": right(force=lambda c, x=x: (0, 0, x))}, "component 3 of the force") for x in (NAN, INF, 1j, None, "1")),
    ({"ends": right(force=lambda c: (0, 0, 1 / (c.P - 3)))}, "force on the right end fails with ZeroDivision"),
    ({"ends": right(force=lambda c: exit(3))}, "force on the right end fails with SystemExit"),
    # what is a number here is an expression in the equations
    ({"ends": right(force=lambda c: (0, 0, math.cos(c.P)))}, "force on the right end fails with TypeError.*with UFL"),
    (
        {"ends": (clamped(rotation=lambda c: (np.cos(c.P), 0, 0, np.sin(c.P))), TIP)},
        "rotation of the left end fails.*with UFL",
    ),
    ({"ends": (free(), TIP)}, "add up to .0.0, 0.0, -3.0., and nothing holds the rod against that"),
    *(
        ({"ends": (clamped(), hinged(x, lambda c: (0, 0, None)))}, "hinge of the right end")
        for x in ("abc", (1j, 0, 0))
    ),
    ({"inertia": Inertia(rho_A=lambda c: c.s - 0.2)}, "is negative"),
    # what functions of a place return
    ({"potential": lambda x, c: x.r[0] > 0}, "is true or false"),
    (lambda: {"constraints": (everywhere(lambda x, c: x.k[0], strain="no"),)}, "strain is 'no'"),  # type: ignore[arg-type]
    # energies
    ({"energy": lambda v, k, c: ufl.sqrt(ufl.dot(k, k))}, "not finite"),
    ({"energy": lambda v, k, c: bending_and_twist(k, (1, 1))}, "three stiffnesses, not 2"),
    ({"energy": lambda v, k, c: bending_and_twist(k, (1, 1e-13, 1))}, "convex, but for round-off"),
    ({"potential": lambda x, c: loads.spring(x.r, (1, 2))}, "one number or three, not 2"),
    # ordinate, start, springs
    *((tip(lambda r, q, x=x: x), "ordinate fails with TypeError") for x in ("a", "1", True, None, 1j, np.zeros(1))),
    (lambda: tip(lambda r, q: r[0], name=3), "name is 3"),
    (lambda: tip(lambda r, q: r[0], label=None), "label is None"),
    (lambda: tip(lambda r, q: r[0], s=True), "s is True"),
    *(({"start": lambda s, x=x: x}, "start fails with") for x in ("a", [[1, 0], [1]], np.full((5, 4), 1j))),
    (lambda: {"ends": (clamped(), elastic(lambda c: 1.0, anchor=(0, 0)))}, "anchor is"),  # type: ignore[arg-type]
    (lambda: {"ends": (clamped(), elastic(None, lambda c: 1.0, directors=(0, 0, 0, 0)))}, "zero quaternion"),
    ({"ends": (clamped(), elastic(lambda c: (1.0, -2.0, 0.0), force=lambda c: (0, 0, -c.P)))}, "of -2 pushes away"),
    ({"energy": lambda v, k, c: 1.0}, "stored energy is flat"),
    ({"ends": (clamped((0, 1)), TIP)}, "position of the left end has 2 components: give 3"),
    ({"ends": (clamped(3.0), TIP)}, "position of the left end is 3.0: give a function"),
    ({"energy": section.circle(1.0, E=1.0, nu=0.3)}, r"is Section.*: give a function W.*, as section.energy\(rod\) is"),
    ({"ends": right(force=Parameter(1.0))}, r"force on the right end is Parameter.*: give a function f\(c\)\."),
    (lambda: numbers(B=Parameter("B", 1.0)), "value is 'B': give a number"),  # type: ignore[arg-type]
    (lambda: {"ends": (clamped(), sliding_hinge((1, 0, 0), (NAN, 0, 1)))}, "direction in which a hinge slides"),
]


@pytest.mark.parametrize(("changes", "words"), SCENES)
def test_scenes(changes: Any, words: str) -> None:
    with pytest.raises(InputError, match=words) as raised:
        scene(**(changes() if callable(changes) else changes))
    assert "\n" not in str(raised.value)


def event(of: Any, name: Any = "ends meet") -> Plan:
    return Plan(events=(Event(name, of),))


def control(**named: Any) -> Plan:
    return Plan(steps=StepControl(**named))


PLANS: list[tuple[Callable[[], Any], str]] = [
    (lambda: Plan((1.0, 1.0 + 3e-16)), "as narrow as round-off"),
    (lambda: Plan(error_bars="no"), "error_bars is 'no'"),  # type: ignore[arg-type]
    (lambda: Plan(spectrum=10**10), "no more than 147 eigenvalues"),
    *((lambda x=x: Plan(events=x), r"events(\[0\])? is") for x in (None, Event("a", lambda s: 1.0), {1})),
    (lambda: event(lambda s: 1.0, 3), "name is 3"),
    (lambda: event(lambda s: 1.0, ""), "event has no name"),
    *((lambda x=x: event(x), "of is .*: give a function of 1") for x in (3, lambda: 1.0, lambda s, c: 1.0)),
    *((lambda x=x: event(lambda s: x), "event 'ends meet' fails") for x in (None, "1", True, 1j, np.zeros(3))),
    (lambda: control(first=INF), "first = inf lead"),
    (lambda: control(first=1e-7), "first step of 1e-07 is out of bounds"),
    *((lambda x=x: Plan(steps=IndexStepControl(resolved=x)), "resolved is") for x in (NAN, INF, -1.0, "a")),
    (lambda: Discretization(elements=10**9), "too large"),
    (lambda: Discretization(elements=8.0), "elements is 8.0: give a whole number, as in elements=8"),  # type: ignore[arg-type]
    (lambda: Discretization(elements=1, vertices=("0", "1")), r"vertices\[0\] is '0': give a number"),  # type: ignore[arg-type]
    (lambda: control(largest="0.1"), "largest is '0.1': give a number, as in largest=0.15"),
    (lambda: control(most=0), "most is 0: a branch has at least one point"),
    (lambda: Plan(at=0.5), "at is 0.5: give a tuple of numbers"),  # type: ignore[arg-type]
    (lambda: Plan(depth=-1), "-1 is not a depth"),
    (lambda: Plan(locus=("A", 0, "b")), r"locus\[1:\]\[1\] is .b.: give a number"),  # type: ignore[arg-type]
    (lambda: Plan(steps=0.1), r"steps is 0.1: give StepControl"),  # type: ignore[arg-type]
    (lambda: Discretization(8, 6), "formulation 8: choose .*, and give numbers by name, as in elements=8, degree=6"),  # type: ignore[arg-type]
    (lambda: Discretization(elements=2, vertices=(0.0, 1e-300, 1.0)), "must ascend"),
    (lambda: Discretization(elements=2, vertices=(0.0, 0.5, 2.0)), "must begin and end at 0 and 1"),
]


@pytest.mark.usefixtures("stop")
@pytest.mark.parametrize(("make", "words"), PLANS)
def test_plans(make: Callable[[], Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        found = make()
        rodfem.trace(scene(), *((None, found) if isinstance(found, Plan) else (found,)))


@pytest.mark.usefixtures("stop")
def test_arguments_of_functions(tmp_path: Path) -> None:
    ours = scene()
    cases: list[tuple[Callable[[], Any], str]] = [
        (lambda: rodfem.run(ours, output="a\0b"), "output is"),
        (lambda: rodfem.run(ours, output=tmp_path, figures="no"), "figures is 'no'"),  # type: ignore[arg-type]
        (lambda: rodfem.run(ours, output=tmp_path, words=lambda: ""), "words is"),  # type: ignore[arg-type]
        (lambda: rodfem.many([ours], lambda: {}, tmp_path), "work is .*: give a function of 1"),  # type: ignore[arg-type]
        (lambda: rodfem.many([ours], lambda rod: {1}, tmp_path), "what no file can hold"),  # type: ignore[arg-type]
        (lambda: rodfem.many([ours], lambda rod: {"a": NAN}, tmp_path), "what no file can hold"),
        (lambda: rodfem.many([ours], lambda rod: [1], tmp_path), "return a dictionary"),  # type: ignore[arg-type]
        (lambda: rodfem.load_json(None), "path is None"),  # type: ignore[arg-type]
        (lambda: rodfem.load_json(True), "path is True"),  # type: ignore[arg-type]
        (lambda: rodfem.load_modes("a", "b", 0.5), "row is 0.5"),  # type: ignore[arg-type]
        (lambda: rodfem.Solver(ours, spectrum=10**10), "no more than 147"),
    ]
    for call, words in cases:
        with pytest.raises(InputError, match=words):
            call()
    assert not list(tmp_path.iterdir())


@pytest.mark.usefixtures("stop")
def test_what_belongs_to_a_plan_or_a_mesh_is_named() -> None:
    for asked, words in (
        ({"degree": 1}, "A plan has no 'degree': choose one of .*, or give a Discretization"),
        ({"nonsense": 1}, "A plan has no 'nonsense': choose one of span, at, depth, "),
        ({"depth": 1, "plan": Plan()}, r"depth and plan are both given: give plan=Plan\(depth="),
    ):
        with pytest.raises(InputError, match=words):
            rodfem.trace(scene(), **asked)
    with pytest.raises(TypeError, match="its arguments are scene, discretization, comm"):
        rodfem.Solver()  # type: ignore[call-arg]


def test_ufl_prints_nothing_besides(capfd: pytest.CaptureFixture[str]) -> None:
    """Its logger writes what it raises, once or twice, and the sentence has that."""
    with pytest.raises(SceneError, match=r"write it with UFL .ufl.cosh, ufl.conditional., without math, numpy and if"):
        scene(energy=lambda v, k, c: stiff(1.0, k) if k[0] > 0 else stiff(2.0, k))
    assert capfd.readouterr() == ("", "")
    assert not getLogger("UFL").disabled


def test_a_constant_is_a_function_of_the_constants() -> None:
    """Wherever a scene takes a function of ``c`` alone."""
    given = scene(
        ends=(clamped((0, 0, 0), (1, 0, 0, 0)), elastic(3.0, (1.0, 2.0, 3.0), force=(0, 0, 1.0))),
        inertia=Inertia(2.0, (1.0, 1.0, 2.0)),
        distributed=(0.0, 0.0, 1.0),
        attachments=(Attachment(0.5, mass=2.0, force=(0, 0, -1)),),
        constraints=(integral(lambda x, c: x.k[2], 0.1),),
    )
    c = given.constants()
    assert given.sides[0].support(c) == [0, 0, 0] and given.sides[1].force(c) == (0, 0, 1.0)
    assert given.inertia.rho_A(c) == given.attachments[0].mass(c) == 2.0 and given.has_inertia
    assert given.distributed(c) == (0.0, 0.0, 1.0) and given.constraints[0].equals(c) == 0.1
    slides = sliding_hinge((1, 0, 0), (0, 0, 2.0), force=3.0)
    assert scene(ends=(clamped(), slides)).sides[1].force(c) == (0.0, 0.0, 3.0)


@pytest.mark.usefixtures("stop")
@pytest.mark.few(5)
@pytest.mark.parametrize(
    "changes",
    [
        {"name": "a b \N{GREEK SMALL LETTER LAMDA}"},
        {"interval": [0, np.int64(1)], "span": np.array([0.0, 3.0])},
        {"interval": (0, Fraction(1, 1))},
        numbers(B=Fraction(1, 3)) | {"energy": lambda v, k, c: stiff(c.B, k)},
        {"breaks": (Fraction(1, 2),), "attachments": (Attachment(Fraction(1, 2), mass=Fraction(1, 3)),)},
        {"ends": right(force=lambda c: (Fraction(0), np.int64(0), np.float32(0) - c.P))},
        {"ends": left((Fraction(0), np.int64(0), 0), (Fraction(1), np.int64(0), 0, 0))},
        {"ends": right(energy=lambda x, c: ufl.ln(x.d3[2] + 2))},
        {"ends": left(np.zeros(3), np.array([2.0, 0, 0, 0]))},
        {"potential": lambda x, c: loads.spring(x.r, np.ones(3))},
    ],
)
def test_what_is_no_mistake(changes: dict[str, Any]) -> None:
    with pytest.raises(Computed):
        rodfem.trace(scene(**changes), Discretization(elements=np.int64(4)), Plan(depth=np.int64(1)))


def test_numbers_are_floats() -> None:
    """UFL knows no fractions and no numbers of numpy, and JSON none of the former."""
    rod = scene(**numbers(B=Fraction(1, 3)), breaks=(np.float32(0.5),), distributed=lambda c: np.array([0, 0, 1]))
    asked = Plan(accuracy=Fraction(1, 1000), locus=("B", Fraction(1, 4), np.int64(1)))
    steps = StepControl(largest=Fraction(1, 10))
    found = [rod.parameters["B"].value, *rod.breaks, *rod.distributed(rod.constants()), *asked.locus[1:], steps.largest]
    assert all(isinstance(x, float) for x in (*found, asked.accuracy))
    force = right(force=(Fraction(1, 3), np.int64(0), 0))[1]
    assert scene(ends=(clamped(), force), distributed=lambda c: (0, 0, -c.P)).ends[1].force(None) == (1 / 3, 0.0, 0)


# --- other scenes


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


@pytest.mark.few(68)
@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"interval": (1.0, 0.0)}, "interval"),
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
def test_other_scenes(change: dict, words: str, capfd: pytest.CaptureFixture[str]) -> None:
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


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (held(right=free(follower=lambda c: (0, 0, c.F))), "give it an inertia"),
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
    with pytest.raises(InputError, match=f"{what} needs one: use Discretization.formulation=.pointwise.."):
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


STATED = [End, SlidingHinge, Attachment, Constraint, Integral, Inertia, Ordinate, Scene]
EVERY = sorted({(owner.__name__, name) for owner in STATED for name in takes_functions(owner)})


def with_function(owner: str, name: str) -> Scene:
    """A scene with a function that raises in one field of one of its parts."""
    moving = clamped(rotation=lambda c: (1, 0, 0, 0))
    if owner in ("End", "SlidingHinge"):
        end = {"End": End, "SlidingHinge": SlidingHinge}[owner](**{name: raising})
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


# --- functions that take another branch for expressions than for numbers

OTHER = "as a function of numbers and .* as an expression of its constants"
SOFT, STIFF = (1.0, 1.0, 1.0), (9.0, 9.0, 9.0)


def flag(factor: Callable[[Any], Any] = lambda c: 1.0, on: float = 1.0, end: Any = None, **changes: Any) -> Scene:
    """Column under a thrust with a ``factor`` that depends on a constant ``on``."""
    ends = clamped(), free(lambda c: (0.0, 0.0, -c.P * factor(c)), energy=end)
    return column("flag", ends, (0.0, 6.0), constants={"on": on}, **changes)


@pytest.mark.parametrize(
    ("factor", "on", "words"),
    [
        (lambda c: 1 if c.on == 1 else 2, 1.0, rf"^The force on the right end is -6 {OTHER}.*ufl\.conditional"),
        (lambda c: 1 if c.on in (1, 2) else 2, 1.0, OTHER),
        (lambda c: 1 if c.on else 2, 0.0, OTHER),
        (lambda c: {1.0: 1.0}.get(c.on, 3.0), 1.0, OTHER),
        (lambda c: {1.0: 1.0}[c.on], 1.0, "KeyError, 'c.on'"),
        (lambda c: 1 if 2 * c.on == 2 else 2, 1.0, rf"is -6 {OTHER.replace('.*', '-12')}, at P = 6"),
        (lambda c: {6.0: 2.0}.get(c.P, 1.0), 1.0, OTHER),
    ],
)
def test_a_branch_by_the_value_of_a_constant(factor: Callable[[Any], Any], on: float, words: str) -> None:
    """The first gave half of Euler's load with the bar 9e-12, the one by a dictionary a third of it."""
    with pytest.raises(SceneError, match=words):
        flag(factor, on)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"energy": lambda v, k, c: bending_and_twist(k, {1.0: SOFT}.get(c.on, STIFF))}, f"stored energy .* {OTHER}"),
        ({"end": lambda x, c: {1.0: 2.0}.get(c.on, 1.0) * x.r[0] ** 2}, f"energy of the right end .* {OTHER}"),
        ({"potential": lambda x, c: {1.0: 2.0}.get(c.on, 1.0) * x.r[0] ** 2}, f"potential along the rod .* {OTHER}"),
        ({"distributed": lambda c: (0.0, 0.0, c.P if c.s == 0.5 else 1.0 + c.on if c.on == 1 else 0.0)}, OTHER),
        ({"inertia": Inertia(lambda c: {1.0: 2.0}.get(c.on, 1.0))}, f"mass per length .* {OTHER}"),
        (
            {"attachments": (Attachment(0.5, force=lambda c: (0.0, 0.0, -c.P * {1.0: 1.0}.get(c.on, 3.0))),)},
            f"force of an attachment .* {OTHER}",
        ),
        (
            {"ordinate": Ordinate("bent", s=None, of=lambda x, c: x.k[0] ** 2 * {1.0: 2.0}.get(c.on, 1.0))},
            f"ordinate along the rod .* {OTHER}",
        ),
    ],
)
def test_every_function_is_asked(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(SceneError, match=words):
        flag(**changes)


@pytest.mark.few(7)
@pytest.mark.parametrize(
    "changes",
    [
        {"factor": lambda c: ufl.conditional(ufl.eq(c.on, 1), 1.0, 2.0)},
        {"factor": lambda c: ufl.conditional(ufl.lt(c.P, 1), 1.0, 2.0)},
        {"factor": lambda c: ufl.max_value(c.on, 0.5)},
        {"factor": (lambda twice: lambda c: twice(c.on))(lru_cache(lambda x: 2 * x))},
        {"factor": lambda c: (lambda x: ufl.diff(x**2 / 2, x))(ufl.variable(c.on))},
        {"end": lambda x, c: ufl.erf(x.r[0]) ** 2 + ufl.bessel_J(1, x.r[0])},
        {"end": lambda x, c: ufl.ln(x.r[2])},
        {"attachments": (Attachment(0.5, force=lambda c: (0.0, 0.0, -c.P if c.s == 0.5 else 0.0)),)},
    ],
)
def test_what_is_the_same_as_an_expression(changes: dict[str, Any]) -> None:
    """Conditions of UFL, caches, derivatives, functions that UFL does not evaluate, the place of an attachment."""
    assert flag(**changes).name == "flag"
