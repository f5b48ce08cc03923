"""Hard by what happens: branch points and folds near each other, at one load, in one step, at the end of a range.

Ranges of the load have any width about, at and beside branch points, in either direction; loads are asked for there.

At random the two planes of a cantilever pass their critical loads several times: the thrust over Euler's is ``1 +
g1(P)`` for bending in one plane and ``1 + g2(P)`` in the other one.  Each ``g`` has its zeros at given loads, where the
index changes by one, and is smooth between them.  Loads are drawn in a cluster of any width from 1e-3 to 1; now and
then two of both planes are one, so that eigenvalues pass zero together, in the same direction or in opposite ones, and
now and then one is that of a row.
"""

from dataclasses import dataclass
from itertools import pairwise
from math import erf, exp, inf, log, pi, sqrt
from typing import Any

import numpy as np
import ufl
from classics import SUPPORTS, column
from continuation.test_unfolding import cantilever, fold_of
from hard.case import Change, Measured, check, compare, run, said, singular
from hard.stiffness import EULER
from hard.two_freedoms import cubic, scene

from rodfem import Discretization, Ordinate, Scene, clamped, free
from rodfem.continuation.kinds import IMPERFECT
from rodfem.forms.energy import bending_and_twist

MEND = 1e-4
"""Lateral load below which the steps jump the gap, which tells of the other side; above it a search finds that."""
LATERAL = 1e-3
"""Lateral load of the cantilever beside an isola, along e2."""
MESH = Discretization("reduced", 4, 3)


def neighbours(apart: float) -> Measured:
    """A cantilever with two bending stiffnesses, 1 and 1 + apart."""
    return check(
        [Change(EULER, 0, 1), Change(EULER * (1 + apart), 1, 2)],
        column("neighbours", SUPPORTS["clamped-free"], (0.0, 4.0), constants={"B2": 1 + apart}),
    )


def folds(apart: float) -> Measured:
    """Two folds, ``apart`` in load."""
    return check(
        [Change(apart / 2, 0, 1), Change(-apart / 2, 1, 0)], cubic(3 * (apart / 4) ** (2 / 3), (-0.1, 0.1)), MESH
    )


def dent(width: float) -> Measured:
    """A spring of stiffness ``1 - 2 exp(-t^2)``, ``t = (u - 0.5123)/width``: folds at ``t = -+log(2)^(1/2)``."""

    def potential(u: Any, f2: Any, c: Any) -> Any:
        t = (u - 0.5123) / width
        return u * u / 2 - width**2 * (pi**0.5 * t * ufl.erf(t) + ufl.exp(-t * t)) + f2 / 2 - c.P * u

    at = log(2) ** 0.5
    load = width * (pi**0.5 * erf(at) - at)
    diagram = run(scene(potential, (0.0, 1.0)), MESH)
    expected = [Change(0.5123 + load, 0, 1), Change(0.5123 - load, 1, 0)]
    return compare(singular(diagram[0]), expected, said(diagram))


def cusp(a: float) -> Measured:
    """``u^3 + a u = P`` without a fold."""
    return check([], cubic(-a, (-0.1, 0.1)), MESH)


def crossings(apart: float) -> Measured:
    """An eigenvalue ``(P^2 - d^2)`` that is negative between two loads, on a state that does not change."""
    d = apart / 2
    model = scene(lambda u, f2, c: 0.6 * u**2 + 0.5 * (c.P * c.P - c.a) * f2 + 0.1 * f2**2, (-0.31, 0.4), a=d * d)
    return check([Change(-d, 0, 1), Change(d, 1, 0)], model, MESH)


def opposite(inside: int, apart: float) -> Measured:
    """Two eigenvalues that cross in opposite directions, ``apart`` in load: the index is 1 on either side."""
    model = scene(lambda u, f2, c: 0.5 * (c.P + c.a) * u**2 + 0.5 * (c.a - c.P) * f2 + 0.1 * (u**4 + f2**2),
                  (-0.31, 0.4), a=(1 - inside) * apart / 2)  # fmt: skip
    return check([Change(-apart / 2, 1, inside), Change(apart / 2, inside, 1)], model, MESH)


def transcritical(slope: float) -> Measured:
    """``u (u - slope P) = 0``: both branches, which exchange their stability at P = 0."""
    model = scene(lambda u, f2, c: u**3 / 3 - 0.5 * c.a * c.P * u**2 + 0.5 * f2, (-0.3, 0.4), a=slope)
    diagram = run(model, MESH, depth=1)
    other = [b for b in diagram if b.parent]
    ends = [abs(p.ordinate - slope * p.load) for b in other for p in b.points]
    if said(diagram) or len(other) != 2 or max(ends) > 1e-9:
        return Measured(inf, 1.0, said(diagram), f"{len(other)} branches leave")
    return compare(singular(diagram[0]), [Change(0.0, 0, 1)])


def fold_with_branch_point(gap: float) -> Measured:
    """The fold of ``P = -u^2`` at u = 0, and a pitchfork of the twist at u = ``gap``, at which P = -gap^2."""
    model = scene(lambda u, f2, c: u**3 / 3 + c.P * u + 0.5 * (u - c.a) * f2 + f2**2, (-0.2, 0.1), a=gap)
    diagram = run(model, MESH)
    expected = (
        [Change(-gap * gap, 0, 1), Change(0.0, 1, 2)] if gap > 0 else [Change(0.0, 0, 1), Change(-(gap**2), 1, 2)]
    )
    if gap == 0:
        expected = [Change(0.0, 0, 2)]
    return compare(singular(diagram[0]), expected, said(diagram))


def imperfect(lateral: float) -> Measured:
    """A cantilever under a lateral load as well: the branch that bends against it has the only fold."""
    diagram = run(cantilever(lateral), at=(3.0,), depth=1, tries=24 if lateral > MEND else 0)
    found = [s for b in diagram for s in singular(b)]
    if [s.kind for s in found] == [IMPERFECT]:
        return Measured(inf, 1.0, (found[0].note,))
    if len(found) != 1:
        return Measured(inf, 1.0, said(diagram), f"{found} where one fold was expected")
    return compare(found, [Change(fold_of(lateral), found[0].negative_before, found[0].negative_after)], said(diagram))


def thrust(c: Any) -> tuple[Any, ...]:
    """The thrust P - t^2 rises and falls again with t."""
    return (0.0, c.e, c.t * c.t - c.P)


def with_isola(excess: float) -> Scene:
    """A cantilever under a lateral load and a thrust that exceeds its fold by ``excess`` at most, at t = 0.

    Bent against the lateral load it is in equilibrium where the thrust is above that fold: from t = -sqrt(excess) to
    sqrt(excess), in two states, of index 0 and 1.  The fold is that of the elastica in closed form.
    """
    return column(
        "isola", (clamped(), free(thrust)), (-1.0, 1.0), load="t", planar="e1",
        constants={"t": -1.0, "P": fold_of(LATERAL) + excess, "e": LATERAL},
        ordinate=Ordinate("tip", s=1.0, of=lambda r, q: r[1]),
    )  # fmt: skip


def isola(excess: float) -> Measured:
    """Both folds of the isola, and nothing else."""
    diagram = run(with_isola(excess), Discretization("auto", 6, 6), at=(0.0,), tries=6)
    if [b.ended for b in diagram] != ["end of range", "closed loop"] or singular(diagram[0]):
        return Measured(inf, 1.0, said(diagram), f"{diagram.branches} where one beside an isola was expected")
    folds = sorted(singular(diagram[1]), key=lambda s: s.point.load)
    indices = [(s.negative_before, s.negative_after) for s in folds]
    if sorted(indices) != [(0, 1), (1, 0)]:
        return Measured(inf, 1.0, said(diagram), f"{folds} where two folds were expected")
    expected = [Change(sign * sqrt(excess), *index) for sign, index in zip((-1, 1), indices, strict=True)]
    return compare(folds, expected, said(diagram))


# --- ranges -----------------------------------------------------------------------------------------------------------

LOADS = (EULER, 2 * EULER)
"""Branch points of a cantilever of bending stiffnesses 1 and 2."""
HEIGHT, LOW = 1e-5, 1e-8
"""Load of a fold, and a load so low that one step leads past two folds."""
TO = 1e-6
"""Relative error of the last state: its load is exact, and the curve is not steep there."""


def within(low: float, high: float) -> Measured:
    """Branch points of the straight column in a range, begun at ``low``, which may be the upper end.

    One at the start of a range is no point of its search, and is said to be there.
    """
    inside = [x for x in LOADS if min(low, high) < x < max(low, high)]
    index = sum(x < low for x in LOADS)
    step = 1 if high > low else -1
    expected = [Change(x, index + step * i, index + step * (i + 1)) for i, x in enumerate(inside[::step])]
    return check(expected, column("range", SUPPORTS["clamped-free"], (low, high)), error_bars=False)


def asked(off: float) -> Measured:
    """A load asked for: its row is there, and has the index of its side; at the branch point one zero eigenvalue."""
    scene = column("asked", SUPPORTS["clamped-free"], (0.0, 4.0))
    diagram = run(scene, at=(EULER + off,), error_bars=False)
    found = compare(singular(diagram[0]), [Change(EULER, 0, 1)], said(diagram))
    (row,) = [s.point for s in diagram.special("user", diagram[0].name)]
    expected = {int(off > 0)} if off else {0, 1}
    if row.load != EULER + off or not expected & set(range(row.negative, row.negative + row.zero + 1)):
        return Measured(inf, 1.0, said(diagram), f"row at {row.load}, index {row.negative}, zero {row.zero}")
    return found


def turning(short: float, height: float = HEIGHT) -> Measured:
    """``u^3 - a u = P``, whose range ends before a fold, by a part ``short`` of its ``height``: there the branch ends.

    A step that turns at the fold begins and ends within the range.
    """
    a = 3 * (height / 2) ** (2 / 3)
    high = height * (1 - short)
    diagram = run(cubic(a, (-0.1, high)), MESH)
    (branch,) = diagram
    u = np.roots([1.0, 0.0, -a, -high]).real.min()
    outside = max(p.load for p in branch.points) > high
    if outside or branch.ended != "end of range" or abs(branch.points[-1].ordinate - u) > TO * abs(u):
        return Measured(inf, 1.0, said(diagram), f"ended: {branch.ended}, at {branch.points[-1].ordinate}, not {u}")
    return compare(singular(branch), [], said(diagram))


# --- two planes, at random --------------------------------------------------------------------------------------------

RANGE = (0.25, 2.3)
PLANES = Discretization("auto", 6, 6)
SHALLOW = 1e-5
"""Largest value of ``g`` between two neighbouring zeros of it below which a draw is left out."""
SIDE = 1e-11
"""Distance from a zero at which the index beside it is taken."""


@dataclass(frozen=True)
class Plane:
    """Zeros of a function ``g``, the width of each, and the bound of the function."""

    zeros: tuple[float, ...]
    widths: tuple[float, ...]
    size: float

    def __call__(self, P: Any, root: Any = sqrt) -> Any:
        value = self.size
        for zero, width in zip(self.zeros, self.widths, strict=True):
            value = value * (P - zero) / root(width**2 + (P - zero) ** 2)
        return value

    @property
    def depth(self) -> float:
        """Largest size between two neighbouring zeros, the least of all; infinite with fewer than two."""
        zeros = sorted(self.zeros)
        pieces = [np.linspace(a, b, 21) for a, b in pairwise(zeros)]
        return min((max(abs(self(P)) for P in piece) for piece in pieces), default=inf)


@dataclass(frozen=True)
class Draw:
    """Two planes, and the rate ``grow`` at which thrust and stiffnesses grow with the load."""

    planes: tuple[Plane, Plane]
    grow: float

    def index(self, P: float) -> int:
        """Number of planes that have buckled."""
        return sum(plane(P) > 0 for plane in self.planes)

    def scene(self) -> Scene:
        first, second = (lambda P, plane=plane: plane(P, ufl.sqrt) for plane in self.planes)
        grows = lambda P: ufl.exp(self.grow * (P - 1.2))  # noqa: E731
        push = lambda c: (0.0, 0.0, -EULER * grows(c.P) * (1 + first(c.P)))  # noqa: E731
        return column(
            "two planes", (clamped(), free(push)), RANGE,
            energy=lambda v, k, c: grows(c.P) * bending_and_twist(k, (1.0, (1 + first(c.P)) / (1 + second(c.P)), 1.0)),
        )  # fmt: skip

    def measured(self) -> Measured:
        """Special points and indices of all rows against the closed form."""
        diagram = run(self.scene(), PLANES, error_bars=False)
        places = sorted({x for plane in self.planes for x in plane.zeros})
        expected = [Change(x, self.index(x - SIDE), self.index(x + SIDE)) for x in places]
        for point in diagram[0].points:
            if not point.zero and point.negative != self.index(point.load):
                return Measured(inf, 1.0, said(diagram), f"index {point.negative} at {point.load}")
        return compare(singular(diagram[0]), expected, said(diagram))


def drawn(number: int, seed: int = 49, most: int = 4, shallow: float = SHALLOW) -> Draw:
    """Random draw of a ``number``, of two to ``most`` zeros; those not deeper than ``shallow`` are drawn again."""
    random = np.random.default_rng([seed, number])
    while True:
        middle = random.uniform(0.4, 2.15)
        zeros: tuple[list[float], list[float]] = ([], [])
        widths: tuple[list[float], list[float]] = ([], [])
        for _ in range(random.integers(2, most + 1)):
            away = 0.5 * exp(random.uniform(np.log(1e-3), 0.0)) * random.choice([-1, 1])
            inside = RANGE[0] + 0.01 < middle + away < RANGE[1] - 0.01
            plane = int(random.integers(2))
            zeros[plane].append(float(middle + away) if inside else float(random.uniform(0.3, 2.25)))
            widths[plane].append(float(10 ** random.uniform(-1, 0.5)))
        kind, grow = random.choice(["apart", "apart", "together", "row"]), random.choice([0.0, 0.0, 1.0, 3.0, -2.0])
        sizes = [random.choice([-1, 1]) * 10 ** random.uniform(-1.3, -0.15) for _ in range(2)]
        if kind == "together" and zeros[0] and zeros[1]:
            zeros[1][0] = zeros[0][0]
        if kind == "row":
            some = zeros[0] or zeros[1]
            some[0] = min(0.6641, 1.1766, 1.5866, 1.9966, key=lambda row: abs(row - some[0]))
        planes = [Plane(tuple(z), tuple(w), float(c)) for z, w, c in zip(zeros, widths, sizes, strict=True)]
        if min(plane.depth for plane in planes) > shallow:
            return Draw((planes[0], planes[1]), float(grow))


def random_crossings(number: int) -> Measured:
    """Random draw of a ``number``."""
    return drawn(number).measured()


def random_cluster(number: int) -> Measured:
    """Random draw of a ``number`` with up to five zeros, and pairs that are shallower."""
    return drawn(number, seed=16, most=5, shallow=1e-6).measured()
