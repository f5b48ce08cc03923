"""One run of a scene from beginning to end: trace, save as it goes, then judge, follow and draw."""

from __future__ import annotations

import atexit
import gc
import os
import shlex
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from functools import cache, partial
from itertools import product
from math import nan
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mpi4py import MPI

from rodfem.app.persons_file import leave_the_run
from rodfem.app.terminal import Report
from rodfem.continuation.branch import Branch, SpecialPoint
from rodfem.continuation.kinds import USER
from rodfem.continuation.observer import Remark
from rodfem.diagram.diagram import PLAN, Diagram, traced
from rodfem.diagram.plan import Plan, plan_of
from rodfem.diagram.solver import MESH, RANKS, SCENE
from rodfem.errors import ConvergenceError, InputError
from rodfem.fem.fields import Discretization
from rodfem.fem.system import System
from rodfem.modes.finder import ModeFinder, typical_modes
from rodfem.modes.modes import Modes, save_modes
from rodfem.output.files import load_json, save_json, save_run
from rodfem.output.pieces import typical_state
from rodfem.problem.arguments import checked, function, path, yes_or_no
from rodfem.problem.scene import Scene
from rodfem.problem.trials import asked_for
from rodfem.ranks import on_first
from rodfem.stability.assessment import Assessor, Verdict
from rodfem.whole_files import locked, remove_earlier

if TYPE_CHECKING:
    from rodfem.codim2.locus import Locus

atexit.register(gc.freeze)  # what there is at the end goes with the process: a search for garbage in it takes 0.15 s


@checked(
    scene=SCENE,
    discretization=MESH,
    plan=PLAN,
    output=path("results/column"),
    figures=yes_or_no,
    comm=RANKS,
    quiet=yes_or_no,
    verbose=yes_or_no,
    words=function("str"),
)
def run(
    scene: Scene,
    discretization: Discretization | None = None,
    plan: Plan | None = None,
    output: Path | str | None = None,
    *,
    figures: bool = True,
    comm: MPI.Comm = MPI.COMM_WORLD,
    quiet: bool = False,
    verbose: bool = False,
    words: Callable[[str], str] = str,
    **of_plan: Any,
) -> Diagram:
    """Trace a scene, and write ``diagram.json``, ``states.h5`` and (on rank 0) the pictures into ``output``.

    Files are updated after every branch: an interrupted run keeps all completed branches, which :func:`rodfem.load`
    reads; to have the others, run the scene anew.  Those of an earlier run in the folder stay until the first branch is
    complete.  Returns the diagram.  A file that ``rodfem run FILE.py`` reads for its rod ends here: that command runs
    it.  Raises :class:`~rodfem.errors.InputError` for bad input, before any computation, and where the folder cannot be
    written any more or is in use by another process, and :class:`~rodfem.errors.ConvergenceError` where not even a
    first equilibrium is found.

    ``scene``, ``discretization``, ``plan``, or its fields ``of_plan``, and ``comm`` are as for :func:`rodfem.trace`;
    ``output`` is a folder, by default ``results/<name>``; ``figures`` says whether pictures are drawn, ``quiet`` that
    nothing is printed, ``verbose`` that what is technical is printed, too: unknowns, meshes, points as they are found,
    times, and methods.  ``words`` rewords each line on the terminal.
    """
    plan, discretization = plan_of(plan, of_plan), discretization or Discretization()
    leave_the_run(discretization, plan)
    output = Path(output or Path("results") / scene.name)
    plan.check(scene, discretization)
    terminal = Terminal(plan, output, comm, words, quiet=quiet, verbose=verbose)
    with locked(output, comm):
        diagram = traced(scene, discretization, plan, terminal, comm)
        terminal.report(diagram, figures)
    return diagram


class Terminal(Report):
    """Shows a run on the terminal, and keeps its files up to date."""

    def __init__(
        self, plan: Plan, output: Path, comm: MPI.Comm, words: Callable[[str], str], *, quiet: bool, verbose: bool
    ) -> None:
        """Write what the ``plan`` asks for into a folder ``output`` that there is, on the first rank of ``comm``."""
        super().__init__(comm, words=words, verbose=verbose)
        self.on = self.on and not quiet
        self.plan, self.output, self.comm, self._saved = plan, output, comm, 0
        self.files: list[str] = []
        self.data: dict[str, Any] = {}

    def system(self, system: System, accuracy: float | None = None) -> None:
        """Say what is solved, and refuse a method that does not apply before anything is computed."""
        super().system(system, accuracy)
        if self.plan.method or self.plan.modes:
            Assessor(system).choose(self.plan.method or "auto", self.plan.modes)

    def complete(self, diagram: Diagram) -> None:
        """Save the branches that have not been saved: an interrupted run keeps those that are complete."""
        if self._saved == len(diagram):
            return
        new = diagram.branches[self._saved :]
        modes = typical_modes(new, diagram.solvers)
        with diagram.clock("files"):
            if not self._saved:
                on_first(self.comm, lambda: remove_earlier(self.output, _files_of_a_run(self.output)))
            self.data = diagram.data | {"files": self.files}
            save_run(self.data, new, diagram.solvers, self.output, first=not self._saved, modes=modes)
            self._saved = len(diagram)

    def _name(self, *files: str) -> None:
        """Name ``files`` in the diagram before they are written: the next run in the folder removes what is named."""
        self.files += [file for file in files if file not in self.files]
        on_first(self.comm, lambda: save_json(self.data | {"files": self.files}, self.output / "diagram.json"))

    @contextmanager
    def _guard(self, diagram: Diagram, branch: Branch, special: SpecialPoint) -> Iterator[None]:
        """Go on where the block fails, and keep a warning of the special point with the diagram."""
        try:
            yield
        except (InputError, ConvergenceError) as trouble:
            remark = Remark(str(trouble), special.point.load, branch=branch.name)
            diagram.warnings.append(remark)
            self.warn(remark)

    def report(self, diagram: Diagram, figures: bool) -> None:
        """Print tables, do what the plan asks for beyond branches, and draw the pictures if ``figures``."""
        scene, plan, output, branches = diagram.scene, self.plan, self.output, diagram.branches
        self.complete(diagram)
        if plan.sensitivity:
            self._derive(diagram)
        data = self.data = diagram.data
        self._name()
        self.summary(data)
        self.table(data, branches, plan.most_branches)
        self.derivatives(branches, scene)
        self.spectra(branches, scene)
        self.frequencies(branches, scene)
        self.timing(diagram.clock, sum(len(b.points) for b in branches))
        named = shlex.quote(str(output))
        self.say(f"Results in {output}{os.sep}: diagram.json, states.h5 (rodfem view {named} shows them)")
        if plan.method or plan.modes:
            self._assess(diagram)
        if plan.locus is not None:
            self._follow(diagram, figures, plan.locus)
        if figures:
            self._name("diagram.png", "shape.png")
            on_first(self.comm, lambda: draw(output, self))
        diagram.complete = True
        self.data = data | diagram.remarks | {"complete": True}
        self._name()

    def _derive(self, diagram: Diagram) -> None:
        """Find derivatives of critical loads, and of ordinates at given loads, in each constant that is in a form."""
        asked = asked_for(diagram.scene) - {diagram.scene.load, "s"}
        bar = self.plan.error_bars or self.plan.accuracy is not None
        for branch in diagram:
            states = [special for special in branch.special if special.kind == USER]
            for special, name in product([*_to_follow(branch), *states], sorted(asked)):
                with self._guard(diagram, branch, special):
                    user = special.kind == USER
                    found = special.point.derivative(name) if user else special.derivative(name, along_the_rod=True)
                    special.derivatives[name] = found.value, found.error if bar else nan
                    if found.acts_along(special.point.load):
                        special.densities[name] = found.ends, found.density

    def _assess(self, diagram: Diagram) -> None:
        """Judge the states at the loads of the plan, each on its own mesh; save their modes."""
        scene, plan, file = diagram.scene, self.plan, self.output / "modes.h5"
        which = f"left-most {scene.inertia.words}" if scene.conservative else f"{scene.inertia.words} nearest zero"
        self.say(f"\nIs it stable? ({which})")
        finder_on = cache(lambda mesh: ModeFinder(diagram.solvers[mesh], plan.error_bars))
        saved = False
        for branch, special in ((b, s) for b in diagram for s in b.special if s.kind == USER):
            found: tuple[Verdict | None, Modes | None] = None, None
            with self._guard(diagram, branch, special):
                found = _verdict(finder_on(special.point.mesh), special, plan)
            verdict, modes = found
            if verdict is None:
                continue
            self.verdict(branch.name, f"{scene.load} = {special.point.load:.10g}", verdict.at(special.point), modes)
            if modes is not None:
                self._name("modes.h5")
                keep = partial(save_modes, modes, file, branch.name, special.row, _header(diagram))
                on_first(self.comm, partial(keep, first=not saved))
                saved = True
        if saved:
            self.say(f"Modes in {self.output}{os.sep}: modes.h5 (rodfem view moves them)")

    def _follow(self, diagram: Diagram, figures: bool, asked: tuple[str, float, float]) -> None:
        """Follow each special point that no locus passes in the plane of the load and the parameter asked for."""
        saved: list[dict] = []
        for branch in diagram:
            near: list[Locus] = []
            for special in _to_follow(branch):
                which = f"{special.kind} of {branch.name} at {special.point.load:.8g}"
                if any(found.passes(special, diagram.solvers[0].units) for found in near):
                    self.say(f"\nThe {which} is on a locus above")
                    continue
                if self.plan.accuracy is not None:
                    self.say("\nA locus stays on the mesh of its special point: its estimate says how accurate it is")
                known = len(near)
                with self._guard(diagram, branch, special):
                    near.append(diagram.locus(special, asked[0], asked[1:]))
                for found in near[known:]:
                    self.say(found.text())
                    saved.append(found.data())
                    self._name(f"locus-{len(saved)}.json", *["locus.png"] * figures)
                    on_first(self.comm, partial(found.save, self.output / f"locus-{len(saved)}.json"))
        if saved and figures:
            from rodfem.output.plot_locus import draw_locus

            on_first(self.comm, lambda: draw_locus(saved, self.output / "locus.png"))
            self.say(f"Loci in {self.output}{os.sep}: locus-1.json ..., locus.png")


def _files_of_a_run(folder: Path) -> list[str]:
    """Names of the files that a diagram in a folder names."""
    try:
        return [str(name) for name in load_json(folder / "diagram.json").get("files", ())]
    except InputError:
        return []


def _verdict(finder: ModeFinder, special: SpecialPoint, plan: Plan) -> tuple[Verdict | None, Modes | None]:
    """Verdict on a state, and its modes if the plan asks for them."""
    if plan.modes:
        return finder(special.point.x, plan.modes, plan.method or "auto")
    return finder.assessor(special.point.x, plan.method), None


def _header(diagram: Diagram) -> dict[str, Any]:
    """What a file of modes says of its scene and its mesh."""
    scene, mesh = diagram.scene, asdict(diagram.solvers[0].system.fields.discretization)
    about = {"scene": scene.name, "title": scene.title or scene.name, "parameter": scene.load}
    return about | {name: value for name, value in mesh.items() if name != "vertices"}


def _to_follow(branch: Branch) -> list[SpecialPoint]:
    """Special points of a branch that have a locus, but for those at which it meets another branch."""
    return [s for s in branch.special if s.connects_to is None and (s.kind.counted or s.kind.line)]


def draw(output: Path, report: Report) -> None:
    """Draw the diagram, and at the same time in a second process the shape of a stable state if there is one."""
    from concurrent.futures import ThreadPoolExecutor

    from rodfem.output.files import load_json
    from rodfem.output.plot_diagram import draw_diagram
    from rodfem.output.plot_frequencies import draw_frequencies
    from rodfem.output.render import draw_shape_safely
    from rodfem.output.words import is_sweep

    data = load_json(output / "diagram.json")
    if is_sweep(data):
        draw_frequencies(data, output / "diagram.png")
        report.say(f"Picture in {output}{os.sep}: diagram.png")
        return
    branch, row, words = typical_state(data)
    name = "\N{GREEK SMALL LETTER LAMDA}" if data["parameter_label"] == r"\lambda" else data["parameter"]
    caption = f"{data['title']}, {branch}, {name} = {words}"
    with ThreadPoolExecutor(1) as background:  # the shape is drawn by a process of its own, for which the thread waits
        shape = background.submit(draw_shape_safely, output / "states.h5", branch, row, output / "shape.png", caption)
        draw_diagram(data, output / "diagram.png")
    trouble = shape.result()
    report.say(f"Pictures in {output}{os.sep}: diagram.png" + ("" if trouble else ", shape.png"))
    if trouble:
        report.say(trouble)
