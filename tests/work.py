"""Work of a computation in counts, which have no noise: what a run costs, whatever else the machine does.

Factorisations, columns solved for, and assembled forms are those of compiled code, on one rank.  Newton's iterations
and counted states are those of Python's classes.  Rows and special points are recorded with them: a count over its
number of rows is what one of them costs.
"""

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any
from unittest import mock

import rodfem
from rodfem.fem.newton import NewtonResult
from rodfem.linalg.compiled import module
from rodfem.stability.inertia import Factored

RECORD = Path(__file__).parent / "golden" / "work.json"


@cache
def recorded() -> dict[str, dict[str, int]]:
    """The counts that were recorded, by the names of the cases in ``golden_cases``."""
    read: dict[str, dict[str, int]] = json.loads(RECORD.read_text())
    return read


def compiled() -> dict[str, int]:
    """Counts of compiled code since its modules were loaded."""
    chain, assembly = module("linalg/chain").lib, module("fem/assembly").lib
    return {
        "factorisations": chain.chain_factored(),
        "solves": chain.chain_solved_columns(),
        "assemblies": assembly.assemblies(),
    }


def size(diagram: rodfem.Diagram) -> dict[str, int]:
    """Numbers of rows and of special points of a diagram, which its counts are for."""
    return {
        "rows": sum(len(b.points) for b in diagram.branches),
        "special points": sum(len(b.special) for b in diagram.branches),
    }


@contextmanager
def counted() -> Iterator[dict[str, int]]:
    """Counts of the block of a ``with`` statement, complete at its end."""
    counts = {"iterations": 0, "counted states": 0}

    def wrapped(function: Callable[..., Any], name: str, of: Callable[[Any, Any], int]) -> Callable[..., Any]:
        def wrapper(self: Any, *args: Any, **kwargs: Any) -> Any:
            result = function(self, *args, **kwargs)
            counts[name] += of(self, result)
            return result

        return wrapper

    before = compiled()
    patches = (
        (NewtonResult, "__init__", "iterations", lambda made, _: made.iterations),
        (Factored, "count", "counted states", lambda *_: 1),
    )
    started = [mock.patch.object(c, m, wrapped(getattr(c, m), name, of)) for c, m, name, of in patches]
    for patch in started:
        patch.start()
    try:
        yield counts
    finally:
        for patch in started:
            patch.stop()
        counts |= {name: count - before[name] for name, count in compiled().items()}
