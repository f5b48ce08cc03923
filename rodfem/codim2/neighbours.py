"""Special points of rods that differ in constants alone, each found from where it was on the rod before.

The singular system is solved again with other constants, on one mesh with one set of forms: a few steps of Newton's
method instead of a diagram.  All modes are in the border, so that loads may meet and pass through one another.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np
from petsc4py import PETSc

from rodfem.codim2.adjoint import Adjoint
from rodfem.codim2.criteria import kept
from rodfem.continuation.branch import SpecialPoint
from rodfem.continuation.kinds import FOLD
from rodfem.continuation.singular import SingularSystem
from rodfem.errors import ConvergenceError
from rodfem.fem.state import line
from rodfem.tolerances import SAME_SPECIAL, unit

PARTS = (1, 2, 4, 8)
"""Numbers of parts into which a change of the constants is divided, in turn."""
PARALLEL = 0.9  # cosine of two null vectors of one special point


class Neighbours:
    """Special points of one rod, found again at other constants; collective."""

    def __init__(self, specials: Sequence[SpecialPoint]) -> None:
        self.solver = specials[0].point.own_solver
        self.system = self.solver.system
        self.values = {name: p.value for name, p in self.system.scene.parameters.items()}
        self._folds = [special.kind == FOLD for special in specials]
        self._known = [(special.point.x, list(special.null_vectors)) for special in specials]

    def at(self, values: Mapping[str, float]) -> list[Adjoint]:
        """Each special point at these ``values`` of constants; raises :class:`ConvergenceError` if one is lost."""
        begin, end = self.values, {**self.values, **values}
        for parts in PARTS:
            known = self._known
            try:
                with kept(self.system):
                    for part in range(1, parts + 1):
                        there = {name: begin[name] + (end[name] - begin[name]) * part / parts for name in begin}
                        found = self._solved(known, there)
                        known = [(each.x, each.null) for each in found]
            except ConvergenceError:
                continue
            self._known, self.values = known, end
            return found
        raise ConvergenceError("A special point is not found again with other constants.")

    def _solved(self, known: Sequence[tuple[PETSc.Vec, list[PETSc.Vec]]], values: Mapping[str, float]) -> list[Adjoint]:
        """The special points from ``known`` ones near by."""
        scene = self.system.scene
        self.system.line = line(scene, {**values, scene.load: 0.0}, {scene.load: 1.0})
        found = list[Adjoint]()
        for i, ((x, null), fold) in enumerate(zip(known, self._folds, strict=True)):
            others = [] if fold else [v for j, (_, vectors) in enumerate(known) if j != i for v in vectors]
            states = SingularSystem(self.solver, [*null, *others], len(null), fold=fold)
            there = states.solve(x)
            if there is None:
                raise ConvergenceError("Newton's method does not converge")
            found.append(Adjoint(self.solver, there.x, states))
        for a, b in pairwise(sorted(found, key=lambda each: each.load)):
            if abs(a.load - b.load) < SAME_SPECIAL * unit(a.load, one=self.solver.units.load) and self._alike(a, b):
                raise ConvergenceError("Two special points have become one")
        return found

    def _alike(self, a: Adjoint, b: Adjoint) -> bool:
        """Whether two special points have a null vector in common."""
        v, w = a.null[0], b.null[0]
        return bool(abs((self.system.metric * v).dot(w)) > PARALLEL * self.system.norm(v) * self.system.norm(w))


def gradient(found: Adjoint, names: Sequence[str]) -> np.ndarray:
    """Derivatives of the mean load of a special point in constants."""
    return np.array([np.trace(found.splitting(name)) / len(found.null) for name in names])
