"""The whole picture: tracing a scene, without a file or a line of output, and all that can be asked of its diagram."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import fields, replace
from html import escape
from itertools import chain
from numbers import Integral
from operator import attrgetter
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, overload
from uuid import uuid4

from mpi4py import MPI

from rodfem import compat
from rodfem.adaptivity.mesh_sequence import start_mesh
from rodfem.continuation.branch import LAWS, Branch, Point, SpecialPoint
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.follow import StepControl
from rodfem.continuation.kinds import KINDS
from rodfem.continuation.natural_shape import misfit
from rodfem.continuation.observer import Observer, Recorder, Remark
from rodfem.deflation.search import Coexisting, equilibria_at, with_copies
from rodfem.diagram.equilibria import check_start
from rodfem.diagram.explorer import Explorer
from rodfem.diagram.plan import EQUATIONS, Plan, entries, plan_of
from rodfem.diagram.solver import MESH, METHOD, POINT, RANKS, SCENE, Solver, state_of
from rodfem.diagram.sweep import Sweep
from rodfem.errors import InputError, many
from rodfem.fem import form_compiler
from rodfem.fem.fields import Discretization
from rodfem.fem.fingerprint import fingerprint
from rodfem.fem.shape import compile_richer
from rodfem.libraries import optional
from rodfem.modes.finder import typical_modes
from rodfem.modes.modes import Modes
from rodfem.output.files import as_data, origin, save_run
from rodfem.output.table import REMARK
from rodfem.problem.arguments import Check, a, checked, finite, interval, path, text, whole
from rodfem.problem.functions import derived
from rodfem.problem.scene import Scene
from rodfem.problem.validation import FLEXIBLE, round_off_of_strains, statement
from rodfem.ranks import agree, end_together, on_first
from rodfem.stability.assessment import Verdict
from rodfem.timing import Clock
from rodfem.whole_files import locked

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rodfem.codim2.locus import Locus
    from rodfem.output.render import Snapshot
    from rodfem.report.page import Page


class Diagram:
    """A bifurcation diagram: what :func:`rodfem.trace` returns, and :func:`rodfem.load` reads.

    It is a sequence of branches, in the order in which they were found, which are also found by name.  All methods that
    compute are collective over the ranks that share the rod.

    ``scene`` and ``plan`` are what was traced, ``branches`` all branches, and ``solvers`` those of the meshes, by the
    number that a point has in ``mesh``.  ``warnings`` and ``notes`` are sentences on what went wrong without stopping
    the computation, and on what is worth knowing; each has the ``branch`` and the ``loads`` that it is about, or None.
    ``complete`` says whether all that was asked for has been done.
    """

    def __init__(self, scene: Scene, plan: Plan, branches: list[Branch], solvers: Sequence[BranchSolver]) -> None:
        self.scene, self.plan, self.branches, self.solvers = scene, plan, branches, solvers
        self.warnings: list[Remark] = []
        self.notes: list[Remark] = []
        self.run, self.origin, self.complete = uuid4().hex, origin(), False
        self.asked: dict[str, Any] = {}  # plan and fingerprint of the equations, as they were traced
        self.lacks = ""  # what its plan had and its file does not hold: ``events`` or ``steps``

    # --- what there is ---------------------------------------------------------------------------------------------

    @property
    def clock(self) -> Clock:
        """Seconds by scope, of the computation and of later requests."""
        return self.solvers[0].system.clock

    @property
    def span(self) -> tuple[float, float]:
        """Range of the load, its start first."""
        return self.plan.load_range(self.scene)

    def __len__(self) -> int:
        return len(self.branches)

    def __iter__(self) -> Iterator[Branch]:
        return iter(self.branches)

    @overload
    def __getitem__(self, key: str | int) -> Branch: ...

    @overload
    def __getitem__(self, key: slice) -> list[Branch]: ...

    def __getitem__(self, key: str | int | slice) -> Branch | list[Branch]:
        """Branch by name or number, or several as of a list; raises :class:`KeyError` or :class:`IndexError`."""
        if isinstance(key, slice):
            return self.branches[key]
        if isinstance(key, Integral):
            return self.branches[int(key)]
        for branch in self.branches:
            if branch.name == key:
                return branch
        raise KeyError(f"no branch {key!r}: there are {', '.join(repr(b.name) for b in self.branches)}")

    @checked(kind=text("fold"), branch=text("branch 1"))
    def special(self, kind: str | None = None, branch: str | None = None) -> list[SpecialPoint]:
        """Special points, of one kind ("fold", "branch point", "flutter", "divergence", ...) or one branch if named.

        Without a kind those at which something happens: loads asked for and ends are left out.  Branch points are found
        by the kinds of their normal forms, too ("pitchfork", "subcritical pitchfork", "transcritical", ...), and events
        by their names.  Raises :class:`~rodfem.errors.InputError` for a kind that does not exist.
        """
        every = list(chain.from_iterable(b.special for b in (self if branch is None else [self[branch]])))
        if kind is None:
            return [s for s in every if not s.kind.request]
        found = [s for s in every if kind in s.names]
        known = [*KINDS, *LAWS, *map(attrgetter("name"), self.plan.events)]
        if not found and kind not in known:
            raise InputError(f"There is no kind {kind!r}: choose one of {', '.join(known)}.")
        return found

    @checked(load=finite(1.0))
    def at(self, load: float) -> list[Point]:
        """All equilibria of the diagram at exactly ``load``, computed there, each with its own index.

        In the order of their branches; at the load of a fold or branch point also the state there.  Raises
        :class:`~rodfem.errors.InputError` for a load outside the range, and
        :class:`~rodfem.errors.ConvergenceError` where no equilibrium is found between two rows on either side of it.
        """
        low, high = sorted(self.span)
        if not low <= load <= high:
            raise InputError(
                f"The load {load:g} is outside the range {low:g} to {high:g} of this diagram: trace a wider one, as in "
                "diagram.again(span=...)."
            )
        solver = self.solvers[self._finest()]
        if not solver.conservative:
            guess = min(self.branches[0].points, key=lambda p: abs(p.load - load))
            return [self.solver(guess).equilibrium(load, guess)]
        found = equilibria_at(solver, self.branches, load)
        compare = self.plan.error_bars or self.plan.accuracy is not None
        return [self.solver(p).examined(p, compare=compare, special=self._special_at(p)) for p in found]

    @checked(load=finite(1.0))
    def states(self, load: float) -> list[Coexisting]:
        """All equilibria at a load, as :meth:`at` finds them, each with the number of its symmetric copies.

        A diagram has one of mirror images, and of a circle of states: ``.images`` and ``.freedoms`` count them.
        """
        return [with_copies(self.solvers[point.mesh], point) for point in self.at(load)]

    @checked(point=POINT)
    def solver(self, point: Point | SpecialPoint) -> Solver:
        """Return the solver of the mesh that a point belongs to."""
        mesh = point.point.mesh if isinstance(point, SpecialPoint) else point.mesh
        return derived(self, mesh, lambda: Solver.of(self.solvers[mesh]))

    # --- what it can be asked ------------------------------------------------------------------------------------

    @checked(point=POINT, method=METHOD, number=whole(4, 1))
    def assess(self, point: Point | SpecialPoint, method: str = "auto", number: int = 4) -> Verdict:
        """Decide the stability of a point with a given method: see :meth:`rodfem.Solver.assess`."""
        return self.solver(point).assess(self._special_at(point) or point, method, number)

    @checked(point=POINT, number=whole(3, 1), method=METHOD)
    def modes(self, point: Point | SpecialPoint, number: int = 3, method: str = "auto") -> Modes:
        """Left-most modes of a point: see :meth:`rodfem.Solver.modes`."""
        return self.solver(point).modes(point, number, method)

    @checked(
        special=a(SpecialPoint, "a special point, as in diagram.special('fold')[0]"),
        parameter=text("A"),
        interval=interval(-3.0, 0.0),
        load=interval(0.0, 1.0),
        steps=a(StepControl, "a StepControl, as in StepControl(largest=0.02)"),
    )
    def locus(
        self,
        special: SpecialPoint,
        parameter: str,
        interval: tuple[float, float],
        load: tuple[float, float] | None = None,
        steps: StepControl | None = None,
    ) -> Locus:
        """Follow a special point in the plane of the load and a second parameter.

        ``special`` is a fold, a branch point, a flutter load or a divergence load of this diagram, ``interval`` has the
        least and greatest value of the ``parameter``, and ``load`` those of the load, by default the diagram's;
        ``steps`` control the step, by default :data:`rodfem.codim2.follow.STEPS`.  Raises
        :class:`~rodfem.errors.InputError` for a parameter, bounds or a kind of special point that make no sense, and
        :class:`~rodfem.errors.ConvergenceError` where the special point is not found again.
        """
        from rodfem.codim2.follow import STEPS, locus

        found = [branch for branch in self.branches if any(special is mine for mine in branch.special)]
        if not found:
            raise InputError(
                f"The special point at {self.scene.load} = {special.point.load:.8g} is not one of this diagram: give "
                "one of diagram.special()."
            )
        low, high = sorted(load or self.span)
        points, row = found[0].points, special.row
        # near an index that the mesh leaves open another eigenvalue may vanish with this one
        doubtful = any(point.undecided for point in points[max(row - 1, 0) : row + 2])
        solver, bounds = self.solvers[special.point.mesh], ((low, high), interval)
        return locus(solver, special, parameter, bounds, steps or STEPS, doubtful=doubtful)

    @checked(load=finite(1.0), tries=whole(24, 0), seed=whole(0, 0))
    def search(self, load: float, tries: int = 24, seed: int = 0) -> list[Point]:
        """Equilibria at ``load`` that are on no branch, by ``tries`` deflated Newton iterations; none twice."""
        return Solver.of(self.solvers[self._finest()]).search(load, self.at(load), tries, seed)

    @checked(discretization=MESH)
    def again(self, discretization: Discretization | None = None, **changes: Any) -> Diagram:
        """Trace once more with another discretisation, plan or constants: ``again(span=(60, 4))``, ``again(A=-1.5)``.

        ``changes`` are fields of :class:`~rodfem.Plan`, or constants of the scene, which share its forms.  The mesh
        stays unless one is given, or an accuracy.  Raises :class:`~rodfem.errors.InputError` for any other change.
        """
        system, plans = self.solvers[0].system, [f.name for f in fields(Plan)]
        in_plan = {name: changes.pop(name) for name in plans if name in changes}
        self._check_changes(in_plan, changes)
        plan, mesh = replace(self.plan, **in_plan), discretization or system.fields.asked
        if discretization is None and plan.accuracy is not None and mesh.vertices is None:
            mesh = Discretization(mesh.formulation, factors=mesh.factors)
        return trace(self.scene.varying(**changes) if changes else self.scene, mesh, plan, comm=system.comm)

    def _check_changes(self, in_plan: dict[str, Any], constants: dict[str, Any]) -> None:
        """Raise :class:`InputError` for a constant that there is not, and without what no file holds of a plan."""
        known = [name for name in self.scene.parameters if name != self.scene.load]
        if unknown := [name for name in constants if name not in known]:
            raise InputError(
                f"A plan has no {unknown[0]!r}, nor has the scene apart from its load: choose one of "
                f"{', '.join([*(f.name for f in fields(Plan)), *known])}, or give a Discretization first."
            )
        if self.lacks and self.lacks not in in_plan:
            raise InputError(
                f"The plan of this diagram had {self.lacks} of its own, which no file holds: give them, as in "
                f"again({self.lacks}=...)."
            )

    def _special_at(self, point: Point | SpecialPoint) -> SpecialPoint | None:
        """The fold or branch point whose state that of a point is, where there is one."""
        x = state_of(point)
        for branch in self.branches:
            if branch.parent is not None and branch.points[0].x is x:
                leaves, number = branch.parent
                return self[leaves].special[number]
            for special in branch.special:
                if special.kind.singular and special.point.x is x:
                    return special
        return None

    def _finest(self) -> int:
        """Number of the mesh with most unknowns."""
        return max(range(len(self.solvers)), key=lambda i: self.solvers[i].system.fields.unknowns)

    # --- how it is kept and shown ------------------------------------------------------------------------------------

    @property
    def data(self) -> dict[str, Any]:
        """Contents of ``diagram.json``: see docs/files.md."""
        systems = [solver.system for solver in self.solvers]
        data = as_data(self.branches, systems, self.clock, self.span, self.plan.accuracy)
        self.asked |= {} if EQUATIONS in self.asked else {EQUATIONS: fingerprint(systems[0], self.span)}
        own = {name: getattr(self, name) for name in ("asked", "complete", "run", "origin")}
        return data | self.remarks | own

    @property
    def remarks(self) -> dict[str, Any]:
        """Entries ``warnings`` and ``notes`` of ``diagram.json``."""
        said = {"warnings": self.warnings, "notes": self.notes}
        return {name: [{e.name: e.value(x) for e in REMARK} for x in remarks] for name, remarks in said.items()}

    def in_words(self) -> str:
        """What the diagram says, a sentence a line: ranges of stability, how stability is lost, what is left open.

        What the run warned of, and its notes, stand with the sentence of the branch that they are about.
        """
        from rodfem.output.summary import in_sentences

        return "\n".join(in_sentences(self.data))

    def to_dataframe(self) -> Any:
        """All rows as a ``pandas.DataFrame``; raises :class:`~rodfem.errors.SetupError` without pandas."""
        frames = [branch.to_dataframe() for branch in self]
        for frame, branch in zip(frames, self, strict=True):
            frame.insert(0, "branch", branch.name)
        return optional("pandas", "tables").concat(frames, ignore_index=True)

    def to_xarray(self) -> Any:
        """All rows as an ``xarray.Dataset``: their numbers, shape, strains, forces and moments, with coordinates.

        Raises :class:`~rodfem.errors.SetupError` without xarray.  Collective.
        """
        from rodfem.output.states import dataset_of

        return dataset_of(self.branches, self.data)

    def view(self) -> Page:
        """Make the page that ``rodfem view`` opens: a notebook shows it, ``.open()`` a browser; collective."""
        from rodfem.report.page import Page, page_of, payload_of

        comm = self.solvers[0].system.comm
        with TemporaryDirectory() as folder:
            shared = Path(comm.bcast(folder))
            self.save(shared)
            html = page_of(payload_of(shared)) if comm.rank == 0 else ""
            comm.barrier()
        return Page(html)

    @checked(folder=path("results/column"))
    def save(self, folder: Path | str) -> Path:
        """Write ``diagram.json`` and ``states.h5`` into a folder, which is made; returns it.

        Raises :class:`~rodfem.errors.InputError` where it cannot be written, or another process writes into it.
        """
        folder = Path(folder)
        with locked(folder, self.solvers[0].system.comm):
            modes = typical_modes(self.branches, self.solvers)
            save_run(self.data, self.branches, self.solvers, folder, first=True, modes=modes)
        return folder

    @checked(path=path("diagram.png"))
    def plot(self, path: Path | str | None = None, ax: Axes | None = None) -> Figure:
        """Draw the diagram with stability and special points; also into a file, if a ``path`` is given.

        A notebook shows what is returned.  In axes of matplotlib, ``ax``, several diagrams are one picture: each has
        colours that the others do not have.  Raises :class:`~rodfem.errors.InputError` where it cannot be written.
        """
        from rodfem.output.style import save

        if self.scene.conservative:
            from rodfem.output.plot_diagram import figure_of
        else:
            from rodfem.output.plot_frequencies import figure_of
        figure = figure_of(self.data, ax)
        if path is not None:
            on_first(self.solvers[0].system.comm, lambda: save(figure, Path(path)))
        return figure

    @checked(point=POINT, path=path("shape.png"), caption=text("stable"))
    def show(self, point: Point | SpecialPoint, path: Path | str | None = None, caption: str | None = None) -> Snapshot:
        """Draw the rod at a point, with its supports and loads; also into a file, if a ``path`` is given.

        A notebook shows what is returned.  Raises :class:`ImportError` where PyVista is missing, and
        :class:`~rodfem.errors.InputError` for a path that is no PNG's.
        """
        from rodfem.output.render import snapshot

        shown = point.point if isinstance(point, SpecialPoint) else point
        return snapshot(self.branches, self.solvers, shown, path, caption)

    def __repr__(self) -> str:
        low, high = self.span
        points = many(sum(len(b.points) for b in self.branches), "point")
        size = f"{many(len(self), 'branch', 'branches')}, {points}, {many(len(self.special()), 'special point')}"
        return f"<Diagram of {self.scene.name!r}: {size}, {self.scene.load} from {low:g} to {high:g}>"

    def _repr_html_(self) -> str:
        """Table of special points for notebooks."""
        from rodfem.output.words import table_of

        rows = ["".join(f"<td>{escape(cell)}</td>" for cell in row[:5]) for row in table_of(self.data)]
        head = ("branch", "kind", self.scene.load, self.scene.ordinate.name, "index")
        title = "".join(f"<th>{escape(name)}</th>" for name in head)
        body = "".join(f"<tr>{row}</tr>" for row in rows)
        return f"<p>{escape(repr(self)[1:-1])}</p><table><thead><tr>{title}</tr></thead><tbody>{body}</tbody></table>"


PLAN: Check = a(Plan, "a Plan, as in Plan(at=(1.0,), depth=1)")


@checked(scene=SCENE, discretization=MESH, plan=PLAN, observer=a(Observer, "a rodfem.Observer"), comm=RANKS)
def trace(
    scene: Scene,
    discretization: Discretization | None = None,
    plan: Plan | None = None,
    observer: Observer | None = None,
    *,
    comm: MPI.Comm = MPI.COMM_WORLD,
    **of_plan: Any,
) -> Diagram:
    """Trace the equilibria of a scene and decide the stability of each; collective over the ranks of ``comm``.

    Conservative scenes are followed by continuation, from branch to branch; of loads without a potential the range is
    swept, and frequencies are computed.  The ``discretization`` is by default 8 elements of degree 6, or few elements
    to start with where the plan has an accuracy; the ``plan`` is the scene's range to a depth of 2; its fields may
    be given instead, as ``of_plan``: ``trace(scene, depth=1, at=(0.5,))``.  An ``observer`` hears of the progress.

    Raises :class:`~rodfem.errors.InputError` for bad input, before any computation, and
    :class:`~rodfem.errors.ConvergenceError` where not even a first equilibrium is found.  An error after the first
    branch was begun, or an interrupt, carries the branches so far in its attribute ``diagram``.  On several ranks of
    ``comm`` one that nobody catches ends all ranks, which would wait for the one that fails; so does the end of what
    started them (:func:`rodfem.ranks.end_together`).
    """
    plan = plan_of(plan, of_plan)
    diagram = traced(scene, discretization or Discretization(), plan, observer or Observer(), comm)
    diagram.complete = True
    return diagram


def traced(scene: Scene, discretization: Discretization, plan: Plan, observer: Observer, comm: MPI.Comm) -> Diagram:
    """Trace a ``scene`` as :func:`trace` does: the diagram is not yet ``complete``, as a run has more to do."""
    _check(scene, discretization, plan, comm)
    recorder, clock = Recorder(observer), Clock()
    with form_compiler.announce_compilation(recorder.compiling) as compiled:
        with clock("setup"):
            mesh = _mesh(scene, discretization, plan, comm)
            found = Solver(scene, mesh, comm, spectrum=plan.spectrum, clock=clock).equilibria
            if plan.accuracy is None:
                check_start(found, plan.load_range(scene))
        if stressed := misfit(scene, plan.load_range(scene)[0]):
            recorder.note(stressed)
        recorder.system(found.system, plan.accuracy)
        feasible = _with_bars(plan, found, recorder)
        if compiled and feasible.error_bars and form_compiler.ALONE:
            compile_richer(found.system)

        def complete() -> None:
            compat.destroy_garbage(comm)
            recorder.complete(diagram)

        explorer = Explorer if found.conservative else Sweep
        tracer = explorer(found, feasible, recorder, complete)
        diagram = Diagram(scene, feasible, tracer.branches, tracer.solvers)
        diagram.warnings, diagram.notes, diagram.asked["plan"] = recorder.warnings, recorder.notes, entries(plan, scene)
        try:
            tracer.run()
        except BaseException as trouble:  # an interrupt, too: nothing that has been computed is lost
            if diagram.branches:
                trouble.diagram = diagram  # type: ignore[attr-defined]
                trouble.add_note("The branches traced before are in the attribute `diagram` of this error.")
            raise
    return diagram


def _check(scene: Scene, discretization: Discretization, plan: Plan, comm: MPI.Comm) -> None:
    """Raise :class:`InputError` for a plan that does not fit, or ranks that were given different ones."""
    end_together()
    if comm.size > 1:
        agree(comm, scene=statement(scene), discretisation=discretization, plan=entries(plan, scene))
    plan.check(scene, discretization)


def _with_bars(plan: Plan, solver: BranchSolver, observer: Observer) -> Plan:
    """The plan, without error bars where round-off of strains, which two meshes have alike, is in none of them."""
    if doubt := round_off_of_strains(solver.system.scene):
        doubt, plan = f"{doubt}: no error is estimated; {FLEXIBLE}.", replace(plan, error_bars=False)
    elif plan.error_bars:
        doubt = solver.system.equations.known.rough()
    if doubt:
        observer.warn(doubt)
    return plan


def _mesh(scene: Scene, discretization: Discretization, plan: Plan, comm: MPI.Comm) -> Discretization:
    """Discretisation as given, or to start with for the accuracy of the plan."""
    if plan.accuracy is None or discretization.vertices is not None:
        return discretization
    mesh = start_mesh(scene, discretization.formulation, plan.accuracy, comm)
    return replace(mesh, factors=discretization.factors)
