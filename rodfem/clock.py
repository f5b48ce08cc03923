"""Where the time goes: seconds spent in assembly, solves and stability."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from time import perf_counter


class Clock:
    """Accumulates wall time by name; nested measurements are charged to the innermost name."""

    def __init__(self) -> None:
        """Start with nothing measured."""
        self.seconds: dict[str, float] = {}
        self.started = perf_counter()
        self._running: list[str] = []
        self._mark = self.started

    def _charge(self) -> None:
        now = perf_counter()
        if self._running:
            name = self._running[-1]
            self.seconds[name] = self.seconds.get(name, 0.0) + now - self._mark
        self._mark = now

    @contextmanager
    def __call__(self, name: str) -> Iterator[None]:
        """Measure the block under ``name``."""
        self._charge()
        self._running.append(name)
        try:
            yield
        finally:
            self._charge()
            self._running.pop()

    def total(self) -> float:
        """Seconds since the clock was made."""
        return perf_counter() - self.started
