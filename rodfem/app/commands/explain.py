"""A word of the tables, files and pictures, in a sentence or two."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import fill

from rodfem.app.cli import Parser
from rodfem.output.glossary import ENTRIES, explanation, title

WIDTH = 110
"""Columns of a paragraph."""


def main(words: Sequence[str]) -> None:
    """Explain it, or list all; raises :class:`~rodfem.errors.InputError` for a word that no entry has."""
    parser = Parser(prog="rodfem explain", description=__doc__)
    parser.add_argument("word", nargs="*", help="as index, BP, 'branch point'; none lists all")
    word = " ".join(parser.parse_args(words).word)
    if not word:
        print("\n".join(sorted(map(title, ENTRIES), key=str.lower)))
    for name, text in explanation(word) if word else ():
        print(fill(f"{name}: {text}", WIDTH, subsequent_indent="  "))
