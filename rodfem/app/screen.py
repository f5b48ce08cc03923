"""A terminal, by rich, which takes 12 ms to load: lines in colours, and one below them that says what is done now."""

from __future__ import annotations

from time import monotonic
from typing import TextIO

from rich.console import Console
from rich.progress import Progress, SpinnerColumn, TaskID, TextColumn, TimeElapsedColumn
from rich.table import Column
from rich.text import Text

from rodfem.continuation.kinds import KINDS

CODES = "|".join(sorted({kind.code for kind in KINDS.values() if kind.code}))
PARTS = ((rf"(?<=^  )(?:{CODES})\b", "cyan"), (r"\bunstable\b", "red"), (r"\bstable\b", "green"))
"""Parts of lines, and their styles."""
SHORT = 0.5
"""Seconds of a run without a line that changes."""


def coloured(line: str) -> Text:
    """One line of text with its colours."""
    text = Text(line)
    if line.startswith("  ! ") or line[:1].strip():
        text.stylize("yellow" if line.startswith("  ! ") else "bold")
        return text
    for part, style in PARTS:
        text.highlight_regex(part, style)
    return text


class Screen:
    """What is seen on one terminal; to be closed, or the cursor stays hidden."""

    def __init__(self, stream: TextIO) -> None:
        """Show nothing yet on the terminal that ``stream`` is; NO_COLOR refuses colours."""
        self._console = Console(file=stream, highlight=False, markup=False, emoji=False, soft_wrap=True)
        self._progress: Progress | None = None
        self._task, self._begun = TaskID(0), monotonic()

    @property
    def width(self) -> int:
        """Columns of the terminal."""
        return self._console.width

    def show(self, line: str) -> None:
        """Print a line that stays, above the one that changes."""
        self._console.print(coloured(line))

    def status(self, words: str, *, long: bool) -> None:
        """Say what is done now, until :meth:`close`; a short run draws no such line unless it takes ``long``."""
        if self._progress is not None:
            self._progress.update(self._task, description=words)
        elif long or monotonic() - self._begun > SHORT:
            one_line = Column(no_wrap=True, overflow="ellipsis")
            columns = TextColumn("{task.description}", markup=False, table_column=one_line), TimeElapsedColumn()
            self._progress = Progress(SpinnerColumn(style="cyan"), *columns, console=self._console, transient=True)
            self._task = self._progress.add_task(words, total=None)
            self._progress.start()

    def close(self) -> None:
        """Remove the line that changes, and show the cursor again."""
        if self._progress is not None:
            self._progress.stop()
            self._progress = None
