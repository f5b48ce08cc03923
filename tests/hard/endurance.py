"""Long branches and many scenes in one process: time, memory, open files and communicators stay what they are."""

import gc
import os
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf
from statistics import median
from typing import Any

import classics
from classics import SUPPORTS, column
from hard.case import Measured
from hard.stiffness import EULER
from mpi4py import MPI

from rodfem import Discretization, Observer, Plan, StepControl, compat, trace

SLOWER = 2.0
"""Largest ratio of the time of a row, or a scene, in the last fifth to that in the second: 3 if it grew from zero."""
KEPT, LEFT = 8.0, 0.5
"""Most kilobytes that a row may keep, two vectors of PETSc and its records, and that a scene may leave behind."""
HEAP = 4096.0
"""Kilobytes by which the heap may grow besides."""
TRIES = 3
"""Runs of which the best counts: another process slows rows of a millisecond now and then, growth slows all runs."""
PARTS = 5
"""Parts of a run; the first is not looked at."""
MESH = Discretization("reduced", 4, 3)


def resident() -> float:
    """Kilobytes of memory in use by this process."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1024


KNOWN = 10
"""Scenes before those that are measured: the meshes of the last few stay, and were other ones."""


def handles() -> tuple[int, int]:
    """Number of open files, and the number that the next communicator gets."""
    comm = MPI.COMM_SELF.Dup()
    number = int(comm.py2f())
    comm.Free()
    return len(os.listdir("/proc/self/fd")), number


@dataclass
class Record(Observer):
    """Processor time, memory and handles after each of some events."""

    times: list[float] = field(default_factory=list)
    memory: list[float] = field(default_factory=list)
    handles: list[tuple[int, int]] = field(default_factory=list)

    def add(self) -> None:
        self.times.append(time.process_time())
        self.memory.append(resident())
        self.handles.append(handles())

    def progress(self, *_: Any) -> None:
        self.add()

    def judged(self, most: float) -> Measured:
        """The largest of what has grown, over what is promised: time, kilobytes, handles."""
        part = len(self.times) // PARTS
        steps = [b - a for a, b in zip(self.times, self.times[1:], strict=False)]
        slower = median(steps[-part:]) / median(steps[part : 2 * part])
        kept, allowed = max(self.memory[-part:]) - self.memory[part], most * (len(self.memory) - part) + HEAP
        # what other tests have left in the process may go, or come, once: a leak goes on
        halves = zip(self.handles[part], self.handles[(part + len(self.handles)) // 2], self.handles[-1], strict=True)
        more = [a < b < c for a, b, c in halves]
        wrong = f"{self.handles[part]} became {self.handles[-1]}" if any(more) else ""
        return Measured(max(slower / SLOWER, kept / allowed), 1.0, wrong=wrong)


def best(measure: Callable[[int], Measured]) -> Callable[[int], Measured]:
    """The same measured up to :data:`TRIES` times, until it is right; what is wrong is so at once."""

    def measured(number: int) -> Measured:
        found = measure(number)
        for _ in range(TRIES - 1):
            if found.right or found.wrong:
                break
            found = measure(number)
        return found

    return measured


@best
def rows(number: int) -> Measured:
    """A cantilever that an end moment rolls up, in so many rows."""
    record, size = Record(), 1.0 / number
    scene = classics.rolled("moment")
    steps = StepControl(first=size, largest=size, smallest=size / 10, most=number + 1)
    diagram = trace(scene, MESH, Plan(steps=steps, error_bars=False, depth=0), record)
    if len(diagram[0].points) != number + 1:
        return Measured(inf, 1.0, (), f"{diagram[0]}")
    return record.judged(KEPT)


@best
def scenes(number: int) -> Measured:
    """So many columns, each of another bending stiffness, with its buckling load."""
    record = Record()
    for i in range(-KNOWN, number):
        B1 = 1.0 + i / (number + KNOWN)
        scene = column("many", SUPPORTS["clamped-free"], (0.0, 6.0), constants={"B1": B1, "B2": 5.0})
        (found,) = trace(scene, MESH, Plan(error_bars=False, depth=0))[0].special[:1]
        if abs(found.point.load / (B1 * EULER) - 1) > 1e-4:
            return Measured(inf, 1.0, (), f"{found} where {B1 * EULER} was expected")
        gc.collect()
        compat.destroy_garbage(MPI.COMM_WORLD)
        if i >= 0:
            record.add()
    return record.judged(LEFT)
