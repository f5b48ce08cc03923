"""One end of a step of a sweep, as what looks for critical loads in the step is given it."""

from __future__ import annotations

from dataclasses import dataclass

from petsc4py import PETSc

from rodfem.stability.frequencies import Frequencies


@dataclass(frozen=True)
class Side:
    """One end of a step: its ``load``, the equilibrium ``x`` there, and the eigenvalues ``found``."""

    load: float
    x: PETSc.Vec
    found: Frequencies
