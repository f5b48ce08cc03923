"""Glossary: every word and code of tables, files and pictures, in a sentence or two, as ``glossary.md`` has them."""

from __future__ import annotations

from difflib import get_close_matches
from importlib.resources import files

from rodfem.continuation.kinds import KINDS
from rodfem.errors import InputError
from rodfem.output.table import COLUMNS, SPECIAL


def _read() -> dict[str, str]:
    text = (files("rodfem.output") / "glossary.md").read_text(encoding="utf-8").split("\n## ", 1)[1]
    return dict(line.split(": ", 1) for line in text.splitlines() if ": " in line)


ENTRIES = _read()
"""Text of each entry by its names, which are between bars."""
KNOWN = {"kind", *(name for key in ENTRIES for name in key.split(" | "))}
ENTRIES |= {x.name: f"{x.words[:1].upper()}{x.words[1:]}." for x in (*COLUMNS, *SPECIAL) if x.name not in KNOWN}
NAMES = {name: key for key in ENTRIES for name in key.split(" | ")}
"""Entry of each name."""


def title(entry: str) -> str:
    """Names of an entry in words, the codes of the terminal among them: ``branch point, BP``."""
    codes = dict.fromkeys(kind.code for name, kind in KINDS.items() if name in entry.split(" | "))
    return ", ".join([*entry.split(" | "), *codes])


def explanation(word: str) -> list[tuple[str, str]]:
    """Titles and texts of a word, several for a code of several kinds.

    Raises :class:`~rodfem.errors.InputError` for a word that no entry has.
    """
    found = _found(word)
    if not found:
        inside = [name for name in NAMES if word.lower() in name.lower().replace(",", "").split()]
        near = inside[:3] or get_close_matches(word.lower(), NAMES)
        best = f"{' or '.join(near)}, or rodfem explain" if near else "rodfem explain"
        raise InputError(f"There is no entry {word!r}: try {best}, which lists all.")
    return [(title(NAMES[name]), ENTRIES[NAMES[name]]) for name in dict.fromkeys(found)]


def is_entry(word: str) -> bool:
    """Whether a word has an entry."""
    return bool(_found(word))


def _found(word: str) -> list[str]:
    """Names of the entries of a word: those of a code, or its own."""
    found = [name for name, kind in KINDS.items() if kind.code == word.upper()]
    wanted = " ".join(word.lower().split())
    return found or [name for name in NAMES if name.lower() in (wanted, wanted.replace(" ", "_"))]
