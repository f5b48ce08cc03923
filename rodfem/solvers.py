"""A scene on a mesh, ready to compute single equilibria: what judges, searches and loci are asked with."""

from __future__ import annotations

from mpi4py import MPI
from petsc4py import PETSc

from rodfem import compat
from rodfem.clock import Clock
from rodfem.continuation import Equilibria, Follower
from rodfem.errors import ConvergenceError
from rodfem.fields import Discretization
from rodfem.scene import Scene
from rodfem.system import System


def solver(
    scene: Scene,
    discretization: Discretization | None = None,
    comm: MPI.Comm = MPI.COMM_WORLD,
    *,
    spectrum: int = 0,
    clock: Clock | None = None,
) -> Equilibria:
    """Set up what computes equilibria of a scene; collective over the ranks of ``comm``.

    Parameters
    ----------
    scene
        The rod.
    discretization
        Elements and degree, by default those of :func:`rodfem.run`.  States and special points of a run belong to the
        discretisation of that run: give the same one to work with them.  Saved states can be loaded on any.
    comm
        Ranks that share the rod.
    spectrum
        Number of left-most eigenvalues that are recorded of each state (conservative scenes).
    clock
        Where times are noted.

    Returns
    -------
    A :class:`~rodfem.continuation.Follower`, which counts the index of states and follows branches; of a scene with a
    load without potential an :class:`~rodfem.continuation.Equilibria`.  :func:`equilibrium`, :func:`rodfem.load_state`,
    :func:`rodfem.judge`, :class:`rodfem.ModeFinder`, :func:`rodfem.locus`, :func:`rodfem.states_at` and
    :func:`rodfem.further` take it.

    Raises :class:`~rodfem.errors.SceneError` for a discretisation that does not fit the scene.
    """
    if scene.conservative:
        compat.require_real_petsc()
    system = System(scene, discretization or Discretization(), comm, clock)
    return Follower(system, spectrum) if scene.conservative else Equilibria(system)


def equilibrium(found: Equilibria, load: float, guess: PETSc.Vec | None = None) -> PETSc.Vec:
    """State of equilibrium at exactly ``load``; collective.

    Parameters
    ----------
    found
        What :func:`solver` returned.
    load
        Value of the scene's load.
    guess
        State nearby to start Newton's method from: of the same discretisation, at another load perhaps.  Without one
        the scene's own start is taken, as for the first state of a run.

    Raises :class:`~rodfem.errors.SceneError` for a load that is not admissible, and
    :class:`~rodfem.errors.ConvergenceError` where no equilibrium is found.
    """
    scene = found.system.scene
    scene.parameters[scene.load].check(scene.load, load)
    if guess is None:
        x, outcome = found.first(load)
    else:
        found.system.set_phase(guess)
        x, outcome = found.at_load(guess, load)
    if not outcome.converged:
        raise ConvergenceError(
            f"No equilibrium was found at {scene.load} = {load:g}: go there in steps of the load, each from the "
            "state before."
        )
    return x
