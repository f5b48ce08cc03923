"""Results of a continuation: points, special points and branches of equilibria."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from math import inf
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from rodfem.continuation.kinds import BRANCH_POINT, NUMBER, Kind
from rodfem.errors import SMALLER_STEPS, ConvergenceError, InputError, many
from rodfem.libraries import optional
from rodfem.problem.arguments import SHORT, reals
from rodfem.stability.soft_mode import STABLE, SoftMode, in_short, is_stable, stability

if TYPE_CHECKING:
    from petsc4py import PETSc

    from rodfem.codim2.sensitivity import Derivative, Tolerance
    from rodfem.continuation.branch_solver import BranchSolver
    from rodfem.fem.resultants import Profile, Reactions
    from rodfem.problem.events import Event, Level
    from rodfem.stability.cluster import Cluster

NOT_TRACED = "not traced"
FIRST_BRANCH = "first branch"
"""Name of the branch of the start state, where neither the scene nor its shape gives another."""


@dataclass(repr=False)
class Point:
    """One equilibrium, a row of a branch.  Numbers are nondimensional, or in the units of the scene.

    It also has ``s``, ``r``, ``directors``, ``strain``, ``curvature``, ``force``, ``moment``: arrays along the rod; and
    the ``reactions`` of its supports.
    """

    sensitivity: ClassVar[Callable[[], Any]]  # the module of derivatives, of a room above, which is bound there
    x: PETSc.Vec  #: state vector
    tangent: PETSc.Vec | None  #: unit tangent of the branch in the metric; None where no branch is followed
    arclength: float  #: length of the branch from its start, in the metric
    load: float  #: the one number of the diagram
    ordinate: float  #: the other one
    energy: float  #: ``int W ds`` alone: less of it need not be less total energy
    stretch: float  #: smallest ``v3`` along the rod
    negative: int  #: number of negative eigenvalues
    zero: int  #: number of zero ones
    slope: float  #: the load's component of the tangent
    drift: float  #: largest drift scalar, zero but for round-off
    error: float  #: last correction of Newton's method
    spectrum: list[float] = field(default_factory=list)  #: left-most eigenvalues, where they were asked for
    omega2: list[list[float]] = field(default_factory=list)  #: squares of frequencies, real and imaginary part
    motion: list[str] = field(default_factory=list)  #: their types of motion
    curve: list[int] = field(default_factory=list)  #: numbers of their curves against the load
    negative_in_space: int | None = None  #: index in space of a planar rod; None: not computed
    mesh: int = 0  #: number of the discretisation that ``x`` belongs to
    estimate: float = float("nan")  #: error of the mesh in load and ordinate, where an accuracy was asked for
    undecided: int = 0  #: eigenvalues of either sign, which are not among the negative ones
    soft: list[SoftMode] = field(default_factory=list)  #: eigenvalues near zero, by name
    nearest: float = 0.0  #: estimate of the least eigenvalue but for symmetries; 0: one factorisation does not tell
    potential: float = float("nan")  #: total energy ``V`` of rod, loads, springs and foundations, if there is one
    conjugate: float = float("nan")  #: ``-dV/dload``, what the load does work on
    kink: str = ""  #: what has a kink at the very state: ``negative`` is the index on one side of it
    uncompared: str = ""  #: why the index was not compared with that of a richer mesh: that has no such state
    solver: BranchSolver | None = field(default=None, compare=False)  #: of the mesh
    branch: str = field(default="", compare=False)  #: name of the branch

    @property
    def index(self) -> int:
        """Number of negative eigenvalues; without a potential of those that are negative or complex."""
        return self.negative

    @property
    def stable(self) -> bool | None:
        """Whether no eigenvalue is negative, of a planar rod in space, too, where :attr:`negative_in_space` is known.

        None where :attr:`undecided` ones may be, and no other is, on a kink, and if a richer mesh has no such state.
        """
        return is_stable(stability(self.negative, self.undecided, self.kink or self.uncompared, self.negative_in_space))

    def profile(self, s: Sequence[float] | np.ndarray | None = None) -> Profile:
        """Shape, strains, contact force and moment at arclengths ``s`` (m,), by default at the nodes; collective.

        Raises :class:`~rodfem.errors.InputError` for what is no arclength of the rod.
        """
        scene, resultants = self.own_solver.system.scene, self.own_solver.resultants
        if s is None:
            return resultants.profile(self.x)
        places, (first, last) = np.array(reals("s", np.atleast_1d(s).tolist(), (0.0, 0.5))), scene.interval
        if not ((places >= first) & (places <= last)).all():
            raise InputError(f"The arclengths {SHORT.repr(s)} leave the rod: give some from {first:g} to {last:g}.")
        return resultants.profile(self.x, places)

    @property
    def own_solver(self) -> BranchSolver:
        """Solver of its mesh; raises :class:`~rodfem.errors.InputError` for a point without one."""
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

    @cached_property
    def middle(self) -> float | None:
        """Size of the curvature at the middle of the rod, bending alone; None without a solver."""
        if self.solver is None:
            return None
        place = np.array([sum(self.solver.system.scene.interval) / 2])
        k = self.solver.resultants.profile(self.x, place).curvature[0]
        return float(np.hypot(k[0], k[1]))

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
        """Forces and moments of the supports and of what is attached: ``point.reactions.left.force``; collective.

        A special point has bounds of their errors: ``special.errors["reactions"]``.
        """
        return self.own_solver.reactions(self.x)

    def derivative(self, parameter: str, *, along_the_rod: bool = False) -> Derivative:
        """Derivative of the ordinate in a ``parameter`` at this load: ``.value`` and ``.error``; collective.

        ``along_the_rod`` a ``.density``, of a parameter that varies.  Raises :class:`~rodfem.errors.InputError` for
        what has none, and :class:`~rodfem.errors.ConvergenceError` where the state is singular.
        """
        return Point.sensitivity().ordinate_derivative(self, parameter, along_the_rod=along_the_rod)

    def backwards(self, total: float) -> Point:
        """The same equilibrium on the branch of length ``total`` followed the other way."""
        tangent = None if self.tangent is None else -self.tangent
        return replace(self, arclength=total - self.arclength, tangent=tangent, slope=-self.slope)

    def __repr__(self) -> str:
        """Load, ordinate and stability."""
        word = in_short(self.negative, self.undecided, self.kink, self.uncompared, self.negative_in_space)
        plane = self.negative_in_space is None and self.solver is not None and self.solver.system.scene.planar
        word += " in its plane (not examined in space)" if plane and word == STABLE else ""
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
    """``load = load_b + coefficient x^power + ...`` on the branch that leaves a bifurcation of a ``kind``.

    ``x`` is the change ``of`` the ordinate, or the distance from the branch point, in the metric, where that does not
    change to leading order; ``side`` is the sign of the load's change, zero where there is none or none is known.  Of
    ``x = o1 a + o2 a^2`` in the distance the first term gives the law.  Where it leads only as long as the ordinate
    does not change visibly the second one does, and the ``uncertainty`` has what the first adds.
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
        """Name a pitchfork of a known side by the index of the trunk at loads just below and just above."""
        if self.kind == PITCHFORK and self.side:
            there, here = (index_above, index_below) if self.side > 0 else (index_below, index_above)
            self.kind = LAWS[1] if there > here else LAWS[2]

    def __repr__(self) -> str:
        """Kind, power, and coefficient with its uncertainty."""
        law = f"coefficient {self.coefficient:.10g} +- {self.uncertainty:.0e} of x^{self.power}"
        return f"<Normal form: {self.kind}, {law}, x the {self.of}>"


@dataclass(repr=False)
class SpecialPoint:
    """A special point: kind, precision of its location, null vectors, and the index on either side."""

    kind: Kind  #: one of :mod:`rodfem.continuation.kinds`
    point: Point  #: the equilibrium
    negative_before: int  #: index on either side, in order of arclength
    negative_after: int  #: the same
    located_to: float  #: uncertainty of the load for the given mesh
    null_vectors: list[PETSc.Vec] = field(default_factory=list)  #: of metric norm 1, for each eigenvalue that vanishes
    nearby: list[PETSc.Vec] = field(default_factory=list)  #: of eigenvalues that are nearly zero there
    coupling: float = 0.0  #: cosine between null vector and derivative in the load: zero at a branch point, not a fold
    error_estimate: float = float("nan")  #: bound of the error in the load, the mesh included; ordinate if it is given
    ordinate_error: float = float("nan")  #: bound of the error in the ordinate
    resolved: bool | None = None  #: whether the mesh resolves the state, so that the bounds hold; None: not examined
    connects_to: tuple[str, int] | None = None  #: branch, and number of its special point, that this one meets here
    switched: bool = False  #: whether the branches that leave here have been sought
    row: int = -1  #: number of its row in the branch
    test_function: str = "mu"  #: what vanishes: the eigenvalue ``mu``, the ``slope`` of the load, the ``stretch``
    note: str = ""  #: remark in words
    law: NormalForm | None = None  #: normal form of the branch that leaves here
    omega2: float = float("nan")  #: double eigenvalue of flutter
    omega2_error: float = float("nan")  #: bound of its error
    unfolding: float = float("nan")  #: size of the unfolding parameters: round-off, unless there is an imperfection
    cluster: Cluster | None = None  #: the eigenvalues that collide
    event: Event | Level | None = None  #: the event that happens here, of those that the plan asks for
    bounds: Callable[[], dict[str, np.ndarray]] = dict  #: computes :attr:`errors`, once
    #: of the load, and bounds of their errors
    derivatives: dict[str, tuple[float, float]] = field(default_factory=dict)
    #: of these derivatives along the rod: ends (m + 1,) of pieces, and means (m,)
    densities: dict[str, tuple[np.ndarray, np.ndarray]] = field(default_factory=dict)

    @property
    def errors(self) -> dict[str, np.ndarray]:
        """Bounds of the errors of what follows from the state, by name; empty without one; collective.

        ``energy``, ``potential``, ``conjugate``; ``reactions`` (k, 2, 3), force and moment of the left and the right
        support and of attachments; ``spectrum`` (k,), where it was asked for; the largest one along the rod of ``r``,
        ``strain``, ``curvature``, ``force`` and ``moment``.
        """
        try:
            return self.bounds()
        except ConvergenceError:
            return {}

    def __repr__(self) -> str:
        """Kind, load and change of the index."""
        change = f"{self.negative_before}->{self.negative_after}"
        return f"<Special point: {self.kind.words} at load {self.point.load:.10g}, index {change}>"

    def derivative(self, parameter: str, *, along_the_rod: bool = False) -> Derivative:
        """Derivative of its load in a ``parameter``: how much stiffer, how much later it buckles; collective.

        ``.value``, and ``.error``, which is computed when it is asked for; ``along_the_rod`` a ``.density``, of a
        parameter that varies.  Raises :class:`~rodfem.errors.InputError` for what has none, and
        :class:`~rodfem.errors.ConvergenceError` where the parameter takes the special point apart.
        """
        return Point.sensitivity().derivative(self, parameter, along_the_rod=along_the_rod)

    def coefficient_derivative(self, parameter: str) -> Derivative:
        """The same of the coefficient of its :attr:`law`: how much more, or less, a bent rod carries."""
        return Point.sensitivity().coefficient_derivative(self, parameter)

    def tolerance(self, deviations: Mapping[str, float | tuple[float, float]]) -> Tolerance:
        """Standard deviation of its load by those of constants, ``{"A": 0.02}``, to first order; and the mesh's error.

        Of a field that varies at random about a constant, with ``exp(-|s - t| / L)`` as correlation, it is a pair of
        deviation and length ``L``, ``{"A": (0.02, 0.1)}``.  Raises :class:`~rodfem.errors.InputError` for one that is
        not positive, and what :meth:`derivative` does.
        """
        return Point.sensitivity().tolerance(self, deviations)

    @property
    def names(self) -> tuple[str, ...]:
        """Names by which it is found: its kind, that of its normal form, and that of its event."""
        law = "" if self.law is None else self.law.kind
        event = "" if self.kind.test != NUMBER else self.note if self.event is None else self.event.name
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
    """Neighbouring rows ``a``, ``b``: the index changes from ``before`` to ``after`` without a special point."""

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
    "arclength", "load", "ordinate", "energy", "potential", "conjugate", "stretch",
    "negative", "zero", "undecided", "negative_in_space", "stable", "slope",
)  # fmt: skip
"""Attributes of a point of which a branch has a column."""


@dataclass(repr=False)
class Branch:
    """A connected piece of equilibria: its points in order, its special points, where it came from and why it ended."""

    name: str  #: unique in the diagram
    parent: tuple[str, int] | None  #: branch, and number of its special point, that this one left
    depth: int  #: number of such switches
    points: list[Point] = field(default_factory=list)  #: in order of arclength
    special: list[SpecialPoint] = field(default_factory=list)  #: in order of arclength
    ended: str = NOT_TRACED  #: why no more points follow
    unexplained: list[Unexplained] = field(default_factory=list)  #: changes of the index without a special point
    begins: int | None = None  #: index right after the branch point that it leaves, where that of the trunk says it
    singular_start: int = 0  #: eigenvalues that vanish at its first state and not all along: no point is located there
    image: str = ""  #: symmetry that carries it to a branch of opposite ordinate, which is not traced

    def __repr__(self) -> str:
        """Name, size and end."""
        points = many(len(self.points), "point")
        return f"<Branch {self.name!r}: {points}, {len(self.special)} special, ended: {self.ended}>"

    def __getitem__(self, name: str) -> np.ndarray:
        """Column (P,) of an attribute of its points, nan where it is not known; raises :class:`KeyError`."""
        values = [getattr(p, name, KeyError) for p in self.points]
        if KeyError in values or not all(x is None or isinstance(x, int | float) for x in values):
            raise KeyError(f"points have no number {name!r}: there are {', '.join(COLUMNS)}")
        return np.array([np.nan if x is None else x for x in values])

    def to_dataframe(self) -> Any:
        """All numbers of its rows as a ``pandas.DataFrame``."""
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

    def explain(self) -> None:
        """Keep what is not explained of the changes of the index along the whole branch, which must be in order."""
        self.unexplained = breaks(self.points, self.special, self.begins)

    def renumber(self) -> None:
        """Sort points and special points along the branch, set their rows, and name the branch of the points."""
        self.points.sort(key=lambda p: p.arclength)
        row = {id(p): i for i, p in enumerate(self.points)}
        for point in self.points:
            point.branch = self.name
        self.special.sort(key=lambda s: s.point.arclength)
        for special in self.special:
            special.row = row[id(special.point)]


def breaks(points: Sequence[Point], specials: Sequence[SpecialPoint], begins: int | None = None) -> list[Unexplained]:
    """Neighbours among rows in order of arclength, some of them special points, whose indices do not agree.

    A row allows an interval: eigenvalues that are zero within the tolerance of the count may be of either sign.  If the
    intervals of two neighbours are disjoint an eigenvalue has crossed zero unseen, or a number is wrong.  ``begins`` is
    the index right after the first row, where it is known although it is none of these special points.
    """
    at = {id(s.point): s for s in specials if s.kind.singular}
    persistent = persistent_zeros(points)
    found = []
    for a, b in pairwise(points):
        left, right = _interval(a, at, persistent, after=True), _interval(b, at, persistent, after=False)
        if a is points[0] and begins is not None:
            left = begins, begins
        if left[1] < right[0] or right[1] < left[0]:
            found.append(Unexplained(a, b, left[0], right[0]))
    return found


def persistent_zeros(points: Sequence[Point]) -> int:
    """Number of eigenvalues that are zero at every row: of symmetries, or of families of equilibria at one load."""
    return min((p.zero for p in points), default=0)


def _interval(point: Point, at: dict[int, SpecialPoint], persistent: int, after: bool) -> tuple[int, int]:
    """Least and greatest index right before or after a row."""
    if (special := at.get(id(point))) is not None:
        index = special.negative_after if after else special.negative_before
        return index, index
    return point.negative, point.negative + max(point.zero - persistent, point.undecided)


def merge_doubles(branch: Branch) -> None:
    """Merge neighbouring branch points that a mesh which lacks a symmetry of the rod has apart, by less than its error.

    The rod itself may have them apart, so that the bars of the one point are to hold for each of them.
    """
    bars = {id(s): s.error_estimate for s in branch.special}
    for p, q in list(pairwise(branch.special)):
        if not _double(branch, p, q, bars[id(p)] + bars[id(q)]):
            continue
        apart, ordinates = abs(p.point.load - q.point.load), abs(p.point.ordinate - q.point.ordinate)
        q.error_estimate = max(q.error_estimate, apart + p.error_estimate)
        q.ordinate_error = max(q.ordinate_error, ordinates + p.ordinate_error)
        q.bounds = dict  # of one of them alone
        q.null_vectors = p.null_vectors + q.null_vectors
        q.negative_before = p.negative_before
        q.point.zero += p.multiplicity
        if p.negative_after > p.negative_before:  # those of p are negative at q, and count as zero now
            q.point.negative -= p.multiplicity
        q.note = f"{q.multiplicity} eigenvalues that this mesh does not tell apart vanish within {apart:.0e}"
        branch.special.remove(p)
        branch.points = [point for point in branch.points if point is not p.point]
        branch.renumber()


def _double(branch: Branch, p: SpecialPoint, q: SpecialPoint, bar: float) -> bool:
    """Whether two neighbouring branch points are one within their ``bar``, as all rows between them are.

    The bar of a point that the mesh does not resolve says nothing of its neighbour.
    """
    points = all(s.kind == BRANCH_POINT and s.test_function == "mu" and s.resolved is not False for s in (p, q))
    between = [x for x in branch.points if p.point.arclength <= x.arclength < q.point.arclength]
    same = p.point.mesh == q.point.mesh and bar < inf
    return points and same and all(abs(row.load - q.point.load) <= bar for row in between)


def not_followed(branches: Sequence[Branch]) -> int:
    """Number of branch points from which no branch was sought, as the depth of the plan was reached."""
    return sum(s.to_follow for b in branches for s in b.special)
