"""Hard because points of codimension two on a locus look alike, hide in one step, or have no solution at them."""

from math import inf, sqrt

import numpy as np
import ufl
from classics import ROUND, circle, column
from demo_cases import scene as demo_scene
from hard.case import Measured, run
from hard.loci import UNIFORM, words
from hard.two_freedoms import scene as two_freedoms
from scipy.linalg import eigh

from rodfem import Discretization, Plan, Ring, trace
from rodfem.codim2.locus import COARSE, Locus
from rodfem.codim2.points import PASSES
from rodfem.forms import loads

WAVES, MODES = 3, 40
"""Waves of a stiffness around a ring, and of the modes by which its critical pressure is known."""


def _marked(found: Locus, kind: str, exact: tuple[float, float]) -> float:
    """Distance of the only row that is marked so, over its error."""
    rows = [mark.row for mark in found.marks if mark.kind == kind]
    if len(rows) != 1:
        return inf
    error = found.located_to[rows[0]] + np.nan_to_num(found.error[rows[0]], posinf=0.0)
    return float((abs(found.values[rows[0]] - exact) / error).max())


def cusp(width: float) -> Measured:
    """Folds of ``u^4/4 - b u^2/2 - P u``, on ``27 P^2 = 4 b^3``, in bounds of 0.1 for P and of this ``width`` for b."""
    potential = lambda u, f2, c: u**4 / 4 - c.b * u * u / 2 - c.P * u + f2 / 2  # noqa: E731
    diagram = run(two_freedoms(potential, (-0.1, 0.1), b=0.01), UNIFORM)
    found = diagram.locus(diagram.special("fold")[0], "b", (-width, width), (-0.1, 0.1))
    whole = [mark.kind for mark in found.marks] == ["cusp"] and all(end.endswith("its bound") for end in found.ended)
    return Measured(_marked(found, "cusp", (0.0, 0.0)) if whole else inf, 1.0, (), "" if whole else str(words(found)))


def passes(skew: float) -> Measured:
    """Folds ``P - 1.5 skew b = -(b + skew P)^2/4`` pass a branch point: one curve, no cusp, no end."""
    potential = lambda u, f2, c: (  # noqa: E731
        u**4 / 4 - (c.P - 1.5 * skew * c.b) * u * u / 2 + (c.b + skew * c.P) * u**3 / 3 + f2 / 2
    )
    diagram = trace(two_freedoms(potential, (-0.1, 0.1), b=-0.2), UNIFORM, Plan(depth=1, error_bars=False))
    found = diagram.locus(diagram.special("fold")[0], "b", (-1.0, 1.0), (-1.0, 1.0))
    P, b = found.values.T
    off = abs(P - 1.5 * skew * b + (b + skew * P) ** 2 / 4)
    rows = [m.row for m in found.marks if m.kind == PASSES]
    one = len(rows) == 1 and all(end.endswith("its bound") for end in found.ended) and "cusp" not in words(found)
    away = np.delete(off, rows).max()
    held = one and bool((abs(found.values[rows[0]]) <= found.located_to[rows[0]]).all())
    return Measured(float(away) if held else inf, 1e-9, (), "" if held else str((found.marks, found.ended)))


def end_on_ring(most: float) -> Measured:
    """Michell's ring: its folds end where ``C t0 = sqrt(3)``, at ``C = 11/8``, where branches turn supercritical."""
    diagram = trace(demo_scene("ring"), Discretization("auto", 8, 6), Plan(depth=2, error_bars=False))
    exact = (sqrt(3) / 1.375, 1.375)
    fold = min(diagram.special("fold"), key=lambda s: abs(s.point.load - exact[0]))
    found = diagram.locus(fold, "C", (1.0, most))
    rows = [m.row for m in found.marks if m.kind == "the fold ends on a branch point" and found.values[m.row, 0] > 1]
    if len(rows) != 1:
        return Measured(inf, 1.0, (), str(words(found)))
    return Measured(float((abs(found.values[rows[0]] - exact) / found.located_to[rows[0]]).max()), 1.0)


def convex(most: float) -> Measured:
    """A ruler whose stretching stiffness E is followed to ``most`` in steps of its interval: convex for all E > 0."""
    mesh, plan = Discretization("auto", 8, 6), Plan(depth=0, error_bars=False)
    diagram = trace(demo_scene("ruler"), mesh, plan)
    found = diagram.locus(diagram.special("branch point")[0], "E", (5.0, most))
    there = trace(demo_scene("ruler", stretching=most), mesh, plan).special("branch point")[0]
    whole = found.ended == ("E = 5, its bound", f"E = {most:g}, its bound")
    off = abs(found.values[-1, 0] - there.point.load) if whole else inf
    return Measured(off, 1e-9, (), "" if whole else str(found.ended))


def modulated(e: float) -> Measured:
    """A pressed ring of stiffness ``1 + e cos 3s`` on 8 elements, which break its symmetry: a circle stays one."""
    rod = column(
        "modulated", Ring(), (1.0, 5.0), start=circle, planar="e2", constants={"P": 1.0, "B2": 1.0, "e": e},
        energy=lambda v, k, c: 0.5 * c.B1 * k[0] ** 2 + 0.5 * c.C * k[2] ** 2
        + 0.5 * c.B2 * (1 + c.e * ufl.cos(WAVES * c.s)) * (k[1] - 1) ** 2,
        potential=lambda x, c: loads.pressure(x.r, x.dr, c.P), **ROUND,
    )  # fmt: skip
    diagram = trace(rod, Discretization("auto", 8, 6), Plan(depth=0))
    found = diagram.locus(diagram.special("branch point")[0], "e", (-0.5, 0.5), (0.0, 8.0))
    known = np.isfinite(found.error[:, 0])
    off = [abs(load - _pressure(e)) for load, e in found.values[known]]
    slope = [abs(_pressure(e + 1e-5) - _pressure(e - 1e-5)) / 2e-5 for _, e in found.values[known]]
    bars = found.error[known, 0] + slope * found.error[known, 1]
    said = (*words(found), *([COARSE] if found.unresolved else []))
    return Measured(float((off / bars).max()) if known.any() and (found.index == [0, 2]).all() else inf, 1.0, said)


def _pressure(e: float) -> float:
    """Least critical pressure: ``B w = P M w`` for amplitudes of modes, ``B`` of ``(1 + e cos 3s)(w'' + w)^2``."""
    m = np.array([i for i in range(-MODES, MODES + 1) if abs(i) > 1])
    a = 1.0 - m * m
    bending = np.diag(a * a) + e / 2 * np.outer(a, a) * (abs(m[:, None] - m) == WAVES)
    return float(eigh(bending, np.diag(-a))[0][0])
