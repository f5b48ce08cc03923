"""Left-most eigenvalues of a straight rod by rodfem: time and error of one formulation and degree.

    python -m benchmarks.speed.eigenvalues cord reduced 6 5 4 8 12      # degree 6, five runs, 4, 8 and 12 elements

prints a line of JSON for each number of elements.  The time is that of one whole judgement along a branch, index and
certificate included, after a first one that is not counted.
"""

from __future__ import annotations

import json
import sys
from statistics import median
from time import process_time
from typing import Any

import numpy as np

from benchmarks.references import Spectrum, spectra
from benchmarks.speed.scenes import with_inertia
from rodfem.diagram.solver import Solver
from rodfem.errors import ConvergenceError, InputError
from rodfem.fem.fields import Discretization
from rodfem.stability.assessment import Assessor


def measure(spectrum: Spectrum, formulation: str, elements: int, degree: int, runs: int) -> dict[str, Any]:
    """Median time, and the largest relative error of the reference eigenvalues."""
    solver = Solver(with_inertia(spectrum), Discretization(formulation, elements, degree)).equilibria
    solver.system.set_phase(None)
    x, outcome = solver.at_load(solver.start(spectrum.load), spectrum.load)
    if not outcome.converged:
        raise ConvergenceError("no straight state")
    assessor, times = Assessor(solver.system), []
    number = len(spectrum.values) + (0 if assessor.conservative else 3)  # the other plane's lie between
    for _ in range(runs + 1):
        started = process_time()
        verdict = assessor(x, "shift-invert", number)
        times.append(process_time() - started)
    found = np.real(verdict.values)
    error = max(float(abs(found / value - 1).min()) for value in spectrum.values)
    return {
        "formulation": formulation,
        "elements": elements,
        "degree": degree,
        "unknowns": solver.system.fields.unknowns,
        "runs": runs,
        "seconds": median(times[1:]),
        "values": found.tolist(),
        "error": error,
    }


def main() -> None:
    """Print what is measured."""
    name, formulation, degree, runs, *elements = sys.argv[1:]
    spectrum = spectra()[name]
    for n in elements:
        try:
            found = measure(spectrum, formulation, int(n), int(degree), int(runs))
        except (ConvergenceError, InputError) as trouble:
            print(f"{name}, {n} elements of degree {degree}: {trouble}", file=sys.stderr)
        else:
            print(json.dumps({"name": name, **found}), flush=True)


if __name__ == "__main__":
    main()
