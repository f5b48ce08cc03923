"""Derivatives of critical loads and of ordinates, of all recorded scenes, against differences of what is located."""

from collections.abc import Callable, Iterator

import pytest
from golden_cases import NOT_CONSERVATIVE, cases, distinct, trace

import rodfem
from rodfem import Diagram, Plan, Point, SpecialPoint
from rodfem.codim2.adjoint import restoration
from rodfem.codim2.neighbours import Neighbours
from rodfem.continuation.kinds import DIVERGENCE, FLUTTER
from rodfem.errors import ConvergenceError
from rodfem.fem.state import line

SIXTH = ((-3, -1 / 60), (-2, 3 / 20), (-1, -3 / 4), (1, 3 / 4), (2, -3 / 20), (3, 1 / 60))
"""Places and weights of the central difference of the sixth order."""
STEP, SHORT = 1e-3, 3e-4
"""Of a constant, relative: of a critical load; of one of several modes, which part, and of a state."""
CHOICE = ("demo hemitropic", "demo ring", "classic tip spring", "classic in a plane")
IMPERFECTIONS = {"classic michell": {"B1", "B2"}}
"""Constants that take branch points apart: two stiffnesses of a ring under twist, which have to be one."""


def difference(of: Callable[[float], float], value: float, step: float = STEP) -> float:
    """Derivative at a ``value``."""
    h = step * (abs(value) or 1.0)
    return sum(weight / h * of(value + place * h) for place, weight in SIXTH)


def located(special: SpecialPoint, name: str) -> Callable[[float], float]:
    """Load of the special point of rods with another constant: the singular system solved again, or a diagram."""
    scene = special.point.own_solver.system.scene
    if special.kind.singular:
        near = Neighbours([special])
        return lambda value: near.at({name: value})[0].load

    def load(value: float) -> float:
        found = rodfem.trace(scene.varying(**{name: value}), plan=Plan(depth=0, error_bars=False))
        return min((s.point.load for s in found.special(str(special.kind))), key=lambda x: abs(x - special.point.load))

    return load


def ordinate(point: Point, name: str) -> Callable[[float], float]:
    """Ordinate of the state at its load, of rods with another constant."""
    solver = point.own_solver
    scene = solver.system.scene
    known = {n: p.value for n, p in scene.parameters.items()}

    def of(value: float) -> float:
        with restoration(solver.system):
            solver.system.line = line(scene, {**known, name: value, scene.load: 0.0}, {scene.load: 1.0})
            x, outcome = solver.at_load(point.x, point.load)
            assert outcome.converged
            return solver.shape.ordinate(x)

    return of


def states(diagram: Diagram) -> Iterator[Point]:
    """The state of each branch farthest from the critical loads, none of a branch that ends next to one."""
    critical = [s.point.load for branch in diagram.branches for s in branch.special if s.kind.singular]

    def distance(point: Point) -> float:
        return min((abs(point.load - load) for load in critical), default=1.0)

    for branch in diagram.branches:
        point = max(branch.points[:-1], key=distance)
        if distance(point) > 0.02 * max(1.0, abs(point.load)):
            yield point


def marked(name: str) -> object:
    return pytest.param(name, marks=[] if name in CHOICE else [pytest.mark.long])


@pytest.mark.parametrize("name", [marked(name) for name in distinct()])
def test_derivatives_are_differences(name: str) -> None:
    """To 1e-8, or within the bars; what has none is an imperfection."""
    diagram, none = trace(cases()[name]()), set()
    scene = diagram.scene
    kinds = [s for b in diagram.branches for s in b.special if s.kind.singular or s.kind in (FLUTTER, DIVERGENCE)]
    for constant in (x for x in scene.parameters if x != scene.load):
        value = scene.parameters[constant].value
        for special in kinds:
            if special.kind == FLUTTER and not value:
                continue  # no rod has less than no mass
            try:
                found = special.derivative(constant)
            except ConvergenceError as trouble:
                assert "is an imperfection" in str(trouble)
                none.add(constant)
                continue
            step = SHORT if special.multiplicity > 1 else STEP
            slope = difference(located(special, constant), value, step)
            assert abs(found.value - slope) <= found.error + 1e-8 * max(1.0, abs(slope)), (constant, special)
        for point in states(diagram) if name not in NOT_CONSERVATIVE else ():
            try:
                found = point.derivative(constant)
            except ConvergenceError:
                continue  # all states are at one load
            slope = difference(ordinate(point, constant), value, SHORT)
            assert abs(found.value - slope) <= found.error + 1e-8 * max(1.0, abs(slope)), (constant, point)
    assert none == IMPERFECTIONS.get(name, set())
