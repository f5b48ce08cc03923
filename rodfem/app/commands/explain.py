"""A word of the tables, files and pictures, in a sentence or two."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from shutil import get_terminal_size
from textwrap import fill

from rodfem.app.cli import Parser
from rodfem.app.terminal import WIDTH
from rodfem.output.glossary import ENTRIES, explanation, is_entry, title


def main(words: Sequence[str]) -> None:
    """Explain it, or list all; raises :class:`~rodfem.errors.InputError` for a word that no entry has."""
    parser = Parser(prog="rodfem explain", description=__doc__)
    parser.add_argument("word", nargs="*", help="as index, BP LP, branch point; none lists all")
    given = parser.parse_args(words).word
    if not given:
        print("\n".join(sorted(map(title, ENTRIES), key=str.lower)))
    together = [" ".join(given)] if given else []
    each = together if any(map(is_entry, together)) or not all(map(is_entry, given)) else given
    for name, text in (entry for word in each for entry in explanation(word)):
        width = min(WIDTH, get_terminal_size().columns) if sys.stdout.isatty() else WIDTH
        print(fill(f"{name}: {text}", width, subsequent_indent="  "))
