"""Draws ``docs/theory/reduced-stiffness.png``: eigenvalues of the reduced stiffness matrix between two equilibria.

Run as ``python -m benchmarks.reduced_stiffness``.
"""

from __future__ import annotations

from collections.abc import Callable
from math import pi
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np

import rodfem
from rodfem import Attachment, Discretization, Ordinate, Parameter, Plan, Scene, StepControl, clamped, free, pinned
from rodfem.continuation.arc import Piece
from rodfem.continuation.crossings import cubic_value
from rodfem.forms.energy import bending_and_twist
from rodfem.stability.reduced_stiffness import Condensation

EULER = pi**2 / 4


def column(thrust: Callable[[Any], Any], **given: Any) -> Scene:
    """A cantilever of stiffness one about d1, and of another one about d2, under a dead ``thrust``."""
    energy = given.pop("energy", lambda v, k, c: bending_and_twist(k, (1.0, 3.0, 1.0)))
    ends = clamped(), free(lambda c: (0.0, 0.0, -thrust(c)))
    tip = Ordinate("tip", s=1.0, of=lambda r, q: r[1])
    return Scene("column", (0.0, 1.0), "unshearable and inextensible", energy, {"P": Parameter(0.0)}, "P", ends, tip,
                 (0.0, 1.0), **given)  # fmt: skip


def pair() -> Scene:
    """The thrust rises beyond Euler's load, and falls again."""
    return column(lambda c: EULER * (1 + 0.1 - (c.P - 0.5) ** 2))


def avoided() -> Scene:
    """The stiffer plane softens with the load, and bending about d1 and d2 is coupled a little."""

    def energy(v: Any, k: Any, c: Any) -> Any:
        return bending_and_twist(k, (1.0, 1.3 - 0.6 * c.P, 1.0)) + 0.015 * k[0] * k[1]

    return column(lambda c: 0.97 * EULER, energy=energy)


def fold() -> Scene:
    """A shallow arch, pinned at both ends, with a dead load at its crown."""
    half = 0.5
    start = lambda s: np.stack([np.cos(s / 2), 0 * s, np.sin(s / 2), 0 * s], axis=1)  # noqa: E731
    ends = [pinned(lambda c, x=x: (1 - np.cos(half), 0.0, x * np.sin(half))) for x in (-1, 1)]
    crown = Ordinate("crown", s=0.0, of=lambda r, q: r[0])
    return Scene(
        "arch", (-half, half), "unshearable", lambda v, k, c: bending_and_twist((k[0], k[1] - 1, k[2]), (9.0, 1.0, 9.0))
        + 2000 * (v[2] - 1) ** 2, {"P": Parameter(0.0)}, "P", tuple(ends), crown, (0.0, 60.0), planar="e2", start=start,
        attachments=(Attachment(0.0, force=lambda c: (c.P, 0.0, 0.0)),),
    )  # fmt: skip


def draw(axes: Any, scene: Scene, title: str, ends: tuple[float, float] | None) -> None:
    """Eigenvalues near zero: by the cubic between two equilibria, and of the reduced stiffness at others between them.

    The two are at the loads ``ends``, or rows on either side of the first fold.
    """
    plan = Plan(at=ends or (), depth=0, error_bars=False, steps=StepControl(largest=0.2))
    diagram = rodfem.trace(scene, Discretization(elements=8, degree=6), plan)
    rows = diagram[0].points
    if ends is None:
        i = rows.index(diagram.special("fold")[0].point)
        a, b = rows[i - 1], rows[i + 1]
    else:
        a, b = (next(p for p in rows if p.load == load) for load in ends)
    assert a.tangent is not None
    assert b.tangent is not None
    solver = diagram.solvers[a.mesh]
    condensation = Condensation(solver.inertia)
    piece = Piece(solver, condensation, a, b, condensation.border(a.x))
    p, q = piece.node(a.x, a.tangent), piece.node(b.x, b.tangent)
    axes.axhline(0.0, color="0.7", lw=1)
    t = np.linspace(0.0, 1.0, 101)
    axes.plot(
        t, [np.linalg.eigvalsh(cubic_value(p, q, x))[:2] / solver.inertia.scale for x in t], color="#0072B2", lw=2
    )
    for x in np.linspace(0.0, 1.0, 9):
        node = p if x == 0 else q if x == 1 else piece.solve(p, q, p.s + x * (q.s - p.s))
        assert node is not None
        axes.plot([x] * 2, np.linalg.eigvalsh(node.H)[:2] / solver.inertia.scale, "o", color="#D55E00", ms=4)
    axes.set(title=title, xlabel="from one row to the next", xlim=(-0.03, 1.03))


def main(path: Path = Path(__file__).parents[1] / "docs" / "theory" / "reduced-stiffness.png") -> None:
    """Draw the picture."""
    figure, (first, second, third) = plt.subplots(1, 3, figsize=(9.0, 2.9), layout="constrained")
    draw(first, pair(), "a pair", (0.1, 0.9))
    first.set_ylim(-0.04, 0.06)
    draw(second, avoided(), "an avoided crossing", (0.2, 0.8))
    draw(third, fold(), "a fold", None)
    first.set_ylabel("lowest eigenvalues of $H$,\nover the lowest bending one")
    figure.savefig(path, dpi=150)


if __name__ == "__main__":
    main()
