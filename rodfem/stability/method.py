"""Interface of a method to decide stability; those of :mod:`rodfem.stability.methods` derive from :class:`Method`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from petsc4py import PETSc

from rodfem.fem.system import System
from rodfem.stability.workspace import Workspace

Interval = tuple[float, float]
NEAR_ZERO = 1e-3
"""Target of the eigenvalues nearest zero, relative to the scale of the stiffness."""


class Found(NamedTuple):
    """Eigenvalues ``values`` (k,), ``vectors``, backward ``errors``; ``certified``: counts prove that none is missing.

    ``factorisations`` are those besides the workspace's own; a ``note`` goes after the reason for the method.
    """

    values: np.ndarray
    vectors: list[PETSc.Vec]
    errors: np.ndarray
    certified: bool = False
    factorisations: int = 0
    note: str = ""


class Method:
    """A way to the eigenvalues that decide the stability of states of one system."""

    finds_modes = True
    """Whether it finds eigenvalues and vectors."""

    def __init__(self, work: Workspace) -> None:
        """Work with matrices that are kept from state to state."""
        self.work = work

    @staticmethod
    def refusal(system: System) -> str:
        """Why it does not apply to a system, in words that follow its name; empty where it does."""
        return ""

    def leftmost(self, x: PETSc.Vec, number: int, interval: Interval | None) -> Found:
        """Left-most eigenvalues of a conservative state, ``number`` of them or those in an interval."""
        raise NotImplementedError

    def nearest(self, x: PETSc.Vec, number: int) -> Found:
        """Eigenvalues nearest zero of a state under loads without a potential."""
        raise NotImplementedError


class SymmetricMethod(Method):
    """A method for conservative loads alone."""

    @staticmethod
    def refusal(system: System) -> str:
        """Loads without a potential."""
        return (
            ""
            if system.scene.conservative
            else "needs a symmetric pencil, which a load without potential does not have"
        )
