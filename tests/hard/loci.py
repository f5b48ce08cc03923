"""Hard because a locus may be a curve of something else: of a mean, of the other side of a gap, of round-off."""

from collections.abc import Callable
from dataclasses import replace
from math import acos, inf, pi
from typing import Any

import classics
import numpy as np
from hard.case import Measured, run
from hard.thrusts import BECK
from hard.two_freedoms import scene as two_freedoms

from rodfem import Diagram, Discretization, Locus, Parameter, StepControl, clamped, free
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
