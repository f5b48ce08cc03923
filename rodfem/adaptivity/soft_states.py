"""Soft modes of states and branches, with what the mesh adds to their uncertainty.

A mesh may make an eigenvalue of its own of one that is exponentially small: it pins what slides along the rod.  The
state is solved for again on a mesh of half the elements' length and one degree more.  With eigenvalues ``mu`` on the
mesh and ``mu'`` on the richer one the error of ``mu'`` is at most ``rho |mu' - mu| / (1 - rho)``
(:mod:`rodfem.adaptivity.error_estimate`).  A mode that this leaves undecided is computed on a still richer mesh, unless
it is within round-off on every one.  If an eigenvalue changes by more than itself all of the change is added.  One of
another sign than on the mesh itself is undecided there, and so is one if the richer mesh has another state, by the
strains of the two.  If the eigenvalues nearest zero do not explain the index of the richer mesh, the index is one of
all between the two: what the mesh adds need not be small.

What vanishes at a special point is zero there by construction, and undecided.  The special point of a richer mesh is at
another load, so that its other eigenvalues are compared across the branch.

Rows that one factorisation decided have no soft modes.  With error bars the eigenvalue nearest zero is compared at the
loads asked for and at the ends of branches; all along a branch if one of these is undecided, or a special point is not
on the richer mesh.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cache, partial
from itertools import compress, groupby
from math import inf, isfinite
from typing import TYPE_CHECKING

import numpy as np
from petsc4py import PETSc

from rodfem.adaptivity.error_estimate import Enriched, RicherPoint
from rodfem.continuation.arc import STEADY, stepped
from rodfem.continuation.branch import Branch, Point, SpecialPoint
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.curves import VERTICAL
from rodfem.continuation.kinds import NUMBER
from rodfem.continuation.observer import Remark
from rodfem.errors import ConvergenceError
from rodfem.fem.newton import TOLERANCE
from rodfem.linalg.orthogonal import complement
from rodfem.stability.inertia import NULL, ROUGH, SPARE, Factored
from rodfem.stability.motion_names import names_for
from rodfem.stability.near_zero import NearZero, decide, near_zero, soft_limit
from rodfem.stability.soft_mode import SoftMode, index_range

if TYPE_CHECKING:
    from rodfem.adaptivity.mesh_sequence import Meshes

FINER, EXACT = "use more elements or a higher degree", "no mesh decides that, it is within round-off"
FEW = 4
"""Most eigenvalues that are judged one by one if the richer mesh has another index; the range of the index has all."""
BARS = "richer meshes may decide that, ask for error bars"


class SoftStates:
    """Finds and names the soft modes of states of one solver.

    With ``richer``, which makes a companion of its mesh, their uncertainty has the error of the mesh in it;
    ``uncompared`` says why the index of the last state was not compared with that of the richer mesh.
    """

    def __init__(self, solver: BranchSolver, richer: Callable[[], Enriched] | None) -> None:
        self.solver, self.names = solver, names_for(solver.system)
        self._richer, self._companions = richer, list[Enriched]()
        self.uncompared = ""
        self._richer_index: int | None = None  # of the last state, if it is another one

    def examine(
        self,
        point: Point,
        *,
        fixed_load: bool,
        compare: bool = False,
        family: bool = False,
        vanishing: Sequence[PETSc.Vec] = (),
    ) -> bool:
        """Record the soft modes of a ``point``, and its index as far as they are decided; whether there are any.

        On a richer mesh the point is at the same load (``fixed_load``), or on the plane across the branch; ``compare``
        asks for the index there.  Along a ``family`` at one load the eigenvalue of the branch itself is zero, at a
        special point those of its ``vanishing`` null vectors.  Raises :class:`ConvergenceError` for a negative index.
        """
        metric = self.solver.system.metric
        clear, self.uncompared, self._richer_index = self._is_clear(point), "", None
        # eigenvalues nearest zero to be judged, soft ones apart: those of another sign on the richer mesh
        least = self._differing(point, fixed_load) if compare and self._richer else 0
        if clear and not least:
            return False
        near, branch = self._small_eigenvalues(point, least, family)
        modes, others = self._modes(point, near), _rank(metric, near.vectors, vanishing)
        for i in set(range(len(modes))).difference(others):
            modes[i] = replace(modes[i], uncertainty=max(abs(modes[i].value), modes[i].uncertainty))
        if others and self._richer:
            with self.solver.system.clock.scope("error bars"):
                refined = self._refined(point, [modes[i] for i in others], fixed_load, [*vanishing, *branch])
            for i, mode in zip(others, refined, strict=True):
                modes[i] = mode
        self._record(point, near, modes)
        self._widen(point, modes)
        return bool(point.soft)

    def _small_eigenvalues(self, point: Point, least: int, family: bool) -> tuple[NearZero, list[PETSc.Vec]]:
        """Eigenvalues near zero, but for that of a ``family`` itself, and its tangent."""
        near = near_zero(self.solver.inertia.at(point.x), least=least)
        if not family or point.tangent is None:
            return near, []
        kept = _rank(self.solver.system.metric, near.vectors, [point.tangent])
        return near.at(kept, near.rest + len(near.vectors) - len(kept)), [point.tangent]

    def _modes(self, point: Point, near: NearZero) -> list[SoftMode]:
        """Eigenvalues ``near`` zero as soft modes; without a richer mesh undecided within the tolerance of a count."""
        least, bars = 0.0 if self._richer else self.solver.inertia.tolerance, near.uncertainty
        bars = np.where(abs(near.values) > bars, np.maximum(bars, least), bars)
        names = self.names(point.x, near.vectors)
        return [SoftMode(*m) for m in zip(names, near.values.tolist(), bars.tolist(), strict=True)]

    def _record(self, point: Point, near: NearZero, modes: list[SoftMode]) -> None:
        """Give a ``point`` its ``modes``, ``near`` zero; raises :class:`ConvergenceError` for a negative index."""
        negative, zero, undecided = near.counts(modes, self.solver.inertia.tolerance)
        if negative < 0:
            raise ConvergenceError(
                f"The count of negative eigenvalues at load {point.load:.8g} gave {negative}: the constraints depend "
                "on each other, or nearly; remove those that follow from the others."
            )
        _give_index(point, negative, undecided)
        point.zero = zero
        limit = soft_limit(self.solver.inertia)
        point.soft = [m for m in modes if not m.decided or abs(m.value) < limit]

    def _widen(self, point: Point, modes: list[SoftMode]) -> None:
        """Leave the index of a ``point`` open as far as that of the richer mesh, if its ``modes`` do not explain that.

        The one farthest from zero then has no bound of its error.
        """
        index, low, high = self._richer_index, point.negative, point.negative + point.undecided
        if modes and index is not None and not low <= index <= high:
            least = min(low, index)
            _give_index(point, least, max(high, index) - least)
            farthest = max(modes, key=lambda m: abs(m.value))
            point.soft = [m for m in point.soft if m is not farthest] + [replace(farthest, uncertainty=inf)]

    def _is_clear(self, point: Point) -> bool:
        """Whether one factorisation told the index of a point, with a distance of the nearest eigenvalue from zero."""
        return bool(point.nearest or self.solver.regular.at(point.x))

    def _differing(self, point: Point, fixed_load: bool) -> int:
        """Number of eigenvalues to judge: of another sign on the richer mesh, or zero there; 1 for a row it has not."""
        with self.solver.system.clock.scope("error bars"):
            richer = self._companion(0)
            try:
                there, again = _counterpart(richer, point, fixed_load)
                inertia = richer.solver.inertia
                found = inertia.at(there.x)
                below = found.eigenvalue_count(-inertia.tolerance)
                if below == point.negative:
                    self.uncompared = "" if again.resolved else again.unlike(point.load)
                    return int(self._moved(point, found) if again.resolved else not fixed_load)
                index = decide(found).index
                if again.resolved and not index.zero > found.drifts:
                    self._richer_index = index.negative
            except ConvergenceError as trouble:  # no such state, or arithmetic leaves too many signs open there
                self.uncompared = str(trouble)
                return int(not fixed_load)
        own = point.zero - self.solver.system.active_drifts(point.x)
        return min(max(abs(index.negative - point.negative), index.zero - found.drifts - own), FEW)

    def _moved(self, point: Point, there: Factored) -> bool:
        """Whether the eigenvalue nearest zero has another value at the same point on the richer mesh."""
        here = self.solver.inertia.at(point.x)
        here.count()
        values = []
        for found in (here, there):
            with found.inertia.afresh():
                values.append(float(found.nearest(1, ROUGH)[0][0]))
        return abs(values[1] - values[0]) > abs(values[0]) / 10

    def _refined(
        self, point: Point, modes: list[SoftMode], fixed_load: bool, zeros: Sequence[PETSc.Vec]
    ) -> list[SoftMode]:
        """The ``modes`` but for ``zeros`` with values of richer meshes; of infinite uncertainty without them."""
        coarse = values = np.array([m.value for m in modes])
        out, soft = modes, bool((abs(values) < soft_limit(self.solver.inertia)).any())
        for level in range(2):  # meshes beyond that of the state
            richer = self._companion(level)
            try:
                point, again = _counterpart(richer, point, fixed_load, soft=soft)
                zeros = [v / richer.system.norm(v) for v in map(partial(richer.transfer, state=False), zeros)]
                finer, rounding = _nearest(richer.solver, point, len(modes), zeros)
            except ConvergenceError:
                return out if level else [replace(m, uncertainty=float("inf")) for m in modes]
            of_mesh = again.rho / (1 - again.rho) * abs(finer - values)
            lost, left, values = abs(finer) + of_mesh <= rounding, of_mesh + rounding, finer
            # a sign that is another one than the mesh's own is not decided there
            contrary, away = np.sign(values) != np.sign(coarse), abs(values - coarse)
            bars = np.where(away > abs(coarse), left + away, left)
            found = zip(modes, values.tolist(), bars.tolist(), strict=True)
            out = [replace(m, value=value, uncertainty=bar) for m, value, bar in found]
            # no richer mesh decides what is within round-off wherever the error of the mesh may move it
            if ((abs(values) > bars) | lost).all() or (contrary & (left < abs(values))).any():
                break
        return out

    def _companion(self, level: int) -> Enriched:
        """Companion of the mesh, or of the companion before; made when it is first asked for."""
        if level == len(self._companions):
            make = partial(Enriched, self._companions[-1].solver) if level else self._richer
            assert make is not None
            self._companions.append(make())
        return self._companions[level]


def _give_index(point: Point, negative: int, undecided: int) -> None:
    """Give a ``point`` another index, in space too: that in the plane, and what is out of it."""
    if point.negative_in_space is not None:
        point.negative_in_space += negative - point.negative
    point.negative, point.undecided = negative, undecided


def _rank(metric: PETSc.Mat, vectors: Sequence[PETSc.Vec], others: Sequence[PETSc.Vec]) -> list[int]:
    """Numbers of the vectors that are no combination of others."""
    return [i for i, v in enumerate(vectors) if complement(metric, [v], others)]


def _counterpart(richer: Enriched, point: Point, fixed_load: bool, *, soft: bool = False) -> tuple[Point, RicherPoint]:
    """Point on a richer mesh, and what was found when it was computed there; or ConvergenceError."""
    first, second = sorted((richer.system.damping, richer.solver.inertia.tolerance), reverse=soft)
    try:
        with richer.system.damped(first):
            again = richer.solve(point, fixed_load=fixed_load)
    except ConvergenceError:
        with richer.system.damped(second):
            again = richer.solve(point, fixed_load=fixed_load)
    if soft and not again.resolved:
        raise ConvergenceError(again.unlike(point.load))
    tangent = None if point.tangent is None else richer.transfer(point.tangent, state=False)
    return replace(point, x=again.x, tangent=tangent, load=again.load, ordinate=again.ordinate), again


def _nearest(
    solver: BranchSolver, point: Point, number: int, zeros: Sequence[PETSc.Vec]
) -> tuple[np.ndarray, np.ndarray]:
    """The ``number`` eigenvalues nearest zero but for those of ``zeros``, ascending, and their uncertainty."""
    found = solver.inertia.at(point.x)
    found.count()
    with solver.inertia.afresh():
        nearest = found.nearest(len(zeros) + number + SPARE, NULL)[1]
    vectors = [v for v in nearest if complement(solver.system.metric, [v], zeros)][:number]
    q = found.quotients(vectors, TOLERANCE * solver.inertia.scale)
    row = solver.axis if point.tangent is None else solver.row(point.tangent)
    settled = solver.inertia.at(stepped(solver, point.x, row))
    moved = abs(np.array([v.dot(settled.matrix * v).real for v in vectors]) - q.values)
    order = np.argsort(q.values)
    return q.values[order], (q.uncertainty + STEADY * moved)[order]


class SoftRows:
    """Examines branches of one run; with ``error_bars`` the error of its meshes is part of every uncertainty."""

    def __init__(self, meshes: Meshes, *, error_bars: bool) -> None:
        self.meshes, self.error_bars = meshes, error_bars
        self._of = cache(
            lambda mesh: SoftStates(meshes.solvers[mesh], partial(meshes.richer, mesh) if error_bars else None)
        )
        self._uncompared: dict[str, tuple[float, str]] = {}

    def examine(self, branch: Branch) -> None:
        """Record soft modes, and undecided eigenvalues, at the points of a branch."""
        family, special = self._is_family(branch), {id(s.point) for s in branch.special}
        doubtful = self._examine_given(branch, family)
        rows = branch.points[1:] if branch.parent else branch.points  # without the branch point that it leaves
        compare = self.error_bars and doubtful
        for point in rows:
            if id(point) not in special:
                self._of(point.mesh).examine(point, fixed_load=False, compare=compare, family=family)
        if compare:
            self._leave_out_doubtful(branch, family=family)

    def _examine_given(self, branch: Branch, family: bool) -> bool:
        """The same at loads asked for, at ends and events; whether one is undecided, or not on the richer mesh."""
        given = _requests(branch)
        counted = {id(s.point): s.point.negative for s in given}
        for s in {id(s.point): s for s in given}.values():  # a load asked for may be that of the end
            states = self._of(s.point.mesh)
            states.examine(s.point, fixed_load=s.kind.request, compare=self.error_bars, family=family)
            if states.uncompared and isfinite(s.error_estimate) and s.resolved:  # else the special point says so
                self._uncompared.setdefault(branch.name, (s.point.load, states.uncompared))
        for s in given:
            if s.negative_before == s.negative_after == counted[id(s.point)]:
                s.negative_before = s.negative_after = s.point.negative
        return _is_doubtful(branch, given)

    def _leave_out_doubtful(self, branch: Branch, *, family: bool) -> None:
        """Make rows of special points that are zeros of the mesh, not of the rod."""
        singular = {id(s.point) for s in branch.special if s.kind.singular}
        rows = [p for p in branch.points if id(p) not in singular]  # with loads asked for, and the end
        left_out = [s.kind.singular and _is_of_the_mesh(s, rows) for s in branch.special]
        for s in compress(branch.special, left_out):
            self._of(s.point.mesh).examine(s.point, fixed_load=False, compare=True, family=family)
        branch.special[:] = [s for s, out in zip(branch.special, left_out, strict=True) if not out]

    def _is_family(self, branch: Branch) -> bool:
        """Whether a branch is a family of equilibria at one load; the slope is small next to a fold, too."""
        span, singular = self.meshes.solvers[0].system.scene.span, {id(s.point) for s in branch.special}
        begin = 1 if branch.parent else 0  # a pitchfork begins without a slope
        rows = [p for p in branch.points[begin:] if id(p) not in singular]
        return bool(rows) and all(abs(p.slope) < VERTICAL * abs(span[1] - span[0]) for p in rows)

    def undecided(self, branch: Branch) -> Iterator[Remark]:
        """Yield a sentence on each piece of a branch whose index is not decided, or not compared with a richer mesh."""
        if branch.name in self._uncompared:
            at, why = self._uncompared.pop(branch.name)
            where = f"{self.meshes.solvers[0].system.scene.load} = {at:.8g}"
            words = f"{branch.name}: At {where} the index is not compared with that of a richer mesh. {why}"
            yield Remark(words, at)
        for words, group in groupby(branch.points, lambda p: p.undecided and index_range(p.negative, p.undecided)):
            if words:
                points = list(group)
                yield Remark(f"{branch.name}: {self._piece(points, str(words))}", points[0].load, points[-1].load)

    def _piece(self, points: list[Point], words: str) -> str:
        """Sentence on neighbouring points whose index is undecided, in ``words``."""
        solver = self.meshes.solvers[points[0].mesh]
        worst = max((m for p in points for m in p.soft if not m.decided), key=lambda m: m.uncertainty)
        remedy = FINER if worst.uncertainty > 10 * TOLERANCE * solver.inertia.scale else EXACT
        if remedy == FINER and not self.error_bars and worst.uncertainty <= solver.inertia.tolerance:
            remedy = BARS
        low, high = (f"{p.load:.8g}" for p in (points[0], points[-1]))
        load = solver.system.scene.load
        where = f"At {load} = {low}" if len(points) == 1 else f"From {load} = {low} to {high}"
        return f"{where} the index is {words} ({worst}): {remedy}."


def _requests(branch: Branch) -> list[SpecialPoint]:
    """Loads asked for, ends and events of a ``branch``, but for those at special points."""
    singular = {id(s.point) for s in branch.special if s.kind.counted or s.test_function == "stretch"}
    return [s for s in branch.special if (s.kind.request or s.kind.test == NUMBER) and id(s.point) not in singular]


def _is_doubtful(branch: Branch, given: Sequence[SpecialPoint]) -> bool:
    """Whether the index is undecided at one of some special points, or one is not on the richer mesh."""
    lost = (s.kind.singular and s.error_estimate == inf for s in branch.special)
    return any(s.point.undecided for s in given) or any(lost)


def _is_of_the_mesh(special: SpecialPoint, rows: Sequence[Point]) -> bool:
    """Whether a ``special`` point is the mesh's, by the ``rows``: on one side the next two are undecided.

    One is enough if the richer mesh has no such point, and none if the index is the same on both sides, as where two of
    them are in one step.  Not if the indices on both sides differ whatever is undecided, or by its own change while as
    much is undecided: that is another mode.
    """
    first = sum(p.arclength < special.point.arclength for p in rows)
    before, after, number = rows[:first][::-1], rows[first:], 2 if isfinite(special.error_estimate) else 1
    change = [(q.negative - p.negative, q.undecided - p.undecided) for p, q in zip(before[:1], after[:1], strict=False)]
    doubtful = _open(before, number) or _open(after, number) or (number == 1 and change == [(0, 0)])
    (low, high), (least, most) = _bounds(before[:2]), _bounds(after[:2])
    differ = high < least or most < low
    own = special.negative_after - special.negative_before
    return doubtful and not differ and change != [(own, 0)]


def _open(rows: Sequence[Point], number: int) -> bool:
    """Whether each of a ``number`` of first rows is undecided."""
    return sum(p.undecided > 0 for p in rows[:number]) == number


def _bounds(rows: Sequence[Point]) -> tuple[float, float]:
    """Greatest of the lower bounds of the index at some ``rows``, and least of the upper ones."""
    return max((p.negative for p in rows), default=0), min((p.negative + p.undecided for p in rows), default=inf)
