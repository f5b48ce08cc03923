"""Results of a continuation: points, special points and branches of equilibria."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.kinds import EVENT, Kind
from rodfem.errors import SMALLER_STEPS, InputError, many
from rodfem.libraries import optional
from rodfem.problem.arguments import SHORT
from rodfem.stability.soft_mode import PLANAR, STABLE, UNDECIDED, SoftMode, index_range, is_stable, stability
from rodfem.tolerances import round_off

if TYPE_CHECKING:
    from rodfem.continuation.branch_solver import BranchSolver
    from rodfem.fem.resultants import Profile, Reactions
    from rodfem.problem.events import Event
    from rodfem.stability.cluster import Cluster

NOT_TRACED = "not traced"
FIRST_BRANCH = "first branch"
"""Name of the branch of the start state, where neither the scene nor its shape gives another."""


@dataclass(repr=False)
class Point:
    """One equilibrium, a row of a branch.  Numbers are nondimensional, or in the units of the scene.

    Attributes
    ----------
    x, tangent
        State vector, and unit tangent of the branch in the metric; None where no branch is followed.
    arclength
        Length of the branch from its start, in the metric.
    load, ordinate
        The two numbers of the diagram.
    energy
        Stored energy ``int W ds`` alone, without the potential of the loads: of two equilibria at one load the one with
        less of it need not be the one with less total energy.
    potential, conjugate
        Total potential energy ``V`` of rod, loads, springs and foundations, and ``-dV/dload``, what the load does work
        on: :class:`~rodfem.fem.state.Energies`.  nan where a load has no potential.
    stretch
        Smallest stretch ``v3`` along the rod.
    negative, zero
        Numbers of negative eigenvalues (the index) and of zero ones.
    undecided
        Number of eigenvalues whose sign is not decided: they are not among the negative ones, and the index is between
        ``negative`` and ``negative + undecided``.  Symmetries, and what vanishes at a special point, are decided.
    kink
        What has a kink at the very state, the equations: there ``negative`` is the index on one side only, and
        stability is undecided.  Empty where nothing has.
    uncompared
        Why the index was not compared with that of a richer mesh, if it was to be: that has no such state.  Stability
        is undecided there.
    slope
        The load's component of the tangent.
    drift, error
        Largest drift scalar, zero but for round-off, and the last correction of Newton's method.
    spectrum
        Left-most eigenvalues, where they were asked for.
    omega2, motion, curve
        Of frequencies: eigenvalues (real and imaginary part), types of motion, numbers of their curves against the
        load.
    negative_in_space
        Index in space of a planar rod; None: not computed.
    mesh, solver, branch
        Number of the discretisation that ``x`` belongs to, its solver, and the name of the branch.
    estimate
        Error of the discretisation in load and ordinate, where an accuracy was asked for.
    soft
        Eigenvalues near zero, by name: :class:`~rodfem.stability.soft_mode.SoftMode`.
    nearest
        Estimated distance of the nearest eigenvalue from zero, symmetry modes left out; 0 where one factorisation does
        not tell the index: an eigenvalue may be soft.
    """

    x: PETSc.Vec
    tangent: PETSc.Vec | None
    arclength: float
    load: float
    ordinate: float
    energy: float
    stretch: float
    negative: int
    zero: int
    slope: float
    drift: float
    error: float
    spectrum: list[float] = field(default_factory=list)
    omega2: list[list[float]] = field(default_factory=list)
    motion: list[str] = field(default_factory=list)
    curve: list[int] = field(default_factory=list)
    negative_in_space: int | None = None
    mesh: int = 0
    estimate: float = float("nan")
    undecided: int = 0
    soft: list[SoftMode] = field(default_factory=list)
    nearest: float = 0.0
    potential: float = float("nan")
    conjugate: float = float("nan")
    kink: str = ""
    uncompared: str = ""
    solver: BranchSolver | None = field(default=None, compare=False)
    branch: str = field(default="", compare=False)

    @property
    def index(self) -> int:
        """Number of negative eigenvalues; without a potential of those that are negative or complex."""
        return self.negative

    @property
    def stable(self) -> bool | None:
        """Whether no eigenvalue is negative, of a planar rod in space, too, where :attr:`negative_in_space` is known.

        None where :attr:`undecided` ones may be, and no other is, on a kink, and if a richer mesh has no such state.
        Zero ones, which :attr:`zero` counts, are those of symmetries, or leave it undecided beyond that.
        """
        return is_stable(self._stability)

    @property
    def _stability(self) -> str:
        return stability(self.negative, self.undecided, self.kink or self.uncompared, self.negative_in_space)

    # --- along the rod ---------------------------------------------------------------------------------------------

    def profile(self, s: Sequence[float] | np.ndarray | None = None) -> Profile:
        """Shape, strains, contact force and moment at arclengths ``s`` (m,), by default at the nodes; collective.

        Raises :class:`~rodfem.errors.InputError` for a place that is not on the rod.
        """
        scene, resultants = self._solver.system.scene, self._solver.resultants
        if s is None:
            return resultants.profile(self.x)
        places, (first, last) = np.atleast_1d(np.asarray(s, dtype=float)), scene.interval
        if not ((places >= first) & (places <= last)).all():
            raise InputError(f"The arclengths {SHORT.repr(s)} leave the rod: give some from {first:g} to {last:g}.")
        return resultants.profile(self.x, places)

    @property
    def _solver(self) -> BranchSolver:
        if self.solver is None:
            raise InputError("This point has no solver: take one of a diagram, or of a Solver.")
        return self.solver

    @cached_property
    def _nodal(self) -> Profile:
        return self.profile()

    @property
    def s(self) -> np.ndarray:
        """Arclengths of the nodes (m,)."""
        return self._nodal.s

    @property
    def r(self) -> np.ndarray:
        """Centreline at :attr:`s`, components in space (m, 3)."""
        return self._nodal.r

    @property
    def directors(self) -> np.ndarray:
        """Directors d1, d2, d3 at :attr:`s` as rows, components in space (m, 3, 3)."""
        return self._nodal.directors

    @property
    def strain(self) -> np.ndarray:
        """Strains ``v`` at :attr:`s`, along the directors (m, 3)."""
        return self._nodal.strain

    @property
    def curvature(self) -> np.ndarray:
        """Curvatures and twist ``k`` at :attr:`s`, along the directors (m, 3)."""
        return self._nodal.curvature

    @property
    def force(self) -> np.ndarray:
        """Contact force at :attr:`s`, along the directors (m, 3)."""
        return self._nodal.force

    @property
    def force_in_space(self) -> np.ndarray:
        """Contact force at :attr:`s`, components in space (m, 3)."""
        return self._nodal.force_in_space

    @property
    def moment(self) -> np.ndarray:
        """Contact moment at :attr:`s`, along the directors (m, 3)."""
        return self._nodal.moment

    @property
    def moment_in_space(self) -> np.ndarray:
        """Contact moment at :attr:`s`, components in space (m, 3)."""
        return self._nodal.moment_in_space

    @cached_property
    def reactions(self) -> Reactions:
        """Forces and moments of the supports and of what is attached: ``point.reactions.left.force``; collective."""
        return self._solver.reactions(self.x)

    def backwards(self, total: float) -> Point:
        """The same equilibrium on the branch of length ``total`` followed the other way."""
        tangent = None if self.tangent is None else -self.tangent
        return replace(self, arclength=total - self.arclength, tangent=tangent, slope=-self.slope)

    def __repr__(self) -> str:
        """Load, ordinate and stability."""
        kind, index = self._stability, index_range(self.negative, self.undecided, self.kink)
        plane = self.negative_in_space is None and self.solver is not None and self.solver.system.scene.planar
        words = {
            STABLE: "stable in its plane (not examined in space)" if plane else "stable",
            PLANAR: f"stable in its plane, unstable in space, index {self.negative_in_space}",
            UNDECIDED: f"undecided, index {index}",
        }
        word = words.get(kind, f"unstable, index {index}") + (f" of the {self.kink}" if self.kink else "")
        word += ", not resolved by this mesh" if self.uncompared else ""
        return f"<Point at load {self.load:.10g}: ordinate {self.ordinate:.6g}, {word}>"


ORDINATE, DISTANCE = "ordinate", "distance"
"""What a normal form is a function of."""
VERTICAL_BRANCH, PITCHFORK, TRANSCRITICAL = "vertical branch", "pitchfork", "transcritical"
"""Kinds of a normal form; at the first one all states of the branch are at one load."""
LAWS = (PITCHFORK, f"supercritical {PITCHFORK}", f"subcritical {PITCHFORK}", TRANSCRITICAL, VERTICAL_BRANCH)
"""All kinds of a normal form: of a pitchfork whose side is known the second or the third."""


@dataclass(repr=False)
class NormalForm:
    """``load = load_b + coefficient x^power + ...`` at a bifurcation of a ``kind``; the coefficient's ``uncertainty``.

    ``side`` is the sign of the load's change on the bifurcating branch, zero where there is none or none is known, and
    ``x`` the change ``of`` the ordinate.  Where the ordinate does not change to leading order it is the distance from
    the branch point, in the metric.  Of ``x = o1 a + o2 a^2`` in the distance a the first term gives the law.  Where it
    leads only as long as the ordinate does not change visibly the second one does, and the uncertainty has what the
    first adds to it where the branch was solved.
    """

    kind: str
    coefficient: float
    power: int
    uncertainty: float
    side: int
    of: str = ORDINATE

    def resolved(self, part: float) -> bool:
        """Whether the coefficient is certain but for a ``part``."""
        return self.uncertainty <= part * abs(self.coefficient)

    def classify(self, index_below: int, index_above: int) -> None:
        """Name a pitchfork by the index of the branch that it leaves at loads just below and just above.

        One whose side is not determined keeps its name.
        """
        if self.kind == PITCHFORK and self.side:
            there, here = (index_above, index_below) if self.side > 0 else (index_below, index_above)
            self.kind = LAWS[1] if there > here else LAWS[2]

    def __repr__(self) -> str:
        """Kind, power, and coefficient with its uncertainty."""
        law = f"coefficient {self.coefficient:.10g} +- {self.uncertainty:.0e} of x^{self.power}"
        return f"<Normal form: {self.kind}, {law}, x the {self.of}>"


@dataclass(repr=False)
class SpecialPoint:
    """A special point: kind, precision of its location, null vectors, and the index on either side.

    Attributes
    ----------
    kind, point, row
        One of :mod:`rodfem.continuation.kinds`, the equilibrium, and the number of its row in the branch.
    negative_before, negative_after
        Index on either side, in order of arclength.
    located_to
        Uncertainty of the load for the given mesh.
    null_vectors, nearby
        Vectors of metric norm 1, one for each eigenvalue that vanishes; and those of others that are nearly zero there.
    coupling
        Cosine between the null vector and the derivative of the equations in the load: zero at a branch point, not at a
        fold.
    error_estimate, ordinate_error
        Bound of the error, that of the discretisation included: of the load for folds and branch points, of the
        ordinate at user points and ends; and that of the ordinate for all (see
        :mod:`rodfem.adaptivity.error_estimate`).
    resolved
        Whether the mesh resolves the state; else errors may well exceed their bounds.  None: not examined.
    connects_to
        Branch, and number of its special point, that this branch meets here.
    switched
        Whether the branches that leave here have been sought.
    test_function
        The test function whose zero was located: the eigenvalue ``mu``, the ``slope`` of the load, the least
        ``stretch``.
    note
        Remark in words.
    law
        Normal form of the branch that leaves here.
    omega2, omega2_error, cluster
        Double eigenvalue of flutter, the bound of its error, and the :class:`~rodfem.stability.cluster.Cluster` of the
        eigenvalues that collide.
    unfolding
        Size of the unfolding parameters that make it a branch point, relative to the metric as eigenvalues are
        (:mod:`rodfem.continuation.unfolding`): round-off, unless an imperfection has taken it apart.
    event
        The event that happens here, of those that the plan asks for.
    """

    kind: Kind
    point: Point
    negative_before: int
    negative_after: int
    located_to: float
    null_vectors: list[PETSc.Vec] = field(default_factory=list)
    nearby: list[PETSc.Vec] = field(default_factory=list)
    coupling: float = 0.0
    error_estimate: float = float("nan")
    ordinate_error: float = float("nan")
    resolved: bool | None = None
    connects_to: tuple[str, int] | None = None
    switched: bool = False
    row: int = -1
    test_function: str = "mu"
    note: str = ""
    law: NormalForm | None = None
    omega2: float = float("nan")
    omega2_error: float = float("nan")
    unfolding: float = float("nan")
    cluster: Cluster | None = None
    event: Event | None = None

    @classmethod
    def given(cls, kind: Kind, point: Point, one: float) -> SpecialPoint:
        """One at a load that is given, of a natural size ``one``: nothing changes there."""
        return cls(kind, point, point.negative, point.negative, round_off(point.load, one))

    def __repr__(self) -> str:
        """Kind, load and change of the index."""
        change = f"{self.negative_before}->{self.negative_after}"
        return f"<Special point: {self.kind.words} at load {self.point.load:.10g}, index {change}>"

    @property
    def names(self) -> tuple[str, ...]:
        """Names by which it is found: its kind, that of its normal form, and that of its event."""
        law = "" if self.law is None else self.law.kind
        event = "" if self.kind != EVENT else self.note if self.event is None else self.event.name
        return tuple(filter(None, (self.kind, law, PITCHFORK * (PITCHFORK in law), event)))

    @property
    def multiplicity(self) -> int:
        """Number of eigenvalues that cross or touch zero here."""
        return len(self.null_vectors)

    @property
    def to_follow(self) -> bool:
        """Whether other branches leave there, and none has been sought."""
        return self.kind.branches and not self.switched


@dataclass(frozen=True)
class Unexplained:
    """Neighbouring rows ``a``, ``b``: the index changes from ``before`` to ``after`` without a special point.

    The ``remedy`` is what to try.
    """

    a: Point
    b: Point
    before: int
    after: int
    remedy: str = f"{SMALLER_STEPS} or more elements"

    def __str__(self) -> str:
        """Say it in a sentence."""
        return (
            f"Between loads {self.a.load:.8g} and {self.b.load:.8g} the index changes from {self.before} to "
            f"{self.after}, and no special point was found that says why: {self.remedy}."
        )


COLUMNS = (
    "arclength",
    "load",
    "ordinate",
    "energy",
    "potential",
    "conjugate",
    "stretch",
    "negative",
    "zero",
    "undecided",
    "negative_in_space",
    "stable",
    "slope",
)
"""Attributes of a point of which a branch has a column."""


@dataclass(repr=False)
class Branch:
    """A connected piece of equilibria: its points in order, its special points, where it came from and why it ended.

    ``begins`` is the index right after the branch point that it leaves, where the indices of the trunk determine it.
    ``singular_start`` is the number of eigenvalues that vanish at the first state of a range and not all along the
    branch: a branch point there, if it is one, is not located.  ``name`` is unique in the diagram; ``parent`` is the
    branch and the number of its special point that this one left, and ``depth`` the number of such switches.
    ``points`` and ``special`` are in order of arclength, ``ended`` says why no more follow, and ``unexplained`` lists
    changes of index without a special point.  ``image`` names the symmetry of the scene that carries the branch to one
    with the opposite ordinate, which is not traced; it is empty where there is none.
    """

    name: str
    parent: tuple[str, int] | None
    depth: int
    points: list[Point] = field(default_factory=list)
    special: list[SpecialPoint] = field(default_factory=list)
    ended: str = NOT_TRACED
    unexplained: list[Unexplained] = field(default_factory=list)
    begins: int | None = None
    singular_start: int = 0
    image: str = ""

    def __repr__(self) -> str:
        """Name, size and end."""
        return f"<Branch {self.name!r}: {len(self.points)} points, {len(self.special)} special, ended: {self.ended}>"

    def __getitem__(self, name: str) -> np.ndarray:
        """Column of an attribute of its points, a number or a yes or no for each: ``branch["load"]``, (P,).

        What is not computed is nan.  Raises :class:`KeyError` for what points do not have.
        """
        values = [getattr(p, name, KeyError) for p in self.points]
        if KeyError in values or not all(x is None or isinstance(x, int | float) for x in values):
            raise KeyError(f"points have no number {name!r}: there are {', '.join(COLUMNS)}")
        return np.array([np.nan if x is None else x for x in values])

    def to_dataframe(self) -> Any:
        """All numbers of its rows as a ``pandas.DataFrame``; raises :class:`~rodfem.errors.SetupError` without it."""
        return optional("pandas", "tables").DataFrame({name: self[name] for name in COLUMNS})

    def start_in_words(self, load: str) -> str:
        """Sentence on a first state that is singular, for a load of that name; empty where it is not."""
        if not self.singular_start:
            return ""
        vanish = many(self.singular_start, "eigenvalue vanishes", "eigenvalues vanish")
        return (
            f"The first state, at {load} = {self.points[0].load:.8g}, is singular: {vanish} there, not all along "
            "the branch. What else leaves it is not followed: begin before it."
        )

    def backwards(self) -> Branch:
        """The same branch followed the other way, from its end, with the same name and reason of its end."""
        total = self.points[-1].arclength
        points = {id(p): p.backwards(total) for p in self.points}
        special = [
            replace(s, point=points[id(s.point)], negative_before=s.negative_after, negative_after=s.negative_before)
            for s in self.special
        ]
        out = Branch(self.name, self.parent, self.depth, list(points.values()), special, self.ended)
        out.renumber()
        return out

    def cut(self, last: float) -> None:
        """Drop what lies beyond the arclength ``last``."""
        self.points = [p for p in self.points if p.arclength <= last]
        self.special = [s for s in self.special if s.point.arclength <= last]

    def append(self, point: Point) -> None:
        """Put a point at the end of the rows, unless it is one of them: a load asked for may be that of a row."""
        if not any(row is point for row in self.points):
            self.points.append(point)

    def insert(self, special: SpecialPoint) -> None:
        """Put a special point among the points by its arclength, and renumber the rows of all special points."""
        self.special.append(special)
        self.append(special.point)
        self.renumber()

    def replace(self, others: Mapping[int, Point]) -> None:
        """Put others in the place of rows, by the ``id`` of these; special points that are at such a row stay there."""
        self.points = [others.get(id(row), row) for row in self.points]
        for special in self.special:
            special.point = others.get(id(special.point), special.point)

    def renumber(self) -> None:
        """Sort points and special points along the branch, set their rows, and name the branch of the points."""
        self.points.sort(key=lambda p: p.arclength)
        row = {id(p): i for i, p in enumerate(self.points)}
        for point in self.points:
            point.branch = self.name
        self.special.sort(key=lambda s: s.point.arclength)
        for special in self.special:
            special.row = row[id(special.point)]


def not_followed(branches: Sequence[Branch]) -> int:
    """Number of branch points from which no branch was sought, as the depth of the plan was reached."""
    return sum(s.to_follow for b in branches for s in b.special)
