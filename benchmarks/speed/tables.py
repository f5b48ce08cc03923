"""Tables of the page on branches: rodfem beside AUTO and scipy, at given errors."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from math import inf
from typing import Any

from benchmarks.auto.settings import ACCURACIES
from benchmarks.common import digits, milliseconds, table
from benchmarks.speed.plots import peers
from benchmarks.speed.run import PAPER, PARTS
from benchmarks.store import Store
from benchmarks.targets import TARGETS

Row = dict[str, Any]
AIMS = {1e-6: (0.5, 1.0, 1.5), 1e-8: (0.25, 0.7, 1.0)}
"""Time per accepted point, index included, over AUTO's that is aimed at, by error: of following, with all included, and
of following the full rod over AUTO's half of it."""
PARTS_IN_WORDS = ("following", "all included")
SWEPT, SWEEP = ("follower",), 1e-3
"""Scenes whose range is swept, and seconds per load that are aimed at."""


def worst(row: Row) -> float:
    """Largest relative error of the targets; infinite where one was not found."""
    if "error" in row:
        return inf if row["error"] is None else float(row["error"])
    return max(row["errors"].values()) if len(row["errors"]) == len(row["values"]) else inf


def per_point(row: Row, part: str = "following") -> float:
    """Seconds per accepted point."""
    return float(row[part]) / float(row["points"])


def fastest(rows: Iterable[Row], error: float, time: Callable[[Row], float]) -> Row | None:
    """The fastest row of at most that error, of which all finer ones of the same kind are as accurate.

    An error can be small by chance.
    """
    groups: dict[tuple[str, int], list[Row]] = {}
    for row in rows:
        groups.setdefault((row["formulation"], row["degree"]), []).append(row)
    good = []
    for group in groups.values():
        group.sort(key=lambda r: -r["elements"])
        for row in group:
            if worst(row) > error:
                break
            good.append(row)
    return min(good, key=time, default=None)


def what(row: Row) -> str:
    """Discretisation in a few letters."""
    return f"{row['elements']} P{row['degree']} {row['formulation']}"


def branches_of(store: Store) -> list[tuple[str, str, list[Row]]]:
    """Scene, branch and rodfem's rows."""
    rows = store.rows("branches")
    return [
        (scene, branch, [r for r in rows if (r["scene"], r["branch"]) == (scene, branch)])
        for scene, branches in TARGETS.items()
        for branch in branches
    ]


def references() -> str:
    """The targets with their values."""
    head = ["scene", "branch", "quantity", "value", "from"]
    return table(
        head,
        [
            [scene, branch, t.name, f"{t.reference:.13g}", t.source]
            for scene, branches in TARGETS.items()
            for branch, found in branches.items()
            for t in found
        ],
    )


def beside_auto(store: Store) -> str:
    """Both programs at each error, per accepted point and per branch."""
    head = [
        *("scene", "branch", "error asked", "AUTO", "error", "points", "ms/point", "following", "ms/branch"),
        *("rodfem", "error", "points", "ms/point", "following", "ms/branch"),
        *("ratio ms/point", "following", "ms/branch"),
    ]
    out = []
    for scene, branch, rows in branches_of(store):
        for accuracy in ACCURACIES:
            mine = fastest(rows, accuracy, per_point)
            for problem, theirs in peers(store, scene, branch).items():
                (other,) = [r for r in theirs if r["asked"] == accuracy] or [None]
                name = scene if problem == scene else f"{scene} ({problem})"
                out.append([name, branch, f"{accuracy:.0e}", *_columns(other, True), *_columns(mine, False)])
                pairs = [(per_point(r, "seconds"), per_point(r), r["seconds"]) for r in (mine, other) if r]
                out[-1] += [digits(a / b, 2) for a, b in zip(*pairs, strict=True)] if len(pairs) == 2 else [""] * 3
    return table(head, out)


def choice(store: Store) -> str:
    """The fastest mesh of rodfem and AUTO at three errors, time of the whole branch, and the paper's mesh."""
    out = []
    for scene, branch, rows in branches_of(store):
        (paper_row,) = [r for r in rows if (r["elements"], r["degree"], r["formulation"]) == (*PAPER, "reduced")] or [
            None
        ]
        for accuracy in ACCURACIES:
            mine = fastest(rows, accuracy, lambda r: float(r["seconds"]))
            theirs = peers(store, scene, branch).get(scene, [])
            (other,) = [r for r in theirs if r["asked"] == accuracy] or [None]
            if mine is None:
                continue
            out.append([f"{scene}, {branch}", f"{accuracy:.0e}", what(mine).removesuffix(" reduced")])
            out[-1] += [milliseconds(mine["seconds"]), milliseconds(other["seconds"]) if other else ""]
            out[-1] += [digits(mine["seconds"] / other["seconds"], 2) if other else ""]
        if out and paper_row and (best := fastest(rows, worst(paper_row), per_point)):
            out[-1].append(digits(per_point(paper_row) / per_point(best), 2))
    return table(
        ["branch", "error", "mesh", "rodfem, ms", "AUTO, ms", "ratio", "paper"], [r + [""] * (7 - len(r)) for r in out]
    )


def stages(store: Store) -> str:
    """What the diagrams of the demos cost by stage, in milliseconds."""
    names = ("set-up", "following", "special points", "error bars", "all", "second rod")
    rows = [[r["scene"], *(f"{1e3 * r[name]:.0f}" for name in names)] for r in store.rows("stages")]
    return table(["demo", *names], rows)


def _columns(row: Row | None, auto: bool) -> list[str]:
    if row is None:
        return [""] * 6
    return [
        f"{row['ntst']} x {row['ncol']}" if auto else what(row),
        f"{worst(row):.0e}",
        str(row["points"]),
        milliseconds(per_point(row, "seconds")),
        milliseconds(per_point(row)),
        milliseconds(row["seconds"]),
    ]


def goals(store: Store) -> str:
    """Each goal with the ratio measured, and where the time goes in what misses it."""
    out = []
    for scene, branch, rows in branches_of(store):
        for accuracy, aims in AIMS.items():
            mine = fastest(rows, accuracy, per_point)
            for problem, theirs in peers(store, scene, branch).items():
                (other,) = [r for r in theirs if r["asked"] == accuracy] or [None]
                if mine is None or other is None or scene in SWEPT:
                    continue
                name, aim = (scene, aims[:2]) if problem == scene else (f"{scene} ({problem})", (aims[2], None))
                for part, goal, words in zip(("following", "seconds"), aim, PARTS_IN_WORDS, strict=True):
                    if goal is not None:
                        ratio = per_point(mine, part) / per_point(other, part)
                        verdict = (
                            "met" if ratio <= goal else f"missed: {reason(mine)}" if part == "following" else "missed"
                        )
                        numbers = [f"{milliseconds(per_point(r, part))} ms" for r in (mine, other)]
                        alone = digits(compiled(mine) / per_point(other), 2) if part == "following" else ""
                        ratios = [f"{goal:g}", digits(ratio, 2), alone]
                        out.append([name, branch, words, f"{accuracy:.0e}", *ratios, *numbers, verdict])
    head = ["scene", "branch", "time", "error", "goal", "ratio", "compiled alone", "rodfem", "AUTO", ""]
    return table(head, out)


def sweeps(store: Store) -> str:
    """Time per load of a sweep of frequencies beside its goal."""
    out = []
    for scene, branch, rows in branches_of(store):
        for accuracy in AIMS if scene in SWEPT else ():
            mine = fastest(rows, accuracy, per_point)
            if mine is not None:
                verdict = "met" if per_point(mine) <= SWEEP else f"missed: {reason(mine)}"
                out.append(
                    [
                        scene,
                        branch,
                        f"{accuracy:.0e}",
                        f"{1e3 * SWEEP:g} ms",
                        f"{milliseconds(per_point(mine))} ms",
                        verdict,
                    ]
                )
    return table(["scene", "branch", "error", "goal", "rodfem", ""], out)


def compiled(row: Row) -> float:
    """Seconds per point that compiled code takes: kernels of forms, factors, solutions, counts."""
    return float(sum(row[part] for part in PARTS)) / row["points"]


def reason(row: Row) -> str:
    """Where rodfem's time per point goes, largest share first."""
    parts = {name: row[name] / row["following"] for name in PARTS}
    parts["everything else (prediction, records, Python between calls)"] = 1 - sum(parts.values())
    names = {"stability": "index", "solve": "factors and solves"}
    ordered = sorted(parts.items(), key=lambda p: -p[1])
    return f"of {row['unknowns']} unknowns; " + ", ".join(f"{names.get(n, n)} {100 * p:.0f} %" for n, p in ordered)


def paper(store: Store) -> str:
    """The paper's discretisation, and the fastest one that is as accurate."""
    head = ["scene", "branch", "formulation", "error", "ms/point", "as accurate", "error", "ms/point", "ratio"]
    out = []
    for scene, branch, rows in branches_of(store):
        for row in (r for r in rows if (r["elements"], r["degree"]) == PAPER and worst(r) < inf):
            best = fastest(rows, worst(row), per_point)
            if best is None:
                continue
            out.append([scene, branch, row["formulation"], f"{worst(row):.0e}", milliseconds(per_point(row))])
            out[-1] += [what(best), f"{worst(best):.0e}", milliseconds(per_point(best))]
            out[-1] += [digits(per_point(row) / per_point(best), 2)]
    return table(head, out)


def beside_scipy(store: Store) -> str:
    """Scipy's solve_bvp, and rodfem at the error that it reached."""
    head = ["scene", "branch", "tol", "error", "points", "nodes", "ms/point", "rodfem", "error", "ms/point", "ratio"]
    out = []
    for scene, branch, rows in branches_of(store):
        for row in store.rows(f"bvp/{scene}/{branch}"):
            best = fastest(rows, row["error"], per_point)
            out.append([scene, branch, f"{row['tolerance']:.0e}", f"{row['error']:.0e}"])
            out[-1] += [f"{row['points']} of {row['tried']}", str(row["nodes"]), milliseconds(row["seconds"])]
            if best is None:
                out[-1] += [""] * 4
            else:
                out[-1] += [what(best), f"{worst(best):.0e}", milliseconds(per_point(best))]
                out[-1] += [digits(row["seconds"] / per_point(best), 2)]
    return table(head, out)


def all_branches(store: Store) -> str:
    """Everything measured of branches."""
    head = ["scene", "branch", "discretisation", "unknowns", "points", "largest error", "ms/point", "following"]
    head += ["locating, ms", "ms/branch", "errors"]
    out = []
    for scene, branch, rows in branches_of(store):
        for r in rows:
            errors = ", ".join(f"{name} {error:.1e}" for name, error in r["errors"].items())
            out.append([scene, branch, what(r), str(r["unknowns"]), str(r["points"])])
            out[-1] += [f"{worst(r):.1e}" if worst(r) < inf else "", milliseconds(per_point(r, "seconds"))]
            out[-1] += [milliseconds(per_point(r)), milliseconds(r["seconds"] - r["following"])]
            out[-1] += [milliseconds(r["seconds"]), errors]
    return table(head, out)
