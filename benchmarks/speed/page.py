"""The page, and the log of all that was measured: every number comes from the store."""

from __future__ import annotations

import subprocess
from itertools import groupby
from pathlib import Path
from typing import Any

from benchmarks.auto.settings import ACCURACIES
from benchmarks.common import digits, exponent, machine, milliseconds, table, versions
from benchmarks.speed import tables, words
from benchmarks.speed.plots import FIGURES
from benchmarks.store import Store

Row = dict[str, Any]
WORK = ("setup", "equilibrium", "count")
LOG = "speed-log.md"
FAR = 5000
"""Exponents are fitted from so many unknowns on."""


def eigenvalues(store: Store) -> str:
    """The fastest judgement for each error."""
    out, rows = [], store.rows("eigenvalues")
    for name in dict.fromkeys(r["name"] for r in rows):
        for accuracy in ACCURACIES:
            best = tables.fastest([r for r in rows if r["name"] == name], accuracy, lambda r: float(r["seconds"]))
            if best:
                out.append([name, f"{accuracy:.0e}", tables.what(best), str(best["unknowns"]), f"{best['error']:.0e}"])
                out[-1].append(milliseconds(best["seconds"]))
    return table(["rod", "error asked", "fastest", "unknowns", "error", "ms"], out)


def judgements(store: Store) -> str:
    """Every judgement measured: what the figure is drawn from."""
    rows = [
        [r["name"], tables.what(r), str(r["unknowns"]), f"{r['error']:.1e}", milliseconds(r["seconds"])]
        for r in store.rows("eigenvalues")
    ]
    return table(["rod", "discretisation", "unknowns", "error", "ms"], rows)


def growth(store: Store) -> str:
    """Times and memory by size, and exponents."""
    head = ["state", "formulation", "unknowns", "set-up, s", "equilibrium, s", "corrections", "index, s", "memory, MB"]
    out = []
    rows = sorted(store.rows("growth"), key=lambda r: (r["state"] != "straight", r["formulation"] != "reduced"))
    for (state, formulation), group in groupby(rows, key=lambda r: (r["state"], r["formulation"])):
        found = sorted(group, key=lambda r: r["unknowns"])
        for r in found:
            out.append([state, formulation, f"{r['unknowns']:g}", digits(r["setup"]), digits(r["equilibrium"])])
            out[-1] += [str(r["corrections"]), digits(r["count"]), digits(r["memory"])]
        sizes = [r["unknowns"] for r in found]
        if sum(n >= FAR for n in sizes) > 1:
            fits = {k: exponent(sizes, [r[k] for r in found], FAR) for k in ("setup", "equilibrium", "count", "memory")}
            words = [f"{fits[k]:.2f}" for k in ("setup", "equilibrium", "count", "memory")]
            out.append([state, formulation, "**exponent**", words[0], words[1], "", words[2], words[3]])
    return table(head, out)


def many(store: Store) -> str:
    """The map on one rank and more."""
    found = store.rows("map")
    out = []
    for r in found:
        alone, work = found[0]["seconds"] - found[0]["again"], r["seconds"] - r["again"]
        out.append([str(r["ranks"]), str(r["couplings"]), digits(r["seconds"]), digits(r["again"]), digits(work)])
        out[-1] += [digits(found[0]["seconds"] / r["seconds"], 2), digits(alone / work, 2)]
    return table(["ranks", "rods", "s", "taken up again, s", "difference, s", "speed-up", "of the difference"], out)


def whole(rows: list[Row]) -> str:
    """Processor time of whole processes beside their goals."""
    verdicts = [(r, "met" if r["seconds"] <= r["goal"] else "missed") for r in rows]
    cells = [[r["demo"], f"{r['goal']:g}", digits(r["seconds"]), verdict] for r, verdict in verdicts]
    return table(["demo", "goal, s", "s", ""], cells)


def minute(data: Row) -> str:
    """First special point, cold and warm, and imports."""
    rows = [[name, digits(data[name]["first"]), digits(data[name]["end"])] for name in ("cold", "warm")]
    added = [[name, milliseconds(seconds)] for name, seconds in data["imports"].items()]
    warm, total = data["warm"]["first"], sum(data["imports"].values())
    return "\n".join(
        [
            table(["cache of forms", "to the first printed special point, s", "to the end, s"], rows),
            f"Warm under 1.5 s: {'met' if warm <= 1.5 else 'missed'}, {digits(warm)} s. Of this {digits(total)} s are",
            "the start of Python and imports, the rest set-up and computation. In this order modules add:",
            "",
            table(["module", "ms"], added),
        ]
    )


def auto_version() -> str:
    """Version of Debian's package, if AUTO is that."""
    done = subprocess.run(["dpkg-query", "-W", "auto-07p"], capture_output=True, text=True, check=False)
    return f"AUTO-07p {done.stdout.split()[-1]}" if done.returncode == 0 and done.stdout.split()[1:] else "no AUTO-07p"


def another_day(store: Store, prefix: str) -> str:
    """Sentence on measurements that are not of the day at the head of the page."""
    low, high = store.loads(prefix)
    same = store.day(prefix) == store.day()
    return "" if same else f"Measured on {store.day(prefix)}; load of the machine between {low:.1f} and {high:.1f}."


def write(store: Store, path: Path) -> None:
    """Write the page, which is read to the end: what one picks between, and what a diagram costs by stage."""
    low, high = store.loads()
    runs = max((r["runs"] for r in store.rows("branches")), default=1)
    lines = [
        "# Speed against error",
        words.PAGE.format(machine=machine(), day=store.day(), low=low, high=high, runs=runs, log=LOG),
    ]
    if store.rows("branches"):
        lines += [_figure("special", "Error of special points against time of a branch"), words.FIGURE]
        lines += ["## What one picks between", words.CHOICE, tables.choice(store)]
    if store.rows("stages"):
        lines += ["## What a diagram costs", words.STAGES, tables.stages(store)]
    lines += ["## What else was measured", words.ELSE.format(log=LOG)]
    path.write_text("\n\n".join(line.strip() for line in lines if line) + "\n")


def write_log(store: Store, path: Path) -> None:
    """Write everything that was measured."""
    low, high = store.loads()
    found = versions("fenics-dolfinx", "petsc4py", "slepc4py", "numpy", "scipy")
    runs = max((r["runs"] for r in store.rows("branches")), default=1)
    lines = [
        "# Log of the speed measurements",
        f"Written by `make bench` (`python -m benchmarks.speed`) in {store.took() / 60:.0f} minutes on {machine()};\n"
        f"{found}, {auto_version()}; one thread;\nload of the machine between {low:.1f} and {high:.1f}; "
        f"measured on {store.day()}.",
        words.INTRODUCTION.format(runs="one run" if runs == 1 else f"{runs} runs"),
    ]
    if "references" in store.pieces:
        deviation = store.pieces["references"]["data"]
        lines += ["## References", tables.references(), words.REFERENCES.format(deviation=deviation)]
    if store.rows("branches"):
        lines += ["## Equilibria", words.EQUILIBRIA, _figure("equilibria", "Error of equilibria against time")]
        lines += ["## Special points", words.SPECIAL]
        lines += [_figure("special", "Error of special points against time")]
        lines += ["## The paper's discretisation", words.PAPER, tables.paper(store)]
    if store.rows("auto") and store.rows("branches"):
        lines += ["## Goals", words.GOALS, tables.goals(store), words.SWEEPS, tables.sweeps(store)]
        lines += ["## Beside AUTO-07p", words.AUTO, tables.beside_auto(store)]
    if store.rows("bvp"):
        lines += ["## Beside scipy", words.SCIPY, tables.beside_scipy(store)]
    if store.rows("eigenvalues"):
        lines += ["## Eigenvalues", words.EIGENVALUES, another_day(store, "eigenvalues")]
        lines += [_figure("eigenvalues", "Error of eigenvalues against time"), eigenvalues(store), judgements(store)]
    if store.rows("growth"):
        lines += ["## Growth", words.GROWTH.format(far=FAR)]
        lines += [_figure("growth", "Cost against the number of unknowns"), growth(store)]
    if store.rows("map"):
        lines += ["## Many rods", words.MANY, many(store)]
    if demos := store.rows("processes"):
        lines += ["## Whole processes", words.PROCESSES, whole(demos)]
    for data in store.rows("first"):
        lines += ["## First minute", words.MINUTE, minute(data)]
    if store.rows("branches"):
        lines += ["## All branches", tables.all_branches(store)]
    if failures := store.failures():
        lines += ["## Left out", "\n".join(f"* {', '.join(keys)}: {why}" for why, keys in failures.items())]
    path.write_text("\n\n".join(line.strip() for line in lines if line) + "\n")


def _figure(key: str, text: str) -> str:
    return f"![{text}]({FIGURES[key]})"
