"""Isolas: closed branches that no other branch meets, found by a search and followed around once."""

from math import inf, sqrt
from typing import Any

from classics import column
from continuation.test_unfolding import fold_of
from hard.case import Change, Measured, compare, run, said, singular

from rodfem import Discretization, Ordinate, Scene, clamped, free

LATERAL = 1e-3
"""Lateral load of the cantilever, along e2."""


def thrust(c: Any) -> tuple[Any, ...]:
    """The thrust P - t^2 rises and falls again with t."""
    return (0.0, c.e, c.t * c.t - c.P)


def scene(excess: float) -> Scene:
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
    diagram = run(scene(excess), Discretization("auto", 6, 6), at=(0.0,), tries=6)
    if [b.ended for b in diagram] != ["end of range", "closed loop"] or singular(diagram[0]):
        return Measured(inf, 1.0, said(diagram), f"{diagram.branches} where one beside an isola was expected")
    folds = sorted(singular(diagram[1]), key=lambda s: s.point.load)
    indices = [(s.negative_before, s.negative_after) for s in folds]
    if sorted(indices) != [(0, 1), (1, 0)]:
        return Measured(inf, 1.0, said(diagram), f"{folds} where two folds were expected")
    expected = [Change(sign * sqrt(excess), *index) for sign, index in zip((-1, 1), indices, strict=True)]
    return compare(folds, expected, said(diagram))
