"""Design: constants, and fields along the rod, that make a rod carry most.

The first critical loads of a rod are found once, and again near by as its numbers change
(:mod:`rodfem.codim2.neighbours`).  The *first loss* is the least of them, which has a kink where two meet: what is best
is often there, as of the strongest column between clamps (Olhoff & Rasmussen, Int. J. Solids Struct. 13 (1977)
605-614).  The bound formulation is smooth: make ``t`` largest of all with ``t <= P_i(a)`` for each of the first loads
``P_i`` of the numbers ``a`` (Bendsoe, Olhoff & Taylor, J. Struct. Mech. 11 (1983) 523-544).  Sequential quadratic
programming solves it, by scipy, with the derivatives of all loads.  The rod that it ends with is traced: if another
load is first there, it begins once more with that.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np

from rodfem.codim2.neighbours import Neighbours, gradient
from rodfem.continuation.branch import SpecialPoint
from rodfem.continuation.kinds import FOLD
from rodfem.diagram.diagram import MESH, PLAN, Diagram, trace
from rodfem.diagram.plan import Plan
from rodfem.diagram.solver import SCENE
from rodfem.errors import ConvergenceError, InputError
from rodfem.fem.fields import Discretization
from rodfem.problem.arguments import checked, whole
from rodfem.problem.field import Field, names, with_fields
from rodfem.problem.functions import derived
from rodfem.problem.scene import Scene
from rodfem.tolerances import unit

FIRST_LOSS = "first loss"
ROUNDS = 6
"""Times that an optimiser begins, at most, with the loads that are first where it ended."""
MOVES = 20
"""Times that it goes on from where it is, at most."""
SAME = 1e-6
"""Part of the first loss by which that of the diagram may be less."""
ENDED = 1e-9  # change of the aim, over its size, at which the optimiser ends
SLOPE = 1e-5  # step of the differences of a person's function of the loads, over their size
Loads = Callable[[np.ndarray], float]


@dataclass(frozen=True, repr=False)
class Design:
    """A rod that is best: its ``scene``, the numbers of each of its fields and constants, and the first ``loads``.

    ``diagram`` is that of the scene, with error bars, which says that it loses its stability there.  ``reached`` says
    whether the optimiser ended by itself, ``message`` how.
    """

    scene: Scene
    fields: dict[str, Field]
    numbers: dict[str, np.ndarray]
    loads: np.ndarray
    diagram: Diagram
    reached: bool
    message: str

    @property
    def load(self) -> float:
        """Load of the first loss."""
        return float(self.loads.min())

    def along(self, name: str, s: Sequence[float] | np.ndarray) -> np.ndarray:
        """A field at arclengths (m,)."""
        t = (np.asarray(s, dtype=float) - self.scene.interval[0]) / self.scene.length
        return self.fields[name].at(self.numbers[name], t)

    def __repr__(self) -> str:
        return f"<Design: first loss at {self.load:.8g}, {self.message}>"


@checked(scene=SCENE, plan=PLAN, discretization=MESH, loads=whole(3, 1))
def design(
    scene: Scene,
    fields: Mapping[str, Field],
    maximise: str | Loads = FIRST_LOSS,
    loads: int = 3,
    plan: Plan | None = None,
    discretization: Discretization | None = None,
) -> Design:
    """Fields in the place of constants of a ``scene`` for which its first branch stays stable longest.

    ``fields`` are :class:`~rodfem.Field` by the name of the constant, as in ``{"A": Field(9, bounds=(0.1, 3.0),
    mean=1.0)}``: numbers along the rod with bounds, and a mean, where a volume is given.  ``maximise`` is the "first
    loss", or a function of the first critical loads (k,), in order, as ``lambda P: -(P[0] - 5.0) ** 2`` for a rod that
    buckles at 5.  So many ``loads`` of the first branch, at which its index grows, take part; the range of the scene,
    or of the ``plan``, has them.  By default the ``discretization`` has two elements for each number.  Raises
    :class:`~rodfem.errors.InputError` for what is no constant, or no critical load in the range, and
    :class:`~rodfem.errors.ConvergenceError` where the loads are lost on the way.
    """
    _check(fields, maximise)
    mesh = discretization or Discretization(elements=max([8, *(2 * len(f.breaks) + 2 for f in fields.values())]))
    search = _Search(with_fields(scene, fields), fields, maximise)
    plan, first = replace(plan or Plan(depth=0), error_bars=False), -np.inf
    for _ in range(ROUNDS):
        rod = search.rod()
        points = losses(trace(rod, mesh, plan), loads)
        if not points:
            low, high = plan.over(scene)
            raise InputError(f"The first branch loses no stability from {low:g} to {high:g}: give a wider range.")
        now = search.value(np.array([special.point.load for special in points]))
        if now >= first - SAME * unit(first, one=1.0) and np.isfinite(first):
            break
        first = search.run(Neighbours(points))
    diagram = trace(rod, mesh, replace(plan, error_bars=True))
    final = np.array([special.point.load for special in losses(diagram, loads) for _ in special.null_vectors])
    own = {name: np.array([rod.parameters[n].value for n in names(name, f)]) for name, f in fields.items()}
    return Design(rod, dict(fields), own, final, diagram, search.reached, search.message)


def _check(fields: Mapping[str, Field], maximise: str | Loads) -> None:
    if maximise != FIRST_LOSS and not callable(maximise):
        raise InputError(f"maximise is {maximise!r}: give 'first loss', or a function of the first critical loads.")
    if not fields or not all(isinstance(field, Field) for field in fields.values()):
        raise InputError(f"fields is {fields!r}: give them by name, as in fields={{'A': Field(9, mean=1.0)}}.")


def losses(diagram: Diagram, number: int) -> list[SpecialPoint]:
    """First special points of the first branch at which its index grows, up to the first fold."""
    found = list[SpecialPoint]()
    for special in diagram[0].special:
        if special.kind.singular and special.negative_after > special.negative_before:
            found.append(special)
            if special.kind == FOLD:
                break
    return found[:number]


class _Search:
    """Numbers of the fields of a scene, and how an optimiser changes them."""

    def __init__(self, scene: Scene, fields: Mapping[str, Field], maximise: str | Loads) -> None:
        self.scene, self.maximise, self.reached, self.message = scene, maximise, False, ""
        self.names = [n for name, field in fields.items() for n in names(name, field)]
        self.numbers = np.array([scene.parameters[n].value for n in self.names])
        self.bounds = [field.bounds for field in fields.values() for _ in field.groups]
        ends = np.cumsum([0, *(len(field.groups) for field in fields.values())])
        self.volumes = [
            (field, slice(*pair)) for field, pair in zip(fields.values(), pairwise(ends.tolist()), strict=True)
        ]

    def rod(self) -> Scene:
        """The scene with these numbers."""
        return self.scene.varying(**dict(zip(self.names, self.numbers.tolist(), strict=True)))

    def value(self, loads: np.ndarray) -> float:
        """What is made largest."""
        return float(loads.min() if self.maximise == FIRST_LOSS else self.maximise(np.sort(loads)))  # type: ignore[operator]

    def run(self, near: Neighbours) -> float:
        """Improve the numbers, with critical loads ``near`` those of the rod; the value that is reached.

        They move by a share of themselves at a time, which is halved if the loads are lost.
        """
        share, value = 0.5, self.value(self._loads(near, self.numbers)[0])
        for _ in range(MOVES):
            before = value
            try:
                value = self._improve(near, share)
            except ConvergenceError as trouble:
                self.reached, self.message, share = False, str(trouble), share / 2
                continue
            if value - before <= SAME * unit(before, one=1.0):
                break
        return value

    def _improve(self, near: Neighbours, share: float) -> float:
        """The same within a ``share`` of the numbers."""
        from scipy.optimize import minimize

        n, begin = len(self.names), self._loads(near, self.numbers)[0]
        size, extra = float(abs(begin).max()), int(self.maximise == FIRST_LOSS)
        room = share * np.maximum(abs(self.numbers), abs(self.numbers).mean())
        low, high = (np.clip(self.numbers + side * room, *np.transpose(self.bounds)) for side in (-1, 1))
        answer = minimize(
            partial(self._aim, near, size),
            np.append(self.numbers, [begin.min() / size] * extra),
            jac=True,
            method="SLSQP",
            bounds=[*zip(low, high, strict=True), *[(None, None)] * extra],
            constraints=[*self._volumes(), *([self._bound(near, size)] if extra else [])],
            options={"maxiter": 200, "ftol": ENDED},
        )
        self.numbers, self.reached, self.message = answer.x[:n], bool(answer.success), str(answer.message)
        return self.value(self._loads(near, self.numbers)[0])

    def _loads(self, near: Neighbours, numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Critical loads (k,), and their derivatives (k, n)."""

        def make() -> tuple[np.ndarray, np.ndarray]:
            found = near.at(dict(zip(self.names, numbers.tolist(), strict=True)))
            return np.array([x.load for x in found]), np.array([gradient(x, self.names) for x in found])

        return derived(near, numbers.tobytes(), make)

    def _aim(self, near: Neighbours, size: float, z: np.ndarray) -> tuple[float, np.ndarray]:
        """What is made least, and its derivatives: minus the bound ``t``, or minus a person's function of the loads."""
        n = len(self.names)
        if len(z) > n:
            return -float(z[n]), -np.eye(n + 1)[n]
        loads, slopes = self._loads(near, z)
        steps = SLOPE * size * np.eye(len(loads))
        parts = [(self.value(loads + step) - self.value(loads - step)) / (2 * step.max()) for step in steps]
        return -self.value(loads), -np.array(parts) @ slopes

    def _bound(self, near: Neighbours, size: float) -> dict[str, Any]:
        """Each load is ``t`` at least."""
        n = len(self.names)

        def slopes(z: np.ndarray) -> np.ndarray:
            found = self._loads(near, z[:n])[1] / size
            return np.column_stack([found, -np.ones(len(found))])

        return {"type": "ineq", "fun": lambda z: self._loads(near, z[:n])[0] / size - z[n], "jac": slopes}

    def _volumes(self) -> list[dict[str, Any]]:
        """Means of the fields."""

        def slopes(field: Field, own: slice, z: np.ndarray) -> np.ndarray:
            row = np.zeros(len(z))
            row[own] = field.volume(z[own])[1]
            return row

        return [
            {
                "type": "eq",
                "fun": lambda z, field=field, own=own: field.volume(z[own])[0] - field.mean,
                "jac": partial(slopes, field, own),
            }
            for field, own in self.volumes
            if field.mean is not None
        ]
