"""What happens between two intervals of a branch, as a verb: kind, normal form and directions of a special point."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import ceil, floor, isfinite, log10
from typing import Any

from rodfem.continuation.kinds import BRANCH_POINT, DIVERGENCE, FLUTTER, FOLD, IMPERFECT
from rodfem.output.intervals import Interval, changes_at
from rodfem.output.plot_pieces import STABLE, UNDECIDED

Branches = Sequence[Mapping[str, Any]]
DIGITS, FEW, MOST = 10, 6, 15
"""Significant digits of a load at most, and of one without an error bar; those of a float."""
EVENTS = {
    FOLD: "turns back in a fold",
    FLUTTER: "flutters: two frequencies coincide and become complex",
    DIVERGENCE: "diverges: a frequency passes through zero",
}
FORMS = {
    "supercritical pitchfork": "buckles supercritically",
    "subcritical pitchfork": "buckles subcritically",
    "transcritical": "meets another branch transcritically",
    "vertical branch": "meets a family of states at one and the same load",
}
"""Normal forms as verbs."""
UNRESOLVED = ", as far as this mesh tells: it does not resolve that state"


def change_in_words(one: Interval, after: Interval, branches: Branches) -> tuple[str, str]:
    """Load at which two intervals of a branch meet, and what happens there."""
    branch, row = one.branch, one.last
    found = changes_at(branch, row)
    if found:
        return known_digits(found[0]), " and ".join(_event(special, branch, branches) for special in found)
    column, segment = branch["columns"]["load"], row if after.rank > one.rank else row - 1
    a, b = told_apart(column[segment], column[segment + 1])
    where = f"some load between {a} and {b}"
    if any(change["row"] == segment for change in branch.get("unexplained") or ()):
        return where, "changes its index without a special point that says why"
    if one.kink or after.kink:
        return where, f"comes to a kink of the {after.kink}" if after.kink else f"leaves a kink of the {one.kink}"
    if UNDECIDED in (one.kind, after.kind):
        return where, "has an eigenvalue that is not told from zero on one side"
    verb = "loses" if one.kind == STABLE else "changes"
    if one.in_space is None or after.in_space is None or (one.least, one.most) != (after.least, after.most):
        return where, f"{verb} its stability, and no special point says why"
    return where, f"{verb} its stability against motions out of the plane (without planar it is located)"


def _event(special: Mapping[str, Any], branch: Mapping[str, Any], branches: Branches) -> str:
    """What happens at a special point, as a verb with all that is known of it."""
    kind, words = special["kind"], EVENTS.get(special["kind"], f"passes a special point, {special['kind']}")
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
    uncertain = law["uncertainty"] is None or abs(law["coefficient"]) <= law["uncertainty"]
    return words + (" (or nearly so)" if uncertain and law["side"] else "")


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


def told_apart(*loads: float, width: float = 0.0) -> list[str]:
    """Loads with as many digits as a range of that ``width`` needs: by default from the first load to the last."""
    width = width or abs(loads[-1] - loads[0])
    more = ceil(log10(max(map(abs, loads)) / width)) if width and any(loads) else 0
    return [f"{load:.{min(FEW + max(more, 0), MOST)}g}" for load in loads]


def known_digits(special: Mapping[str, Any]) -> str:
    """Load of a special point, with the digits that its error bar supports: rounded by less than that."""
    load, error = special["load"], special.get("error_estimate")
    digits = FEW
    if error and isfinite(error) and special.get("resolved") is not False:
        digits = min(max(floor(log10(max(abs(load), error))) - floor(log10(error)) + 1, 1), DIGITS)
    return f"{load:.{digits}g}"
