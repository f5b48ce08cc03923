"""Hard because they are near each other: two critical loads of a sweep, of two planes, or out of a greatest thrust.

The thrust on a column is a parabola in a parameter, and at its greatest about as large as the critical one.  What is
critical of the column is known: flutter of Beck's, divergence of one whose thrust follows the tip in part.
"""

from math import acos, inf, sqrt
from typing import Any

import classics
from closed_forms import double
from hard.case import Change, Measured, compare, run, said

from rodfem import Diagram, Discretization, End, Inertia, Scene, clamped, free
from rodfem.forms import loads as springs

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


def loads(diagram: Diagram, kind: str, at: float) -> list[tuple[float, float]]:
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
    found = loads(diagram, kind, at)
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
        energy=lambda x, c: springs.spring(x.r, (c.k, 3 * c.k, 0.0)) + springs.rotational_spring(x.q, (0.0, 0.0, 1.0)),
    )
    tip = End(follower=classics.push, energy=lambda x, c: springs.spring(x.r, (0.5 * c.k, 1.5 * c.k, 0.0)))
    constants = {"k": k, "B2": 1.3}
    return classics.column("soft springs", (foot, tip), (0.0, 0.9 * k), inertia=THIN, constants=constants)


def soft_springs(k: float) -> Measured:
    """Two degrees of freedom, which flutter at ``P = k/3``; bending makes a difference of 2e-3 k in that."""
    diagram = run(on_soft_springs(k), MESH)
    return compare(diagram.special("flutter"), [Change(k / 3, 0, 2)], said(diagram))
