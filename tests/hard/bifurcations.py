"""Hard by what happens: branch points and folds near each other, at one load, in one step, at the end of a range."""

from math import erf, inf, log, pi, sqrt
from typing import Any

import ufl
from classics import SUPPORTS, column
from continuation.test_unfolding import cantilever, fold_of
from hard.case import Change, Measured, compare, run, said, singular
from hard.stiffness import EULER
from hard.two_freedoms import cubic, scene

from rodfem import Discretization, Ordinate, Scene, clamped, free
from rodfem.continuation.kinds import IMPERFECT

MEND = 1e-4
"""Lateral load below which the steps jump the gap, which tells of the other side; above it a search finds that."""
LATERAL = 1e-3
"""Lateral load of the cantilever beside an isola, along e2."""
MESH = Discretization("reduced", 4, 3)


def neighbours(apart: float) -> Measured:
    """A cantilever with two bending stiffnesses, 1 and 1 + apart."""
    diagram = run(column("neighbours", SUPPORTS["clamped-free"], (0.0, 4.0), constants={"B2": 1 + apart}))
    return compare(singular(diagram[0]), [Change(EULER, 0, 1), Change(EULER * (1 + apart), 1, 2)], said(diagram))


def folds(apart: float) -> Measured:
    """Two folds, ``apart`` in load."""
    diagram = run(cubic(3 * (apart / 4) ** (2 / 3), (-0.1, 0.1)), MESH)
    return compare(singular(diagram[0]), [Change(apart / 2, 0, 1), Change(-apart / 2, 1, 0)], said(diagram))


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
    diagram = run(cubic(-a, (-0.1, 0.1)), MESH)
    return compare(singular(diagram[0]), [], said(diagram))


def crossings(apart: float) -> Measured:
    """An eigenvalue ``(P^2 - d^2)`` that is negative between two loads, on a state that does not change."""
    d = apart / 2
    model = scene(lambda u, f2, c: 0.6 * u**2 + 0.5 * (c.P * c.P - c.a) * f2 + 0.1 * f2**2, (-0.31, 0.4), a=d * d)
    diagram = run(model, MESH)
    return compare(singular(diagram[0]), [Change(-d, 0, 1), Change(d, 1, 0)], said(diagram))


def opposite(inside: int, apart: float) -> Measured:
    """Two eigenvalues that cross in opposite directions, ``apart`` in load: the index is 1 on either side."""
    model = scene(lambda u, f2, c: 0.5 * (c.P + c.a) * u**2 + 0.5 * (c.a - c.P) * f2 + 0.1 * (u**4 + f2**2),
                  (-0.31, 0.4), a=(1 - inside) * apart / 2)  # fmt: skip
    diagram = run(model, MESH)
    return compare(singular(diagram[0]), [Change(-apart / 2, 1, inside), Change(apart / 2, inside, 1)], said(diagram))


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
