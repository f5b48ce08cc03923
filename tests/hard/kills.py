"""Runs that are killed at random moments: ``python -m tests.hard.kills --tries 200``.

A run is ended by SIGKILL:

* ``process``: a single process, at a random time;
* ``writing``: a single process, before a random one of its events of files in the folder of the run;
* ``rank``: one of two ranks, at a random time;
* ``mpirun``: the program that started two ranks, at a random time.

Then nothing may run on, and the folder holds no files, or whole ones of one run, with the first branches of a run that
was not killed.

A line of JSON a try is added to ``results/kills.jsonl`` (or ``--output FILE``); tries that have one are not repeated.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

sys.path.append(str(Path(__file__).parents[1]))

from hard.folders import HOME, MPIRUN, alike, alive, branches_in, children_of, contents, surroundings

from rodfem.errors import InputError
from rodfem.output.files import load_json
from rodfem.output.states import check_run
from rodfem.whole_files import DRAFTS, LOCK

KINDS = {"process": "a single process", "writing": "a single process, while files are written",
         "rank": "one of two ranks", "mpirun": "mpirun itself"}  # fmt: skip
PROGRAM = ("demos/hemitropic.py", "--no-figures", "--step", "0.15", "--depth", "1", "--range", "0", "0.3", "--output")
TURNS = ("process", "writing", "rank", "writing", "process", "writing", "mpirun", "process", "writing", "rank")
"""Kinds of successive tries."""
LIMIT = 60.0
"""Seconds after which the rest of a program that was struck must have ended."""
CLOSE = 1e-8
"""Difference of two diagrams that were computed by different numbers of ranks."""
KILLED, CLEAN, BETWEEN, WRONG = "killed", "clean", "between", "wrong"
COUNTED = """
import os, runpy, signal, sys

last, folder, *sys.argv = sys.argv[1:]
count = 0


def strike(event, arguments):
    global count
    if event in ("open", "os.rename", "os.remove", "os.truncate") and str(arguments[0]).startswith(folder):
        count += 1
        if count == int(last):
            os.kill(os.getpid(), signal.SIGKILL)


sys.addaudithook(strike)
try:
    runpy.run_path(sys.argv[0], run_name="__main__")
finally:
    print("events", count)
"""
"""Program that runs another one, and is killed before one of the events in a folder; without that, it counts them."""
Entry = dict[str, Any]


@dataclass(frozen=True)
class Whole:
    """A run that was not killed: its folder, its events in that, and its seconds from its first words."""

    folder: Path
    events: int
    seconds: dict[int, float]

    def lasts(self, ranks: int) -> float:
        """Seconds on so many ranks, one more folder where it is not known."""
        if ranks not in self.seconds:
            self.seconds[ranks] = ended(command(self.folder.with_name(f"ranks-{ranks}"), ranks))[0]
        return self.seconds[ranks]


def command(folder: Path, ranks: int = 1, last: int | None = None) -> list[str]:
    """Command of a run, which is killed before the event number ``last``."""
    counted = () if last is None else ("-c", COUNTED, str(last), str(folder))
    return [*(MPIRUN if ranks > 1 else ()), sys.executable, "-u", *counted, *PROGRAM, str(folder)]


def started(given: Sequence[str]) -> subprocess.Popen[str]:
    return subprocess.Popen(
        given, cwd=HOME, env=surroundings(), stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    )


def ended(given: Sequence[str]) -> tuple[float, str]:
    """Seconds of a program from its first words, and its words."""
    with started(given) as program:
        assert program.stdout is not None
        program.stdout.readline()
        began = time.monotonic()
        words = program.stdout.read()
    assert program.returncode == 0
    return time.monotonic() - began, words


def whole(folder: Path) -> Whole:
    """Run without a kill."""
    seconds, words = ended(command(folder, last=0))
    return Whole(folder, int(words.split()[-1]), {1: seconds})


def struck(kind: str, chance: random.Random, known: Whole, folder: Path) -> Entry:
    """Kill a run; moment, status, and processes that it left running."""
    ranks = 1 if kind in ("process", "writing") else 2
    if kind == "writing":
        moment: float = chance.randint(1, known.events)
        with started(command(folder, 1, int(moment))) as program:
            program.communicate()
        return {"moment": moment, "of": known.events, "status": program.returncode, "left": []}
    moment = chance.uniform(0.0, known.lasts(ranks))
    which = chance.randrange(2)
    with started(command(folder, ranks)) as program:
        assert program.stdout is not None
        program.stdout.readline()
        time.sleep(moment)
        processes = children_of(program.pid) if ranks > 1 and program.poll() is None else [program.pid]
        if processes and program.poll() is None:  # mpirun outlives its ranks by a moment
            os.kill(processes[which % len(processes)] if kind == "rank" else program.pid, signal.SIGKILL)
        try:
            program.communicate(timeout=LIMIT)
        finally:
            waited = time.monotonic()
            while any(map(alive, processes)) and time.monotonic() < waited + LIMIT:
                time.sleep(0.05)
            left = [process for process in processes if alive(process)]
            for process in {*left, program.pid} if left else ():
                os.kill(process, signal.SIGKILL)
    return {"moment": moment, "of": known.lasts(ranks), "status": program.returncode, "left": left}


def state_of(folder: Path) -> tuple[str, list[str]]:
    """What a kill left: nothing, whole files with their branches, or a new states.h5 beside an earlier diagram.json."""
    if not (folder / "diagram.json").exists():
        rest = {file.name for file in folder.glob("*") if not file.match(DRAFTS)}
        assert rest <= {LOCK, "states.h5"}, rest
        return CLEAN, []
    try:
        check_run(load_json(folder / "diagram.json"), folder / "states.h5")
    except InputError as told:
        return BETWEEN, [str(told)]
    return KILLED, branches_in(folder, drafts=True)


def rows_in(folder: Path) -> list[list[Any]]:
    """Name and columns of each branch; special points may have more to say once further branches are traced."""
    return [[branch["name"], branch["columns"]] for branch in contents(folder)["branches"]]


def attempt(number: int, seed: int, known: Whole, folder: Path) -> Entry:
    """Entry of one try; ``wrong`` says what is not as it should be."""
    kind = TURNS[number % len(TURNS)]
    chance = random.Random(f"{seed} {number}")
    entry: Entry = {"number": number, "seed": seed, "kind": kind, "wrong": ""}
    status = 0
    for again in range(20):  # a run may have ended before the moment has come
        here = folder / f"{number}-{again}"
        entry |= struck(kind, chance, known, here)
        status = entry["status"]
        if status != 0:
            break
    try:
        assert status != 0, "never killed"
        assert not entry["left"], "processes run on"
        entry["state"], entry["branches"] = state_of(here)
        if entry["state"] == KILLED:
            alone = kind in ("process", "writing")
            mine, theirs = rows_in(here), rows_in(known.folder)
            assert alike(mine, theirs[: len(mine)], 0.0 if alone else CLOSE), "other branches"
    except (AssertionError, OSError, InputError) as trouble:
        entry["wrong"] = f"{type(trouble).__name__}: {trouble}"
    return entry


def run(file: Path, tries: int, seed: int = 1) -> list[Entry]:
    """Entries of all tries: those of the file, and the others, which are added to it."""
    known = [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []
    entries = {entry["number"]: entry for entry in known if entry["seed"] == seed}
    file.parent.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory() as place:
        unharmed = None
        for number in (n for n in range(tries) if n not in entries):
            unharmed = unharmed or whole(Path(place) / "whole")
            began = time.monotonic()
            entry = attempt(number, seed, unharmed, Path(place))
            entry["seconds"] = round(time.monotonic() - began, 1)
            entries[number] = entry
            with file.open("a") as results:
                results.write(json.dumps(entry) + "\n")
            print(
                f"{number} {entry['kind']}: {entry['wrong'] or entry.get('state')} ({entry['seconds']} s)", flush=True
            )
    return [entries[n] for n in sorted(entries) if n < tries]


def in_rows(entries: Sequence[Entry]) -> Iterator[list[str]]:
    """Rows of a table: what was killed, how often, what it left, and what was wrong."""
    for kind, words in KINDS.items():
        mine = [entry for entry in entries if entry["kind"] == kind]
        left = Counter(entry.get("state") for entry in mine)
        wrong = sum(bool(entry["wrong"]) for entry in mine)
        yield [words, *map(str, (len(mine), left[CLEAN], left[KILLED], left[BETWEEN], wrong))]


HEAD = ["killed", "tries", "no file yet", "whole files", "files of two runs, which is said", "wrong"]


def main() -> None:
    """Run what is asked for."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.hard.kills", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--tries", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--output", type=Path, default=Path("results") / "kills.jsonl")
    given = parser.parse_args()
    entries = run(given.output, given.tries, given.seed)
    for row in (HEAD, *in_rows(entries)):
        print("; ".join(row))
    sys.exit(any(entry["wrong"] for entry in entries))


if __name__ == "__main__":
    main()
