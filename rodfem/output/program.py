"""Shared by the programs that draw: the picture's name on output, or one sentence on standard error."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path


def status_of(draw: Callable[[], Path], what: Path) -> int:
    """Print the picture that is drawn; returns 0, or 2 after one sentence that says why ``what`` cannot be drawn."""
    try:
        print(draw())
    except KeyError as error:
        print(f"cannot draw {what}: it has no {error}; give the file that a run has written", file=sys.stderr)
    except (ImportError, OSError, RuntimeError, ValueError) as error:
        print(error, file=sys.stderr)
    else:
        return 0
    return 2
