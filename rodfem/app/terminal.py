"""Terminal output, on rank 0 only: the rod, what its diagram says in words, and a table of its special points.

A verbose one has what is technical, too: unknowns, meshes, special points as they are found, and times.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from math import isfinite
from textwrap import fill
from time import monotonic
from typing import Any, TextIO

import numpy as np
from mpi4py import MPI

from rodfem import code_cache
from rodfem.continuation.branch import Branch, Point, SpecialPoint, not_followed
from rodfem.continuation.kinds import END
from rodfem.continuation.observer import Observer
from rodfem.errors import many
from rodfem.fem.system import System
from rodfem.forms.kinematics import RODS
from rodfem.modes.modes import Modes
from rodfem.output.files import mesh_of
from rodfem.output.summary import called, in_sentences
from rodfem.output.table import row_data, special_data
from rodfem.output.words import (
    COUNT,
    INDEX,
    eigenvalue_in_words,
    in_decimals,
    index_in_words,
    mesh_in_words,
    number,
    rounded_up,
    special_lines,
)
from rodfem.problem.scene import Scene
from rodfem.problem.units import ONES
from rodfem.stability.assessment import Verdict
from rodfem.stability.soft_mode import in_short
from rodfem.timing import WORK, Clock

WIDTH, PAUSE = 110, 30.0  # columns of a paragraph; seconds between two lines of progress
MOTIONS = ("rates", "rates of negative real part:"), ("frequencies", "eigenvalues negative or complex:")
"""Eigenvalues of a rod without a potential, and the unstable ones, by the order of the equations of motion in time."""
STRAINS = ("v1 (shear)", "v2 (shear)", "v3 (stretch)")


def _roots(point: Point, one: float, order: int) -> dict[str, str]:
    """Frequencies of a point, of a natural size ``one``, in words for each kind of motion; a complex pair once.

    Of the ``order`` 1 in time they are rates.
    """
    words: dict[str, list[str]] = {}
    for value, kind in zip(point.omega2, point.motion, strict=True):
        w = complex(*value) ** (1.0 / order)
        if value[1] >= 0:
            re, im = in_decimals(w.real, 4, one), in_decimals(abs(w.imag), 4, one)
            text = re if value[0] >= 0 or order == 1 else f"{im}i"
            words.setdefault(kind, []).append(text if value[1] == 0 else f"{re}+-{im}i")
    return {kind: "  ".join(texts[:4]) + (" ..." if len(texts) > 4 else "") for kind, texts in words.items()}


def _eigenvalues(found: Verdict, modes: Modes | None) -> Iterator[str]:
    """Eigenvalues of a verdict in words, with their errors and motions if ``modes`` were computed."""
    errors, motions = np.full(len(found.values), np.nan), ("",) * len(found.values)
    rows = zip(found.values, found.errors, errors, motions, strict=True)
    if modes is not None:
        rows = zip(modes.value, modes.residual, modes.error, modes.motion, strict=True)
    for value, residual, error, motion in rows:
        known = f"residual {residual:.0e}" if isfinite(residual) else ""
        yield f"mu = {eigenvalue_in_words(complex(value), error):<28} {known:<15} {motion}".rstrip()
    if modes is not None and modes.note:
        yield modes.note


class Report(Observer):
    """Prints on rank 0."""

    def __init__(
        self,
        comm: MPI.Comm = MPI.COMM_WORLD,
        stream: TextIO | None = None,
        words: Callable[[str], str] = str,
        *,
        verbose: bool = True,
    ) -> None:
        """Print what ``words`` makes of each line, if ``verbose`` of technical ones too, to ``stream`` on rank 0."""
        self.verbose = verbose
        self.count, self.words, self.units, self.wide = INDEX, words, ONES, 6
        self.eigenvalues, self.unstable = MOTIONS[1]
        self.on = comm.rank == 0
        self.stream = stream or sys.stdout
        self.known: list[Branch] = []
        self.load, self.shown = "load", monotonic()

    def say(self, line: str = "") -> None:
        """Print one line."""
        if self.on:
            self.stream.write(f"{self.words(line)}\n")
            self.stream.flush()

    def detail(self, line: str) -> None:
        """Print a technical line, if all are wanted."""
        if self.verbose:
            self.say(line)

    def note(self, sentence: str) -> None:
        """Print it."""
        self.say(sentence)

    def compiling(self) -> None:
        """Say why the first run takes longer."""
        kept = code_cache.folder()
        self.say(f"Compiling the forms for the first time (some seconds; kept in {kept} for later runs) ...")

    def system(self, system: System, accuracy: float | None = None) -> None:
        """Say what is solved, with how many unknowns, and the accuracy asked for."""
        scene, f = system.scene, system.fields
        self.say(f"{scene.title or scene.name}: {scene.rod} rod, {mesh_in_words(mesh_of(system))}")
        if accuracy is not None:
            self.detail(f"  to start with: meshes are chosen on the way for an accuracy of {accuracy:g}")
        self.detail(f"  unknowns: {', '.join([*f.dofs, *f.scalars])}")
        self.units, self.load = scene.units, scene.load
        self.count = INDEX if scene.conservative else COUNT
        self.eigenvalues, self.unstable = MOTIONS[scene.inertia.order - 1]
        self.wide = len("0->1 (in space 2)") if scene.planar and scene.conservative else max(6, len(self.count))
        if not scene.conservative:
            loads = ", ".join(scene.without_potential())
            self.say(f"  not conservative ({loads}): stability is a matter of {self.eigenvalues}, not of an index")
        self._ignored(scene)

    def _ignored(self, scene: Scene) -> None:
        """Say which terms of the stored energy count for nothing in a rod of that kind, and in which they would."""
        if not (ignored := scene.ignored_strains):
            return
        wanted = {*scene.free_strains, *ignored}
        kind = min((rod for rod, free in RODS.items() if wanted <= set(free)), key=lambda rod: len(RODS[rod]))
        self.warn(
            f"The stored energy depends on {', '.join(STRAINS[i] for i in ignored)}, but a rod that is {scene.rod} "
            f"keeps that undeformed, so that it counts for nothing: leave it out, or choose rod={kind!r}."
        )

    def mesh(self, system: System, load: float, why: str) -> None:
        """Say that a branch goes on with another mesh, and why."""
        self.detail(f"  from {system.scene.load} = {load:.6g} on {mesh_in_words(mesh_of(system))} ({why})")

    def accuracy(self, used: Sequence[System], worst: float, asked: float) -> None:
        """Say with which meshes a branch was traced, and the error of the worst of its points."""
        word = "" if worst <= asked else f", above the {asked:g} asked for"
        meshes = "; ".join(map(mesh_in_words, map(mesh_of, used)))
        self.detail(f"  largest error {rounded_up(worst):.0e}{word}; {meshes}")

    def branch(self, branch: Branch) -> None:
        """Head a new branch."""
        self.known.append(branch)
        origin = f" from {called(branch.parent[0])}, special point {branch.parent[1] + 1}" if branch.parent else ""
        self.detail(f"\n{branch.name}{origin}")
        self.detail(f"       load           ordinate       int W ds  {self.count:>{self.wide}}  zero  located to")

    def progress(self, branch: Branch, point: Point) -> None:
        """Print a line now and then while a branch is traced."""
        if monotonic() - self.shown < PAUSE:
            return
        self.shown, waiting = monotonic(), not_followed(self.known)
        self.say(
            f"  ... {branch.name}, {len(self.known)} known, {many(waiting, 'branch point')} left to follow, "
            f"{self.load} = {in_decimals(point.load, 5, self.units.load)}, {self.count} {point.negative}, "
            f"{len(branch.points)} points"
        )

    def special(self, branch: Branch, special: SpecialPoint) -> None:
        """Print a special point as it is found, as AUTO does."""
        self.detail("  " + self._line(special))

    def _line(self, special: SpecialPoint) -> str:
        p, units = special.point, self.units
        connects_to = f"  meets {special.connects_to[0]}" if special.connects_to else ""
        index = index_in_words(special_data(special), row_data(p))
        return (
            f"{special.kind.code}   {in_decimals(p.load, 10, units.load):<14} "
            f"{in_decimals(p.ordinate, 9, units.ordinate):<14} {in_decimals(p.energy, 6, units.energy):<10} "
            f"{index:>{self.wide}} {p.zero:>5}  {special.located_to:.0e}{connects_to}"
        )

    def finished(self, branch: Branch) -> None:
        """Close a branch: its last point and why it ended."""
        if branch.special and branch.special[-1].kind == END:
            self.detail("  " + self._line(branch.special[-1]))
        self.detail(f"  {len(branch.points)} points; ended: {branch.ended}")

    def table(self, data: Mapping[str, Any], branches: Sequence[Branch], most: int = 0) -> None:
        """Print every special point of the ``data`` of diagram.json, and what was not followed of its ``branches``."""
        self.say("\n" + "\n".join(special_lines(data)))
        if missed := not_followed(branches):
            deepest = max(b.depth for b in branches if any(s.to_follow for s in b.special))
            more = f"Plan(depth={deepest + 1})"
            limit = f"as the depth is {deepest} (switches from the first branch)"
            if most and len(branches) >= most:
                more, limit = f"Plan(most_branches={2 * most})", f"as there are {len(branches)} branches"
            points = many(missed, "branch point was", "branch points were")
            self.say(f"  {points} not followed, {limit}: {more} follows what leaves there")

    def summary(self, data: Mapping[str, Any]) -> None:
        """Print a diagram, the contents of ``diagram.json``, in sentences."""
        self.say("\nIn words (rodfem explain WORD has more)")
        for sentence in in_sentences(data):
            self.say(fill(sentence, WIDTH, initial_indent="  ", subsequent_indent="    "))

    def derivatives(self, branches: Sequence[Branch], scene: Scene) -> None:
        """Print the derivatives of the loads of special points in the constants, if they were asked for."""
        found = [(b.name, s) for b in branches for s in b.special if s.derivatives]
        critical, states = ([(name, s) for name, s in found if s.kind.request == asked] for asked in (False, True))
        self._derivatives(f"critical {scene.load} changes (d{scene.load}/dNAME)", critical)
        self._derivatives(f"{scene.ordinate.name} at a load changes (per NAME)", states)

    def _derivatives(self, what: str, rows: Sequence[tuple[str, SpecialPoint]]) -> None:
        """Print a table of derivatives of ``what``, if there are any."""
        if rows:
            self.say(f"\nHow fast the {what}")
        for name, special in rows:
            pairs = special.derivatives.items()  # what is less than its bar is zero
            values = "  ".join(f"{c}: {0 if abs(value) <= bar else number(value, bar)}" for c, (value, bar) in pairs)
            self.say(f"  {name:<12} {special.kind.words:<13} {special.point.load:<13.8g} {values}")

    def spectra(self, branches: Sequence[Branch], scene: Scene) -> None:
        """Print the left-most eigenvalues of the special points, if they were asked for."""
        rows = [(b.name, s.kind.words, s.point) for b in branches for s in b.special if s.point.spectrum]
        if rows:
            own = "drag" if scene.inertia.order == 1 else "inertia"
            inertia = f"the scene's {own}" if scene.has_inertia else "unit rotary inertia"
            self.say(f"\nLeft-most {scene.inertia.words} for {inertia} (symmetry modes left out; no error bars)")
        for name, kind, point in rows:
            values = "  ".join(f"{mu:.6g}" for mu in point.spectrum)
            self.say(f"  {name:<12} {kind:<14} {point.load:<13.8g} {values}")

    def frequencies(self, branches: Sequence[Branch], scene: Scene) -> None:
        """Print the square roots of the left-most eigenvalues, or rates, at about ten loads, if the scene has them."""
        points, order = [p for b in branches for p in b.points if p.omega2], scene.inertia.order
        if points:
            heads = "Rates of decay", "Frequencies omega, the square roots of the left-most eigenvalues,"
            self.say(f"\n{heads[order - 1]} against {scene.load} (errors not estimated)")
            self._frequencies(points[:: max(1, (len(points) - 1) // 10)], scene.load, order)

    def _frequencies(self, shown: Sequence[Point], load: str, order: int) -> None:
        table = [_roots(p, self.units.omega2 ** (1.0 / order), order) for p in shown]
        kinds = sorted(set().union(*table))
        table.insert(0, dict(zip(kinds, kinds, strict=True)))
        widths = {kind: max(len(words.get(kind, "")) for words in table) for kind in kinds}
        heads = [load, *(in_decimals(p.load, 4, self.units.load) for p in shown)]
        for head, words in zip(heads, table, strict=True):
            cells = "   ".join(f"{words.get(kind, ''):<{width}}" for kind, width in widths.items())
            self.say(f"  {head:>10}  {cells}".rstrip())
        if "torsion" not in widths and order == 2:
            self.say("  no frequency of torsion is among them: without inertia about d3 all are infinite")

    def verdict(self, name: str, load: str, found: Verdict, modes: Modes | None = None) -> None:
        """Print what was ``found`` of the branch ``name`` at a ``load``, with its ``modes`` if there are some."""
        index = found.negative, found.undecided, found.kink
        words = in_short(*index, found.uncompared, found.negative_in_space)
        words = words if self.count == INDEX else words.replace("index", self.unstable)
        zero = f", {found.zero} zero" if found.zero else ""
        self.say(f"  {name}, {load}: {words}{zero}")
        for line in (*map(str, found.soft), *_eigenvalues(found, modes)):
            self.say(f"    {line}")
        proof = ", counts prove that none is missing" if found.certified and len(found.values) else ""
        self.say(f"    {found.method} ({found.reason}){proof}")
        self.detail(f"    {many(found.factorisations, 'factorisation')}, {1e3 * found.seconds:.1f} ms")
        if found.band:
            inside = ", ".join(f"{m:.3g} +- {u:.0e}" for m, u in zip(found.inside, found.uncertainty, strict=True))
            inside = f"; inside: {inside}" if inside else ""
            self.detail(f"    inertia decides beyond {found.band:.1e} (in the metric of rotations){inside}")

    def warn(self, sentence: str) -> None:
        """Say what went wrong without stopping."""
        self.say(f"  ! {sentence}")

    def timing(self, clock: Clock, points: int) -> None:
        """Print how long it took, and where the time went."""
        known = "index" if self.count == INDEX else self.eigenvalues
        self.say(f"\n{many(points, 'point')} with {'its' if points == 1 else 'their'} {known} in {clock.total():.1f} s")
        names = ("setup", *WORK, "location", "error bars", "modes", "files")
        took = {name: f"{clock.seconds.get(name, 0.0):.2f} s" for name in names}
        parts = ", ".join(f"{name} {seconds}" for name, seconds in took.items() if seconds != "0.00 s")
        self.detail(f"Time: {parts}; {clock.each(points):.2f} ms a point ({', '.join(WORK)})")
