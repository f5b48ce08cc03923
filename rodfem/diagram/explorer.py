"""The whole diagram: the branch of the start state, and what leaves from its special points, to a set depth."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace
from math import isfinite

from petsc4py import PETSc

from rodfem.adaptivity.mesh_sequence import TRIES
from rodfem.continuation.branch import Branch, NormalForm, Point, SpecialPoint
from rodfem.continuation.follow import ON_BOUND
from rodfem.continuation.normal_form import normal_form_of, origin_of
from rodfem.continuation.observer import Remark
from rodfem.continuation.singular_points import COUPLED, coupling_of
from rodfem.continuation.switching import directions, lines, start_branch
from rodfem.deflation.search import Deflation, equilibria_at
from rodfem.deflation.symmetries import Orbits
from rodfem.diagram.equilibria import Overfull, first_state, name_of_first
from rodfem.diagram.equivalence import are_images, equivalent, neighbours, other_ordinates
from rodfem.diagram.special_search import Gap, arms
from rodfem.diagram.tracer import Tracer
from rodfem.errors import ConvergenceError, SceneError, many
from rodfem.fem.newton import NewtonResult
from rodfem.fem.shape import link
from rodfem.stability.reduced_stiffness import bordered_of
from rodfem.tolerances import APART, SAME_SPECIAL, SAME_STATE

TAIL, REACH = 8, 4.0
"""Rows before the end of a side branch, at least, among which its mirror image is recognised; length of that part of
it, at least, over the distance of the state that may be its own."""


class Explorer(Tracer):
    """Explores the equilibria of a scene from its start state: what to trace, and in which order."""

    _crossed = 0  # gaps whose other side was looked at

    def run(self) -> list[Branch]:
        """Trace the start state's branch, then what leaves each branch point, breadth first."""
        self.trace(self._primary())
        self._branch_off(0)
        for load in self.plan.at if self.plan.tries else ():
            with self.guard(f"The search at {load:g} was given up"):
                self._search(load)
        return self.branches

    def _search(self, load: float) -> None:
        """Look for equilibria at ``load`` that no branch has reached, and trace what goes through them."""
        self.use(max(self.meshes.solvers, key=lambda f: f.system.fields.unknowns).mesh)
        with self.solver.system.clock.scope("search"):
            search = Deflation(self.solver, load, equilibria_at(self.solver, self.branches, load))
            found = search.run(self.plan.tries)
        self.observer.note(Remark(f"\n{search}", load))
        before = len(self.branches)
        for i, point in enumerate(self._resolved(self._convex(found))):
            if not self._on_branch(point, before):
                self.trace_whole(point, self._unused("found ", f" at {load:g}", i + 1), 0)
        self._branch_off(before)

    def _on_branch(self, point: Point, first: int = 0) -> bool:
        """Whether a point is on one of the branches traced, from number ``first`` on."""
        self.use(point.mesh)
        known = Orbits(self.solver.system)
        for other in equilibria_at(self.solver, self.branches[first:], point.load):
            known.add(other.x)
        return known.distance(point.x) < APART

    def _convex(self, points: list[Point]) -> list[Point]:
        """Those ``points`` along which the stored energy is convex; the others are mentioned."""
        self.use(points[0].mesh if points else self.solver.mesh)
        convex, others = list[Point](), list[Point]()
        for point in points:
            (others if self.solver.lost_convexity(point.x) else convex).append(point)
        if others:
            near = f"{many(len(others), 'equilibrium', 'equilibria')} near {self.scene.load} = {others[0].load:.6g}"
            self.observer.note(f"  {near}: not followed, the stored energy is not convex there")
        return convex

    def _resolved(self, points: list[Point]) -> list[Point]:
        """Those ``points`` that the richer mesh has, too, where errors are estimated; a warning names the others."""
        if not self.soft.error_bars:
            return points
        kept = list[Point]()
        for point in points:
            with self.guard(f"A state found at {self.scene.load} = {point.load:.8g} was not followed"):
                with self.solver.system.clock.scope("error bars"):
                    again = self.meshes.richer(point.mesh).solve(point, fixed_load=True)
                if not again.resolved:
                    raise ConvergenceError(again.unlike(point.load))
                kept.append(point)
        return kept

    def _detached(self, gap: Gap, depth: int) -> None:
        """Trace the branch on the other side of a gap, unless it is squeezed to nothing, or through it."""
        self.use(gap.point.mesh)
        for point in self._convex(arms(self.solver, gap)):
            if self.low < point.load < self.high and point.stretch > 0 and not self._on_branch(point):
                number = 1 + sum(b.name.startswith("detached") for b in self.branches)
                self.trace_whole(point, f"detached {number}", depth)

    def _branch_off(self, first: int) -> None:
        """Trace what leaves the branch points of the branches from number ``first`` on, breadth first."""
        for branch in itertools.islice(self.branches, first, None):  # grows while it is walked
            if branch.depth < self.plan.depth:
                while self._crossed < len(self.specials.gaps) and not self._enough():
                    self._crossed += 1
                    gap = self.specials.gaps[self._crossed - 1]
                    with self.guard(f"The other side of the gap at {gap.point.load:.8g} was not followed"):
                        self._detached(gap, branch.depth + 1)
                for i, special in enumerate(branch.special):
                    if special.to_follow and not self._enough():
                        where = f"{branch.name} at {special.point.load:.8g}"
                        with self.guard(f"No branch could be followed from {where}"):
                            self._switch(branch, i, special)

    def _enough(self) -> bool:
        """Whether there are as many branches as the plan wants at most."""
        return 0 < self.plan.most_branches <= len(self.branches)

    def _primary(self) -> Branch:
        """First branch: its first state."""
        point, start = self._first(), self.span[0]
        if point.stretch < 1e-6:  # no rod any more
            raise SceneError(
                f"The rod is squeezed to a stretch of {point.stretch:.2g} in the first state, at {self.scene.load} = "
                f"{start:g}: write the energy of stretch in v[2] - 1 (zero in the undeformed rod), or push less."
            )
        if self.scene.closed:
            number, *turns = link(self.solver.shape.sample(point.x))
            Tw, Wr = (round(x, 4) + 0.0 for x in turns)  # no negative zero
            known = f"linking number {number:g}" if isfinite(number) else "no linking number, as it lies on itself"
            self.observer.note(f"  closed rod: {known}, twist {Tw:.4f}, writhe {Wr:.4f}")
        assert point.tangent is not None
        ahead = point.x + 0.1 * point.tangent  # rotations that give d3 one direction are a linear space
        return Branch(name_of_first(self.solver.shape, [point.x, ahead]), None, 0, [point])

    def _first(self) -> Point:
        start, stop = self.span
        x, outcome = self._fine_start(start)
        solver = self.solver
        if not outcome.converged:
            raise ConvergenceError(
                f"No equilibrium was found at {self.scene.load} = {start:g} from the scene's start: start at another "
                "load, give the scene a start nearer to one, or see whether constraints repeat each other or what an "
                "end holds."
            )
        solver.require_convexity(x)
        point = solver.point(x, 0.0, solver.load_tangent(x, stop > start), outcome)
        family = point.zero - solver.system.active_drifts(x)
        if family > 0:
            self._leave_family(point, family, stop > start)
        return point

    def _fine_start(self, load: float) -> tuple[PETSc.Vec, NewtonResult]:
        """First state on a mesh that holds its half-waves; with an accuracy, on one of some finer ones."""
        while True:
            try:
                return first_state(self.solver, load)
            except Overfull:
                if self.plan.accuracy is None or len(self.meshes.solvers) == TRIES:
                    raise
                self.use(self.meshes.add(self.solver.system.fields.discretization.finer(2)).mesh)

    def _leave_family(self, point: Point, freedoms: int, increasing: bool) -> None:
        """Give a first point that may move freely at its load the tangent along which the load changes.

        With the null vectors ``phi`` of ``S`` as borders, ``S w = -F_lam`` is solvable where ``phi . F_lam = 0``: the
        load does no work on the free motion, and the branch goes on with the tangent ``(w, 1)``, across the family.
        """
        solver, system = self.solver, self.solver.system
        vectors = solver.inertia.modes_near_zero(point.x, freedoms)
        if max(coupling_of(solver, point.x, v) for v in vectors) > COUPLED:
            raise SceneError(
                f"The first state, at {self.scene.load} = {point.load:g}, may move freely at this load, and is not the "
                f"state that a small {self.scene.load} leads on from: start the range at another load, or give the "
                "scene a start that is in equilibrium under the load, too."
            )
        found = solver.inertia.at(point.x)
        bordered = bordered_of(solver.inertia, freedoms)
        bordered.factor(found.matrix, [solver.inertia.metric * v for v in vectors])
        (tangent, *_), _ = bordered.solve([-found.border])
        system.set_load(tangent, 1.0)
        tangent.scale((1.0 if increasing else -1.0) / system.norm(tangent))
        point.tangent, point.slope = tangent, system.scalar(tangent)

    def _switch(self, parent: Branch, i: int, special: SpecialPoint) -> None:
        """Trace the branches that leave the special point ``i`` of a parent."""
        special.switched = True
        self.use(special.point.mesh)
        self.solver.damp(special.point.zero - self.solver.system.active_drifts(special.point.x) - special.multiplicity)
        ways = directions(self.solver, special)
        before, firsts, leaving = len(self.branches), list[Point](), 0
        found = self._lines(special, ways)
        for direction in found:
            self.use(special.point.mesh)
            self._law(special, direction)
            for sign in (1.0, -1.0):
                if self._enough():
                    break
                self.use(special.point.mesh)
                branch = self._leaving_along(parent, i, direction * sign, len(ways))
                leaving += branch is not None
                if branch is not None and self._is_new(parent, branch, firsts, before):
                    self.trace(branch)
        self._classify_from_the_side(special, self.branches[before:])
        if len(found) > 1 and leaving > len(firsts) and not self._enough():
            said = (
                f"  {leaving} branches leave {parent.name} at {special.point.load:.8g} in {len(found)} directions: "
                f"{leaving - len(firsts)} are images of the others by symmetries of the rod, and are not traced."
            )
            self.observer.note(Remark(said, special.point.load, branch=parent.name))

    def _leaving_along(self, parent: Branch, i: int, direction: PETSc.Vec, ways: int) -> Branch | None:
        """Branch that leaves the special point ``i`` of a parent along a direction, one of ``ways``, in the range."""
        special, margin, depth = parent.special[i], ON_BOUND * (self.high - self.low), parent.depth + 1
        bounds = self.low - margin, self.high + margin  # room for round-off
        leaving = start_branch(self.solver, special, direction, ways, bounds, depth)
        if leaving is None:
            words = f"No branch was found along a null vector of {parent.name} at {special.point.load:.8g}."
            self.observer.warn(Remark(words, special.point.load, branch=parent.name))
            return None
        points, begins = leaving
        if not bounds[0] <= points[1].load <= bounds[1]:
            words = f"  what leaves {parent.name} at {special.point.load:.8g} is outside the range"
            self.observer.note(Remark(words, special.point.load, branch=parent.name))
            return None
        name = self._unused(f"{parent.name}." if parent.depth else "branch ")
        return Branch(name, (parent.name, i), depth, points, begins=begins)

    def _is_new(self, parent: Branch, branch: Branch, firsts: list[Point], before: int) -> bool:
        """Whether a branch that leaves is new, and no mirror image of one of the ``firsts`` that leave there."""
        assert branch.parent is not None
        special, first = parent.special[branch.parent[1]], branch.points[1]
        image = next((p for p in firsts if are_images(self.solver, p, first)), None)
        if image is not None:
            if image.mesh == first.mesh == self.solver.mesh:
                self._other_side(self.branches[before:], special, image, first)
            return False
        firsts.append(replace(first))  # as it is now: once it is traced richer meshes have decided its index
        known = special.connects_to is None and self._traced_already(branch, special)
        return not known and not self._came_from(parent, special, first)

    def _other_side(self, traced: Sequence[Branch], special: SpecialPoint, first: Point, image: Point) -> None:
        """Say that the mirror ``image`` of a branch, which is not traced, has other ordinates, if it does."""
        for branch in [branch for branch in traced if branch.points[1].x is first.x]:
            if words := other_ordinates(branch, first, image, self.solver):
                said = (
                    f"  {branch.name}: What leaves {special.point.load:.8g} on the other side is its mirror image "
                    f"({words}), at the same loads and as stable, but has other ordinates, and is not traced."
                )
                self.observer.note(Remark(said, special.point.load, branch=branch.name))

    def _lines(self, special: SpecialPoint, ways: Sequence[PETSc.Vec]) -> list[PETSc.Vec]:
        """Directions of the branches that leave, by those of the null vectors; what leaves subcritically is first."""
        if len(ways) < 2 or special.test_function != "mu":
            return list(ways)
        if len(ways) > 2:
            words = (
                f"  {len(ways)} null vectors at {self.scene.load} = {special.point.load:.8g}: directions in which "
                "branches leave are sought at random there, and some may be missing."
            )
            self.observer.note(Remark(words, special.point.load))
        found = list[tuple[str, PETSc.Vec]]()
        with self.solver.system.clock.scope("location"):
            for way in lines(self.solver, special, ways):
                form = normal_form_of(self.solver, origin_of(self.solver, special), way)
                found.append((self._kind(form, special), way))
        found.sort(key=lambda each: not each[0].startswith("subcritical"))
        several = dict.fromkeys(kind for kind, _ in found if kind)
        if len(several) > 1:
            special.note = f"branches of several forms leave here: {', '.join(several)}"
        return [way for _, way in found]

    def _kind(self, form: NormalForm | None, special: SpecialPoint) -> str:
        """Kind of the form of a branch that leaves a special point; empty where it is not known."""
        if form is None:
            return ""
        form.classify(*self._indices(special))
        return form.kind

    @staticmethod
    def _indices(special: SpecialPoint) -> tuple[int, int]:
        """Index of the branch that is left at loads just below, and just above."""
        indices = special.negative_before, special.negative_after
        return indices if special.point.slope > 0 else (indices[1], indices[0])

    def _law(self, special: SpecialPoint, direction: PETSc.Vec) -> None:
        """Find the normal form at a branch point: of the branch that leaves, or of this one if it ends on another."""
        if special.law is not None:
            return
        from_the_side = special.test_function == "slope"
        with self.solver.system.clock.scope("location"):
            way = special.null_vectors[0] if from_the_side else direction
            special.law = normal_form_of(self.solver, origin_of(self.solver, special), way)
        if special.law is not None and isfinite(special.error_estimate):
            with self.solver.system.clock.scope("error bars"):
                self.meshes.richer(special.point.mesh).law(special, way, special.law)
        if special.law is not None and not from_the_side:
            special.law.classify(*self._indices(special))
            self.observer.law(special)

    def _classify_from_the_side(self, special: SpecialPoint, trunk: Sequence[Branch]) -> None:
        """Name a pitchfork that was reached along its side branch, from the branch that it ends on, now traced."""
        index = {branch.points[1].load > special.point.load: branch.points[1].negative for branch in trunk}
        if special.law is not None and special.test_function == "slope" and len(index) == 2:
            special.law.classify(index[False], index[True])
            self.observer.law(special)

    def _unused(self, before: str, after: str = "", number: int = 1) -> str:
        """Name with the least ``number`` from this one on that no branch has: of a file, a name is one branch's."""
        names = {branch.name for branch in self.branches}
        while (name := f"{before}{number}{after}") in names:
            number += 1
        return name

    def _came_from(self, parent: Branch, special: SpecialPoint, point: Point) -> bool:
        """Whether what leaves the end of a side branch is that branch again, or its mirror image."""
        if special.test_function != "slope":
            return False
        since = parent.points[-1].arclength - REACH * point.arclength  # its steps may be short there
        rows = next((i for i, row in enumerate(parent.points) if row.arclength >= since), 0)
        tail = replace(parent, points=parent.points[max(min(rows, len(parent.points) - TAIL), 0) :])
        known = equilibria_at(self.solver, [tail], point.load)
        return any(equivalent(point, other, self.solver.units, SAME_STATE) for other in known)

    def _traced_already(self, branch: Branch, special: SpecialPoint) -> bool:
        """Whether another branch ended at this branch point coming along the same way."""
        return any(
            neighbours(branch.points[1], row, self.solver.units)
            for other in self.branches
            for end in other.special
            if end.connects_to is not None and self.alike(end.point, special.point, SAME_SPECIAL)
            for row in other.points[max(end.row - 2, 0) : end.row]
        )
