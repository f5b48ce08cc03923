"""What has been measured, in one file that is brought up to date after every piece."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from time import perf_counter, strftime
from typing import Any

from benchmarks.common import load


class Store:
    """Pieces of a benchmark by key; an interrupted run keeps all completed pieces."""

    def __init__(self, path: Path, resume: bool) -> None:
        """Take up what the file has (``resume``), or start with nothing and overwrite it."""
        self.path = path
        self.pieces: dict[str, dict[str, Any]] = json.loads(path.read_text()) if resume and path.exists() else {}

    def measure(self, key: str, work: Callable[[], Any]) -> Any:
        """Data of a piece: what is kept, or else what ``work`` returns, which is kept from then on."""
        if key not in self.pieces:
            started, before = perf_counter(), load()
            data = work()
            took = perf_counter() - started
            self.pieces[key] = {
                "data": data,
                "took": took,
                "load": [before, load()],
                "when": strftime("%Y-%m-%d %H:%M"),
            }
            self.save()
            print(f"{key} ({took:.1f} s, load {load():.1f})", flush=True)
        return self.pieces[key]["data"]

    def save(self) -> None:
        """Write the file, whole or not at all."""
        self.path.parent.mkdir(parents=True, exist_ok=True)
        new = self.path.with_suffix(".new")
        new.write_text(json.dumps(self.pieces, indent=1) + "\n")
        os.replace(new, self.path)

    def under(self, prefix: str) -> Iterator[tuple[str, Any]]:
        """Rest of the key, and data, of the piece ``prefix`` or all whose keys begin with ``prefix/``."""
        for key, piece in self.pieces.items():
            if key == prefix or key.startswith(prefix + "/"):
                yield key[len(prefix) + 1 :], piece["data"]

    def rows(self, prefix: str) -> list[dict[str, Any]]:
        """All rows of pieces that are lists of rows, without those that say what failed."""
        return [row for _, data in self.under(prefix) for row in data if "failed" not in row]

    def failures(self) -> dict[str, list[str]]:
        """Sentences on what failed, each with the pieces it is about."""
        out: dict[str, list[str]] = {}
        for key, piece in self.pieces.items():
            for row in piece["data"] if isinstance(piece["data"], list) else []:
                if "failed" in row:
                    out.setdefault(row["failed"], []).append(key)
        return out

    def loads(self, prefix: str = "") -> tuple[float, float]:
        """Least and greatest load of the machine beside the measurements whose keys begin with ``prefix``."""
        seen = [x for key, piece in self.pieces.items() if key.startswith(prefix) for x in piece["load"]]
        return min(seen), max(seen)

    def day(self, prefix: str = "") -> str:
        """Day of the first measurement whose key begins with ``prefix``."""
        return next(str(piece["when"])[:10] for key, piece in self.pieces.items() if key.startswith(prefix))

    def took(self) -> float:
        """Seconds that all pieces took."""
        return sum(piece["took"] for piece in self.pieces.values())
