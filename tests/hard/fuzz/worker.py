"""Random scenes through the public interface: ``python -m tests.hard.fuzz --seed 1 --scenes 500``.

Each scene is worked on in a child process, which is replaced where it takes too long or dies.  A line of JSON a scene
is added to ``results/fuzz-SEED.jsonl`` (or ``--output FILE``); scenes that have one are not repeated.  ``--only N``
works on one scene and prints what it shows.
"""

import argparse
import json
import sys
import time
import traceback
from collections import Counter
from collections.abc import Sequence
from multiprocessing import TimeoutError, get_context
from pathlib import Path
from typing import Any

from rodfem import InputError

from .comparison import compared, of_a_sentence
from .scenes import scene

Entry = dict[str, Any]
COMPARED, REFUSED, CRASHED, HUNG = "compared", "refused", "crashed", "hung"
RENEWED = 12
"""Scenes of one child: compiled forms stay in its memory."""
LIMIT = 300.0
"""Seconds of a scene."""


def examine(seed: int, number: int, depth: int = 1) -> Entry:
    """Entry of a scene; an exception that is no error of rodfem's own is a crash."""
    entry: Entry = {"seed": seed, "number": number, "outcome": COMPARED}
    try:
        made = scene(seed, number)
    except InputError as trouble:
        fault = of_a_sentence(str(trouble))
        return entry | {"outcome": REFUSED, "refused": [str(trouble)], "wrong": [fault] if fault else []}
    try:
        found = compared(made, number, depth)
    except Exception:  # whatever it is, it is what the fuzzer is for
        return entry | {"outcome": CRASHED, "scene": made.name, "trace": traceback.format_exc().splitlines()}
    outcome = REFUSED if len(found.refused) == 2 and not found.rows else COMPARED
    return entry | found.entry() | {"outcome": outcome}


def run(file: Path, seed: int, scenes: int, depth: int, limit: float) -> list[Entry]:
    """Entries of scenes 0 to ``scenes``: those of the file, and the others, which are added to it."""
    known = [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []
    entries = {entry["number"]: entry for entry in known if entry["seed"] == seed}
    spawning = get_context("spawn")
    pool = spawning.Pool(1, maxtasksperchild=RENEWED)
    for number in (n for n in range(scenes) if n not in entries):
        began = time.time()
        try:
            entry = pool.apply_async(examine, (seed, number, depth)).get(limit)
        except TimeoutError:  # it hangs, or has died
            entry = {"seed": seed, "number": number, "outcome": HUNG, "trace": [f"no answer within {limit:g} s"]}
            pool.terminate()
            pool = spawning.Pool(1, maxtasksperchild=RENEWED)
        entries[number] = entry = entry | {"seconds": round(time.time() - began, 1)}
        with file.open("a") as results:
            results.write(json.dumps(entry) + "\n")
        if is_fault(entry):
            print(f"{number}: {entry['outcome']}: {entry.get('wrong') or entry.get('differs') or entry}", flush=True)
    pool.terminate()
    return [entries[n] for n in sorted(entries) if n < scenes]


def is_fault(entry: Entry) -> bool:
    """Whether a scene shows what it must not: a crash, a hang, a wrong index, a difference of which nothing is said."""
    return entry["outcome"] in (CRASHED, HUNG) or bool(entry.get("wrong")) or bool(entry.get("silent"))


def in_words(entries: Sequence[Entry]) -> str:
    """Numbers of scenes by their outcome, of rows, and of special points with how well error bars hold."""
    outcomes = ", ".join(f"{number} {name}" for name, number in Counter(e["outcome"] for e in entries).most_common())
    rows, unclear = (sum(entry.get(name, 0) for entry in entries) for name in ("rows", "unclear"))
    ratios = sorted(ratio for entry in entries for ratio in entry.get("ratios", ()))
    return (
        f"{len(entries)} scenes: {outcomes}; {sum(map(is_fault, entries))} with a fault\n"
        f"{rows} rows counted densely, {unclear} of them too near a critical state\n"
        f"{len(ratios)} pairs of special points, {sum(ratio <= 1 for ratio in ratios)} within the sum of their bars, "
        f"the largest ratios {ratios[-5:]}"
    )


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
        print(json.dumps(examine(given.seed, given.only, given.depth), indent=1))
    else:
        file = given.output or Path("results") / f"fuzz-{given.seed}.jsonl"
        file.parent.mkdir(parents=True, exist_ok=True)
        entries = run(file, given.seed, given.scenes, given.depth, given.limit)
        print(in_words(entries))
        sys.exit(any(is_fault(entry) for entry in entries))
