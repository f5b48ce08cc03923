"""Record every special point and index of all cases in ``tests/golden``: numbers.json; with ``work``: work.json.

Work is counted with the error bars that ``tests/diagram/test_golden.py`` computes.
"""

import json
import sys
from pathlib import Path

from golden_cases import VARIED, cases, record, trace
from work import RECORD, counted, size

if __name__ == "__main__":
    numbers, costs = {}, {}
    for name, scene in cases().items():
        if sys.argv[1:] == ["work"]:
            with counted() as costs[name]:
                diagram = trace(scene(), error_bars=name in VARIED)
            costs[name] |= size(diagram)
            print(name, costs[name], flush=True)
        else:
            numbers[name] = record(scene())
            print(name, sum(len(b["special"]) for b in numbers[name]), flush=True)
    path, found = (RECORD, costs) if costs else (Path(__file__).parent / "numbers.json", numbers)
    path.write_text(json.dumps(found, indent=1) + "\n")
