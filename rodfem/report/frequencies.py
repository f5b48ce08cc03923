"""Frequencies of a branch against the load, as the page draws them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rodfem.output.frequency_curves import curves, ranges_of, top
from rodfem.output.plot_frequencies import SPECIAL
from rodfem.report.packing import plain

MOST = 3
"""Left-most frequencies that the page has in view, as the picture."""


def frequencies_of(branch: Mapping[str, Any]) -> dict[str, Any] | None:
    """Curves, unstable ranges and special points of a branch; None where no frequencies are recorded."""
    columns = branch["columns"]
    if not columns.get("omega2"):
        return None
    return {
        "curves": [
            {
                "motion": curve.motion,
                "colour": curve.colour,
                "load": plain(curve.loads),
                "rows": curve.rows.tolist(),
                "parts": {"frequency": plain(curve.real)} | {name: plain(part) for name, part in curve.parts.items()},
            }
            for curve in curves(columns, branch["special"])
        ],
        "ranges": [found._asdict() for found in ranges_of(branch)],
        "marks": [
            {"kind": special["kind"], "row": special["row"], "frequency": abs(complex(special["omega2"])) ** 0.5}
            for special in branch["special"]
            if special["kind"] in SPECIAL
        ],
        "top": top(branch, MOST),
    }
