"""Seconds spent in assembly, solves and stability."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from time import perf_counter

WORK = ("assembly", "solve", "stability")  # what a point of a branch costs


class Clock:
    """Accumulates wall time by name; nested measurements are charged to the innermost name."""

    def __init__(self) -> None:
        self.seconds = defaultdict[str, float](float)
        self.started = perf_counter()
        self._running: list[str] = []
        self._scope = ""
        self._mark = self.started

    def _charge(self) -> None:
        now, running = perf_counter(), self._running
        if running:
            self.seconds[running[-1]] += now - self._mark
        self._mark = now

    @contextmanager
    def __call__(self, name: str) -> Iterator[None]:
        """Measure a block under ``name``."""
        self._charge()
        self._running.append(self._scope or name)
        try:
            yield
        finally:
            self._charge()
            self._running.pop()

    @contextmanager
    def scope(self, name: str) -> Iterator[None]:
        """Charge all of the block to ``name``."""
        outer, self._scope = self._scope, self._scope or name
        try:
            with self(name):
                yield
        finally:
            self._scope = outer

    def each(self, points: int) -> float:
        """Milliseconds of :data:`WORK` for one of so many points."""
        return 1e3 * sum(self.seconds.get(name, 0.0) for name in WORK) / max(points, 1)

    def total(self) -> float:
        """Seconds since the clock was made."""
        return perf_counter() - self.started
