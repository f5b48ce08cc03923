"""Numbers of the rows of ``diagram.json`` whose errors are estimated, each with its bound as the terminal writes it."""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite
from typing import Any

from rodfem.continuation.kinds import KINDS
from rodfem.output.digits import number
from rodfem.output.pieces import is_solved
from rodfem.tolerances import unit

READ = ("load", "ordinate")
"""Numbers of a row whose errors files have; those of energies and of left-most eigenvalues are not estimated."""
GIVEN = "(given)"
"""What stands in place of a bound at a load that was asked for."""


def readings_of(branch: Mapping[str, Any], natural: Mapping[str, float]) -> list[dict[str, str]]:
    """Load and ordinate of each row of a branch, those with an estimate, as ``0.3216501 (3e-07)``.

    Special points have bounds of their own.  Those of other rows are relative, to ``natural`` sizes by the name of the
    number; without these, as in older files, nothing is known of such rows.
    """
    columns = branch["columns"]
    relative = columns.get("estimate") or [None] * len(columns["load"])
    found: list[dict[str, str]] = []
    for row, error in enumerate(relative):
        sizes = natural if error is not None else {}
        values = {name: columns[name][row] for name in READ if name in sizes}
        found.append({name: number(x, error * unit(x, one=sizes[name])) for name, x in values.items() if x is not None})
    for special in branch["special"]:
        solved = not KINDS[special["kind"]].given or is_solved(branch, special)
        found[special["row"]] = _of_special(special, solved)
    return found


def _of_special(special: Mapping[str, Any], solved: bool) -> dict[str, str]:
    bars = special.get("error_estimate"), special.get("ordinate_error_estimate")
    found = {
        name: number(special[name], bar, special.get("resolved"))
        for name, bar in zip(READ, bars, strict=True)
        if bar is not None
    }
    return found if solved else found | {"load": f"{special['load']:.10g} {GIVEN}"}


def eigenvalue_in_words(mu: complex, error: float) -> str:
    """An eigenvalue with the bound of its error, once; empty where that is not known."""
    if not isfinite(error):
        return ""
    (real, bar), (imaginary, other) = (number(x, error).split(" ", 1) for x in (mu.real, abs(mu.imag)))
    if not mu.imag:
        return f"{real} {bar}"
    return f"{real} {'+' if mu.imag > 0 else '-'} {imaginary} i {max(bar, other, key=lambda x: float(x.strip('()')))}"
