"""Design: fields along a rod for which it carries most.

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
from itertools import chain, pairwise
from typing import Any
from warnings import catch_warnings, filterwarnings

import numpy as np

from rodfem.codim2.neighbours import Neighbours, losses
from rodfem.diagram.diagram import Diagram, trace
from rodfem.diagram.plan import Plan
from rodfem.diagram.solver import SCENE
from rodfem.errors import ConvergenceError, InputError
from rodfem.fem.fields import Discretization
from rodfem.problem.arguments import checked
from rodfem.problem.field import Field, names, with_fields
from rodfem.problem.functions import derived
from rodfem.problem.scene import Scene
from rodfem.tolerances import unit

FIRST_LOSS = "first loss"
LOADS, ROUNDS, MOVES = 3, 6, 20
"""Critical loads that take part, times that an optimiser begins with those that are first, and that it goes on."""
SAME = 1e-6
"""Part of an aim by which two are the same."""
Loads = Callable[[np.ndarray], float]


@dataclass(frozen=True, repr=False)
class Design:
    """A rod that is best: its ``scene``, the ``numbers`` of each of its ``fields``, and the first ``loads``, in order.

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
        return np.asarray(self.fields[name].table(t) @ self.numbers[name])

    def __repr__(self) -> str:
        return f"<Design: first loss at {self.load:.8g}, {self.message}>"


@checked(scene=SCENE)
def design(
    scene: Scene,
    fields: Mapping[str, Field],
    maximise: str | Loads = FIRST_LOSS,
    subject_to: Sequence[Any] = (),
    **of_trace: Any,
) -> Design:
    """Fields in the place of constants of a ``scene`` for which its first branch stays stable longest.

    ``fields`` are :class:`~rodfem.Field` by the name of the constant, as in ``{"A": Field(9, bounds=(0.1, 3.0),
    mean=1.0)}``: numbers along the rod with bounds, and a mean, where a volume is given.  ``maximise`` is the "first
    loss", or a function of the first critical loads (k,), in order, as ``lambda P: -(P[0] - 5.0) ** 2`` for a rod that
    buckles, or snaps, at 5.  Three loads take part at which the index of the first branch grows, or as many as there
    are in the range of the scene, or of the plan, up to the first fold.  ``subject_to`` has functions of these loads
    that are not to be negative, as ``lambda P: P[1] - 1.2 * P[0]``, and scipy's ``LinearConstraint`` or
    ``NonlinearConstraint`` on the numbers of all fields, in order.  ``of_trace`` are ``plan`` and ``discretization`` of
    :func:`~rodfem.trace`, by default with two elements for each number.  Raises :class:`~rodfem.errors.InputError` for
    what is no constant, a load without potential and no critical load, :class:`ConvergenceError` where loads are lost.
    """
    _check(fields, maximise)
    mesh = Discretization(elements=max(8, *(2 * field.pieces for field in fields.values())))
    how = dict[str, Any](discretization=mesh, plan=Plan(depth=0)) | of_trace
    plan, search = how["plan"], _Search(with_fields(scene, fields), dict(fields), maximise, subject_to)
    reached = -np.inf
    for _ in range(ROUNDS):
        points = losses(trace(search.rod, **how | {"plan": replace(plan, error_bars=False)})[0], LOADS)
        if not points:
            low, high = plan.load_range(scene)
            raise InputError(f"The first branch loses no stability from {low:g} to {high:g}: give a wider range.")
        if search.aim(np.array([special.point.load for special in points])) >= reached - SAME * abs(reached) > -np.inf:
            break
        reached = search.run(Neighbours(points))
    return search.answer(trace(search.rod, **how | {"plan": replace(plan, error_bars=True)}))


def _check(fields: Mapping[str, Field], maximise: str | Loads) -> None:
    """Raise :class:`InputError` for another aim, and for what are no fields."""
    if maximise != FIRST_LOSS and not callable(maximise):
        raise InputError(f"maximise is {maximise!r}: give 'first loss', or a function of the first critical loads.")
    if not fields or not all(isinstance(field, Field) for field in fields.values()):
        raise InputError(f"fields is {fields!r}: give them by name, as in fields={{'A': Field(9, mean=1.0)}}.")


class _Search:
    """Numbers of the fields of a scene, and how an optimiser changes them."""

    def __init__(
        self, scene: Scene, fields: dict[str, Field], maximise: str | Loads, subject_to: Sequence[Any]
    ) -> None:
        self.scene, self.fields, self.reached, self.message = scene, fields, False, ""
        self.subject_to = subject_to
        self.bound = maximise == FIRST_LOSS
        self.aim: Loads = (lambda loads: float(loads.min())) if self.bound else maximise  # type: ignore[assignment]
        own = [names(name, field) for name, field in fields.items()]
        self.names = [*chain(*own)]
        self.numbers = np.array([scene.parameters[n].value for n in self.names])
        self.limits = np.repeat([field.bounds for field in fields.values()], [*map(len, own)], axis=0)
        self.own = [slice(*pair) for pair in pairwise(np.cumsum([0, *map(len, own)]).tolist())]
        self.means = [(f, own) for f, own in zip(fields.values(), self.own, strict=True) if f.mean is not None]

    @property
    def rod(self) -> Scene:
        """The scene with these numbers."""
        return self.scene.varying(**dict(zip(self.names, self.numbers.tolist(), strict=True)))

    def answer(self, diagram: Diagram) -> Design:
        """The best rod, with its ``diagram``."""
        loads = [special.point.load for special in losses(diagram[0], LOADS) for _ in special.null_vectors]
        numbers = {name: self.numbers[own] for name, own in zip(self.fields, self.own, strict=True)}
        return Design(diagram.scene, self.fields, numbers, np.sort(loads), diagram, self.reached, self.message)

    def run(self, near: Neighbours) -> float:
        """Improve the numbers, with critical loads ``near`` those of the rod; the aim that is reached.

        They move by a share of themselves at a time, which is halved if the loads are lost.
        """
        share, value = 0.5, self.aim(self._loads(near, self.numbers)[0])
        for _ in range(MOVES):
            before = value
            try:
                value = self._improve(near, share)
            except ConvergenceError as trouble:
                self.reached, self.message, share = False, str(trouble), share / 2
                continue
            if value - before <= SAME * unit(before, one=SAME):
                break
        return value

    def _improve(self, near: Neighbours, share: float) -> float:
        """The same within a ``share`` of the numbers."""
        from scipy.optimize import minimize

        n, begin = len(self.names), self._loads(near, self.numbers)[0]
        size, extra = float(abs(begin).max()), int(self.bound)
        room = share * np.maximum(abs(self.numbers), abs(self.numbers).mean())
        low, high = (np.clip(self.numbers + side * room, *self.limits.T) for side in (-1, 1))
        held, k = partial(self._held, near, size), len(begin) * extra
        with catch_warnings():
            filterwarnings("ignore", "Values in x were outside bounds")  # by round-off: scipy takes the bounds
            answer = minimize(
                partial(self._least, near, size),
                np.append(self.numbers, [begin.min() / size] * extra),
                jac=True,
                method="SLSQP",
                bounds=[*zip(low, high, strict=True), *[(None, None)] * extra],
                constraints=[
                    *(
                        {"type": kind, "fun": lambda z, of=of: held(z)[0][of], "jac": lambda z, of=of: held(z)[1][of]}
                        for kind, of in (("ineq", slice(k)), ("eq", slice(k, None)))
                    ),
                    *(self._asked(near, size, each) for each in self.subject_to),
                ],
                options={"maxiter": 200, "ftol": SAME**1.5},
            )
        self.numbers, self.reached, self.message = answer.x[:n], bool(answer.success), str(answer.message)
        return self.aim(self._loads(near, self.numbers)[0])

    def _loads(self, near: Neighbours, numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Critical loads (k,) in order, and their derivatives (k, n)."""
        return derived(near, numbers.tobytes(), lambda: near.loads(self.names, numbers))

    def _least(self, near: Neighbours, size: float, z: np.ndarray) -> tuple[float, np.ndarray]:
        """What is made least, and its derivatives: minus the bound ``t``, or minus a person's function of the loads."""
        n = len(self.names)
        if self.bound:
            return -float(z[n]), -np.eye(n + 1)[n]
        value, row = self._of_loads(near, size, self.aim, z)
        return -value, -row

    def _of_loads(self, near: Neighbours, size: float, of: Loads, z: np.ndarray) -> tuple[float, np.ndarray]:
        """A person's function of the loads, and its derivatives in all unknowns."""
        loads, slopes = self._loads(near, z[: len(self.names)])
        steps = SAME * size * np.eye(len(loads))
        parts = [(of(loads + step) - of(loads - step)) / (2 * step.max()) for step in steps]
        return float(of(loads)), np.append(np.array(parts) @ slopes, np.zeros(len(z) - len(self.names)))

    def _asked(self, near: Neighbours, size: float, asked: Any) -> Any:
        """One of the conditions of a person, as scipy takes it."""
        from scipy.optimize import LinearConstraint, NonlinearConstraint

        n = len(self.names)
        if isinstance(asked, LinearConstraint):
            return NonlinearConstraint(lambda z: asked.A @ z[:n], asked.lb, asked.ub)
        if isinstance(asked, NonlinearConstraint):
            return NonlinearConstraint(lambda z: asked.fun(z[:n]), asked.lb, asked.ub)
        value = partial(self._of_loads, near, size, asked)
        return {"type": "ineq", "fun": lambda z: value(z)[0] / size, "jac": lambda z: value(z)[1] / size}

    def _held(self, near: Neighbours, size: float, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """What is not negative, loads over ``t``, and then what is zero, means of fields; and their derivatives."""
        n, values, slopes = len(self.names), list[float](), list[np.ndarray]()
        if self.bound:
            loads, rows = self._loads(near, z[:n])
            values, slopes = (loads / size - z[n]).tolist(), [np.append(row / size, -1.0) for row in rows]
        for field, own in self.means:
            mean, row = field.volume(z[own])
            values.append(mean - float(field.mean or 0.0))
            slopes.append(np.zeros(len(z)))
            slopes[-1][own] = row
        return np.array(values), np.reshape(slopes, (-1, len(z)))
