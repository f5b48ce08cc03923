"""Shared by the programs that draw: the picture's name on output, or one sentence on standard error."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, NoReturn


def terse(parser: Any) -> Any:
    """Return a parser of argparse whose complaints are one sentence, with status 2."""

    def error(message: str) -> NoReturn:
        sys.stderr.write(f"error: {message[:1].upper()}{message[1:]}.\n")
        sys.exit(2)

    parser.error = error
    return parser


def status_of(draw: Callable[[], Path], what: Path) -> int:
    """Print the picture that is drawn; returns 0, or 2 after one sentence that says why ``what`` cannot be drawn."""
    try:
        print(draw())
    except KeyError as error:
        print(f"cannot draw {what}: it has no {error}; give the file that a run has written", file=sys.stderr)
    except (ImportError, OSError, RuntimeError, ValueError) as error:
        print(str(error).split("\n", 1)[0], file=sys.stderr)
    except (AttributeError, IndexError, TypeError) as error:  # of matplotlib, h5py or numpy, for what is no picture's
        print(f"cannot draw {what} ({error}): give the file that a run has written", file=sys.stderr)
    else:
        return 0
    return 2
