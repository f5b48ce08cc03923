"""Mistakes in Python: each is refused in one sentence that names it, before anything is computed."""

import math
from collections.abc import Callable
from dataclasses import fields, replace
from fractions import Fraction
from functools import lru_cache
from logging import getLogger
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import ufl
from classics import column

import rodfem
from rodfem import Attachment, Discretization, Inertia, InputError, Ordinate, Parameter, Plan, Scene, SceneError
from rodfem.continuation.follow import IndexStepControl, StepControl
from rodfem.diagram import solver
from rodfem.fem.fields import Fields
from rodfem.forms import loads
from rodfem.forms.energy import bending_and_twist
from rodfem.problem import section
from rodfem.problem.contribution import Constraint, Integral, at, everywhere, integral
from rodfem.problem.ends import End, Ring, SlidingHinge, clamped, elastic, free, hinged, pinned, sliding, sliding_hinge
from rodfem.problem.events import Event

pytestmark = pytest.mark.versions

NAN, INF = math.nan, math.inf
TIP = free(force=lambda c: (0, 0, -c.P))
ZERO = (0.0, 0.0, 0.0)
RIGID: dict[str, Any] = {"rod": "unshearable and inextensible"}
PLANE = {"planar": "e2"}
BEAM = Inertia(rho_A=lambda c: 1.0)


class Computed(Exception):
    """The system of a scene was about to be set up."""


@pytest.fixture
def stop(monkeypatch: pytest.MonkeyPatch) -> None:
    def compute(*_: object, **__: object) -> None:
        raise Computed

    monkeypatch.setattr(solver, "System", compute)


def energy(v: Any, k: Any, c: Any) -> Any:
    return 0.5 * (v[0] ** 2 + v[1] ** 2 + (v[2] - 1) ** 2 + k[0] ** 2 + k[1] ** 2 + c.B * k[2] ** 2)


def scene(**changes: Any) -> Scene:
    """A cantilever under a thrust P up to 1 that is right but for the changes."""
    good = {"name": "cantilever", "interval": (0.0, 1.0), "rod": "flexible", "energy": energy, "load": "P"}
    good |= {"ends": (clamped(), TIP), "ordinate": Ordinate("tip", 1.0, lambda r, q: 0.0), "span": (0.0, 1.0)}
    return Scene(**(good | {"parameters": {"P": Parameter(0.0), "B": Parameter(2.0)}} | changes))


def held(left: Any = None, right: Any = None) -> dict[str, Any]:
    return {"ends": (left or clamped(), right or free())}


def pushed(**named: Any) -> dict[str, Any]:
    return held(right=End(**({"force": lambda c: (0, 0, -c.P)} | named)))


def left(position: Any = (0, 0, 0), rotation: Any = (1, 0, 0, 0)) -> dict[str, Any]:
    return held(clamped(lambda c: position, rotation), TIP)


def numbers(**named: Any) -> dict[str, Any]:
    return {"parameters": {"P": 0.0, "B": 2.0} | named}


def tip(of: Any, s: Any = 1.0, name: Any = "tip", label: Any = "") -> dict[str, Any]:
    return {"ordinate": Ordinate(name, s, of, label)}


def stiff(b: Any, k: Any) -> Any:
    return bending_and_twist(k, (b, b, b))


def rigid(energy: Any) -> dict[str, Any]:
    return RIGID | {"energy": energy}


def hump(c: Any) -> Any:
    """Zero at both ends of the range, from 0 to 1, and not inside."""
    return c.P * (1 - c.P)


def turns(s: np.ndarray, count: int) -> np.ndarray:
    """So many turns about e2 in all."""
    return np.stack([np.cos(np.pi * count * s), 0 * s, np.sin(np.pi * count * s), 0 * s], axis=1)


ACROSS, ABOUT = (lambda c: (0.0, hump(c), 0.0)), (lambda c: (hump(c), 0.0, 0.0))
TURNED = sliding(lambda c: (0.0, 0.0, None), lambda c: (ufl.cos(hump(c)), ufl.sin(hump(c)), 0.0, 0.0))
FOLLOWS = held(right=free(follower=lambda c: (0.0, 0.0, -c.P)))
OFF_PLANE: list[tuple[dict[str, Any], str]] = [
    (held(right=free(force=lambda c: (0.0, c.P, 0.0))), "force on the right end pushes the rod out"),
    (held(right=End(moment=lambda c: (0.0, 1.0, c.P))), "moment on the right end pushes the rod out"),
    (held(clamped(rotation=(1.0, 0.0, 0.0, 1.0))), "leaves the plane across e2"),
    (held(right=clamped(lambda c: (0.0, 0.2, 0.9))), "held at 0 and 0.2 along e2"),
    ({"start": lambda s: np.stack([np.cos(s), np.sin(s), 0 * s, 0 * s], axis=1)}, "leaves the plane"),
    # at loads inside of the range alone
    (held(right=free(moment=ABOUT)), "moment on the right end pushes the rod out"),
    (held(right=free(follower_moment=ABOUT)), "follower moment on the right end pushes the rod out"),
    (held(right=free(follower=ACROSS)) | {"inertia": BEAM}, "follower force on the right end pushes the rod out"),
    ({"attachments": (Attachment(0.5, follower=ACROSS),), "inertia": BEAM}, "at s = 0.5 pushes the rod out"),
    ({"follower": ACROSS, "inertia": BEAM}, "distributed follower force pushes the rod out"),
    ({"distributed": lambda c: (0.0, hump(c) * (c.s - 0.5), 0.0)}, "distributed force pushes the rod out"),
    (held(right=TURNED), "rotation of the right end leaves the plane"),
    (held(right=clamped(lambda c: (0.0, hump(c), 1.0))), "held at 0 and 0.* along e2"),
    # energies that prefer one side of the plane; of a load without potential nothing else would tell
    ({"energy": lambda v, k, c: energy(v, k, c) + 1e-6 * c.P * k[0] * k[1]}, "stored energy pushes the rod out of its"),
    ({"potential": lambda x, c: c.P * x.r[1]} | FOLLOWS | {"inertia": BEAM}, "potential along the rod push"),
    (held(right=End(energy=lambda x, c: hump(c) * x.R[1, 2])), "energy of the right end pushes"),
]
"""Changes of a rod that is planar across e2."""

SCENES: list[tuple[dict[str, Any] | Callable[[], dict[str, Any]], str]] = [
    # names, numbers, pairs
    ({"title": 3}, "title is 3"),
    *(({"interval": x}, r"interval(\[\d\])? is") for x in (None, (1.0,), "01", {0.0, 1.0}, (0, 10**400))),
    ({"interval": (1.0, 0.0)}, "interval"),
    *(({"span": x}, r"span(\[\d\])? is") for x in ((True, False), (0, 1j))),
    ({"span": (0.3, 0.3)}, "empty"),
    ({"span": (1.0, 1.0 + 3e-16)}, "range of P from .* round-off"),
    ({"rod": ["unshearable"]}, "kind of rod"),
    ({"load": ["P"]}, "is not a parameter"),
    *((numbers(**{name: 1.0}), "cannot have the name") for name in ("lambda", "__class__", "a/b", "s")),
    *((numbers(B=x), "B is") for x in (True, 10**400, 1j, "1")),
    (numbers(B=Parameter(2.0, admissible=(3.0, 4.0))), "admissible"),
    (numbers(B=Parameter(2.0, admissible=(1.0, -1.0))), "give the lower bound first"),
    (numbers(B=-2.0), "not convex"),
    (lambda: numbers(B=Parameter(1.0, label=3)), "label is 3"),  # type: ignore[arg-type]
    (lambda: numbers(B=Parameter(1.0, "", (0,))), "admissible is"),  # type: ignore[arg-type]
    (lambda: numbers(B=Parameter("B", 1.0)), "value is 'B': give a number"),  # type: ignore[arg-type]
    ({"parameters": ["P", "B"]}, "give a dictionary"),
    ({"states": "branch 2.13"}, "'branch 2.13', a name which others are given: choose another"),
    ({"planar": "e3"}, "planar across 'e3'"),
    # kinds
    *(({"ends": x}, "not two of the kind End") for x in (iter(()), (clamped(),))),
    ({"constraints": at(0.5, lambda x, c: x.r[0])}, r"constraints=\(at\("),
    ({"attachments": Attachment(0.5, mass=1.0)}, r"attachments=\(Attachment\("),
    ({"breaks": 0.5}, r"breaks=\(0.5,\)"),
    ({"breaks": ("0.5",)}, "One of the breaks is"),
    ({"inertia": 1.0}, "inertia is 1.0: give one"),
    (lambda: {"attachments": (Attachment(True, mass=lambda c: 1.0),)}, "s is True"),
    (lambda: {"attachments": (Attachment(0.5),)}, r"Nothing is attached at s = 0.5: .*a mass.*breaks=\(0.5,\)"),
    ({"attachments": (Attachment(1.5, force=lambda c: ZERO),)}, "attachment at s = 1.5 is not on the rod"),
    ({"attachments": (Attachment(1 - 3e-9, force=lambda c: ZERO),)}, "the end at s = 1 are 3e-09 apart"),
    # what functions of the constants return
    *((left((x, 0, 0)), "component 1 of the position") for x in (NAN, "a", 1j, False, np.zeros(1))),
    *((left(x), "position of the left end") for x in ("abc", {0: 0, 1: 0, 2: 0}, {1, 2, 3}, 3)),
    *((left(rotation=x), "rotation of the left end") for x in ("1000", (1j, 0, 0, 0), (INF, 0, 0, 0))),
    (left(rotation=lambda c: (1j, 0, 0, 0)), "component 1 of the rotation"),
    (left(rotation=lambda c: (0, 0, 0, c.P)), "zero quaternion"),
    (held(clamped((0, 1))), "position of the left end has 2 components: give 3"),
    (held(clamped(3.0)), "position of the left end is 3.0: give a function"),
    *((pushed(force=lambda c, x=x: (0, 0, x)), "component 3 of the force") for x in (NAN, INF, 1j, None, "1")),
    (pushed(force=lambda c: (0, 0, 1 / (c.P - 1))), "force on the right end fails with ZeroDivision"),
    (pushed(force=lambda c: (0, 0, ufl.sqrt(0.1 - hump(c)))), "component 3 of the force on the right end"),
    (pushed(force=lambda c: exit(3)), "force on the right end fails with SystemExit"),
    (pushed(force=Parameter(1.0)), r"force on the right end is Parameter.*: give a function f\(c\)\."),
    ({"distributed": lambda c: (0, 1)}, "distributed force has 2"),
    # what is a number here is an expression in the equations
    (pushed(force=lambda c: (0, 0, math.cos(c.P))), "force on the right end fails with TypeError.*with UFL"),
    (left(rotation=lambda c: (np.cos(c.P), 0, 0, np.sin(c.P))), "rotation of the left end fails.*with UFL"),
    ({"inertia": Inertia(rho_A=lambda c: c.s - 0.2)}, "is negative"),
    ({"inertia": Inertia(rho_A=lambda c: 0.2 - hump(c))}, "of -0.0.* at P = 0.* is negative"),
    ({"attachments": (Attachment(0.5, mass=lambda c: 1 - 2 * c.P),)}, "of -1 at P = 1 is negative"),
    (FOLLOWS, "give it an inertia"),
    (FOLLOWS | {"inertia": Inertia(rho_A=lambda c: 1 - c.P)}, "give it an inertia at P = 1"),
    # what functions of a place return
    ({"potential": lambda x, c: x.r[0] > 0}, "is true or false"),
    ({"potential": lambda x, c: x.r}, "potential along the rod has the shape"),
    ({"potential": lambda x, c: x.z}, "potential along the rod asks for 'z' of a place: it has"),
    ({"potential": lambda x, c: loads.spring(x.r, (1, 2))}, "one number or three, not 2"),
    ({"constraints": (at(0.5, lambda x, c: x.k[0]),)}, "asks for 'k' of a place: it has"),
    ({"constraints": (at(0.5, lambda x, c: x.r),)}, "constraint has the shape"),
    (lambda: {"constraints": (everywhere(lambda x, c: x.k[0], strain="no"),)}, "strain is 'no'"),  # type: ignore[arg-type]
    # energies
    (rigid(lambda v, k, c: ufl.sqrt(ufl.dot(k, k))), "not finite"),
    (rigid(lambda v, k, c: bending_and_twist(k, (1, 1))), "three stiffnesses, not 2"),
    (rigid(lambda v, k, c: bending_and_twist(k, (1, 1e-13, 1))), "convex, but for round-off"),
    (rigid(lambda v, k, c: 1.0), "stored energy is flat"),
    (rigid(section.circle(1.0, E=1.0, nu=0.3)), r"is Section.*: give a function W.*, as section.energy\(rod\) is"),
    ({"energy": lambda v, k, c: k}, "energy has the shape"),
    ({"energy": lambda v, k, c: None}, "energy is None: return"),
    ({"parameters": {"P": 0.0}}, "^The stored energy asks for a constant 'B': add it"),
    (
        {"energy": lambda v, k, c: (1 - c.S) * k[0] ** 2},
        r"^The stored energy asks for a constant 'S': .*, or choose one of c\.B, c\.P, c\.s \(the arclength\)",
    ),
    ({"energy": lambda v, k, c: c["B"] * k[0] ** 2}, r"energy fails with TypeError.*subscriptable.*, as c\.P"),
    ({"energy": lambda v, k, c: c.s.x * k[0] ** 2}, r"'x'\\?\".*: v\[0\].* c\.s, numbers or expressions of UFL"),
    ({"energy": lambda v, k, c, s: (1 - s) * k[0] ** 2}, r"give W\(v, k, c\), where .* the arclength, c\.s"),
    # ordinate, start, springs
    *((tip(lambda r, q, x=x: x), "ordinate fails with TypeError") for x in ("a", "1", True, None, 1j, np.zeros(1))),
    (lambda: tip(lambda r, q: r), "ordinate fails with TypeError.*returns a number"),
    (lambda: tip(lambda r, q: r[0], name=3), "name is 3"),
    (lambda: tip(lambda r, q: r[0], label=None), "label is None"),
    (lambda: tip(lambda r, q: r[0], s=True), "s is True"),
    (lambda: tip(lambda r, q: r[0], s=2.0), "not on the rod"),
    *(({"start": lambda s, x=x: x}, "start fails with") for x in ("a", [[1, 0], [1]], np.full((5, 4), 1j))),
    ({"start": lambda s: (math.cos(s), 0.0, 0.0, 0.0)}, "start fails with TypeError.*array of arclengths"),
    ({"start": lambda s: np.zeros((4, len(s)))}, r"start has the shape \(4, 1001\)"),
    ({"start": lambda s: np.zeros((len(s), 4))}, "no rotation everywhere"),
    (lambda: held(right=elastic(lambda c: 1.0, anchor=(0, 0))), "anchor is"),  # type: ignore[arg-type]
    (lambda: held(right=elastic(None, lambda c: 1.0, directors=(0, 0, 0, 0))), "zero quaternion"),
    (held(right=elastic(lambda c: (1.0, -2.0, 0.0), force=lambda c: (0, 0, -c.P))), "of -2 pushes away"),
    # hinges, and clamps that contradict themselves
    *((held(right=hinged(x, lambda c: (0, 0, None))), "hinge of the right end") for x in ("abc", (1j, 0, 0))),
    (held(hinged(ZERO)), "no axis"),
    (held(End(position=lambda c: ZERO, hinge=(1.0, 0.0, 0.0))), "a hinge but no rotation"),
    (lambda: held(right=sliding_hinge((1, 0, 0), (NAN, 0, 1))), "direction in which a hinge slides"),
    # loads on what is held, forces that do no work
    (held(End(position=lambda c: ZERO, follower=lambda c: ZERO)), "whose position is held"),
    (held(right=End(rotation=(1.0, 0.0, 0.0, 0.0), moment=lambda c: ZERO)), "whose directors are held"),
    (held(right=replace(hinged((0.0, 0.0, 1.0)), moment=lambda c: (c.P, 0.0, 1.0))), "across the axis of"),
    (
        held(pinned(), pinned(lambda c: (0, 0, None), lambda c: (1 + c.P, 0, -c.P))),
        "A force acts on the right end in a direction in which its position is held",
    ),
    # nothing that holds, or nothing that gives way
    (held(*[pinned(lambda c: (0, 0, None))] * 2), "drift away along e3"),
    (held(free(), pinned(lambda c: (None, 0, 0))) | {"constraints": (integral(lambda x, c: x.k[2]),)}, "along e1"),
    (held(free(), TIP), "add up to .0.0, 0.0, -1.0., and nothing holds the rod against that"),
    (held(free(), free(lambda c: (0.0, 0.0, hump(c)))), "At P = 0.* add up to .* nothing holds the rod"),
    (RIGID | held(right=clamped(lambda c: (0, 0, 1.2))), "only 1 long"),
    (RIGID | held(right=clamped(lambda c: (0, 0, 0.5 + 4 * hump(c)))), "At P = .* only 1 long"),
    # rings
    ({"ends": Ring()}, "no straight start"),
    ({"ends": Ring(odd=False), "start": lambda s: turns(s, 1)}, r"Ring\(odd=True\)"),
    ({"ends": Ring(odd=True), "start": lambda s: turns(s, 2)}, r"Ring\(odd=False\)"),
    *((PLANE | change, words) for change, words in OFF_PLANE),
]


@pytest.mark.parametrize(("changes", "words"), SCENES)
def test_scenes(changes: Any, words: str, capfd: pytest.CaptureFixture[str]) -> None:
    """Also of what UFL's logger writes nothing is seen."""
    with pytest.raises(InputError, match=words) as raised:
        scene(**(changes() if callable(changes) else changes))
    assert "\n" not in str(raised.value) and str(raised.value).endswith(".")
    assert capfd.readouterr() == ("", "")


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
    (lambda: Discretization(elements=3, vertices=(0.0, 0.5)), "2 vertices"),
    (lambda: Discretization(factors="superglue"), "chain or petsc"),
    *((lambda x=x: Plan(accuracy=x), "between 1e-11 .round-off. and 0.1") for x in (0.0, -1e-6, 1e-20, 1.0, NAN, INF)),
]


@pytest.mark.usefixtures("stop")
@pytest.mark.parametrize(("make", "words"), PLANS)
def test_plans(make: Callable[[], Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        found = make()
        rodfem.trace(scene(**RIGID), *((None, found) if isinstance(found, Plan) else (found,)))


@pytest.mark.usefixtures("stop")
def test_arguments_of_functions(tmp_path: Path) -> None:
    ours = scene(**RIGID)
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
        scene(**rigid(lambda v, k, c: stiff(1.0, k) if k[0] > 0 else stiff(2.0, k)))
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


def flag(factor: Callable[[Any], Any] = lambda c: 1.0, on: float = 1.0, end: Any = None, **changes: Any) -> Scene:
    """Column under a thrust with a ``factor`` that depends on a constant ``on``."""
    ends = clamped(), free(lambda c: (0.0, 0.0, -c.P * factor(c)), energy=end)
    return column("flag", ends, (0.0, 6.0), constants={"on": on}, **changes)


IN_ITS_PLANE = lambda c: (ufl.cos(c.P), 1e-17 * c.P, ufl.sin(c.P), 0.0)  # noqa: E731
RIGHT: list[dict[str, Any]] = [
    {"name": "a b \N{GREEK SMALL LETTER LAMDA}"},
    {"interval": [0, np.int64(1)], "span": np.array([0.0, 3.0])},
    {"interval": (0, Fraction(1, 1))},
    {"breaks": (Fraction(1, 2),), "attachments": (Attachment(Fraction(1, 2), mass=Fraction(1, 3)),)},
    pushed(force=lambda c: (Fraction(0), np.float32(0), np.int64(0) - c.P)),
    left((Fraction(0), np.int64(0), 0), (Fraction(1), np.int64(0), 0, 0)),
    pushed(energy=lambda x, c: ufl.ln(x.d3[2] + 2)),
    left(np.zeros(3), np.array([2.0, 0, 0, 0])),
    {"potential": lambda x, c: loads.spring(x.r, np.ones(3))},
    {"inertia": Inertia(rho_A=lambda c: 1 - c.P)},  # which vanishes at an end of the range
    PLANE | {"potential": lambda x, c: c.P * (x.r[1] ** 2 * x.r[0] + x.R[1, 2] ** 2)},
    PLANE | held(*[clamped(lambda c: (0.0, c.P, 0.0))] * 2),
    PLANE | held(right=sliding(lambda c: (None, 0.0, None), IN_ITS_PLANE)),
    {"ends": (elastic(lambda c: 1.0), free())},
    {"ends": Ring(odd=False), "start": lambda s: turns(s, 2)},
    *({"rod": x} | held(right=clamped(lambda c: (0, 0, 1.2))) for x in ("flexible", "unshearable", "inextensible")),
]
"""Numbers of all kinds; rods that are free, closed, or pulled apart."""
ALIKE: list[dict[str, Any]] = [
    {"factor": lambda c: ufl.conditional(ufl.eq(c.on, 1), 1.0, 2.0)},
    {"factor": lambda c: ufl.conditional(ufl.lt(c.P, 1), 1.0, 2.0)},
    {"factor": lambda c: ufl.max_value(c.on, 0.5)},
    {"factor": (lambda twice: lambda c: twice(c.on))(lru_cache(lambda x: 2 * x))},
    {"factor": lambda c: (lambda x: ufl.diff(x**2 / 2, x))(ufl.variable(c.on))},
    {"end": lambda x, c: ufl.erf(x.r[0]) ** 2 + ufl.bessel_J(1, x.r[0])},
    {"end": lambda x, c: ufl.ln(x.r[2])},
    {"attachments": (Attachment(0.5, force=lambda c: (0.0, 0.0, -c.P if c.s == 0.5 else 0.0)),)},
]
"""Functions that are one as expressions: UFL's conditions, a cache, a derivative, what UFL does not evaluate."""


@pytest.mark.parametrize(("make", "changes"), [*((scene, x) for x in RIGHT), *((flag, x) for x in ALIKE)])
def test_what_is_no_mistake(make: Callable[..., Scene], changes: dict[str, Any]) -> None:
    assert make(**changes).load == "P"


@pytest.mark.usefixtures("stop")
def test_numbers_are_floats() -> None:
    """UFL knows no fractions and no numbers of numpy, and JSON none of the former."""
    rod = scene(**numbers(B=Fraction(1, 3)), breaks=(np.float32(0.5),), distributed=lambda c: np.array([0, 0, 1]))
    asked = Plan(accuracy=Fraction(1, 1000), locus=("B", Fraction(1, 4), np.int64(1)))
    steps = StepControl(largest=Fraction(1, 10))
    found = [rod.parameters["B"].value, *rod.breaks, *rod.distributed(rod.constants()), *asked.locus[1:], steps.largest]
    assert all(isinstance(x, float) for x in (*found, asked.accuracy))
    with pytest.raises(Computed):
        rodfem.trace(rod, Discretization(elements=np.int64(4)), Plan(depth=np.int64(1)))
    force = pushed(force=(Fraction(1, 3), np.int64(0), 0))
    assert scene(**force, distributed=lambda c: (0, 0, -c.P)).ends[1].force(None) == (1 / 3, 0.0, 0)


def test_parameters_that_nothing_feels() -> None:
    rod = scene(**numbers(G=1.0))
    for load, locus, words in (("G", None, "depends on its load 'G'"), ("P", ("G", 0.0, 2.0), "depends on 'G'")):
        with pytest.raises(InputError, match=words):
            Plan((0.0, 1.0), locus=locus).check(rod.varying(load, (0.0, 1.0)))
    with pytest.raises(SceneError, match="'x' is not a parameter"):
        rod.varying(x=1.0)


@pytest.mark.long
@pytest.mark.short
def test_a_rod_squeezed_to_nothing() -> None:
    """The energy is written in v3, not in v3 - 1: without a load the rod has no length."""
    rod = scene(energy=lambda v, k, c: ufl.dot(v, v) + ufl.dot(k, k))
    with pytest.raises(SceneError, match=r"squeezed to a stretch.*v\[2\] - 1"):
        rodfem.trace(rod, Discretization("reduced", 4, 2), Plan(error_bars=False))


def test_a_plan_of_another_range_is_checked_over_it() -> None:
    """A mass is positive up to P = 2: the scene ends before, a plan after."""
    rod = scene(inertia=Inertia(rho_A=lambda c: 2 - c.P))
    Plan((0.0, 2.0)).check(rod)
    with pytest.raises(SceneError, match="of -1 at P = 3 is negative"):
        Plan((0.0, 3.0)).check(rod)
    Plan((0.5, 1.0)).check(scene(inertia=rod.inertia, span=(0.0, 2.0)))


def test_a_start_of_any_size_is_a_rotation() -> None:
    s, start = np.linspace(0, 1, 5), scene(start=lambda s: 1e9 * turns(s, 1)).start
    assert start is not None and start(s) == pytest.approx(turns(s, 1), abs=1e-15)


@pytest.mark.few(1)
@pytest.mark.parametrize(
    ("change", "what"),
    [
        ({"distributed": lambda c: (0, 0, c.P)}, "a distributed force"),
        ({"potential": lambda x, c: x.r[0] ** 2}, "the potential along the rod"),
        ({"attachments": (Attachment(0.5, force=lambda c: (0, 0, c.P)),)}, "what is attached along the rod"),
        ({"constraints": (at(0.5, lambda x, c: x.r[0]),)}, "the constraint"),
        (FOLLOWS | {"inertia": BEAM}, "a load without potential"),
    ],
)
def test_no_centreline(change: dict, what: str) -> None:
    with pytest.raises(InputError, match=f"{what} needs one: use Discretization.formulation=.pointwise.."):
        Fields(scene(**change), Discretization("reduced", 4, 3))
    assert Fields(scene(**change), Discretization("auto", 4, 3)).discretization.formulation == "pointwise"


def test_fewer_elements_than_pieces() -> None:
    with pytest.raises(InputError, match=r"5 pieces between joints.*use more than 4 elements"):
        Fields(scene(breaks=(0.1, 0.2, 0.3, 0.4)), Discretization("auto", 4, 3))


def raising(*_: object) -> Any:
    return 1 / 0


STATED = [End, SlidingHinge, Attachment, Constraint, Integral, Inertia, Ordinate, Scene]
EVERY = {
    (owner, f.name)
    for owner in STATED
    for f in fields(owner)
    if any(word in str(f.type) for word in ("Callable", "Given", "OfPlace"))
}
"""Dataclasses of a scene with their fields that are annotated as functions."""


def with_function(owner: type, name: str) -> Scene:
    """A scene with a function that raises in one field of one of its parts."""
    given: dict[str, Any] = {name: raising}
    if owner in (End, SlidingHinge):
        moving, end = clamped(rotation=lambda c: (1, 0, 0, 0)), owner(**given)
        return scene(ends=(end, moving) if "tion" in name else (clamped(), end))
    parts: dict[type, Callable[[], dict[str, Any]]] = {
        Inertia: lambda: {"inertia": Inertia(**given)},
        Ordinate: lambda: {"ordinate": Ordinate("nothing", 0.0, raising)},
        Attachment: lambda: {"attachments": (Attachment(0.5, **given),)},
        Constraint: lambda: {"constraints": (at(0.5, raising),)},
        Integral: lambda: {"constraints": (integral(**({"of": lambda x, c: x.k[2]} | given)),)},
        Scene: lambda: given,
    }
    return scene(**parts[owner]())


@pytest.mark.parametrize(("owner", "name"), sorted(EVERY, key=str))
def test_no_function_of_a_scene_is_forgotten(owner: type, name: str) -> None:
    """Whatever a dataclass of a scene takes as a function may raise: that is a sentence, and names the function."""
    with pytest.raises(SceneError, match=r"^The .* fails with ZeroDivisionError, 'division by zero'"):
        with_function(owner, name).ordinate.of(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))


@pytest.mark.long
@pytest.mark.short
def test_constraints_that_repeat_each_other() -> None:
    """Named where no first equilibrium can be found: twice the same one, and one on what an end holds."""
    tip, twice, foot = (at(s, lambda x, c, n=n: n * x.r[1]) for s, n in ((1.0, 1), (1.0, 2), (0.0, 1)))
    for constraints, words in (
        ((tip, twice), "constraint 1 of the scene and constraint 2"),
        ((foot,), "constraint 1 of the scene"),
    ):
        with pytest.raises(SceneError, match=f"depend on one another .{words}"):
            rodfem.trace(scene(constraints=constraints), Discretization("pointwise", 4, 6), Plan(error_bars=False))


# --- functions that take another branch for expressions than for numbers

OTHER = "as a function of numbers and .* as an expression of its constants"
SOFT, STIFF = (1.0, 1.0, 1.0), (9.0, 9.0, 9.0)
SWITCHED: list[tuple[dict[str, Any], str]] = [
    ({"factor": lambda c: 1 if c.on == 1 else 2}, rf"^The force on the right end is -6 {OTHER}.*ufl\.conditional"),
    ({"factor": lambda c: 1 if c.on in (1, 2) else 2}, OTHER),
    ({"factor": lambda c: 1 if c.on else 2, "on": 0.0}, OTHER),
    ({"factor": lambda c: {1.0: 1.0}.get(c.on, 3.0)}, OTHER),
    ({"factor": lambda c: {1.0: 1.0}[c.on]}, "KeyError, 'c.on'"),
    ({"factor": lambda c: 1 if 2 * c.on == 2 else 2}, rf"is -6 {OTHER.replace('.*', '-12')}, at P = 6"),
    ({"factor": lambda c: {6.0: 2.0}.get(c.P, 1.0)}, OTHER),
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
]


@pytest.mark.parametrize(("changes", "words"), SWITCHED)
def test_a_branch_by_the_value_of_a_constant(changes: dict[str, Any], words: str) -> None:
    """The first gave half of Euler's load with the bar 9e-12, the one by a dictionary a third of it."""
    with pytest.raises(SceneError, match=words):
        flag(**changes)
