"""Special points of rods that differ in constants alone, each found from where it was on the rod before.

The singular system is solved again with other constants, on one mesh with one set of forms: a few steps of Newton's
method instead of a diagram.  All modes are in the border, so that loads may meet and pass through one another.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import chain, pairwise
from typing import Any

import numpy as np
from petsc4py import PETSc

from rodfem.codim2.adjoint import Adjoint
from rodfem.codim2.criteria import restoration
from rodfem.continuation.branch import Branch, SpecialPoint
from rodfem.continuation.kinds import FOLD
from rodfem.continuation.singular import SingularSystem
from rodfem.errors import ConvergenceError
from rodfem.fem.state import line
from rodfem.tolerances import SAME_SPECIAL, unit

PARTS = (1, 2, 4, 8)
"""Numbers of parts into which a change of the constants is divided, in turn."""
PARALLEL = 0.9  # cosine of two null vectors of one special point
Values = Mapping[str, float]


def in_parts(solve: Callable[[Any, Values], Any], known: Any, values: tuple[Values, Values]) -> Any:
    """Go from a ``known`` solution to other ``values`` of constants, in as few parts as it takes, and solve at each.

    Raises :class:`ConvergenceError` if the most parts are too few.
    """
    begin, end = values
    for parts in PARTS:
        try:
            found = known
            for part in range(1, parts + 1):
                found = solve(found, {name: x + (end[name] - x) * part / parts for name, x in begin.items()})
            return found
        except ConvergenceError as error:
            trouble = error
    raise ConvergenceError(f"A solution is lost on the way to other constants: {trouble}") from trouble


class Neighbours:
    """Special points of one rod, found again at other constants; collective."""

    def __init__(self, specials: Sequence[SpecialPoint]) -> None:
        self.solver = specials[0].point.own_solver
        self.system = self.solver.system
        self.values: Values = {name: p.value for name, p in self.system.scene.parameters.items()}
        self._folds = [special.kind == FOLD for special in specials]
        self._known = [(special.point.x, list(special.null_vectors)) for special in specials]

    def at(self, values: Mapping[str, float]) -> list[Adjoint]:
        """Each special point at these ``values`` of constants; raises :class:`ConvergenceError` if one is lost."""
        end = {**self.values, **values}
        with restoration(self.system):
            found: list[Adjoint] = in_parts(self._solved, self._known, (self.values, end))
        self._known, self.values = [(each.x, each.null) for each in found], end
        return found

    def loads(self, names: Sequence[str], numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Critical loads (k,) in order at these ``numbers`` of constants, and their derivatives in them (k, n)."""
        found = sorted(self.at(dict(zip(names, numbers.tolist(), strict=True))), key=lambda each: each.load)
        slopes = [[np.trace(x.splitting(name)) / len(x.null) for name in names] for x in found]
        return np.array([x.load for x in found]), np.array(slopes)

    def _solved(self, near: Sequence[Adjoint | tuple[PETSc.Vec, list[PETSc.Vec]]], values: Values) -> list[Adjoint]:
        """The special points from those ``near`` them."""
        known = [(each.x, each.null) if isinstance(each, Adjoint) else each for each in near]
        scene = self.system.scene
        self.system.line = line(scene, {**values, scene.load: 0.0}, {scene.load: 1.0})
        found = [self._one(known, number) for number in range(len(known))]
        for a, b in pairwise(sorted(found, key=lambda each: each.load)):
            if abs(a.load - b.load) < SAME_SPECIAL * unit(a.load, one=self.solver.units.load) and self._alike(a, b):
                raise ConvergenceError("two special points have become one")
        return found

    def _one(self, known: Sequence[tuple[PETSc.Vec, list[PETSc.Vec]]], number: int) -> Adjoint:
        """Special point of a ``number``, with the null vectors of the others in the border."""
        (x, null), fold = known[number], self._folds[number]
        others = chain(*(vectors for j, (_, vectors) in enumerate(known) if j != number))
        states = SingularSystem(self.solver, [*null, *([] if fold else others)], len(null), fold=fold)
        there = states.solve(x)
        if there is None:
            raise ConvergenceError("Newton's method does not converge")
        return Adjoint(self.solver, there.x, states)

    def _alike(self, a: Adjoint, b: Adjoint) -> bool:
        """Whether two special points have a null vector in common."""
        v, w = a.null[0], b.null[0]
        return bool(abs((self.system.metric * v).dot(w)) > PARALLEL * self.system.norm(v) * self.system.norm(w))


def losses(branch: Branch, number: int) -> list[SpecialPoint]:
    """First special points of a branch at which its index grows, a ``number`` of them at most, up to the first fold."""
    found = [x for x in branch.special if x.kind.singular and x.negative_after > x.negative_before]
    last = next((i for i, x in enumerate(found) if x.kind == FOLD), number)
    return found[: min(last + 1, number)]
