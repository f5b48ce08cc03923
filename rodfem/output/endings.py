"""Where branches end before the range of the load does, and why, in a few words."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

COMPLETE = ("", "end of range", "closed loop", "not traced")
"""Ends that need no mark."""
MEETS = "meets"
"""Beginning of an end that is on another branch, whose points say so."""
SQUEEZED = "stretch reaches zero"
"""Reason of an end at a load that is solved for."""
BEGINS = "begins here: "
"""Beginning of the note at the first row of a branch that was traced to both sides."""


def endings(branch: Mapping[str, Any]) -> Iterator[tuple[int, str]]:
    """First and last row of a branch of ``diagram.json``, each with the reason, where it is not the range that ends."""
    notes = [str(special.get("note") or "") for special in branch.get("special", []) if special["row"] == 0]
    begun = next((note.removeprefix(BEGINS) for note in notes if note.startswith(BEGINS)), "")
    for row, sentence in ((0, begun), (len(branch["columns"]["load"]) - 1, str(branch.get("ended") or ""))):
        reason = sentence.split(" at ")[0].split(":")[0].split(" any more")[0]
        if reason not in COMPLETE and not reason.startswith(MEETS):
            yield row, reason


def is_solved(branch: Mapping[str, Any], special: Mapping[str, Any]) -> bool:
    """Whether the load of the end ``special`` of a branch is solved for: it is not the range that ends there."""
    return (special["row"], SQUEEZED) in list(endings(branch))
