"""A diagram in sentences: where the rod is stable, how stability is lost, and what the diagram leaves open.

Every sentence repeats the contents of ``diagram.json``: indices between rows, special points and their normal forms,
ends of branches.  What was not examined is not claimed.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations, pairwise
from math import ceil, floor, isfinite, log10
from typing import Any

import numpy as np

from rodfem.continuation.branch import FIRST_BRANCH
from rodfem.continuation.kinds import BRANCH_POINT, DIVERGENCE, FLUTTER, FOLD, IMPERFECT
from rodfem.errors import many
from rodfem.output.pieces import MEETS, Interval, intervals_of
from rodfem.output.words import is_sweep, with_unit
from rodfem.stability.soft_mode import PLANAR, STABLE, UNDECIDED, on_kink
from rodfem.tolerances import NEGLIGIBLE, SAME_SPECIAL

MOST = 6  # intervals of a branch that have a clause each, and branches that are named in one sentence
DIGITS, FEW = 10, 6  # significant digits of a load at most, and of one without an error bar
EVENTS = {
    FOLD: "turns back in a fold",
    FLUTTER: "flutters: two frequencies coincide and become complex",
    DIVERGENCE: "diverges: a frequency passes through zero",
}
RECOVERY = {
    FLUTTER: "ceases to flutter: two complex frequencies coincide and become real",
    DIVERGENCE: "ceases to diverge: a frequency passes through zero",
}
"""The same where the index does not rise."""
OF_RATES = (
    {FLUTTER: "flutters: an oscillation ceases to decay", DIVERGENCE: "diverges: a motion ceases to decay"},
    {FLUTTER: "ceases to flutter: an oscillation decays again", DIVERGENCE: "ceases to diverge: a motion decays again"},
)
"""The same two of a rod with drag."""
FORMS = {
    "supercritical pitchfork": "buckles supercritically",
    "subcritical pitchfork": "buckles subcritically and jumps",
    "transcritical": "meets another branch transcritically",
    "vertical branch": "meets a family of states at one and the same load",
}
"""Normal forms as verbs."""
UNRESOLVED = ", as far as this mesh tells: it does not resolve that state"

Data = Mapping[str, Any]


def in_sentences(data: Data) -> list[str]:
    """Sentences on a diagram, the contents of ``diagram.json``: its branches, ranges of stability, open questions."""
    first, *others = data["branches"]
    shown = [branch for branch in others if _kinds(branch) & {STABLE, PLANAR, UNDECIDED}]
    out = [_of_branch(branch, data) + _remarks(data, branch) for branch in (first, *shown[:MOST])]
    if more := shown[MOST:]:
        out.append(f"{_names(more)} have stable states, too." + _remarks(data, *more))
    if quiet := [branch for branch in others if branch not in shown and intervals_of(branch)]:
        verb = "is unstable on its" if len(quiet) == 1 else "are unstable on their"
        out.append(f"{_names(quiet)} {verb} whole range." + _remarks(data, *quiet))
    return [
        *out,
        *_ranges(data),
        *_coexistence(data),
        *_open(data["branches"], data),
        *filter(None, [_remarks(data).strip()]),
    ]


def _kinds(branch: Data) -> set[str]:
    return {interval.kind for interval in intervals_of(branch)}


def _remarks(data: Data, *branches: Data) -> str:
    """What the run says of some ``branches``; without any, what it says of no branch of the diagram."""
    names, out = {branch["name"] for branch in branches}, ""
    every = {branch["name"] for branch in data["branches"]}
    for word, entry in (("Warning", "warnings"), ("Note", "notes")):
        for remark in data.get(entry) or ():
            if remark["branch"] in names or not (names or remark["branch"] in every):
                out += f" {word}: {' '.join(remark['sentence'].split())}"
    return out


def called(name: str) -> str:
    """Name of a branch inside a sentence."""
    return f"the {name}" if name == FIRST_BRANCH else name


def _capital(name: str) -> str:
    """Name of a branch at the beginning of a sentence."""
    return name[:1].upper() + name[1:]


def _names(branches: Sequence[Data]) -> str:
    """Branches by name, or, where they are many, by number."""
    names = [called(branch["name"]) for branch in branches]
    if len(names) > MOST:
        return f"{len(names)} other branches"
    return _capital(" and ".join(filter(None, (", ".join(names[:-1]), names[-1]))))


# --- one branch


def _of_branch(branch: Data, data: Data) -> str:
    """What is stable along a branch, what happens where that changes, and how it ends."""
    intervals, load, name, ended = intervals_of(branch), _load(data), _subject(branch, data), branch["ended"]
    end = f"it ends where it {ended.rstrip('.')}" if ended.startswith(MEETS) else f"it ends there: {ended.rstrip('.')}"
    if not intervals:
        return f"{name} has one state only; {end}."
    start, stop = distinct_digits(intervals[0].loads[0], intervals[-1].loads[-1], width=_width(data))
    if len(intervals) == 1:
        coarse = any(special.get("resolved") is False for special in branch["special"])
        state, doubt = _state(intervals[0], data), UNRESOLVED if coarse else ""
        parts = [f"{name} is {state} on its whole range, from {load} = {start} to {stop}{doubt}"]
    else:
        (state, here), *others = _changes(intervals, data, stop)
        parts = [f"{name} is {state} from {load} = {start} {here}", *(f"then {state} {here}" for state, here in others)]
    return "; ".join(parts + [end] * (ended != "end of range")) + "."


def _subject(branch: Data, data: Data) -> str:
    """Name of a branch, and where it comes from, as the beginning of a sentence."""
    name, parent = _capital(branch["name"]), branch["parent"]
    if branch is data["branches"][0]:
        return "The first branch" if branch["name"] == FIRST_BRANCH else f"The first branch, {branch['name']},"
    if parent is None:
        return f"{name}, which leaves none of the others,"
    special = next(b for b in data["branches"] if b["name"] == parent[0])["special"][parent[1]]
    return f"{name}, which leaves {called(parent[0])} at {known_digits(special)},"


def _changes(intervals: Sequence[Interval], data: Data, stop: str) -> Iterator[tuple[str, str]]:
    """States of intervals in order, each with what happens at its end; only the first of many."""
    shown = intervals if len(intervals) <= MOST + 1 else intervals[:MOST]
    for one, after in zip(shown, intervals[1:], strict=False):
        where, what = _change(one, after, data["branches"])
        yield _state(one, data), f"to {where}, where it {what}"
    if len(intervals) == len(shown):
        yield _state(shown[-1], data), f"to {stop}"
    else:
        more = many(len(intervals) - 1 - len(shown), "time")
        yield "its stability", f"changes {more} more before {_load(data)} = {stop}"


def _state(interval: Interval, data: Data) -> str:
    """Stability of an interval in words."""
    sweep = is_sweep(data)
    if interval.kind == STABLE:
        plane = " in its plane (not examined in space)" if data.get("planar") and interval.in_space is None else ""
        found = "rates" if interval.branch.get("rates") else "frequencies"
        return f"stable{plane}, by the {found} found," if sweep else f"stable{plane}"
    if interval.kind == UNDECIDED:
        soft = ["the sign of an eigenvalue is not known on this mesh"] * interval.soft
        return f"of undecided stability ({'; '.join([on_kink(interval.kink)] * bool(interval.kink) + soft)})"
    if interval.kind == PLANAR:
        return f"stable in its plane but not in space (index {interval.in_space} at most)"
    index = f"{interval.least}" if interval.least == interval.most else f"{interval.least} to {interval.most}"
    return f"unstable ({index} eigenvalue{'s' * (interval.most != 1)})" if sweep else f"unstable (index {index})"


def _change(one: Interval, after: Interval, branches: Sequence[Data]) -> tuple[str, str]:
    """Load at which two intervals of a branch meet, and what happens there."""
    branch = one.branch
    if found := _specials(one):
        return known_digits(found[0]), " and ".join(_event(special, branch, branches) for special in found)
    row, loads = _step(one, after)
    a, b = distinct_digits(*loads)
    unexplained = any(change["row"] == row for change in branch.get("unexplained") or ())
    what = "changes its index without a special point that says why" if unexplained else _difference(one, after)
    return f"some load between {a} and {b}", what


def _specials(one: Interval) -> list[Data]:
    """Special points at the end of an interval at which the index changes."""
    return [s for s in one.branch["special"] if s["row"] == one.last and s["negative_before"] != s["negative_after"]]


def _step(one: Interval, after: Interval) -> tuple[int, list[float]]:
    """First row and both loads of the step in which two intervals of a branch meet without a special point."""
    row = one.last if after.rank > one.rank else one.last - 1
    return row, one.branch["columns"]["load"][row : row + 2]


def _difference(one: Interval, after: Interval) -> str:
    """What happens between two intervals where no special point is."""
    if one.kink or after.kink:
        return f"comes to a kink of the {after.kink}" if after.kink else f"leaves a kink of the {one.kink}"
    if UNDECIDED in (one.kind, after.kind):
        return "has an eigenvalue that is not told from zero on one side"
    verb = "loses" if one.kind == STABLE else "changes"
    if None in (one.in_space, after.in_space) or (one.least, one.most) != (after.least, after.most):
        return f"{verb} its stability, and no special point says why"
    return f"{verb} its stability against motions out of the plane (without planar it is located)"


def _event(special: Data, branch: Data, branches: Sequence[Data]) -> str:
    """What happens at a special point, as a verb with all that is known of it."""
    kind, rises = special["kind"], special["negative_after"] > special["negative_before"]
    verbs = EVENTS | (OF_RATES[not rises] if branch.get("rates") else {} if rises else RECOVERY)
    words = verbs.get(kind, f"passes a special point, {kind}")
    if kind == IMPERFECT:
        size = special.get("unfolding")
        known = "" if size is None else f" of the relative size {abs(size):.0e}"
        words = f"passes a branch point that an imperfection{known} takes apart"
    elif kind == BRANCH_POINT:
        words = _form(special, rises) + _directions(special, branch, branches)
    return words + (UNRESOLVED if special.get("resolved") is False else "")


def _form(special: Data, rises: bool) -> str:
    """Normal form at a branch point as a verb."""
    law = special["law"]
    if law is None or law["kind"] not in FORMS:
        return "passes a branch point" + (" of undetermined form" if special["followed"] else " that was not followed")
    words = FORMS[law["kind"]]
    if words.startswith("buckles") and not rises:
        words = f"passes a {law['kind']}"
    uncertain = law["uncertainty"] is None or abs(law["coefficient"]) <= law["uncertainty"]
    return words + (" (or nearly so)" if uncertain and law["side"] else "")


def _directions(special: Data, branch: Data, branches: Sequence[Data]) -> str:
    """Number of eigenvalues that vanish at once, and whether one of them stays zero on the branch that leaves."""
    if special["multiplicity"] < 2:
        return ""
    words = f"{special['multiplicity']} directions at once"
    leaving = [b for b in branches if b["parent"] == [branch["name"], branch["special"].index(special)]]
    before = branch["columns"]["zero"][max(special["row"] - 1, 0)]
    if special["multiplicity"] == 2 and len(leaving) == 1 and min(leaving[0]["columns"]["zero"]) == before + 1:
        words += f": a circle of states, hence the zero eigenvalue on {leaving[0]['name']}"
    return f" ({words})"


# --- all branches


def _ranges(data: Data) -> Iterator[str]:
    """Ranges of the load without a stable state, and those that are not examined."""
    if is_sweep(data):
        return
    kinds = STABLE, UNDECIDED, PLANAR
    stable, undecided, planar = ([_cover(x.loads) for x in _intervals(data, kind)] for kind in kinds)
    lost = list(_unlocated(data))
    for a, b in _gaps(stable + lost, *sorted(data["range"])):
        but = ", but there are states of undecided stability" if _overlap(undecided, a, b) else ""
        state = "state that is stable in space, too," if _overlap(planar, a, b) else "stable state"
        yield f"From {_interval(data, a, b, 'to')} no {state} was found{but}."
    for step in lost:
        for a, b in _gaps(stable, *step):
            yield f"Stability is not examined between {_interval(data, a, b, 'and')}, where it changes."


def _intervals(data: Data, kind: str) -> list[Interval]:
    return [x for branch in data["branches"] for x in intervals_of(branch) if x.kind == kind]


def _overlap(ranges: Sequence[tuple[float, float]], a: float, b: float) -> bool:
    return any(low < b and high > a for low, high in ranges)


def _cover(loads: Sequence[float]) -> tuple[float, float]:
    return min(loads), max(loads)


def _unlocated(data: Data) -> Iterator[tuple[float, float]]:
    """Loads of the steps in which stability is lost or won without a special point."""
    for one, after in (pair for branch in data["branches"] for pair in pairwise(intervals_of(branch))):
        if STABLE in (one.kind, after.kind) and UNDECIDED not in (one.kind, after.kind) and not _specials(one):
            yield _cover(_step(one, after)[1])


def _gaps(ranges: Sequence[tuple[float, float]], low: float, high: float) -> Iterator[tuple[float, float]]:
    """Parts of an interval of loads that no range covers, from below."""
    reached, least = low, SAME_SPECIAL * (high - low)
    for a, b in [*sorted((a, b) for a, b in ranges if b > low and a < high), (high, high)]:
        if min(a, high) - reached > least:
            yield reached, min(a, high)
        reached = max(reached, b)


def _coexistence(data: Data, most: int = 100) -> Iterator[str]:
    """Ranges of the load with several stable states, of which ``most`` are compared with each other."""
    stable = [] if is_sweep(data) else _intervals(data, STABLE)
    found = [(*pair, *both) for pair in combinations(stable[:most], 2) if (both := _shared(*pair))]
    for one, other, a, b in found[:MOST]:
        names = " and ".join(dict.fromkeys(called(interval.branch["name"]) for interval in (one, other)))
        states, verb = f"From {_interval(data, a, b, 'to')} two stable states", f"coexist, of {names}"
        if _is_resolved(one) and _is_resolved(other):
            yield f"{states} {verb}: hysteresis is possible."
        else:
            yield f"{states} may {verb}: the mesh does not resolve them, use more elements."
    if more := found[MOST:]:
        yield f"So do {many(len(more), 'further pair')} of stable states elsewhere{', or more' * (len(stable) > most)}."


def _shared(one: Interval, other: Interval) -> tuple[float, float] | None:
    """Loads that two intervals share, their energies being others there; None without such a range.

    Those of one energy, to what linear interpolation leaves, are mirror images, or one branch twice.  Energies of
    other states may be the same at one load, of symmetry, say, but not at two.
    """
    (a, b), (c, d) = _cover(one.loads), _cover(other.loads)
    low, high = max(a, c), min(b, d)
    if high - low <= SAME_SPECIAL * max(b - a, d - c):
        return None
    at = low + np.array([0.5, 0.31]) * (high - low)
    energies = []
    for x in (one, other):
        energy = np.array(x.branch["columns"]["energy"][x.first : x.last + 1])
        order = np.argsort(x.loads, kind="stable")
        energies.append(np.interp(at, np.array(x.loads)[order], energy[order]))
    p, q = energies
    return (low, high) if (abs(p - q) > 1e-3 * np.maximum(abs(p), abs(q))).any() else None


def _is_resolved(one: Interval) -> bool:
    """Whether the mesh resolves one of its states that were examined, if any was."""
    found = [s.get("resolved") for s in one.branch["special"] if one.first <= s["row"] <= one.last]
    return True in found or False not in found


def _open(branches: Sequence[Data], data: Data) -> Iterator[str]:
    """What a diagram leaves open."""
    if any(branch.get("singular_start") for branch in branches):
        yield "The first state is singular: what leaves it was not followed."
    if missed := data.get("branch_points_not_followed"):
        yield f"{many(missed, 'branch point was', 'branch points were')} not followed."
    if changes := sum(len(branch.get("unexplained") or ()) for branch in branches):
        yield f"{many(changes, 'change')} of the index without a special point: see the warnings."
    if coarse := sum(special.get("resolved") is False for branch in branches for special in branch["special"]):
        what = f"{many(coarse, 'special point')}, whose error bars are no bounds"
        yield f"The mesh does not resolve {what}: use more elements or a higher degree."


# --- loads


def _interval(data: Data, a: float, b: float, word: str) -> str:
    """Two loads with a word between them."""
    first, last = distinct_digits(a, b, width=_width(data))
    return f"{_load(data)} = {first} {word} {last}"


def _load(data: Data) -> str:
    """Name of the load, with its unit."""
    return with_unit(data["parameter"], str(data.get("parameter_unit") or ""))


def _width(data: Data) -> float:
    low, high = data["range"]
    return float(abs(high - low))


def distinct_digits(*loads: float, width: float = 0.0) -> list[str]:
    """Loads with as many digits as a range of that ``width`` needs: by default from the first load to the last."""
    width = width or abs(loads[-1] - loads[0])
    loads = tuple(0.0 if abs(load) < NEGLIGIBLE * width else load for load in loads)  # round-off of a computed end
    more = ceil(log10(max(map(abs, loads)) / width)) if width and any(loads) else 0
    return [f"{load:.{min(FEW + max(more, 0), 15)}g}" for load in loads]


def known_digits(special: Data) -> str:
    """Load of a special point, with the digits that its error bar supports: rounded by less than that."""
    load, error = special["load"], special.get("error_estimate")
    digits = FEW
    if error and isfinite(error) and special.get("resolved") is not False:
        digits = min(max(floor(log10(max(abs(load), error))) - floor(log10(error)) + 1, 1), DIGITS)
    return f"{load:.{digits}g}"
