"""Trace the branches of the demos with AUTO-07p: speed against error of a collocation code."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from benchmarks.auto.output import AutoError
from benchmarks.auto.problems import PROBLEMS
from benchmarks.auto.program import check, require_auto
from benchmarks.auto.settings import ACCURACIES, SETTINGS, at_accuracy, find
from benchmarks.auto.trace import Traced, trace
from benchmarks.common import machine, versions

HEADER = (
    f"{'problem':16}{'branch':10}{'NTST':>5}{'NCOL':>5}{'tol':>8}{'error':>9}{'points':>8}{'ms/point':>10}"
    f"{'following':>10}{'s':>9}"
)


def line(traced: Traced) -> str:
    """A row of the table."""
    error = f"{traced.error:9.1e}" if traced.errors else f"{'-':>9}"
    return (
        f"{traced.scene:16}{traced.name:10}{traced.ntst:5}{traced.ncol:5}{traced.tol:8.0e}{error}{traced.points:8}"
        f"{traced.ms_per_point:10.3f}{1e3 * traced.following / traced.points:10.3f}{traced.seconds:9.4f}"
    )


def arguments() -> argparse.Namespace:
    """What the command line says."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.auto", description=__doc__, epilog="Problems: " + ", ".join(PROBLEMS) + "."
    )
    add = parser.add_argument
    add("problems", nargs="*", metavar="problem", help="which (default: all)")
    add(
        "--accuracy",
        type=float,
        nargs="+",
        choices=ACCURACIES,
        default=list(ACCURACIES),
        help="as found by --sweep (default 1e-4 1e-6 1e-8)",
    )
    add("--ntst", type=int, help="mesh intervals, instead of --accuracy (default 20 with --ncol or --tol)")
    add("--ncol", type=int, help="collocation points in each, 2 to 7 (default 4)")
    add("--tol", type=float, help="AUTO's EPSL and EPSU; EPSS is ten times that (default 1e-9)")
    add("--dsmax", type=float, help="largest step on the branches (default: the problem's)")
    add("--runs", type=int, default=5, help="of which the median time counts (default 5)")
    add("--json", type=Path, metavar="FILE", help="write everything there")
    add("--sweep", action="store_true", help="find the fastest discretisation for each error; writes settings.json")
    add("--check", action="store_true", help="compare the derivatives with finite differences, and stop")
    options = parser.parse_args()
    unknown = [name for name in options.problems if name not in PROBLEMS]
    if unknown:
        parser.error(f"unknown problem {unknown[0]!r}: choose from {', '.join(PROBLEMS)}")
    if options.ncol is not None and not 2 <= options.ncol <= 7:
        parser.error("AUTO takes 2 to 7 collocation points")
    if options.runs < 1:
        parser.error("at least one run is needed")
    return options


def main() -> None:
    """Print the table."""
    options = arguments()
    problems = [PROBLEMS[name] for name in options.problems or PROBLEMS]
    require_auto()
    if options.check:
        print(f"{'problem':16}    df/du      df/dp      db/du      db/dp   (deviation from central differences)")
        for problem in problems:
            print(f"{problem.name:16}" + "".join(f"{number:11.1e}" for number in check(problem)))
        return
    if options.sweep:
        find(problems)
        print(f"Settings for each error are in {SETTINGS}.")
        return
    print(HEADER)
    everything: list[Traced] = []
    for problem in problems:
        fixed = any(item is not None for item in (options.ntst, options.ncol, options.tol))
        if fixed or not any(branch.targets for branch in problem.branches):
            mesh = (options.ntst or 20, options.ncol or 4, options.tol or 1e-9)
            found = trace(problem, mesh, options.dsmax, options.runs)
        else:
            found = [t for a in options.accuracy for t in at_accuracy(problem.name, a, options.dsmax, options.runs)]
        for traced in found:
            print(line(traced), flush=True)
        everything += found
        if problem.note:
            print(f"{'':16}({problem.note})")
    if options.json:
        data = {"machine": machine(), "versions": versions("numpy"), "branches": [t.data() for t in everything]}
        options.json.write_text(json.dumps(data, indent=1) + "\n")


if __name__ == "__main__":
    try:
        main()
    except AutoError as error:
        print(error, file=sys.stderr)
        sys.exit(2)
    except BrokenPipeError:
        sys.exit(1)
