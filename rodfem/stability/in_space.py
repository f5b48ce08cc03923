"""Stability in space of the states of a planar rod."""

from __future__ import annotations

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from rodfem.errors import SceneError
from rodfem.fem.newton import correct
from rodfem.fem.state import State
from rodfem.fem.system import System
from rodfem.problem.ends import CLOSING_MOMENT
from rodfem.stability.inertia import NULL, Factored, Inertia
from rodfem.tolerances import same_place


class InSpace:
    """Counts the index of planar states among all perturbations in space.

    The rod in space has the same mesh, and quaternions instead of the angle: rotations of space and of the
    cross-sections are exact symmetries of the discrete rod, so that zero eigenvalues are zero.
    """

    def __init__(self, planar: System) -> None:
        self.planar = planar
        self.system = System(planar.scene.in_space(), planar.fields.discretization, planar.comm, planar.clock)
        self.inertia = Inertia(self.system)
        # places in this rank's part of a vector of the equations that a planar rod does without
        f, normal = self.system.fields, planar.scene.normal
        assert normal is not None
        dofs = [f.dofs["q"][..., [i + 1 for i in range(3) if i != normal]], *f.out_of_plane(normal).values()]
        places = np.unique(f.number[np.concatenate([d.ravel() for d in dofs])]) - f.offset
        self._out = places[(places >= 0) & (places < len(f.free_owned))]

    def negative(self, x: PETSc.Vec) -> int:
        """Number of negative eigenvalues in space of the planar equilibrium ``x``; raises as :meth:`at` does.

        Those out of the plane that the count has as zero are decided by their Rayleigh quotients: symmetries are left
        out, and a rod that is nearly symmetric may fall out of its plane slowly.
        """
        found = self.at(x)
        index = found.count()
        near = index.zero - found.drifts
        if near <= 0:
            return index.negative
        q = found.inside_band(near, NULL)
        squares = [(v.array_r * (self.inertia.metric * v).array_r)[self._out].sum() for v in q.vectors]
        falling = (q.values < -q.uncertainty) & (self.system.sum(np.array(squares)) > 0.5)  # mostly out of the plane
        return index.negative + int(falling.sum())

    def at(self, x: PETSc.Vec) -> Factored:
        """Second variation in space at the planar equilibrium ``x``; :class:`SceneError` if that is none in space.

        The state is corrected in space, unless it is so near a singular one that its own error decides as well.
        """
        planar = self.planar.at(x)
        quaternions = planar.fields.turning.quaternion(planar.turned)
        named = planar.parts | self._scalars(planar) | {"q": quaternions}
        state = self.system.vector(self.system.fields.filled(named))
        self.system.set_phase(state)
        residual = self.system.new_vector()
        self.system.at(state).residual(residual)
        out = self.system.comm.allreduce(float(np.sum(residual.array_r[self._out] ** 2)), op=MPI.SUM) ** 0.5
        if out > 1e-8 * self.system.stiffness_scale:  # else it is round-off
            raise SceneError(
                f"A force or moment pushes the rod out of its plane across {self.planar.scene.planar}: "
                "leave planar out of the scene."
            )
        settled = state.copy()
        # within this distance, in the metric, of the planar state
        converged = correct(self.system, settled, self.system.load_axis(), 0.01).converged
        return self.inertia.at(settled if converged else state)

    def _scalars(self, state: State) -> dict[str, float]:
        """Scalar unknowns in space from those in the plane, vectors by their components along new directions."""
        scene, old, new = self.planar.scene, self.planar.fields, self.system.fields
        out = {x.name: state.scalars[x.name] for x in old.unknown_scalars}
        vectors: dict[str, np.ndarray] = {}
        for x in old.unknown_scalars:
            if x.direction is not None:
                vectors[x.group.name] = vectors.get(x.group.name, np.zeros(3)) + out.pop(x.name) * np.array(x.direction)
        if scene.closed:
            at_end = same_place(old.coordinates(old.discretization.degree), scene.interval[1], scene.length)
            mine = state.turned[at_end].max(initial=-np.inf)
            last = np.array([new.comm.allreduce(float(mine), op=MPI.MAX)])
            moment = [out.pop(x.name) for x in old.groups[CLOSING_MOMENT]]
            closing = old.turning.functional(last, np.array(moment))
            out |= {x.name: float(closing[x.component]) for x in new.groups[CLOSING_MOMENT]}
        for x in new.unknown_scalars:
            if x.direction is not None and x.group.name in vectors:
                out[x.name] = float(np.dot(x.direction, vectors[x.group.name]))
        return out
