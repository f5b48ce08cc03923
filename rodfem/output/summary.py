"""A diagram in sentences: where the rod is stable, how stability is lost, and what the diagram leaves open.

Every sentence repeats the contents of ``diagram.json``: indices between rows, special points and their normal forms,
ends of branches.  What was not examined is not claimed.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import ceil, floor, isfinite, log10
from typing import Any

from rodfem.continuation.branch import FIRST_BRANCH
from rodfem.continuation.kinds import BRANCH_POINT, DIVERGENCE, FLUTTER, FOLD, IMPERFECT
from rodfem.errors import many
from rodfem.output.pieces import (
    MEETS,
    PLANAR,
    STABLE,
    UNDECIDED,
    Interval,
    changes_at,
    coexisting,
    intervals_in,
    intervals_of,
    step_between,
    unlocated,
    without_stable,
)
from rodfem.output.words import is_sweep

MOST_INTERVALS, MOST_NAMES = 6, 6
"""Intervals of a branch that have a clause each, and branches that are named in one sentence."""
Branches = Sequence[Mapping[str, Any]]
DIGITS, FEW = 10, 6
"""Significant digits of a load at most, and of one without an error bar."""
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
FORMS = {
    "supercritical pitchfork": "buckles supercritically",
    "subcritical pitchfork": "buckles subcritically",
    "transcritical": "meets another branch transcritically",
    "vertical branch": "meets a family of states at one and the same load",
}
"""Normal forms as verbs."""
UNRESOLVED = ", as far as this mesh tells: it does not resolve that state"


def in_sentences(data: Mapping[str, Any]) -> list[str]:
    """Sentences on a diagram, the contents of ``diagram.json``: its branches, ranges of stability, open questions."""
    first, *others = data["branches"]
    shown = [branch for branch in others if _kinds(branch) & {STABLE, PLANAR, UNDECIDED}]
    quiet = [branch for branch in others if branch not in shown and _kinds(branch)]
    out = [_of_branch(branch, data) + _remarks(data, branch) for branch in (first, *shown[:MOST_NAMES])]
    if more := shown[MOST_NAMES:]:
        out.append(f"{_names(more)} have stable states, too." + _remarks(data, *more))
    if quiet:
        verb = "is unstable on its" if len(quiet) == 1 else "are unstable on their"
        out.append(f"{_names(quiet)} {verb} whole range." + _remarks(data, *quiet))
    return [*out, *_ranges(data), *_coexistence(data), *_open(data), *filter(None, [_remarks(data).strip()])]


def _remarks(data: Mapping[str, Any], *branches: Mapping[str, Any]) -> str:
    """What the run says of some ``branches``; without any, what it says of no branch of the diagram."""
    names, out = {branch["name"] for branch in branches}, ""
    every = {branch["name"] for branch in data["branches"]}
    for word, entry in (("Warning", "warnings"), ("Note", "notes")):
        for remark in data.get(entry) or ():
            if remark["branch"] in names or not (names or remark["branch"] in every):
                out += f" {word}: {' '.join(remark['sentence'].split())}"
    return out


def _kinds(branch: Mapping[str, Any]) -> set[str]:
    """Kinds of stability along a branch."""
    return {interval.kind for interval in intervals_of(branch)}


def _of_branch(branch: Mapping[str, Any], data: Mapping[str, Any]) -> str:
    """What is stable along a branch, what happens where that changes, and how it ends."""
    intervals, load, name = intervals_of(branch), data["parameter"], _subject(branch, data)
    if not intervals:
        return f"{name} has one state only; {_end(branch)}."
    start, stop = distinct_digits(intervals[0].loads[0], intervals[-1].loads[1], width=_width(data))
    if len(intervals) == 1:
        coarse = any(special.get("resolved") is False for special in branch["special"])
        state, doubt = _state(intervals[0], data), UNRESOLVED if coarse else ""
        parts = [f"{name} is {state} on its whole range, from {load} = {start} to {stop}{doubt}"]
    else:
        (state, end), *others = _changes(intervals, data, stop)
        parts = [f"{name} is {state} from {load} = {start} {end}", *(f"then {state} {end}" for state, end in others)]
    return "; ".join(parts + ([] if branch["ended"] == "end of range" else [_end(branch)])) + "."


def _changes(intervals: Sequence[Interval], data: Mapping[str, Any], stop: str) -> Iterator[tuple[str, str]]:
    """States of intervals in order, each with what happens at its end; only the first of many."""
    shown = intervals if len(intervals) <= MOST_INTERVALS + 1 else intervals[:MOST_INTERVALS]
    for one, after in zip(shown, intervals[1:], strict=False):
        where, what = change_in_words(one, after, data["branches"])
        yield _state(one, data), f"to {where}, where it {what}"
    if len(intervals) == len(shown):
        yield _state(shown[-1], data), f"to {stop}"
    else:
        more = many(len(intervals) - 1 - len(shown), "time")
        yield "its stability", f"changes {more} more before {data['parameter']} = {stop}"


def _end(branch: Mapping[str, Any]) -> str:
    """How a branch ends, in a clause."""
    ended = str(branch["ended"]).rstrip(".")
    return f"it ends where it {ended}" if ended.startswith(MEETS) else f"it ends there: {ended}"


def _subject(branch: Mapping[str, Any], data: Mapping[str, Any]) -> str:
    """Name of a branch, and where it comes from, as the beginning of a sentence."""
    name, parent = _named(branch["name"]), branch["parent"]
    if branch is data["branches"][0]:
        return "The first branch" if branch["name"] == FIRST_BRANCH else f"The first branch, {branch['name']},"
    if parent is None:
        return f"{name}, which leaves none of the others,"
    special = next(b for b in data["branches"] if b["name"] == parent[0])["special"][parent[1]]
    return f"{name}, which leaves {called(parent[0])} at {known_digits(special)},"


def called(name: str) -> str:
    """Name of a branch inside a sentence."""
    return f"the {name}" if name == FIRST_BRANCH else name


def _named(name: str) -> str:
    """Name of a branch at the beginning of a sentence."""
    return name[:1].upper() + name[1:]


def _state(interval: Interval, data: Mapping[str, Any]) -> str:
    """Stability of an interval in words."""
    if interval.kind == STABLE:
        plane = " in its plane (not examined in space)" if data.get("planar") and interval.in_space is None else ""
        return f"stable{plane}, by the frequencies found," if is_sweep(data) else f"stable{plane}"
    if interval.kind == UNDECIDED:
        return f"of undecided stability ({interval.why})"
    if interval.kind == PLANAR:
        return f"stable in its plane but not in space (index {interval.in_space} at most)"
    index = f"{interval.least}" if interval.least == interval.most else f"{interval.least} to {interval.most}"
    many = "s"[: interval.most != 1]
    return f"unstable ({index} eigenvalue{many})" if is_sweep(data) else f"unstable (index {index})"


def _ranges(data: Mapping[str, Any]) -> Iterator[str]:
    """Ranges of the load without a stable state, and those that are not examined."""
    if is_sweep(data):
        return
    stable, undecided = ([x.covers for x in intervals_in(data["branches"], kind)] for kind in (STABLE, UNDECIDED))
    lost = list(unlocated(data["branches"]))
    for a, b in without_stable(stable + lost, *sorted(data["range"])):
        doubt = any(low < b and high > a for low, high in undecided)
        but = ", but there are states of undecided stability" if doubt else ""
        yield f"From {_between(data, a, b, 'to')} no stable state was found{but}."
    for step in lost:
        for a, b in without_stable(stable, *step):
            yield f"Stability is not examined between {_between(data, a, b, 'and')}, where it changes."


def _coexistence(data: Mapping[str, Any]) -> Iterator[str]:
    """Ranges of the load with several stable states."""
    pairs = [] if is_sweep(data) else list(coexisting(intervals_in(data["branches"], STABLE)))
    for one, other, a, b in pairs[:MOST_NAMES]:
        names = " and ".join(dict.fromkeys(called(interval.branch["name"]) for interval in (one, other)))
        states, verb = f"From {_between(data, a, b, 'to')} two stable states", f"coexist, of {names}"
        if one.resolved and other.resolved:
            yield f"{states} {verb}: hysteresis is possible."
        else:
            yield f"{states} may {verb}: the mesh does not resolve them, use more elements."
    if more := pairs[MOST_NAMES:]:
        yield f"So do {many(len(more), 'further pair')} of stable states at other loads."


def _between(data: Mapping[str, Any], a: float, b: float, word: str) -> str:
    """Two loads with a word between them."""
    first, last = distinct_digits(a, b, width=_width(data))
    return f"{data['parameter']} = {first} {word} {last}"


def _width(data: Mapping[str, Any]) -> float:
    """Width of the range of the load."""
    low, high = data["range"]
    return float(abs(high - low))


def _open(data: Mapping[str, Any]) -> Iterator[str]:
    """What a diagram leaves open."""
    branches = data["branches"]
    if any(branch.get("singular_start") for branch in branches):
        yield "The first state is singular: what leaves it was not followed."
    if missed := data.get("branch_points_not_followed"):
        yield f"{many(missed, 'branch point was', 'branch points were')} not followed."
    if changes := sum(len(branch.get("unexplained") or ()) for branch in branches):
        yield f"{many(changes, 'change')} of the index without a special point: see the warnings."
    if coarse := sum(special.get("resolved") is False for branch in branches for special in branch["special"]):
        what = f"{many(coarse, 'special point')}, whose error bars are no bounds"
        yield f"The mesh does not resolve {what}: use more elements or a higher degree."


def change_in_words(one: Interval, after: Interval, branches: Branches) -> tuple[str, str]:
    """Load at which two intervals of a branch meet, and what happens there."""
    branch, row = one.branch, one.last
    if found := changes_at(branch, row):
        return known_digits(found[0]), " and ".join(_event(special, branch, branches) for special in found)
    column, segment = branch["columns"]["load"], step_between(one, after)
    a, b = distinct_digits(column[segment], column[segment + 1])
    unexplained = any(change["row"] == segment for change in branch.get("unexplained") or ())
    what = "changes its index without a special point that says why" if unexplained else _change(one, after)
    return f"some load between {a} and {b}", what


def _change(one: Interval, after: Interval) -> str:
    """What happens between two intervals where no special point is."""
    if one.kink or after.kink:
        return f"comes to a kink of the {after.kink}" if after.kink else f"leaves a kink of the {one.kink}"
    if UNDECIDED in (one.kind, after.kind):
        return "has an eigenvalue that is not told from zero on one side"
    verb = "loses" if one.kind == STABLE else "changes"
    if None in (one.in_space, after.in_space) or (one.least, one.most) != (after.least, after.most):
        return f"{verb} its stability, and no special point says why"
    return f"{verb} its stability against motions out of the plane (without planar it is located)"


def _event(special: Mapping[str, Any], branch: Mapping[str, Any], branches: Branches) -> str:
    """What happens at a special point, as a verb with all that is known of it."""
    kind, verbs = special["kind"], EVENTS if _rises(special) else EVENTS | RECOVERY
    words = verbs.get(kind, f"passes a special point, {kind}")
    if kind == IMPERFECT:
        size = special.get("unfolding")
        known = "" if size is None else f" of the relative size {abs(size):.0e}"
        words = f"passes a branch point that an imperfection{known} takes apart"
    elif kind == BRANCH_POINT:
        words = _form(special) + _directions(special, branch, branches)
    return words + (UNRESOLVED if special.get("resolved") is False else "")


def _form(special: Mapping[str, Any]) -> str:
    """Normal form at a branch point as a verb."""
    law = special["law"]
    if law is None or law["kind"] not in FORMS:
        return "passes a branch point" + (" of undetermined form" if special["followed"] else " that was not followed")
    words = FORMS[law["kind"]]
    if words.startswith("buckles") and not _rises(special):
        words = f"passes a {law['kind']}"
    uncertain = law["uncertainty"] is None or abs(law["coefficient"]) <= law["uncertainty"]
    return words + (" (or nearly so)" if uncertain and law["side"] else "")


def _rises(special: Mapping[str, Any]) -> bool:
    """Whether the index rises at a special point, along the branch."""
    return bool(special["negative_after"] > special["negative_before"])


def _directions(special: Mapping[str, Any], branch: Mapping[str, Any], branches: Branches) -> str:
    """Number of eigenvalues that vanish at once, and whether one of them stays zero on the branch that leaves."""
    if special["multiplicity"] < 2:
        return ""
    words = f"{special['multiplicity']} directions at once"
    place = [branch["name"], branch["special"].index(special)]
    leaving = [b for b in branches if b["parent"] == place]
    before = branch["columns"]["zero"][max(special["row"] - 1, 0)]
    if special["multiplicity"] == 2 and len(leaving) == 1 and _least_zeros(leaving[0]) == before + 1:
        words += f": a circle of states, as the eigenvalue that stays zero along {leaving[0]['name']} says"
    return f" ({words})"


def _least_zeros(branch: Mapping[str, Any]) -> int:
    """Number of eigenvalues that vanish all along a branch."""
    return min(branch["columns"]["zero"])


def distinct_digits(*loads: float, width: float = 0.0) -> list[str]:
    """Loads with as many digits as a range of that ``width`` needs: by default from the first load to the last."""
    width = width or abs(loads[-1] - loads[0])
    more = ceil(log10(max(map(abs, loads)) / width)) if width and any(loads) else 0
    return [f"{load:.{min(FEW + max(more, 0), 15)}g}" for load in loads]


def known_digits(special: Mapping[str, Any]) -> str:
    """Load of a special point, with the digits that its error bar supports: rounded by less than that."""
    load, error = special["load"], special.get("error_estimate")
    digits = FEW
    if error and isfinite(error) and special.get("resolved") is not False:
        digits = min(max(floor(log10(max(abs(load), error))) - floor(log10(error)) + 1, 1), DIGITS)
    return f"{load:.{digits}g}"


def _names(branches: Sequence[Mapping[str, Any]]) -> str:
    """Branches by name, or, where they are many, by number."""
    names = [called(branch["name"]) for branch in branches]
    if len(names) > MOST_NAMES:
        return f"{len(names)} other branches"
    return _named(" and ".join(filter(None, (", ".join(names[:-1]), names[-1]))))
