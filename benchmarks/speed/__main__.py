"""Measure speed against error and write docs/speed.md with its figures.

All that is measured is kept in results/speed/measured.json as it comes: --resume goes on where a run was interrupted,
--page writes the page again from what there is.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from benchmarks.common import ROOT
from benchmarks.speed.page import write
from benchmarks.speed.plots import draw
from benchmarks.speed.run import QUICK, Size, everything
from benchmarks.speed.store import Store


def main() -> None:
    """Measure, and write the page."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.speed", description=__doc__)
    add = parser.add_argument
    add("--quick", action="store_true", help="a few points, one run each, to check that all works")
    add("--resume", action="store_true", help="keep what an interrupted run has measured")
    add("--page", action="store_true", help="measure nothing: write the page from what is kept")
    add("--results", type=Path, default=ROOT / "results" / "speed", metavar="DIR", help="(default results/speed)")
    add("--output", type=Path, default=ROOT / "docs", metavar="DIR", help="for speed.md and figures (default docs)")
    options = parser.parse_args()
    store = Store(options.results / "measured.json", resume=options.resume or options.page)
    try:
        if not options.page:
            everything(store, QUICK if options.quick else Size())
    finally:
        if store.pieces:
            options.output.mkdir(parents=True, exist_ok=True)
            figures = draw(store, options.output)
            write(store, options.output / "speed.md", figures)
            print(f"{options.output / 'speed.md'}, measured in {store.took() / 60:.1f} minutes")


if __name__ == "__main__":
    main()
