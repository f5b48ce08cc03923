"""Sweeps that are hard: two critical loads near each other, or out of a greatest thrust; paths that may be lost.

The thrust on a column is a parabola in a parameter, and at its greatest about as large as the critical one.  What is
critical of the column is known: flutter of Beck's, divergence of one whose thrust follows the tip in part.

A sweep may lose its path before a fold, past an imperfect bifurcation, or on an orbit.
"""

import re
from collections.abc import Callable
from itertools import pairwise
from math import acos, inf, pi, sqrt
from typing import Any

import classics
import ufl
from closed_forms import double
from hard.case import Change, Measured, compare, reference, run, said
from hard.snapping import turning

from rodfem import Diagram, Discretization, End, Inertia, Ordinate, Ring, Scene, clamped, free
from rodfem.forms import loads

MESH = Discretization("pointwise", 4, 6)
BECK, SHARE = float(double(20.0, 120.0)[0]), 0.4
"""Beck's load; the share of a thrust that follows a tip, which diverges."""
DIVERGES = acos(-SHARE / (1 - SHARE)) ** 2
AT_ROW, BETWEEN = 5.0, 5.0371
"""Values of the parameter: one of a row of the sweep, and one between two rows."""
CRITICAL = {"flutter": (BECK, 1.0), "divergence": (DIVERGES, SHARE)}
THIN = Inertia(rho_A=lambda c: 1.0, rho_I=lambda c: (0.0, 0.0, 0.01))
"""Of a rod that resists spinning alone."""
NEAR = 0.3
"""Of that value: other critical loads are farther away."""


def critical_loads(diagram: Diagram, kind: str, at: float) -> list[tuple[float, float]]:
    """Critical loads of a kind that are near the greatest thrust, each with its bar, in ascending order."""
    return sorted((s.point.load, s.error_estimate) for s in diagram.special(kind) if abs(s.point.load - at) < NEAR)


def pair(kind: str, at: float, top: float) -> Measured:
    """``at -+ top^(1/2)``, or none where the greatest thrust, ``top`` above the critical one, is below it."""
    critical, share = CRITICAL[kind]

    def push(part: float) -> Any:
        return lambda c: (0.0, 0.0, -part * (critical + c.top - (c.p - c.at) ** 2))

    constants = {"p": 0.0, "B2": 10.0, "top": top, "at": at}
    ends = clamped(), free(force=push(1 - share), follower=push(share))
    scene = classics.column("peaked", ends, (0.0, 10.0), load="p", inertia=classics.BEAM, constants=constants)
    diagram = run(scene, MESH)
    found = critical_loads(diagram, kind, at)
    exact = [at - sqrt(top), at + sqrt(top)] if top > 0 else []
    if len(found) != len(exact):
        return Measured(inf, 1.0, said(diagram), f"{found} where {exact} were expected")
    ratios = tuple(abs(load - x) / bar for (load, bar), x in zip(found, exact, strict=True))
    return Measured(max(ratios, default=0.0), 1.0, said(diagram), ratios=ratios)


def two_planes(apart: float) -> Measured:
    """Beck's column with bending stiffnesses 1 and 1 + apart."""
    strong = 1.0 + apart
    diagram = run(classics.partly_following(1.0, (0.0, 30.0), strong), MESH)
    return compare(diagram.special("flutter"), [Change(BECK, 0, 2), Change(BECK * strong, 2, 4)], said(diagram))


def asked(off: float) -> Measured:
    """The same in two planes, asked for at the second flutter load, or ``off`` that, relative: a row is there."""
    strong = 1.5
    plan = {"at": (BECK * strong * (1 + off),)}
    diagram = run(classics.partly_following(1.0, (0.0, 35.0), strong), MESH, **plan)
    return compare(diagram.special("flutter"), [Change(BECK, 0, 2), Change(BECK * strong, 2, 4)], said(diagram))


def on_soft_springs(k: float) -> Scene:
    """A stiff rod on springs k and k/2 across its ends, thrice that in the other plane; a thrust that follows."""
    foot = End(
        position=lambda c: (None, None, 0.0),
        energy=lambda x, c: loads.spring(x.r, (c.k, 3 * c.k, 0.0)) + loads.rotational_spring(x.q, (0.0, 0.0, 1.0)),
    )
    tip = End(follower=classics.push, energy=lambda x, c: loads.spring(x.r, (0.5 * c.k, 1.5 * c.k, 0.0)))
    constants = {"k": k, "B2": 1.3}
    return classics.column("soft springs", (foot, tip), (0.0, 0.9 * k), inertia=THIN, constants=constants)


def soft_springs(k: float) -> Measured:
    """Two degrees of freedom, which flutter at ``P = k/3``; bending makes a difference of 2e-3 k in that."""
    diagram = run(on_soft_springs(k), MESH)
    return compare(diagram.special("flutter"), [Change(k / 3, 0, 2)], said(diagram))


# --- paths ------------------------------------------------------------------------------------------------------------

COARSE = Discretization("auto", 6, 5)
TO_FOLD = 1e-5
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
    return Measured(apart, TO_FOLD)


def imperfect(lateral: Callable[[Any], Any], most: float) -> Scene:
    """A column whose thrust follows its tip in part, under a lateral load as well."""
    ends = (
        clamped(),
        free(force=lambda c: (0.0, lateral(c), -0.8 * c.P), follower=lambda c: (0.0, 0.0, -0.2 * c.P)),
    )
    return classics.column("pushed", ends, (0.0, most), planar="e1", inertia=classics.BEAM, constants={"B2": 5.0})


def bends(lateral: float, most: float = 8.0) -> Measured:
    """It bends to one side, further and further, and is stable; beyond the branch point straight states are not."""
    diagram = run(imperfect(lambda c: lateral, most), COARSE, error_bars=False)
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
