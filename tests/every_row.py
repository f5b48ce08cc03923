"""Recorded indices of every row of every demo, classical problem and scene of the documentation, by other methods.

``python -m tests.every_row`` examines all conservative scenes, or those named, by :data:`WITNESSES`: two shifts of the
same factors, the spectrum by SLEPc, and the paper's reduction to the null space of the constraints with MUMPS.  It
takes some minutes, and prints a line a scene.
"""

import sys
from typing import Any

from golden_cases import cases, trace

from rodfem.stability.assessment import Assessor

WITNESSES = ("count", "shift-invert", "reduction")
"""Methods that decide the index anew at each row."""


def disagreements(name: str, witnesses: tuple[str, ...] = WITNESSES) -> tuple[int, list[str]]:
    """Number of rows of a scene on its first mesh, and a sentence on each recorded index that a witness denies."""
    found, wrong = trace(cases()[name](), error_bars=False), []
    rows = [(branch, i, point) for branch in found.branches for i, point in enumerate(branch.points) if point.mesh == 0]
    for branch, i, point in rows:
        for witness in witnesses:
            index = _index(found.solvers[0], point, witness)
            if index != point.negative:
                wrong.append(f"{branch.name}, row {i}, load {point.load:.10g}: {point.negative}, {witness} {index}")
    return len(rows), wrong


def _index(solver: Any, point: Any, witness: str) -> int:
    """Index by a method: two shifts, or the number of negative eigenvalues that it finds."""
    if witness == "count":
        return Assessor(solver)(point.x, witness).negative
    found = Assessor(solver)(point.x, witness, point.negative + 2)
    assert found.certified, witness
    return int((found.values < -solver.inertia.tolerance / solver.system.scene.length).sum())


def main() -> None:
    """Examine the scenes named, or all."""
    total, failed = 0, 0
    for name in sys.argv[1:] or [name for name, scene in cases().items() if scene().conservative]:
        rows, wrong = disagreements(name)
        total, failed = total + rows, failed + len(wrong)
        print(f"{name}: {rows} rows, {len(wrong)} disagreements", *wrong, sep="\n  ", flush=True)
    print(f"{total} rows by {', '.join(WITNESSES)}: {failed} disagreements")
    sys.exit(bool(failed))


if __name__ == "__main__":
    main()
