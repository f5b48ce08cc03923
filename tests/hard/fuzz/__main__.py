"""Random scenes through the public interface: ``python -m tests.hard.fuzz --seed 1 --scenes 500``.

Each scene is worked on in a child process, which is replaced where it takes too long or dies.  A line of JSON a scene
is added to ``results/fuzz-SEED.jsonl`` (or ``--output FILE``); scenes that have one are not repeated.  ``--only N``
works on one scene and prints what it shows.
"""

import argparse
import json
import sys
from pathlib import Path

from . import worker

LIMIT = 300.0
"""Seconds of a scene."""


def main() -> None:
    """Run what is asked for."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.hard.fuzz", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--scenes", type=int, default=100, help="scenes 0 to this of the seed")
    parser.add_argument("--depth", type=int, default=1)
    parser.add_argument("--limit", type=float, default=LIMIT, help="seconds of a scene")
    parser.add_argument("--output", type=Path)
    parser.add_argument("--only", type=int, help="number of the only scene, in this process")
    given = parser.parse_args()
    if given.only is not None:
        print(json.dumps(worker.examine(given.seed, given.only, given.depth), indent=1))
    else:
        file = given.output or Path("results") / f"fuzz-{given.seed}.jsonl"
        file.parent.mkdir(parents=True, exist_ok=True)
        entries = worker.run(file, given.seed, given.scenes, given.depth, given.limit)
        print(worker.in_words(entries))
        sys.exit(any(worker.is_fault(entry) for entry in entries))


if __name__ == "__main__":
    main()
