"""A state in, a report on its stability out: one interface to all methods of :mod:`rodfem.stability.registry`.

Every verdict on a conservative state has its index by the count, decided within the count's band by Rayleigh quotients
(:mod:`rodfem.stability.near_zero`); methods differ in how they find eigenvalues and vectors.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any

import numpy as np
from petsc4py import PETSc

from rodfem.errors import ConvergenceError, InputError, many
from rodfem.fem.shape import Shape
from rodfem.ranks import as_failure
from rodfem.stability.dependence import require_independent_constraints
from rodfem.stability.methods import Found, Method, Workspace
from rodfem.stability.near_zero import Decision, decide
from rodfem.stability.registry import AUTO, METHODS, find
from rodfem.stability.soft_mode import ONE_SIDE, WORDS, SoftMode, is_stable, stability

COUNT, DENSE = "count", "dense"
"""Methods that find no eigenvalues, and all there are."""
SMALL = 12
"""A system with fewer unknowns than this for each eigenvalue is solved by dense matrices."""


@dataclass(frozen=True, repr=False)
class Verdict:
    """Stability of one state.

    Attributes
    ----------
    negative, zero, undecided
        Index, number of zero eigenvalues (symmetry modes included), and of those whose sign is not decided, which are
        not among the negative ones; under non-conservative loads the number of eigenvalues with a negative real part
        or an imaginary part, of all that the mesh has (of those found, if it is too large), and that of free motions.
    values, vectors, errors
        Left-most eigenvalues ``mu = omega^2`` without symmetry modes (under non-conservative loads those nearest zero),
        vectors (without multipliers if constraints were reduced; none if mu is complex), and backward errors.
    band, inside, uncertainty
        Half width of the interval about zero, in the metric, in which inertia alone decides nothing; Rayleigh quotients
        of the eigenvalues in it, and their round-off.
    certified
        Whether counts prove that none is missing among the values.
    seconds, factorisations, method, reason
        Cost of the verdict, how it was done, and why so.
    soft, kink, uncompared, negative_in_space
        Of :meth:`rodfem.Solver.assess`: eigenvalues near zero in the metric, by name; what has a kink at the very
        state, where the numbers are those of one side; why the index was not compared with that of a richer mesh; of a
        planar rod the index in space, if it is known.
    """

    negative: int
    zero: int
    values: np.ndarray
    vectors: list[PETSc.Vec]
    errors: np.ndarray
    band: float
    inside: np.ndarray
    uncertainty: np.ndarray
    certified: bool
    seconds: float
    factorisations: int
    method: str
    reason: str
    undecided: int = 0
    soft: tuple[SoftMode, ...] = ()
    kink: str = ""
    uncompared: str = ""
    negative_in_space: int | None = None

    @property
    def stable(self) -> bool | None:
        """Whether no direction is unstable; None where that is not decided."""
        doubt = self.kink or self.uncompared
        return is_stable(stability(self.negative, self.undecided, doubt, self.negative_in_space))

    def at(self, point: Any) -> Verdict:
        """The same with kink and soft modes of a ``point`` of a branch, and the index as far as they are decided."""
        here = replace(self, kink=point.kink, uncompared=point.uncompared, negative_in_space=point.negative_in_space)
        if not point.soft:
            return here
        counts = replace(here, negative=point.negative, zero=point.zero, undecided=point.undecided)
        return replace(counts, soft=tuple(point.soft))

    def __repr__(self) -> str:
        """Stability, counts and the left-most eigenvalue."""
        first = f", left-most mu = {self.values[0]:.10g}" if len(self.values) else ""
        words = f"{WORDS[self.stable]}, {self.negative} negative, {self.zero} zero"
        return f"<Verdict by {self.method}: {words}{first}>"

    def __str__(self) -> str:
        values = ", ".join(f"{v:.10g}" for v in self.values) or "none computed"
        proof = ", none missing" if self.certified and len(self.values) else ""
        alone = f"; not compared with a richer mesh: {self.uncompared}" if self.uncompared else ""
        inside = f"; {len(self.inside)} inside the band {self.band:.1e} of the count" if len(self.inside) else ""
        undecided = f", {self.undecided} undecided" if self.undecided else ""
        undecided += f", {ONE_SIDE} of the {self.kink}" if self.kink else ""
        undecided += f", {self.negative_in_space} negative in space" if self.negative_in_space is not None else ""
        return (
            f"{self.negative} negative, {self.zero} zero{undecided}{inside}; left-most: {values}{proof} "
            f"({self.method}: {self.reason}; {many(self.factorisations, 'factorisation')}, {1e3 * self.seconds:.1f} ms)"
            f"{alone}"
        )


class Assessor(Workspace):
    """Judges states of one system; keeps matrices, symbolic factorisations and the last modes for the next state."""

    def __init__(self, source: Any) -> None:
        super().__init__(source)
        self._methods: dict[str, Method] = {}

    def choose(self, name: str, number: int) -> tuple[str, str]:
        """Name of the method to use and the reason; raises :class:`InputError` for one unknown or not applicable."""
        if name == AUTO:
            if not self.conservative:
                return "shift-invert", "the load has no potential, the pencil no symmetry"
            if number == 0:
                return COUNT, "no eigenvalues were asked for"
            if self.system.fields.unknowns < SMALL * number:
                return DENSE, f"{self.system.fields.unknowns} unknowns are too few for a Krylov space"
            return "shift-invert", "the pencil is symmetric: one sparse factorisation serves eigenvalues and count"
        if refusal := find(name).refusal(self.system):
            others = ", ".join(other for other in METHODS if not find(other).refusal(self.system))
            raise InputError(f"Method {name!r} {refusal}: choose one of {others}.")
        return name, "as asked"

    def __call__(self, x: PETSc.Vec, method: str = AUTO, number: int = 4, interval: Any = None) -> Verdict:
        """Assess the equilibrium ``x`` by a ``method`` of :mod:`rodfem.stability.registry`, or ``auto``.

        ``interval`` (low, high) is where slicing looks, by default where the ``number`` left-most are.  Raises
        :class:`InputError` for a method that does not exist or apply, for dependent constraints, and for more
        eigenvalues than a small mesh has, :class:`ConvergenceError` if an eigensolver fails.
        """
        name, reason = self.choose(method, number)
        if number < 0:
            raise InputError(f"{number} eigenvalues cannot be computed: ask for none or more.")
        started = perf_counter()
        if self.inertia is None:
            with as_failure(self.system.comm):
                found = self._method(name).nearest(x, max(number, 1))
            index, zero, nothing = self.nonsymmetric.at(x).spectrum.unstable, self.system.active_drifts(x), np.zeros(0)
            inside: tuple[float, np.ndarray, np.ndarray] = 0.0, nothing, nothing
            made = 0
        else:
            decision = self._index(x)
            index, zero = decision.index.negative, decision.index.zero
            inside, made = (decision.band, decision.inside, decision.uncertainty), 2 - self.factorisations()
            try:
                with as_failure(self.system.comm):
                    found = self._method(name if number else COUNT).leftmost(x, number, interval)
                if interval is None and len(found.values) < number and name != COUNT:
                    raise ConvergenceError(
                        f"The method {name} found {len(found.values)} of {number} eigenvalues: ask for fewer of them, "
                        "or choose another method."
                    )
            except ConvergenceError:
                few = self.system.fields.unknowns < SMALL * number  # there may be no more than were found
                if few and not find(DENSE).refusal(self.system):
                    self._method(DENSE).leftmost(x, number, None)
                raise
            made += self.factorisations()
        return Verdict(
            *(index, zero, found.values, found.vectors, found.errors, *inside, found.certified),
            *(perf_counter() - started, made + found.factorisations, name, reason + found.note),
        )

    def leftmost(self, x: PETSc.Vec, number: int) -> Found:
        """The ``number`` left-most eigenpairs of the conservative state ``x`` alone, without its index."""
        name, _ = self.choose(AUTO, number)
        with as_failure(self.system.comm):
            return self._method(name).leftmost(x, number, None)

    def _method(self, name: str) -> Method:
        """Method by name, kept for the next state."""
        if name not in self._methods:
            self._methods[name] = find(name)(self)
        return self._methods[name]

    def _index(self, x: PETSc.Vec) -> Decision:
        """Count; where that breaks down, name the constraints that depend on each other."""
        assert self.inertia is not None
        try:
            return decide(self.inertia.at(x))
        except ConvergenceError:
            require_independent_constraints(Shape(self.system), x)
            raise


def assess(source: Any, x: PETSc.Vec, method: str = "auto", number: int = 4) -> Verdict:
    """Assess one state of a system or solver: see :class:`Assessor`, which is to be kept along a branch.

    ``source``, ``x``, ``method`` and ``number`` are as there.
    """
    return Assessor(source)(x, method, number)
