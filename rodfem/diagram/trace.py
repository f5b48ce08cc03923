"""Tracing a scene: from its statement to its diagram, without a file or a line of output.

Equilibria are traced on meshes that are raised on the way (:mod:`rodfem.adaptivity.mesh_sequence`).  A sweep computes a
few frequencies at every load: one mesh is chosen before, on which these do not change by more than the accuracy when it
is refined.
"""

from __future__ import annotations

from dataclasses import replace
from math import ceil
from typing import Any

import numpy as np
from mpi4py import MPI

from rodfem import compat
from rodfem.adaptivity.mesh_sequence import start_mesh
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.observer import Observer, Recorder
from rodfem.diagram.diagram import Diagram
from rodfem.diagram.equilibria import at_load, check_start, first_state
from rodfem.diagram.explorer import Explorer
from rodfem.diagram.plan import EQUATIONS, Plan, entries, plan_of
from rodfem.diagram.solver import MESH, RANKS, SCENE, Solver
from rodfem.diagram.sweep import Sweep
from rodfem.errors import Argument, ConvergenceError, Remedy
from rodfem.fem import form_compiler
from rodfem.fem.fields import Discretization
from rodfem.fem.fingerprint import fingerprint
from rodfem.fem.shape import compile_richer
from rodfem.fem.system import System
from rodfem.problem.arguments import a, checked
from rodfem.problem.scene import Scene
from rodfem.problem.validation import FLEXIBLE, round_off_of_strains, statement
from rodfem.ranks import agree, end_together
from rodfem.stability.nonsymmetric import FREQUENCIES, NonsymmetricSolver
from rodfem.stability.spectrum import SHIFT
from rodfem.timing import Clock
from rodfem.tolerances import unit

REFINED, MOST = 1.5, 8
"""Ratio of the numbers of elements of one mesh and the next; number of refinements."""
MARGIN = 10.0
"""Frequencies are to be better than asked for by this factor: flutter loads depend on two that are near each other."""
WORSE, FINE = 3, 1e-6
"""Refinements after each other that do not help before the best mesh is taken: coarse ones do not see all yet.  Below
this change, which is round-off, one is enough."""

PLAN = a(Plan, "a Plan, as in Plan(at=(1.0,), depth=1)")


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
    swept, and frequencies are computed.

    Parameters
    ----------
    scene
        The rod.
    discretization
        Elements and degree, by default 8 elements of degree 6; where the plan has an accuracy few elements to start
        with.
    plan
        What is explored, by default the scene's range to a depth of 2; its fields may be given instead, as
        ``of_plan``: ``trace(scene, depth=1, at=(0.5,))``.
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
    plan = plan_of(plan, of_plan)
    diagram = traced(scene, discretization or Discretization(), plan, observer or Observer(), comm)
    diagram.complete = True
    return diagram


def traced(scene: Scene, discretization: Discretization, plan: Plan, observer: Observer, comm: MPI.Comm) -> Diagram:
    """Trace a ``scene`` as :func:`trace` does: the diagram, which is not yet ``complete``, as a run has more to do.

    ``discretization``, ``plan``, ``observer`` and ``comm`` are those of that function.
    """
    end_together()
    if comm.size > 1:
        agree(comm, scene=statement(scene), discretisation=discretization, plan=entries(plan, scene))
    plan.check(scene, discretization)
    recorder, clock = Recorder(observer), Clock()
    with form_compiler.announce_compilation(recorder.compiling) as compiled:
        with clock("setup"):
            mesh = _mesh(scene, discretization, plan, recorder, comm)
            found = Solver(scene, mesh, comm, spectrum=plan.spectrum, clock=clock).equilibria
            if plan.accuracy is None:
                check_start(found, plan.over(scene), recorder.warn)
        asked = {"plan": entries(plan, scene), EQUATIONS: fingerprint(found.system, plan.over(scene))}
        recorder.system(found.system, plan.accuracy)
        if doubt := round_off_of_strains(scene):
            recorder.warn(f"{doubt}: no error is estimated; {FLEXIBLE}.")
            plan = replace(plan, error_bars=False)  # two meshes have that round-off alike: no bar would hold it
        elif plan.error_bars and (doubt := found.system.equations.known.rough()):
            recorder.warn(doubt)
        if compiled and plan.error_bars and form_compiler.ALONE:
            compile_richer(found.system)

        def complete() -> None:
            compat.destroy_garbage(comm)
            recorder.complete(diagram)

        explorer = Explorer if found.conservative else Sweep
        tracer = explorer(found, plan, recorder, complete)
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
    mesh, change = _frequency_mesh(scene, discretization.formulation, plan, plan.accuracy, comm)
    observer.frequency_mesh(mesh, plan.spectrum or FREQUENCIES, change, plan.accuracy)
    return replace(mesh, factors=discretization.factors)


def _frequency_mesh(
    scene: Scene, formulation: str, plan: Plan, accuracy: float, comm: MPI.Comm
) -> tuple[Discretization, float]:
    """Discretisation for the frequencies of a sweep, and by how much they change on the next one.

    The change is relative (to one, for values mu = omega^2 smaller than that).  Where refinement ceases to help, at
    round-off, the best mesh is returned.
    """
    loads, number = np.linspace(*plan.over(scene), 3), plan.spectrum or FREQUENCIES
    mesh = replace(start_mesh(scene, formulation, accuracy, comm), vertices=None)
    system = System(scene, mesh, comm)
    values, symmetries = _frequencies(system, loads, number), system.symmetries
    best, least, worse = mesh, np.inf, 0
    for _ in range(MOST):
        finer = replace(mesh, elements=ceil(REFINED * mesh.elements))
        richer = _frequencies(System(scene, finer, comm, symmetries=symmetries), loads, number)
        change = max(_change(v[:number], w, scene.units.omega2) for v, w in zip(values, richer, strict=True))
        best, least, worse = (mesh, change, 0) if change < least else (best, least, worse + 1)
        if worse >= (WORSE if least > FINE else 1) or least < accuracy / MARGIN:
            break
        mesh, values = finer, richer
    return best, least


def _frequencies(system: System, loads: np.ndarray, number: int) -> list[np.ndarray]:
    """Eigenvalues mu nearest the origin at each of the loads, two more than ``number``."""
    solver = BranchSolver(system)
    eigensolver = NonsymmetricSolver(solver.system)
    x, _ = first_state(solver, float(loads[0]))
    found = []
    for load in loads:
        x = at_load(solver, x, float(load))
        values = eigensolver.at(x).near(number + 2, SHIFT * system.scene.units.omega2).values
        found.append(values[np.argsort(abs(values))][: number + 2])
    if min(map(len, found)) < number:
        remedy = Remedy("ask for fewer ({})", Argument("Plan", "spectrum"))
        raise ConvergenceError(f"The coarsest mesh has fewer than {number} frequencies", remedy)
    return found


def _change(values: np.ndarray, richer: np.ndarray, one: float) -> float:
    """Largest distance of values from the nearest of the richer ones, relative to values greater than ``one``."""
    return max(float(abs(richer - v).min() / unit(v, one=one)) for v in values)
