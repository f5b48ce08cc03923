"""Scenes one by one in a child process, and a line of results for each."""

import json
import os
import select
import subprocess
import sys
import time
import traceback
from pathlib import Path
from typing import Any

from rodfem import InputError

from .comparison import compared, of_a_sentence
from .scenes import scene

Entry = dict[str, Any]
COMPARED, REFUSED, CRASHED, HUNG = "compared", "refused", "crashed", "hung"
RENEWED = 12
"""Scenes of one child: compiled forms stay in its memory."""


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


def work(seed: int, depth: int) -> None:
    """Child process: a number a line comes in, an entry a line goes out."""
    out = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # whatever prints besides must not be taken for an entry
    for line in sys.stdin:
        out.write(json.dumps(examine(seed, int(line), depth)) + "\n")
        out.flush()


class Child:
    """A child process that examines scenes of a seed."""

    def __init__(self, seed: int, depth: int, errors: Path) -> None:
        command = [sys.executable, "-m", "tests.hard.fuzz", "--work", "--seed", str(seed), "--depth", str(depth)]
        with errors.open("a") as file:
            self.process = subprocess.Popen(
                command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=file, text=True, start_new_session=True
            )
        self.done = 0

    def ask(self, seed: int, number: int, limit: float) -> Entry:
        """Entry of a scene, also where the child hangs or dies."""
        process, nobody = self.process, {"seed": seed, "number": number}
        assert process.stdin is not None and process.stdout is not None
        try:
            process.stdin.write(f"{number}\n")
            process.stdin.flush()
        except BrokenPipeError:
            return nobody | {"outcome": CRASHED, "trace": [f"ended with {process.wait()}"]}
        ready, _, _ = select.select([process.stdout], [], [], limit)
        if not ready:
            return nobody | {"outcome": HUNG, "trace": [f"no answer within {limit:g} s"]}
        line = process.stdout.readline()
        self.done += 1
        return json.loads(line) if line else nobody | {"outcome": CRASHED, "trace": [f"ended with {process.wait()}"]}

    def end(self) -> None:
        """End it."""
        self.process.kill()
        self.process.wait()


def run(file: Path, seed: int, scenes: int, depth: int, limit: float) -> list[Entry]:
    """Entries of scenes 0 to ``scenes``: those of the file, and the others, which are added to it."""
    known = [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []
    entries = {entry["number"]: entry for entry in known if entry["seed"] == seed}
    child = None
    try:
        for number in (n for n in range(scenes) if n not in entries):
            began, child = time.time(), child or Child(seed, depth, file.with_suffix(".err"))
            entry = child.ask(seed, number, limit) | {"seconds": round(time.time() - began, 1)}
            entries[number] = entry
            with file.open("a") as results:
                results.write(json.dumps(entry) + "\n")
            if is_fault(entry):
                print(
                    f"{number}: {entry['outcome']}: {entry.get('wrong') or entry.get('differs') or entry}", flush=True
                )
            if entry["outcome"] in (CRASHED, HUNG) or child.done >= RENEWED:
                child.end()
                child = None
    finally:
        if child is not None:
            child.end()
    return [entries[n] for n in sorted(entries) if n < scenes]


def is_fault(entry: Entry) -> bool:
    """Whether a scene shows what it must not: a crash, a hang, a wrong index, a difference of which nothing is said."""
    return entry["outcome"] in (CRASHED, HUNG) or bool(entry.get("wrong")) or bool(entry.get("silent"))
