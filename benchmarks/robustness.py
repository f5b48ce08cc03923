"""Hard cases, what is promised of each and what is measured: writes ``docs/robustness.md`` and its log.

Run by ``make bench``.  The cases are those of ``tests/hard``, which tests a few values of each; here all are measured,
each case in a process of its own.  What is measured is kept in results/robustness/measured.json as it comes: --resume
goes on where a run was interrupted.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterable, Iterator
from functools import partial
from math import inf, isfinite
from pathlib import Path
from time import strftime
from typing import Any

from benchmarks.common import ROOT, digits, machine, measured, table, versions
from benchmarks.store import Store

sys.path.append(str(ROOT / "tests"))

from hard.case import Case, Measured, words
from hard.cases import CASES, PROBLEMS, problem_at
from hard.fuzz import worker

from rodfem.errors import InputError

LIMIT = 900.0
"""Seconds after which a process that measures a case is stopped."""
ACCURACIES = (1e-4, 1e-6, 1e-8, 1e-10, 1e-11)
SEED = 1
"""Of the random scenes."""
TITLES = {
    "stiffness": "Stiffness, meshes, rotations",
    "bifurcations": "Bifurcations",
    "sweeps": "Flutter and divergence of a sweep",
    "loci": "Loci in two parameters",
    "published": "Cases of the literature",
    "endurance": "Endurance",
}
WORDS = {
    "stiffness": "Shear and stretch up to 1e14 times stiffer than bending, one to 100,000 elements, degrees 1 to 12, "
    "graded meshes, ends turned past 4 pi, stiffness, weight and foundation that vary at random.",
    "bifurcations": "Branch points 1e-12 apart, folds in pairs, cusps, crossings that cancel or touch, imperfections "
    "down to 1e-12, isolas, ranges that begin at a branch point or end at a fold, clusters of up to five "
    "points at random.",
    "sweeps": "Beck's column in two planes, flutter and divergence that come and go within a step, frequencies near "
    "round-off, folds of the path, floating rings.",
    "loci": "Gaps between two curves, turning points, crossings, ends.",
    "published": "Michell's, Greenhill's and Goto's rings, writhed rods, snapping strips and arches, "
    "heavy curved rods, against closed forms, shooting in space and the authors' numbers.",
    "endurance": "Branches of 10,000 rows, 1,000 scenes in one process.",
}
"""What the cases of each group are."""
LOG = "robustness-log.md"


def measure(group: str, number: int) -> Iterator[dict[str, Any]]:
    """Verdict on each value of a case, the error over its bar, and what was said."""
    case = CASES[group][number]
    for value in case.all:
        try:
            found = case.measure(value)
        except InputError as refused:
            found = Measured(inf, 1.0, (str(refused),))
        ratio = found.error / found.bar
        row = {"verdict": found.verdict, "ratio": ratio if isfinite(ratio) else None, "ratios": found.ratios}
        yield row | {"said": found.said, "why": found.wrong}


def results(store: Store, group: str, number: int, case: Case) -> list[dict[str, Any]]:
    """Those of all values of a case; where its process is stopped, of the rest why."""

    def work() -> list[dict[str, Any]]:
        found = list(measured("benchmarks.robustness", "--measure", group, number, limit=LIMIT))
        return (found + found[-1:] * len(case.all))[: len(case.all)]

    rows: list[dict[str, Any]] = store.measure(f"{group}/{case.name}", work)
    return rows


def summary(case: Case, found: list[dict[str, Any]]) -> list[str]:
    """Row of a case: values that are right with the largest error over its bar, values of which it is said why not."""
    by: dict[str, list[str]] = {}
    for value, row in zip(case.all, found, strict=True):
        shown = f"{value:g}" if isinstance(value, (int, float)) else str(value)
        by.setdefault(row.get("verdict", row.get("failed", "wrong")), []).append(shown)
    worst = max((r["ratio"] for r in found if r.get("verdict") == "right"), default=None)
    verdicts = [f"{kind if kind == 'right' else f'**{kind}**'}: {', '.join(values)}" for kind, values in by.items()]
    name, of, hard, promised, source, parameter = words()[case.name].values()
    return [name, of, hard, f"{promised} ({source})", parameter, "; ".join(verdicts), digits(worst, 2)]


def bars_of(store: Store) -> str:
    """How well error bars hold: comparisons of all cases, and of random scenes that are traced twice, in a table.

    Those of diagrams that say that they leave something open, a point that may be missing, stand by themselves.
    """
    every = [row for group in CASES for row in store.rows(group)]
    cases, left_open = ([r for row in every if (row["verdict"] == "said") is said for r in row.get("ratios", ())]
                        for said in (False, True))  # fmt: skip
    pairs = [r for entry in store.rows("fuzz") if not entry.get("said") for r in entry.get("ratios", ())]
    rows = []
    for name, ratios in (
        ("the cases above that are right or wrong", cases),
        ("random scenes of which nothing is left open", pairs),
        ("both", cases + pairs),
        ("the cases above of which it is said what is left open", left_open),
    ):
        above = sum(r > 1.0 for r in ratios)
        share = digits(100 * (1 - above / len(ratios)), 4) + " %" if ratios else ""
        rows.append([name, str(len(ratios)), str(above), share, digits(max(ratios, default=None), 3)])
    return table(["loads of special points", "number", "above their bar", "within", "largest error over bar"], rows)


def accuracies_of(store: Store) -> str:
    """How well accuracies that are asked for are kept, in a table."""
    rows = []
    for accuracy in ACCURACIES:
        found = store.measure(f"accuracy/{accuracy:g}", partial(asked, accuracy))
        verdicts = [row.get("verdict", "stopped") for row in found]
        left = "; ".join(row["name"] for row in found if row.get("verdict") == "said")
        worst = max((row["ratio"] for row in found if row.get("verdict") == "right"), default=None)
        counts = [str(verdicts.count(kind)) for kind in ("right", "said", "wrong", "stopped")]
        rows.append([f"{accuracy:g}", *counts, digits(worst, 3), left])
    return table(["accuracy", "right", "said", "wrong", "stopped", "largest error over it", "said of"], rows)


def asked(accuracy: float) -> list[dict[str, Any]]:
    """Verdicts on all problems at an accuracy, in a process of its own."""
    return list(measured("benchmarks.robustness", "--accuracy", accuracy, limit=4 * LIMIT))


def at_accuracy(accuracy: float) -> Iterator[dict[str, Any]]:
    """Verdict on each problem with a known solution, with the error over the accuracy, and what was said."""
    for name in PROBLEMS:
        found = problem_at(accuracy, name)
        ratio = found.error if isfinite(found.error) else None
        yield {"name": name, "verdict": found.verdict, "ratio": ratio, "said": found.said, "why": found.wrong}


def accuracy_section(store: Store) -> str:
    """Section of the page on accuracies that are asked for."""
    return f"""## Accuracies asked for

`Plan(accuracy=...)` chooses meshes such that every load and ordinate is in error by less than that (relative to values
greater than one). Of {len(PROBLEMS)} problems with a known solution, all of whose special points count, the largest
error over the accuracy; **said**: that it is not reached. Finer ones than 1e-11 are refused: there round-off decides.
Measured on {strftime("%Y-%m-%d")}.

{accuracies_of(store)}"""


def counts_of(groups: Iterable[list[dict[str, Any]]]) -> list[str]:
    """Numbers of series, of values right, said and wrong or stopped, and the largest error over its bar."""
    found = list(groups)
    rows = [row for group in found for row in group]
    verdicts = [row.get("verdict", "stopped") for row in rows]
    right, said = verdicts.count("right"), verdicts.count("said")
    worst = max((row["ratio"] for row in rows if row.get("verdict") == "right"), default=None)
    return [str(len(found)), str(right), str(said), str(len(rows) - right - said), digits(worst, 2)]


def undecided(store: Store) -> str:
    """Cases of which the program says what it cannot decide, with the values."""
    rows = []
    for group, cases in CASES.items():
        for number, case in enumerate(cases):
            found = zip(case.all, results(store, group, number, case), strict=True)
            values = [
                f"{v:g}" if isinstance(v, (int, float)) else str(v) for v, r in found if r.get("verdict") == "said"
            ]
            if values:
                rows.append([case.name, words()[case.name]["parameter"], ", ".join(values)])
    return table(["case", "parameter", "said at"], rows)


def page(store: Store, scenes: int) -> str:
    """The page that is read: groups with their counts, what stays undecided, error bars, accuracies."""
    rows = [
        [TITLES[group], *counts_of(results(store, group, number, case) for number, case in enumerate(cases))]
        for group, cases in CASES.items()
    ]
    number = sum(map(len, CASES.values()))
    groups = "\n".join(f"- **{TITLES[group]}.** {WORDS[group]}" for group in CASES)
    return f"""# Hard cases

Which problems make programs of this kind fail, and what does rodfem do with them? `tests/hard` has {number}
series of problems with a closed form, a shooting solution or a published value; each tests a row of
[the contract](resolution.md). *Right* is what is promised, within the error bars that the program gives itself.
*Said* is a sentence of the program on what it cannot decide. *Wrong* is neither, and there should be none. Each series
with its values, and the source of the numbers, is in the [log]({LOG}).

{groups}

{table(["group", "series", "right", "said", "wrong", "largest error over bar"], rows)}
## What stays undecided

Not a failure but a limit, which the program states: the difference is below round-off, or below what the mesh decides.

{undecided(store)}
## Error bars

Bars are to hold in 99 % of all cases, and no error is to exceed three of them. The first row compares with references;
the second one compares {scenes} random scenes, each traced on two meshes in two formulations, with each other.

{bars_of(store)}
{accuracy_section(store)}"""


def log(store: Store, scenes: int) -> str:
    """The log, with everything measured; so many random scenes are traced twice."""
    head = ["case", "row of the contract", "what makes it hard", "promised", "parameter", "measured", "error over bar"]
    parts = []
    for group, cases in CASES.items():
        rows = [summary(case, results(store, group, number, case)) for number, case in enumerate(cases)]
        parts.append(f"## {TITLES[group]}\n\n{table(head, rows)}")
    folder = store.path.parent
    store.measure("fuzz", lambda: worker.run(folder / "fuzz.jsonl", SEED, scenes, depth=1, limit=LIMIT))
    counts: dict[str, int] = {}
    for group in CASES:
        for _, data in store.under(group):
            for row in data:
                verdict = row.get("verdict", "stopped")
                counts[verdict] = counts.get(verdict, 0) + 1
    total = ", ".join(f"{number} {verdict}" for verdict, number in sorted(counts.items()))
    return f"""# Log of the hard cases

Written by `make bench` (`python -m benchmarks.robustness`) in {store.took() / 60:.0f} minutes on
{machine()}; {versions("petsc4py", "slepc4py", "numpy", "scipy")}; one thread; {strftime("%Y-%m-%d")}.

Each case is a one-parameter family of problems with a closed form or a published value; `tests/hard` has them, and
tests some values of each. It tests a row of [the contract](resolution.md). *Exact* are all special points, each within
its error bar, with the index on either side. *Right*: what is promised, to the error bars that the program gives
itself; the last column is the largest error over its bar (or over what is promised). **said**: the program says in a
sentence what it could not decide. **wrong**: neither; there should be none. In all: {total}.

{chr(10).join(parts)}
## Error bars

They are to hold in 99 % of all cases, and no error is to be larger than three times its bar. Of the cases above every
load of a special point that has a reference is counted. Of random scenes (`python -m tests.hard.fuzz`, {scenes} of
seed {SEED}) special points on two meshes are compared with each other: their difference over the sum of their bars.

{bars_of(store)}
{accuracy_section(store)}"""


def main() -> None:
    """Write the page, or measure one value in this process."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--measure", nargs=2, metavar=("GROUP", "NUMBER"))
    parser.add_argument("--accuracy", type=float, help="measure all problems at this accuracy in this process")
    parser.add_argument("--accuracies", action="store_true", help="bring the page's section on these up to date")
    parser.add_argument("--output", type=Path, default=ROOT / "docs" / "robustness.md")
    parser.add_argument("--resume", action="store_true", help="keep what an interrupted run has measured")
    parser.add_argument("--scenes", type=int, default=40, help="random scenes that are traced twice")
    given = parser.parse_args()
    if given.measure:
        for row in measure(given.measure[0], int(given.measure[1])):
            print(json.dumps(row), flush=True)
    elif given.accuracy:
        for row in at_accuracy(given.accuracy):
            print(json.dumps(row), flush=True)
    elif given.accuracies:
        store = Store(ROOT / "results" / "robustness" / "accuracies.json", given.resume)
        for path in (given.output, given.output.with_name(LOG)):
            before = path.read_text().partition("## Accuracies asked for")[0]
            path.write_text(f"{before}{accuracy_section(store)}")
    else:
        store = Store(ROOT / "results" / "robustness" / "measured.json", given.resume)
        if not given.resume:
            for kept in store.path.parent.glob("*.jsonl"):
                kept.unlink()
        given.output.with_name(LOG).write_text(log(store, given.scenes))
        given.output.write_text(page(store, given.scenes))


if __name__ == "__main__":
    main()
