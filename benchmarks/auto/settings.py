"""Which discretisation of AUTO is the fastest for a given error: found once by a sweep, kept in settings.json."""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterable
from pathlib import Path

from benchmarks.auto.output import AutoError
from benchmarks.auto.problems import PROBLEMS, Problem
from benchmarks.auto.trace import Traced, trace

ACCURACIES = (1e-4, 1e-6, 1e-8)
SETTINGS = Path(__file__).with_name("settings.json")
"""Problem -> branch -> accuracy -> [NTST, NCOL, tol]."""


def sweep(problem: Problem, accuracies: Iterable[float] = ACCURACIES) -> dict[str, dict[str, list[float]]]:
    """The fastest NTST, NCOL and tolerance for each branch and error, the better of two runs each.

    One counts only if the mesh a step finer is as accurate: an error can be small by chance.
    """
    meshes = (5, 6, 8, 10, 12, 14, 16, 20, 24, 30, 40, 60)
    best: dict[str, dict[str, list[float]]] = {branch.name: {} for branch in problem.branches if branch.targets}
    for accuracy, ncol, factor in itertools.product(accuracies, (3, 4, 5, 6, 7), (1e-1, 1e-2)):
        tol, key = float(f"{accuracy * factor:.0e}"), f"{accuracy:g}"
        before: dict[str, Traced] = {}
        done: set[str] = set()  # the branches for which a finer mesh, which is slower, need not be tried
        for ntst in meshes:
            now: dict[str, Traced] = {}
            for name in sorted(best.keys() - done):
                try:
                    now[name] = trace(problem, (ntst, ncol, tol), runs=2, only=name)[-1]
                except (AutoError, IndexError):
                    continue
                old, new, entry = before.get(name), now[name], best[name].get(key)
                if old and all(b.name == name and b.complete and b.error <= accuracy for b in (old, new)):
                    done.add(name)
                    if entry is None or old.seconds < entry[3]:
                        best[name][key] = [old.ntst, ncol, tol, old.seconds]
                elif entry and new.complete and new.seconds > 2 * entry[3]:
                    done.add(name)
            before = now
    return {name: {key: entry[:3] for key, entry in found.items()} for name, found in best.items()}


def find(problems: Iterable[Problem]) -> None:
    """Sweep the problems and write their settings."""
    settings = json.loads(SETTINGS.read_text()) if SETTINGS.exists() else {}
    for problem in problems:
        settings[problem.name] = sweep(problem)
    SETTINGS.write_text(json.dumps(settings, indent=1) + "\n")


def at_accuracy(name: str, accuracy: float, dsmax: float | None = None, runs: int = 5) -> list[Traced]:
    """Every branch of a problem, each with the discretisation that `settings.json` has for this error."""
    problem, chosen = PROBLEMS[name], json.loads(SETTINGS.read_text())[name]
    result = []
    for branch in problem.branches:
        entry = chosen.get(branch.name, {}).get(f"{accuracy:g}")
        if entry:
            result += trace(problem, (int(entry[0]), int(entry[1]), entry[2]), dsmax, runs, only=branch.name)
    return result
