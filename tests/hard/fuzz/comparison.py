"""One scene, traced twice: by different formulations, meshes, factors and steps, which have no number in common.

What must agree: every recorded index with a dense count; special points within the sum of their error bars; states at
the loads asked for; the number of branches.  What differs is *silent* unless one of the two traces has said that it
leaves something open, as that the special points of a branch do not explain its indices.
"""

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, field
from math import inf, isfinite
from typing import Any

import numpy as np

from rodfem import Branch, Diagram, Discretization, Plan, Point, Scene, SpecialPoint, StepControl, trace
from rodfem.continuation.kinds import EVENT
from rodfem.errors import ConvergenceError, InputError
from rodfem.fem.system import System
from rodfem.tolerances import round_off

from .oracle import Oracle

ZERO, NEAR = 1e-7, 1e-4
"""An eigenvalue less than the first, over the lowest bending one, is zero; between the two it may be either."""
OF_A_RING = 1e-2
"""The second where a closed rod may move along itself: the mesh's eigenvalue of that motion."""
COLLAPSED = 1e-9
"""Stretch, at its least along the rod, at which the null space of the constraints of an unshearable rod is another."""
ROWS = 40, 12
"""Most rows of the first and of the second trace that are counted, spread over all of them."""
MOST_BRANCHES = 7
ENDED = ("end of range", "closed loop", "meets another branch", "stretch reaches zero")
"""Beginnings of the reasons for which a branch ends, but for those that depend on steps and meshes."""
OTHER = 0.05
"""Relative difference of stored energies of two resolved states that are two equilibria, not one with two errors."""
FAMILY = "no symmetry of the scene explains"
"""What is said where two traces may have two states of a family."""
APART = 0.05
"""Part of the range beyond which two special points outside each other's bars are two: each lacks a partner."""
AT = (0.37, 0.81)
"""Loads to stop at, as parts of the range."""


@dataclass
class Compared:
    """What a scene shows.

    ``rows`` were counted, ``unclear`` of them too near a critical state; ``ratios`` are differences of special points
    over the sums of their bars, in load and ordinate.  ``wrong`` (indices) and ``differs`` are sentences on what
    disagrees, ``said`` is what the traces say they leave open, ``refused`` the errors by which they ended.
    """

    scene: str
    rows: int = 0
    unclear: int = 0
    ratios: list[float] = field(default_factory=list)
    unresolved: int = 0
    wrong: list[str] = field(default_factory=list)
    differs: list[str] = field(default_factory=list)
    said: list[str] = field(default_factory=list)
    refused: list[str] = field(default_factory=list)

    @property
    def silent(self) -> bool:
        """Whether something differs, and neither trace said a word."""
        return bool(self.wrong) or bool(self.differs and not self.said)

    def entry(self) -> dict[str, Any]:
        """As a line of a file of results."""
        return asdict(self) | {"silent": self.silent}


def meshes(scene: Scene, number: int) -> tuple[Discretization, Discretization]:
    """Two discretisations: the first formulation that applies, and all fields, some by MUMPS."""
    more = 2 if scene.closed else 1
    factors = "petsc" if number % 5 == 3 else "chain"
    return Discretization("auto", 5 * more, 6), Discretization("pointwise", 7 * more, 5, factors=factors)


def plans(scene: Scene, depth: int) -> tuple[Plan, Plan]:
    """Two plans, of long steps and of short ones."""
    low, high = scene.span
    at = tuple(low + part * (high - low) for part in AT)
    steps = StepControl(first=0.05, largest=0.2, most=120), StepControl(first=0.02, largest=0.11, most=240)
    return tuple(Plan(at=at, depth=depth, steps=s, most_branches=MOST_BRANCHES) for s in steps)  # type: ignore[return-value]


def compared(scene: Scene, number: int = 0, depth: int = 1) -> Compared:
    """Trace a scene twice and compare."""
    out, diagrams = Compared(scene.name), []
    for mesh, plan, most in zip(meshes(scene, number), plans(scene, depth), ROWS, strict=True):
        diagram = traced(scene, mesh, plan, out)
        if diagram is None:
            continue
        diagrams.append(diagram)
        out.said += open_questions(diagram)
        if scene.conservative:
            check_rows(diagram, out, most)
    if len(diagrams) == 2:
        check_pair(*diagrams, out)
    elif diagrams:
        out.differs.append("one of the two traces is refused, the other is not")
    return out


def traced(scene: Scene, mesh: Discretization, plan: Plan, out: Compared) -> Diagram | None:
    """Diagram of a scene; what is refused must be so in one sentence."""
    try:
        return trace(scene, mesh, plan)
    except (InputError, ConvergenceError) as trouble:
        out.refused.append(f"{type(trouble).__name__}: {trouble}")
        if (fault := of_a_sentence(str(trouble))) != "":
            out.wrong.append(f"refused by {fault}: {trouble}")
        found: Diagram | None = getattr(trouble, "diagram", None)
        if found is not None or "than a mesh of" in str(trouble):  # that of the other trace may hold the half-waves
            out.said.append(str(trouble))
        return found


def of_a_sentence(text: str) -> str:
    """What is wrong with the sentence of an error; empty for nothing."""
    if "\n" in text:
        return "several lines"
    if not text.rstrip().endswith(".") or not text[:1].strip():
        return "no sentence"
    return "numbers that are none" if any(word in text.split() for word in ("nan", "inf", "None")) else ""


def open_questions(diagram: Diagram) -> list[str]:
    """All that a diagram says it could not decide."""
    unexplained = [str(u) for b in diagram for u in b.unexplained]
    ended = [f"{b.name} ended: {b.ended}" for b in diagram if not b.ended.startswith(ENDED)]
    points = [s for b in diagram for s in b.special if not s.kind.request]
    notes = [f"{s!r}: {s.note}" for s in points if s.note and not (s.event and s.note == s.event.name)]
    unresolved = [f"{s!r} is not resolved" for s in points if s.resolved is False]
    return [*diagram.warnings, *(n.strip() for n in diagram.notes if "eigenvalue" in n), *unexplained, *ended, *notes,
            *unresolved]  # fmt: skip


# --- indices --------------------------------------------------------------------------------------------------------


def check_rows(diagram: Diagram, out: Compared, most: int) -> None:
    """Compare index and zeros of rows with the oracle's."""
    system = diagram.solvers[0].system
    oracle = Oracle(system)
    rows = [(b, i, p) for b in diagram for i, p in enumerate(b.points) if p.mesh == 0]
    special = {id(s.point) for b in diagram for s in singular(b)} | {id(b.points[0]) for b in diagram if b.parent}
    for j in np.unique(np.linspace(0, len(rows) - 1, min(most, len(rows))).astype(int)):
        branch, i, point = rows[j]
        out.rows += 1
        fault = index_of(oracle, system, point, id(point) in special)
        if fault is None:
            out.unclear += 1
        elif fault:
            out.wrong.append(f"{branch.name} row {i}, load {point.load:.8g}: {fault}")


def index_of(oracle: Oracle, system: System, point: Point, special: bool) -> str | None:
    """What a dense count denies of a row; None where an eigenvalue is too near zero to tell.

    The signs of those that count as zero may have been decided by a richer mesh: each then has a name in the row.
    """
    mu = oracle.eigenvalues(point.x)
    near = OF_A_RING if any(s.along for s in system.symmetries) else NEAR
    unsure = ((abs(mu) > ZERO) & (abs(mu) < near)) | (oracle.noise > np.maximum(abs(mu), ZERO))
    if special or oracle.dependent or point.stretch < COLLAPSED or unsure.any():
        return None
    negative, zero = int((mu < -ZERO).sum()), int((abs(mu) <= ZERO).sum())
    if point.negative <= negative <= point.negative + point.undecided and point.zero == zero:
        return ""
    below, above = point.negative - negative, negative + zero - point.negative - point.zero
    if below >= 0 and above >= 0 and below + above <= len(point.soft):
        return None
    least = ", ".join(f"{m:.3g}" for m in mu[: negative + zero + 2])
    return f"recorded ({point.negative}, {point.zero}), dense ({negative}, {zero}) of {least}"


# --- special points -------------------------------------------------------------------------------------------------


def check_pair(first: Diagram, second: Diagram, out: Compared) -> None:
    """Compare two diagrams: the first branches point by point, what leaves them by what is on it."""
    a, b = first[0], second[0]
    width = abs(first.scene.span[1] - first.scene.span[0])
    if not first.scene.conservative and any(FAMILY in words for words in (*first.warnings, *second.warnings)):
        return
    if whole(a) and whole(b):
        if a.ended[:8] != b.ended[:8]:
            out.differs.append(f"{a.name} ended: {a.ended}; and {b.ended}")
        check_specials("trunk", singular(a), singular(b), out, width)
    check_asked(first, second, out)
    if not (all(map(whole, first)) and all(map(whole, second))) or max(len(first), len(second)) >= MOST_BRANCHES:
        return
    found = [joined(first), joined(second)]
    if len(found[0]) != len(found[1]):
        out.differs.append(f"{len(found[0])} branches, and {len(found[1])}")
    else:
        pools = [sorted((s for x in branches[1:] for s in singular(x)), key=_place) for branches in found]
        check_specials("branches", *pools, out, width)


def joined(diagram: Diagram) -> list[Branch]:
    """Branches that branch points join to the first.

    A detached one is beyond a gap: found where a step happens to lead across, it need not be, without a search.
    """
    return [b for b in diagram if not b.name.startswith("detached")]


def whole(branch: Branch) -> bool:
    """Whether a branch ended where the rod says, not the steps."""
    return branch.ended.startswith(ENDED)


def singular(branch: Branch) -> list[SpecialPoint]:
    """Special points at which something happens to the rod, not to a number of its state alone."""
    return [s for s in branch.special if not s.kind.request and s.kind != EVENT]


def _place(s: SpecialPoint) -> tuple[float, float]:
    return s.point.load, s.point.ordinate


def check_specials(
    where: str, first: Sequence[SpecialPoint], second: Sequence[SpecialPoint], out: Compared, width: float
) -> None:
    """Match two lists, each point with the nearest one of its kind in units of the bars; ``width`` is the range's."""
    left = list(second)
    for s in first:
        candidates = [(ratio_of(s, t), t) for t in left if s.kind == t.kind and _change(s) == _change(t)]
        ratio, t = min(candidates, key=lambda pair: pair[0], default=(inf, None))
        if t is None or (ratio > 1 and abs(s.point.load - t.point.load) > APART * width):
            out.differs.append(f"{where}: {describe(s)} has no partner")
            continue
        left.remove(t)
        if any(x.resolved is False or not isfinite(x.error_estimate) for x in (s, t)):
            out.unresolved += 1
            continue
        out.ratios.append(ratio)
        if ratio > 1:
            out.differs.append(f"{where}: {describe(s)} and {describe(t)}, apart by {ratio:.3g} times their bars")
    out.differs += [f"{where}: {describe(t)} of the second trace has no partner" for t in left]


def _change(s: SpecialPoint) -> tuple[int, ...]:
    return tuple(sorted((s.negative_before, s.negative_after)))


def ratio_of(s: SpecialPoint, t: SpecialPoint) -> float:
    """Difference of two special points over the sum of their bars: the larger of load and ordinate."""
    load = abs(s.point.load - t.point.load) / max(bars(s)[0] + bars(t)[0], 1e-300)
    ordinate = abs(s.point.ordinate - t.point.ordinate) / max(bars(s)[1] + bars(t)[1], 1e-300)
    return max(load, ordinate if all(isfinite(x.ordinate_error) for x in (s, t)) else 0.0)


def bars(s: SpecialPoint) -> tuple[float, float]:
    """Error bars of load and ordinate, each not below the round-off of the number itself."""
    load = s.error_estimate if isfinite(s.error_estimate) else s.located_to
    return max(load, round_off(s.point.load, 0.0)), max(s.ordinate_error, round_off(s.point.ordinate, 0.0))


def describe(s: SpecialPoint) -> str:
    """A special point with its bars."""
    load, ordinate = bars(s)
    return (
        f"{s.kind} at {s.point.load:.12g} +- {load:.2g}, {s.point.ordinate:.10g} +- {ordinate:.2g}, "
        f"{s.negative_before}->{s.negative_after}"
    )


def check_asked(first: Diagram, second: Diagram, out: Compared) -> None:
    """Compare the states at loads that were asked for, in their order along the first branches."""
    units = first.scene.units
    for s, t in zip(_asked(first[0]), _asked(second[0]), strict=False):
        if s.point.load != t.point.load:
            return
        ratio = abs(s.point.ordinate - t.point.ordinate) / max(bars(s)[1] + bars(t)[1], 1e-300)
        if s.resolved is False or t.resolved is False or not isfinite(s.ordinate_error + t.ordinate_error):
            out.unresolved += 1
            continue
        low, high = sorted((s.point.energy, t.point.energy))
        if high - low > OTHER * max(abs(low), abs(high), units.energy):
            out.said.append(f"at load {s.point.load:.8g}: two equilibria, of the energies {low:.6g} and {high:.6g}")
        if ratio > 1:
            out.differs.append(f"at load {s.point.load:.8g}: {describe(s)} and {describe(t)}, {ratio:.3g} bars apart")


def _asked(branch: Branch) -> Iterator[SpecialPoint]:
    return (s for s in branch.special if s.kind == "user")
