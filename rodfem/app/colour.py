"""Colour on a terminal: headings, codes of special points, warnings, and what is stable or not."""

from __future__ import annotations

import os
import re
from typing import TextIO

from rodfem.continuation.kinds import KINDS
from rodfem.launcher import RANK

BOLD, RED, GREEN, YELLOW, CYAN = "1", "31", "32", "33", "36"
"""Codes of ANSI terminals."""
CODES = "|".join(sorted({kind.code for kind in KINDS.values() if kind.code}))
PATTERNS = (
    (re.compile(r"^  ! .*"), YELLOW),
    (re.compile(r"^\S.*"), BOLD),
    (re.compile(rf"(?<=^  )(?:{CODES})\b"), CYAN),
    (re.compile(r"\bunstable\b"), RED),
    (re.compile(r"\bstable\b"), GREEN),
)
"""Parts of a line, and their colours: the first pattern that a part matches."""


def wanted(stream: TextIO) -> bool:
    """Whether a stream is a terminal that shows colours, and nobody has asked for none (https://no-color.org).

    What Open MPI gives its ranks is a terminal of its own, even where its output goes into a file: no colours there.
    """
    refused = os.environ.get("NO_COLOR") or os.environ.get("TERM") == "dumb"
    return stream.isatty() and not refused and not any(name in os.environ for name in RANK)


def painted(line: str) -> str:
    """One line of text with its colours."""
    for pattern, colour in PATTERNS[:2]:
        if pattern.match(line):
            return f"\033[{colour}m{line}\033[0m"
    for pattern, colour in PATTERNS[2:]:
        line = pattern.sub(lambda found, colour=colour: f"\033[{colour}m{found[0]}\033[0m", line)  # type: ignore[misc]
    return line
