"""A report on a saved diagram, in the browser: the diagram, the rod in space, its stability."""

from __future__ import annotations

import os
import sys
import webbrowser
from collections.abc import Sequence
from pathlib import Path

from rodfem.app.cli import Parser
from rodfem.report.page import write_report

SCREENS = ("DISPLAY", "WAYLAND_DISPLAY")
"""Variables of the environment, one of which is set where there is a display."""
WITHOUT = ("darwin", "win32")
"""Systems that have a display without them."""


def main(words: Sequence[str]) -> None:
    """Write the page and open it; raises :class:`~rodfem.errors.InputError` where the folder has no diagram."""
    parser = Parser(prog="rodfem view", description=__doc__)
    parser.add_argument("folder", type=Path, help="that of a run, as results/cord")
    parser.add_argument("--output", type=Path, help="page to write (default: report.html in the folder)")
    parser.add_argument("--no-open", action="store_true", help="write the page, and open no browser")
    given = parser.parse_args(words)
    path = write_report(given.folder, given.output)
    print(path)
    if not given.no_open and has_display():
        webbrowser.open(path.resolve().as_uri())


def has_display() -> bool:
    """Whether a browser could show a page here."""
    return sys.platform in WITHOUT or any(os.environ.get(name) for name in SCREENS)
