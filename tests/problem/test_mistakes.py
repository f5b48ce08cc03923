"""Mistakes in Python: each is refused in one sentence that names it, before anything is computed."""

import math
from collections.abc import Callable
from fractions import Fraction
from logging import getLogger
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import ufl

import rodfem
from rodfem import (
    Attachment,
    Discretization,
    End,
    Event,
    IndexStepControl,
    Inertia,
    Ordinate,
    Parameter,
    Plan,
    Scene,
    StepControl,
    at,
    clamped,
    elastic,
    everywhere,
    free,
    hinged,
    integral,
    pinned,
    section,
    sliding_hinge,
)
from rodfem.diagram import solver
from rodfem.errors import InputError, SceneError
from rodfem.forms import loads
from rodfem.forms.energy import bending_and_twist

NAN, INF, HUGE, TINY = math.nan, math.inf, 1e308, 1e-320
TIP = free(force=lambda c: (0, 0, -c.P))


class Computed(Exception):
    """The system of a scene was about to be set up."""


@pytest.fixture(autouse=True)
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
    ({"interval": (0.0, 1e200)}, "A rod from 0 to 1e.200"),
    ({"interval": (1e16, 1e16 + 2), "ordinate": Ordinate("tip", 1e16, lambda r, q: 0.0)}, "short for its arclengths"),
    *(({"span": x}, r"span(\[\d\])? is") for x in ((True, False), (0, 1j))),
    *(({"span": x}, "range of P from .* round-off") for x in ((0, TINY), (1.0, 1.0 + 3e-16), (-HUGE, HUGE))),
    ({"rod": ["unshearable"]}, "kind of rod"),
    ({"load": ["P"]}, "is not a parameter"),
    *((numbers(**{name: 1.0}), "cannot have the name") for name in ("lambda", "__class__", "a/b")),
    *((numbers(B=x), "B is") for x in (True, 10**400, 1j, "1")),
    (lambda: numbers(B=Parameter(1.0, label=3)), "label is 3"),  # type: ignore[arg-type]
    (lambda: numbers(B=Parameter(1.0, "", (0,))), "admissible is"),  # type: ignore[arg-type]
    (numbers(B=TINY) | {"energy": lambda v, k, c: stiff(c.B, k)}, "stiffness of"),
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
    ({"inertia": Inertia(rho_A=lambda c: TINY)}, "no floats"),
    # what functions of a place return
    *(({"potential": lambda x, c, z=z: z * x.r[0]}, "potential along the rod has .* in it") for z in (NAN, INF, 1j)),
    ({"potential": lambda x, c: x.r[0] > 0}, "is true or false"),
    ({"constraints": (at(0.5, lambda x, c: NAN * x.r[0]),)}, "has nan in it"),
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
    (lambda: Plan((0, TINY)), "as narrow as round-off"),
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
    (lambda: control(largest="0.1"), "largest is '0.1': give a number, as in largest=0.1"),
    (lambda: control(most=0), "most is 0: a branch has at least one point"),
    (lambda: Plan(at=0.5), "at is 0.5: give a tuple of numbers"),  # type: ignore[arg-type]
    (lambda: Plan(depth=-1), "-1 is not a depth"),
    (lambda: Plan(locus=("A", 0, "b")), r"locus\[1:\]\[1\] is .b.: give a number"),  # type: ignore[arg-type]
    (lambda: Plan(steps=0.1), r"steps is 0.1: give StepControl"),  # type: ignore[arg-type]
    (lambda: Discretization(8, 6), "formulation 8: choose .*, and give numbers by name, as in elements=8, degree=6"),  # type: ignore[arg-type]
    (lambda: Discretization(elements=2, vertices=(0.0, 1e-300, 1.0)), "must ascend"),
    (lambda: Discretization(elements=2, vertices=(0.0, 0.5, 2.0)), "must begin and end at 0 and 1"),
]


@pytest.mark.parametrize(("make", "words"), PLANS)
def test_plans(make: Callable[[], Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        found = make()
        rodfem.trace(scene(), *((None, found) if isinstance(found, Plan) else (found,)))


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
    assert given.sides[0].held(c) == [0, 0, 0] and given.sides[1].force(c) == (0, 0, 1.0)
    assert given.inertia.rho_A(c) == given.attachments[0].mass(c) == 2.0 and given.has_inertia
    assert given.distributed(c) == (0.0, 0.0, 1.0) and given.constraints[0].equals(c) == 0.1
    slides = sliding_hinge((1, 0, 0), (0, 0, 2.0), force=3.0)
    assert scene(ends=(clamped(), slides)).sides[1].force(c) == (0.0, 0.0, 3.0)


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
