"""Tracing a scene: from its statement to its diagram, without a file or a line of output."""

from __future__ import annotations

from dataclasses import replace

from mpi4py import MPI

from rodfem import compat
from rodfem.adaptivity.mesh_sequence import start_mesh
from rodfem.continuation.observer import Observer, Recorder
from rodfem.diagram.diagram import Diagram
from rodfem.diagram.explorer import Explorer
from rodfem.diagram.first_mesh import check_start, frequency_mesh
from rodfem.diagram.plan import EQUATIONS, Plan, entries
from rodfem.diagram.solver import MESH, RANKS, SCENE, Solver
from rodfem.diagram.sweep import Sweep
from rodfem.fem import form_compiler
from rodfem.fem.fields import Discretization
from rodfem.fem.fingerprint import fingerprint
from rodfem.fem.transfer import compile_richer
from rodfem.problem.arguments import a, checked
from rodfem.problem.scene import Scene
from rodfem.problem.validation import FLEXIBLE, round_off_of_strains
from rodfem.ranks import end_together
from rodfem.stability.nonsymmetric import FREQUENCIES
from rodfem.timing import Clock

PLAN = a(Plan, "a Plan, as in Plan(at=(1.0,), depth=1)")


@checked(scene=SCENE, discretization=MESH, plan=PLAN, observer=a(Observer, "a rodfem.Observer"), comm=RANKS)
def trace(
    scene: Scene,
    discretization: Discretization | None = None,
    plan: Plan | None = None,
    observer: Observer | None = None,
    *,
    comm: MPI.Comm = MPI.COMM_WORLD,
) -> Diagram:
    """Trace the equilibria of a scene and decide the stability of each; collective over the ranks of ``comm``.

    Conservative scenes are followed by continuation, from branch to branch; of loads without a potential the range is
    swept, and frequencies are computed.

    Parameters
    ----------
    scene
        The rod.
    discretization
        Elements and degree, by default 8 elements of degree 6; where the plan has an accuracy few elements to start
        with.
    plan
        What is explored, by default the scene's range to a depth of 2.
    observer
        What hears of the progress; by default nothing does.
    comm
        Ranks that share the rod.

    Returns
    -------
    diagram
        Branches, special points and solvers; its ``warnings`` say what could not be decided.

    Raises
    ------
    InputError
        For bad input, before any computation.
    ConvergenceError
        Where not even a first equilibrium is found.

    An error after the first branch was begun, or an interrupt, carries the branches so far in its attribute
    ``diagram``.  On several ranks one that nobody catches ends all ranks, which would wait for the one that fails; so
    does the end of what started them (:func:`rodfem.ranks.end_together`).
    """
    diagram = traced(scene, discretization or Discretization(), plan or Plan(), observer or Observer(), comm)
    diagram.complete = True
    return diagram


def traced(scene: Scene, discretization: Discretization, plan: Plan, observer: Observer, comm: MPI.Comm) -> Diagram:
    """Trace a scene as :func:`trace` does: the diagram, which is not yet ``complete``, as a run has more to do.

    Parameters
    ----------
    scene, discretization, plan, observer, comm
        As there.

    Raises as :func:`trace` does.
    """
    plan.check(scene, discretization)
    end_together()
    recorder, clock = Recorder(observer), Clock()
    with form_compiler.announce_compilation(recorder.compiling) as compiled:
        with clock("setup"):
            mesh = _mesh(scene, discretization, plan, recorder, comm)
            found = Solver(scene, mesh, comm, spectrum=plan.spectrum, clock=clock).equilibria
            if plan.accuracy is None:
                check_start(found, plan.over(scene), recorder.warn)
        asked = {"plan": entries(plan, scene), EQUATIONS: fingerprint(found.system, plan.over(scene))}
        recorder.system(found.system, plan.accuracy)
        if unused := _not_used(discretization, plan):
            recorder.note(unused)
        if doubt := round_off_of_strains(scene):
            recorder.warn(f"{doubt}: no error is estimated; {FLEXIBLE}.")
            plan = replace(plan, error_bars=False)  # two meshes have that round-off alike: no bar would hold it
        if plan.error_bars and (doubt := found.system.equations.known.rough()):
            recorder.warn(doubt)
        if compiled and plan.error_bars and form_compiler.ALONE:
            compile_richer(found.system)

        def complete() -> None:
            compat.destroy_garbage(comm)
            recorder.complete(diagram)

        tracer: Explorer | Sweep
        if found.conservative:
            tracer = Explorer(found, plan, recorder, complete)
        else:
            tracer = Sweep(found, plan, recorder, complete)
        diagram = Diagram(scene, plan, tracer.branches, tracer.solvers)
        diagram.warnings, diagram.notes, diagram.asked = recorder.warnings, recorder.notes, asked
        try:
            tracer.run()
        except BaseException as trouble:  # an interrupt, too: nothing that has been computed is lost
            if diagram.branches:
                trouble.diagram = diagram  # type: ignore[attr-defined]
                trouble.add_note("The branches traced before are in the attribute `diagram` of this error.")
            raise
    return diagram


def _mesh(
    scene: Scene, discretization: Discretization, plan: Plan, observer: Observer, comm: MPI.Comm
) -> Discretization:
    """Discretisation as given, or for the accuracy of the plan: to start with, or of a whole sweep."""
    if plan.accuracy is None or discretization.vertices is not None:
        return discretization
    if scene.conservative:
        return replace(
            start_mesh(scene, discretization.formulation, plan.accuracy, comm), factors=discretization.factors
        )
    number = plan.spectrum or FREQUENCIES
    mesh, change = frequency_mesh(scene, discretization.formulation, plan.accuracy, plan.over(scene), number, comm)
    observer.frequency_mesh(mesh, number, change, plan.accuracy)
    return replace(mesh, factors=discretization.factors)


def _not_used(given: Discretization, plan: Plan) -> str:
    """Sentence on elements and a degree in whose place the accuracy of a plan chooses; empty without such."""
    own = Discretization()
    if (
        plan.accuracy is None
        or given.vertices is not None
        or (given.elements, given.degree) == (own.elements, own.degree)
    ):
        return ""
    return (
        f"  The accuracy chooses the meshes, not elements={given.elements} and degree={given.degree}: "
        "give vertices, too, for a mesh to begin with."
    )
