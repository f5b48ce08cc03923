"""What a continuation produces: points, special points and branches of equilibria."""

from __future__ import annotations

from dataclasses import dataclass, field

from petsc4py import PETSc

FOLD, BRANCH_POINT, USER, END = "fold", "branch point", "user", "end"
FLUTTER, DIVERGENCE = "flutter", "divergence"
"""Under loads without a potential: a pair of frequencies becomes complex; one becomes imaginary."""


@dataclass
class Point:
    """One equilibrium: state ``x``, unit ``tangent``, ``arclength`` from the start of the branch, and records.

    ``slope`` is the load's component of the tangent, ``drift`` the largest drift scalar (zero but for round-off),
    ``error`` the last Newton correction, ``mesh`` the number of the discretisation that ``x`` belongs to, and
    ``estimate`` the error of the discretisation in load and ordinate, where an accuracy was asked for.
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
    negative_in_space: int | None = None
    mesh: int = 0
    estimate: float = float("nan")


@dataclass
class Law:
    """``load = load_b + coefficient x^power + ...``, a bound of the coefficient's error, and the kind of bifurcation.

    ``side`` is the sign of the load's change on the bifurcating branch.
    """

    kind: str
    coefficient: float
    power: int
    uncertainty: float
    side: int

    def judge(self, index_below: int, index_above: int) -> None:
        """Name a pitchfork by the index of the branch that it leaves at loads just below and just above."""
        if self.kind == "pitchfork":
            there, here = (index_above, index_below) if self.side > 0 else (index_below, index_above)
            self.kind = "supercritical pitchfork" if there > here else "subcritical pitchfork"


@dataclass
class Special:
    """A special point: what it is, how precisely it was located, its null vectors, and the index on either side.

    ``located_to`` is the uncertainty of the load for the given mesh; ``error_estimate`` bounds its error, that of the
    discretisation included: of the load for folds and branch points, of the ordinate at user points and ends;
    ``ordinate_error`` bounds that of the ordinate at all (see :mod:`rodfem.accuracy`). ``coupling``
    is the cosine between the null vector and the derivative of the equations in the load: zero at a branch point,
    not at a fold.
    """

    kind: str
    point: Point
    negative_before: int
    negative_after: int
    located_to: float
    null_vectors: list[PETSc.Vec] = field(default_factory=list)
    coupling: float = 0.0
    error_estimate: float = float("nan")
    ordinate_error: float = float("nan")
    meets: tuple[str, int] | None = None
    switched: bool = False
    row: int = -1
    zero_of: str = "mu"
    note: str = ""
    law: Law | None = None
    omega2: float = float("nan")
    omega2_error: float = float("nan")

    @property
    def multiplicity(self) -> int:
        """Number of eigenvalues that cross or touch zero here."""
        return len(self.null_vectors)


@dataclass
class Branch:
    """A connected piece of equilibria: its points in order, its special points, where it came from and why it ended."""

    name: str
    parent: tuple[str, int] | None
    depth: int
    points: list[Point] = field(default_factory=list)
    special: list[Special] = field(default_factory=list)
    ended: str = "not traced"

    def insert(self, special: Special) -> None:
        """Put a special point among the points by its arclength, and renumber the rows of all special points."""
        self.special.append(special)
        self.points.append(special.point)
        self.renumber()

    def renumber(self) -> None:
        """Sort points and special points along the branch and set their rows."""
        self.points.sort(key=lambda p: p.arclength)
        row = {id(p): i for i, p in enumerate(self.points)}
        self.special.sort(key=lambda s: s.point.arclength)
        for special in self.special:
            special.row = row[id(special.point)]
