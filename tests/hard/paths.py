"""Hard because a sweep may lose its path: before a fold, past an imperfect bifurcation, on an orbit."""

import re
from collections.abc import Callable
from itertools import pairwise
from math import inf, pi
from typing import Any

import classics
import ufl
from hard.case import Measured, reference, run, said
from hard.snapping import turning

from rodfem import Diagram, Discretization, Ordinate, Ring, Scene, clamped, free
from rodfem.forms import loads

MESH = Discretization("auto", 6, 5)
NEAR = 1e-5
"""Distance from a fold at which a sweep ends."""
SAME = 1e-6
"""Relative difference of the bending energies of a ring that two formulations load."""


def ends_at(diagram: Diagram) -> float:
    """Load beyond which a sweep says that its path could not be followed; nan where it does not say so."""
    found = [re.search(r"= ([-+0-9.e]+) could not be followed", sentence) for sentence in diagram.warnings]
    return next((float(one[1]) for one in found if one), float("nan"))


def snapping(load: float, share: float) -> Measured:
    """A cantilever whose clamp turns, and whose load follows its tip by a ``share``: the sweep ends at the fold."""
    (fold,) = reference("hysteresis", load, share)
    diagram = run(turning(load, share), Discretization("auto", 8, 6), error_bars=False)
    beyond, apart = [p for p in diagram[0].points if p.load > fold.load], abs(ends_at(diagram) - fold.load)
    if beyond or not apart < inf:
        return Measured(inf, 1.0, (), f"{beyond} beyond {fold}, ended {diagram[0].ended}")
    return Measured(apart, NEAR)


def imperfect(lateral: Callable[[Any], Any], most: float) -> Scene:
    """A column whose thrust follows its tip in part, under a lateral load as well."""
    ends = (
        clamped(),
        free(force=lambda c: (0.0, lateral(c), -0.8 * c.P), follower=lambda c: (0.0, 0.0, -0.2 * c.P)),
    )
    return classics.column("pushed", ends, (0.0, most), planar="e1", inertia=classics.BEAM, constants={"B2": 5.0})


def bends(lateral: float, most: float = 8.0) -> Measured:
    """It bends to one side, further and further, and is stable; beyond the branch point straight states are not."""
    diagram = run(imperfect(lambda c: lateral, most), MESH, error_bars=False)
    to_one_side = all(a.ordinate < b.ordinate for a, b in pairwise(diagram[0].points) if b.load < 6.0)
    stable = all(p.stable for p in diagram[0].points) and not diagram.special("divergence")
    ended = diagram[0].ended == "end of range"
    wrong = "" if to_one_side and stable else f"{diagram.special('divergence')}, {diagram[0].points}"
    return Measured(0.0 if ended and not wrong else inf, 1.0, said(diagram), wrong)


def floating_ring(waves: float, follows: bool) -> Scene:
    """A ring with two ``waves`` of natural curvature, under a pressure as a load that follows or by its potential."""
    load: dict[str, Any] = {"potential": lambda x, c: loads.pressure(x.r, x.dr, c.P)}
    if follows:
        load = {"follower": lambda c: (c.P, 0.0, 0.0), "inertia": classics.BEAM}
    return classics.column(
        "ring", Ring(), (0.0, 5.0), planar="e2", start=classics.circle, interval=(0.0, 2 * pi), constants={"e": waves},
        energy=lambda v, k, c: 0.5 * ((k[1] - 1 - c.e * ufl.cos(2 * c.s)) ** 2 + k[0] ** 2 + k[2] ** 2),
        ordinate=Ordinate("bending", None, of=lambda x, c: x.k[1] ** 2), **load,
    )  # fmt: skip


def floats(given: tuple[float, int]) -> Measured:
    """A ring of so many ``waves`` and elements under loads that follow, beside that under a potential, at 3."""
    waves, elements = given
    mesh = Discretization("pointwise", elements, 6)
    swept, traced = (run(floating_ring(waves, follows), mesh, error_bars=False, at=(3.0,)) for follows in (True, False))
    a, b = ([s.point.ordinate for s in diagram.special("user")] for diagram in (swept, traced))
    ended = swept[0].ended == traced[0].ended == "end of range"
    apart = max((abs(x - y) / y for x, y in zip(a, b, strict=True)), default=inf) if len(a) == len(b) else inf
    return Measured(apart if ended else inf, SAME, said(swept))
