"""Special points of rods that differ in constants alone, each found from where it was on rods near by.

The singular system is solved again with other constants, on one mesh with one set of forms: a few steps of Newton's
method instead of a diagram.

:class:`Neighbours` goes from rod to rod.  All modes are in the border, so that loads may meet and pass through one
another.

:class:`Rods` are those of a family.  A rod whose first branch was traced has special points and *witnesses*: the
equilibria at both ends of the branch, and one at a load between each two special points.  On a rod near by each is
found again from where it was on the rods before, extrapolated where some of them stand in line with it: special points
by the singular system, witnesses at their loads.  The index of each witness says how many eigenvalues have passed zero
before it.  If no point is lost, destroyed, or on another side of its neighbours, and all indices are those of the
traced rod, the branch has the same special points.  What two points that come or go together between two witnesses
would be is not seen.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, pairwise
from typing import Any

import numpy as np
from petsc4py import PETSc

from rodfem.adaptivity.error_estimate import Enriched, bound
from rodfem.codim2.adjoint import IMPERFECT, Adjoint, restoration
from rodfem.codim2.criteria import FEWER
from rodfem.continuation.branch import Branch, SpecialPoint
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.kinds import FOLD
from rodfem.continuation.singular import SingularState, SingularSystem, Vectors
from rodfem.errors import ConvergenceError
from rodfem.fem.state import load_line
from rodfem.linalg.orthogonal import combine
from rodfem.tolerances import INSIDE, SAME_SPECIAL, round_off, unit

PARTS = (1, 2, 4, 8)
"""Numbers of parts into which a change of the constants is divided, in turn."""
PARALLEL = 0.9  # cosine of two null vectors of one special point
Values = Mapping[str, float]
WEIGHTS = [[1.0], [2.0, -1.0], [3.0, -3.0, 1.0], [4.0, -6.0, 4.0, -1.0]]
"""Of rods in line with a new one and at equal distances, the nearest first, by their number."""
NUMBERS = ("critical_load", "error", "ordinate", "index_before", "index_after")
"""What a family has of a special point."""
NEAR, KEPT = 0.05, 400  # part of the range of loads in which modes of others are in a border; rods to continue from
Place = tuple[float, ...]


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
        self.system.line = load_line(self.system.scene, **values)
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
        if (there := states.solve(x)) is None:
            raise ConvergenceError("Newton's method does not converge")
        return Adjoint(self.solver, there.x, states)

    def _alike(self, a: Adjoint, b: Adjoint) -> bool:
        """Whether two special points have a null vector in common."""
        v, w = a.null[0], b.null[0]
        return bool(abs((self.system.metric * v).dot(w)) > PARALLEL * self.system.norm(v) * self.system.norm(w))


def losses(branch: Branch, number: int) -> list[SpecialPoint]:
    """First special points of a branch at which its index grows, a ``number`` of them at most, up to the first fold."""
    branch.points[0].own_solver.system.scene.require_potential("A choice by critical loads")
    found = [x for x in branch.special if x.kind.singular and x.negative_after > x.negative_before]
    last = next((i for i, x in enumerate(found) if x.kind == FOLD), number)
    return found[: min(last + 1, number)]


# --- a family


@dataclass(frozen=True)
class Rod:
    """States of one rod on a mesh: special points with their null vectors, and witnesses."""

    points: list[PETSc.Vec]
    null: list[list[PETSc.Vec]]
    witnesses: list[PETSc.Vec]


class Rods:
    """Rods with the special points of one that was traced, at the values of some constants by ``names``."""

    def __init__(self, branch: Branch, names: Sequence[str], *, error_bars: bool) -> None:
        """Take a ``branch`` that :func:`continued` allows."""
        self.special, points = specials(branch), branch.points
        self.solver: BranchSolver = points[0].own_solver
        self.system, self.names, self.ends = self.solver.system, names, (points[0].load, points[-1].load)
        changes = [special.negative_after for special in self.special] or [points[0].negative]
        self.indices = [points[0].negative, *changes]
        self.known, self.finer = dict[Place, Rod](), dict[Place, Rod]()
        first = tuple(self.system.scene.parameters[name].value for name in names)
        self.known[first] = _traced(branch)
        self.richer = Enriched(self.solver) if error_bars and self.special else None
        if self.richer is not None:
            self.finer[first] = _transferred(self.known[first], self.richer)

    def distance(self, values: Place, sizes: np.ndarray) -> float:
        """Distance of the nearest known rod, in ``sizes`` of the constants."""
        return float(np.linalg.norm((np.array([*self.known]) - values) / sizes, axis=1).min())

    def at(self, values: Place, sizes: np.ndarray) -> list[dict[str, Any]]:
        """Special points of the rod with these ``values``; raises :class:`ConvergenceError` if they are others."""
        bars = [0.0] * len(self.special)
        with restoration(self.system):
            rod, found, moved = self._found(self.solver, in_line(self.known, values, sizes), values)
            witnesses = self._witnesses(rod, found)
        known = Rod(rod.points, rod.null, witnesses)
        if self.richer is not None:
            with restoration(self.richer.system):
                moved = [self.richer.transfer(change, state=False) for change in moved]
                finer, again, _ = self._found(self.richer.solver, in_line(self.finer, values, sizes), values, moved)
                bars = [*map(self._bar, found, again)]
            _keep(self.finer, values, finer)
        _keep(self.known, values, known)
        return [*self._data(found, bars)]

    def _found(
        self, solver: BranchSolver, rods: Sequence[Rod], values: Place, moved: Vectors = ()
    ) -> tuple[Rod, list[SingularState], Vectors]:
        """Special points of the rod by ``rods`` in line, where witnesses are expected, by what guesses are wrong."""
        weights = np.array(WEIGHTS[len(rods) - 1])
        solver.system.line = load_line(solver.system.scene, **dict(zip(self.names, values, strict=True)))

        def expected(of: Callable[[Rod], list[PETSc.Vec]]) -> list[PETSc.Vec]:
            return [combine([*states], weights) for states in zip(*map(of, rods), strict=True)]

        guesses = expected(lambda rod: rod.points)
        guesses = [x + change for x, change in zip(guesses, moved, strict=True)] if moved else guesses
        found = [self._singular(solver, i, guesses, rods[0].null) for i in range(len(guesses))]
        self._require_order(found)
        rod = Rod([x.x for x in found], [x.vectors for x in found], expected(lambda rod: rod.witnesses))
        return rod, found, [x.x - guess for x, guess in zip(found, guesses, strict=True)]

    def _singular(
        self, solver: BranchSolver, i: int, guesses: Sequence[PETSc.Vec], null: Sequence[list[PETSc.Vec]]
    ) -> SingularState:
        """Special point number ``i`` near its guess."""
        fold, load = self.special[i].kind == FOLD, solver.system.scalar
        reach = NEAR * abs(self.ends[1] - self.ends[0])
        near = [j for j, x in enumerate(guesses) if j != i and not fold and abs(load(x) - load(guesses[i])) < reach]
        others = chain.from_iterable(null[j] for j in near)
        found = SingularSystem(solver, [*null[i], *others], len(null[i]), fold=fold).solve(guesses[i])
        if found is None:
            raise ConvergenceError("a special point is not found again")
        scale = solver.inertia.scale
        if found.spread > FEWER * scale or (not fold and found.size > max(IMPERFECT * scale, found.noise)):
            raise ConvergenceError("a special point is destroyed")
        return found

    def _require_order(self, found: Sequence[SingularState]) -> None:
        """Raise :class:`ConvergenceError` if a special point has left the range, or passed another one."""
        low, high = sorted(self.ends)
        before, now = [s.point.load for s in self.special], [x.load for x in found]
        if not all(low < load < high for load in now):
            raise ConvergenceError("a special point leaves the range")
        if not all((b - a) * (d - c) > 0.0 for (a, b), (c, d) in zip(pairwise(before), pairwise(now), strict=True)):
            raise ConvergenceError("two special points pass one another")

    def _witnesses(self, rod: Rod, found: Sequence[SingularState]) -> list[PETSc.Vec]:
        """Equilibria at both ends, and between special points, with the indices of the traced rod."""
        loads = [self.ends[0], *((a.load + b.load) / 2.0 for a, b in pairwise(found)), self.ends[1]]
        out = []
        for load, guess, index in zip(loads, rod.witnesses, self.indices, strict=True):
            x, outcome = self.solver.at_load(guess, load)
            regular = self.solver.regular.at(x) if outcome.converged else None
            if regular is None or regular.index.negative != index:
                raise ConvergenceError(f"the index near {load:g} is another one")
            out.append(x)
        return out

    def _bar(self, found: SingularState, again: SingularState) -> float:
        """Bound of the error of a critical load, by the same point ``again`` of the richer mesh."""
        assert self.richer is not None
        rho = self.richer.rho([found.x, found.vectors[0]], [again.x, again.vectors[0]])
        left = round_off(again.load, self.solver.units.load)
        return bound(found.load, again.load, left, rho)

    def _data(self, found: Sequence[SingularState], bars: Sequence[float]) -> Iterator[dict[str, Any]]:
        for special, x, bar in zip(self.special, found, bars, strict=True):
            ordinate, index = self.solver.shape.ordinate(x.x), (special.negative_before, special.negative_after)
            numbers = x.load, bar if self.richer else None, ordinate, *index
            yield {"kind": str(special.kind)} | dict(zip(NUMBERS, numbers, strict=True))


def _traced(branch: Branch) -> Rod:
    """Rod of a branch, with the rows half way between special points as witnesses, and those at the ends."""
    special, points = specials(branch), branch.points
    middle = [points[(a.row + b.row) // 2].x for a, b in pairwise(special)]
    null = [[*s.null_vectors] for s in special]
    return Rod([s.point.x for s in special], null, [points[0].x, *middle, points[-1].x])


def _transferred(rod: Rod, richer: Enriched) -> Rod:
    """Special points of a rod on a richer mesh."""
    null = [[richer.transfer(v, state=False) for v in vectors] for vectors in rod.null]
    return Rod([richer.transfer(x, state=True) for x in rod.points], null, [])


def _keep(known: dict[Place, Rod], values: Place, rod: Rod) -> None:
    """Keep a rod to continue from, and forget the oldest one where there are many."""
    known[values] = rod
    if len(known) > KEPT:
        del known[next(iter(known))]


def in_line(known: Mapping[Place, Rod], values: Place, sizes: np.ndarray) -> list[Rod]:
    """The nearest known rod, and those beyond it that are in line with it and the new one, at equal distances."""
    places = np.array([*known]) / sizes
    new = np.array(values) / sizes
    nearest = places[int(np.linalg.norm(places - new, axis=1).argmin())]
    out = []
    for number in range(len(WEIGHTS)):
        wanted = nearest + number * (nearest - new)
        distances = np.linalg.norm(places - wanted, axis=1)
        found = int(distances.argmin())
        if distances[found] > INSIDE * max(1.0, float(np.linalg.norm(wanted))):
            break
        out.append(known[[*known][found]])
    return out


def specials(branch: Branch) -> list[SpecialPoint]:
    """Special points of a branch but for loads that were asked for, and ends."""
    return [special for special in branch.special if not special.kind.request]


def continued(branch: Branch, span: tuple[float, float]) -> bool:
    """Whether a ``branch`` from end to end of the ``span`` has folds and branch points alone, on one mesh, no doubt."""
    points = branch.points
    alone = all(s.kind.singular and s.resolved is not False and not s.nearby for s in specials(branch))
    whole = {points[0].load, points[-1].load} == {*span} and len({id(p.solver) for p in points}) == 1
    return alone and whole and not branch.unexplained
