"""Measure speed against error and write docs/speed.md, its log docs/speed-log.md, and their figures.

All that is measured is kept in results/speed/measured.json as it comes: --resume goes on where a run was interrupted,
--page writes the page again from what there is, and --pictures draws the figures again from the log's tables alone.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from benchmarks.common import ROOT
from benchmarks.speed.page import LOG, write, write_log
from benchmarks.speed.plots import draw
from benchmarks.speed.run import QUICK, Size, everything
from benchmarks.store import Store


def main() -> None:
    """Measure, and write the page."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.speed", description=__doc__)
    add = parser.add_argument
    add("--quick", action="store_true", help="a few points, one run each, to check that all works")
    add("--resume", action="store_true", help="keep what an interrupted run has measured")
    add("--page", action="store_true", help="measure nothing: write the page from what is kept")
    add("--pictures", action="store_true", help="measure nothing: draw the figures of the log as it is")
    add("--results", type=Path, metavar="DIR", help="(default results/speed; with --quick results/speed-quick)")
    add(
        "--output", type=Path, metavar="DIR", help="for the pages and figures (default docs; with --quick the results')"
    )
    options = parser.parse_args()
    results = options.results or ROOT / "results" / ("speed-quick" if options.quick else "speed")
    output = options.output or (results if options.quick else ROOT / "docs")
    if options.pictures:
        print(*draw(output / LOG), sep="\n")
        return
    store = Store(results / "measured.json", resume=options.resume or options.page)
    try:
        if not options.page:
            everything(store, QUICK if options.quick else Size())
    finally:
        if store.pieces:
            output.mkdir(parents=True, exist_ok=True)
            write(store, output / "speed.md")
            write_log(store, output / LOG)
            draw(output / LOG)
            print(f"{output / 'speed.md'}, measured in {store.took() / 60:.1f} minutes")


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        sys.exit("interrupted; go on with --resume")
