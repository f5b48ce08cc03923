"""Hard because a locus may be a curve of something else: of a mean, of the other side of a gap, of round-off.

Points of codimension two on it look alike, hide in one step, or have no solution at them.
"""

from collections.abc import Callable
from dataclasses import replace
from math import acos, inf, pi, sqrt
from typing import Any

import classics
import numpy as np
import ufl
from classics import ROUND, circle, column
from demo_cases import scene as demo_scene
from hard.case import Measured, run
from hard.sweeps import BECK
from hard.two_freedoms import scene as two_freedoms
from scipy.linalg import eigh

from rodfem import Diagram, Discretization, Locus, Parameter, Plan, Ring, StepControl, clamped, free, trace
from rodfem.codim2.locus import COARSE
from rodfem.codim2.points import PASSES
from rodfem.continuation.kinds import CROSSES
from rodfem.forms import loads
from rodfem.forms.energy import bending_and_twist
from rodfem.output.plot_locus import stable_region

MESH = Discretization("auto", 4, 6)
UNIFORM = Discretization("auto", 4, 3)
"""Of a rod whose strains are."""
LONG = StepControl(first=0.1, largest=0.3)
"""Steps of a straight locus."""
SPLIT = 0.5
"""Greatest parameter whose fourth power parts the bending stiffnesses."""


def located(diagram: Diagram, name: str, interval: tuple[float, float], **given: Any) -> Locus:
    """Locus of the last special point of a diagram that is not given."""
    special = next(s for s in reversed(diagram[0].special) if not s.kind.request)
    return diagram.locus(special, name, interval, **given)


def words(locus: Locus) -> tuple[str, ...]:
    """What a locus says of itself besides its ends at bounds."""
    marks = {mark.kind for mark in locus.marks if not mark.kind.startswith("turns")}
    return (*sorted(marks), *(end for end in locus.ended if not end.endswith("its bound") and end != "closed curve"))


def beyond(locus: Locus, exact: np.ndarray) -> float:
    """Largest distance of the load from ``exact``, over its error; where that is not known, that of the first row more.

    The mesh's error is the same all along these curves.
    """
    error, left = locus.error[:, 0], locus.located_to[:, 0]
    known = np.where(np.isfinite(error), error, left + np.nanmax(error))
    return float((abs(locus.values[:, 0] - exact) / known).max())


def gap(kind: str, width: float) -> Measured:
    """``P^2 = b^2 + width^2``: two curves of branch points, or folds, that nearly cross; one of them is followed."""
    potential: Callable[[Any, Any, Any], Any] = {
        "branch point": lambda u, f2, c: 0.5 * (c.P**2 - c.b**2 - c.e**2) * u * u + 0.25 * u**4 + 0.5 * f2,
        "fold": lambda u, f2, c: u**3 / 3 - (c.P**2 - c.b**2 - c.e**2) * u + 0.5 * f2,
    }[kind]
    span = (-0.3, 0.3) if kind == "branch point" else (0.3, 0.0)
    start = 0.2 if kind == "branch point" else 0.1
    diagram = run(two_freedoms(potential, span, b=start, e=width), UNIFORM, error_bars=False)
    found = located(diagram, "b", (-0.3, 0.3), load=(-0.3, 0.3))
    off = abs(found.values[:, 0] ** 2 - found.values[:, 1] ** 2 - width**2).max()
    if width == 0:  # they do cross
        crossed = CROSSES in words(found) or any("ends on a branch point" in end for end in found.ended)
        unfilled = stable_region(found.data(), [found.data()]) is None  # beyond the crossing the other side is stable
        return Measured(float(off) if crossed and unfilled else inf, 1e-9, words(found))
    turns = [mark for mark in found.marks if mark.kind == "turns in P"]
    one = len(turns) == 1 and abs(abs(found.values[turns[0].row, 0]) - width) < 1e-9
    one = one and bool((abs(found.values[:, 0]) > 0.999 * width).all()) and not words(found)
    return Measured(float(off) if one else inf, 1e-9, words(found), "" if one or words(found) else str(found.ended))


def split(kind: str, order: int) -> Measured:
    """Bending stiffnesses 1 and ``1 + e^order``: what is one load of both planes at e = 0 becomes two."""
    push = classics.push
    ends = {
        "branch point": free(push),
        "divergence": free(force=lambda c: (0.0, 0.0, -0.8 * c.P), follower=lambda c: (0.0, 0.0, -0.2 * c.P)),
        "flutter": free(follower=push),
    }[kind]
    exact, span = {"branch point": (pi**2 / 4, (0.0, 4.0)), "divergence": (acos(-1 / 4) ** 2, (3.0, 4.0)),
                   "flutter": (BECK, (18.0, 22.0))}[kind]  # fmt: skip
    scene = classics.column(
        "split", (clamped(), ends), span, constants={"P": span[0], "e": 0.0},
        energy=lambda v, k, c: bending_and_twist(k, (1.0, 1.0 + c.e**order, 1.0)),
        **({} if kind == "branch point" else {"inertia": classics.BEAM}),
    )  # fmt: skip
    found = located(run(scene, MESH), "e", (-SPLIT, SPLIT))
    each = [beyond(found, exact * part) for part in (1.0, 1.0 + found.values[:, 1] ** order)]
    said = all("together any more" in end for end in found.ended)
    return Measured(max(each) if said else inf, 1.0, (), "" if said else str(found.ended))


def imperfect(half: float) -> Measured:
    """A force across a column in an interval of this ``half`` width about zero: its branch point is none beside it."""
    ends = clamped(), free(lambda c: (0.0, c.e, -c.P))
    scene = classics.column("across", ends, (0.0, 4.0), constants={"P": 0.0, "e": 0.0, "B2": 2.0})
    found = located(run(scene, MESH), "e", (-half, half))
    said = all("e is an imperfection" in end for end in found.ended)
    return Measured(beyond(found, np.full(len(found.values), pi**2 / 4)) if said else inf, 1.0)


def founded(most: float) -> Measured:
    """Beck's column on a foundation of a stiffness up to ``most``: it changes no flutter load (Smith & Herrmann)."""
    beck = classics.beck(span=(15.0, 25.0))
    scene = replace(
        beck, planar="e1", parameters={**beck.parameters, "w": Parameter(0.0)},
        potential=lambda x, c: loads.spring(x.r, (0.0, c.w, 0.0)),
    )  # fmt: skip
    found = located(run(scene, MESH), "w", (-1.0, most), steps=LONG)
    values, left = found.values[:, 0], found.located_to[:, 0]
    apart = np.ptp(values) / (2 * left.max())  # the mesh's error is that of all rows
    error = max(beyond(found, np.full(len(values), BECK)), float(apart))
    return Measured(error, 1.0, (), "" if len(values) > 2 else "short")


def island(radius: float) -> Measured:
    """``P^2 + b^2 = radius^2`` in bounds of 0.3: followed once round."""
    diagram = run(
        two_freedoms(
            lambda u, f2, c: 0.5 * (c.P**2 + c.b**2 - c.e**2) * u * u + 0.25 * u**4 + 0.5 * f2, (-0.3, 0.3), e=radius
        ),
        UNIFORM,
        error_bars=False,
    )
    found = located(diagram, "b", (-0.3, 0.3))
    once = found.ended[1] == "closed curve" and len(found.marks) == 4
    return Measured(float(abs(np.hypot(*found.values.T) - radius).max()) if once else inf, 1e-9)


# --- points of codimension two ----------------------------------------------------------------------------------------

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
