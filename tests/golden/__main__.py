"""Record every special point and index of all cases in ``tests/golden/numbers.json``."""

from __future__ import annotations

import json
from pathlib import Path

from golden_cases import cases, record

if __name__ == "__main__":
    numbers = {}
    for name, scene in cases().items():
        numbers[name] = record(scene())
        print(name, sum(len(b["special"]) for b in numbers[name]), flush=True)
    (Path(__file__).parent / "numbers.json").write_text(json.dumps(numbers, indent=1) + "\n")
