"""Frequencies against the load, drawn from ``diagram.json`` alone."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from rodfem.plot import DPI, MARKERS, PALETTE, SIZE, STYLE

COLORS = {"bending about d1": 1, "bending about d2": 2, "torsion": 3, "bending": 4, "mixed": 5}
"""Places in the palette."""


def _by_motion(columns: Mapping[str, Any]) -> dict[str, list[tuple[float, complex]]]:
    """Load and frequency (the root with positive real part) of all eigenvalues, by kind of motion."""
    out: dict[str, list[tuple[float, complex]]] = {}
    for load, pairs, motions in zip(columns["load"], columns["omega2"], columns["motion"], strict=True):
        for pair, motion in zip(pairs, motions, strict=True):
            out.setdefault(motion, []).append((load, complex(*pair) ** 0.5))
    return dict(sorted(out.items()))


def draw_frequencies(diagram: Mapping[str, Any], path: Path, most: int = 3) -> Path:
    """Draw the square roots of the left-most eigenvalues against the load, as in Kumar & Healey (2010), figure 11.

    One colour for each kind of motion; real frequencies are dots, a complex pair is a cross (real part) and a plus
    (imaginary part), flutter loads are stars.  The axis shows the lowest ``most`` frequencies; all are
    nondimensional.  Returns ``path``; raises ValueError without any ``omega2``.
    """
    branches = [b for b in diagram["branches"] if b["columns"].get("omega2")]
    if not branches:
        raise ValueError(f"The diagram of {diagram['scene']} has no eigenvalues: run a scene with a follower load.")
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=SIZE, dpi=DPI, layout="constrained")
        axes = figure.subplots()
        top, seen = 0.0, dict[str, str]()
        for branch in branches:
            for motion, rows in _by_motion(branch["columns"]).items():
                color = seen.setdefault(motion, PALETTE[COLORS.get(motion, 7) % len(PALETTE)])
                loads, roots = np.array([load for load, _ in rows]), np.array([root for _, root in rows])
                real, pair = abs(roots.imag) < 1e-9, roots.imag > 1e-9
                axes.plot(loads[real], roots[real].real, ".", color=color, ms=4)
                axes.plot(loads[pair], roots[pair].real, "x", color=color, ms=4)
                axes.plot(loads[pair], roots[pair].imag, "+", color=color, ms=4)
                top = max([top, *roots[pair].imag])
            for pairs in branch["columns"]["omega2"]:
                top = max(top, *sorted(complex(*p).real ** 0.5 for p in pairs if p[0] > 0)[:most])
            for special in branch["special"]:
                if special["kind"] == "flutter":
                    omega = special["omega2"] ** 0.5
                    axes.plot(special["load"], omega, linestyle="none", **MARKERS["flutter"])
                    text = f"{special['load']:.4f}"
                    axes.annotate(text, (special["load"], omega), (8, -16), textcoords="offset points")
        axes.set_ylim(0, 1.15 * top)
        axes.set_xlabel(f"${diagram['parameter_label']}$")
        axes.set_ylabel(r"$\omega$")
        axes.set_title(str(diagram["title"]))
        handles = [Line2D([], [], color=color, marker=".", ls="none", label=motion) for motion, color in seen.items()]
        handles += [
            Line2D([], [], color="0.3", marker="x", ls="none", label="complex pair, real part"),
            Line2D([], [], color="0.3", marker="+", ls="none", label="complex pair, imaginary part"),
            Line2D([], [], ls="none", **MARKERS["flutter"], label="flutter"),
        ]
        axes.legend(handles=handles, loc="upper left", bbox_to_anchor=(1.01, 1.0), fontsize=9)
        d = diagram["discretization"]
        found = [s["error_estimate"] for b in branches for s in b["special"] if s["kind"] == "flutter"]
        accuracy = f"; flutter loads accurate to {max(found):.1e} (estimated)" if found else ""
        size = f"{d['elements']} elements of degree {d['degree']}, {d['unknowns']} unknowns"
        footer = f"{d['formulation']} formulation, {size}"
        figure.supxlabel(footer + accuracy, fontsize=8.5, color="0.4", x=0.01, ha="left")
        figure.savefig(path)
    return path
