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


def draw_frequencies(diagram: Mapping[str, Any], path: Path, most: int = 3) -> Path:
    """Draw the square roots of the left-most eigenvalues against the load, as in Kumar & Healey (2010), figure 11.

    Real parts are dots, imaginary parts of complex pairs crosses, flutter loads stars.  The axis shows the lowest
    ``most`` frequencies; all are nondimensional.  Returns ``path``; raises ValueError without any ``omega2``.
    """
    branches = [b for b in diagram["branches"] if b["columns"].get("omega2")]
    if not branches:
        raise ValueError(f"The diagram of {diagram['scene']} has no eigenvalues: run a scene with a follower load.")
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=SIZE, dpi=DPI, layout="constrained")
        axes = figure.subplots()
        top = 0.0
        for branch in branches:
            loads = np.array(branch["columns"]["load"])
            for load, pairs in zip(loads, branch["columns"]["omega2"], strict=True):
                roots = np.array([complex(*pair) ** 0.5 for pair in pairs])
                real = roots[abs(roots.imag) < 1e-9]
                flutter = roots[roots.imag > 1e-9]
                axes.plot(np.full(len(real), load), real.real, ".", color=PALETTE[1], ms=4)
                axes.plot(np.full(len(flutter), load), flutter.real, ".", color=PALETTE[2], ms=4)
                axes.plot(np.full(len(flutter), load), flutter.imag, "+", color=PALETTE[2], ms=4)
                top = max([top, *sorted(roots.real)[:most], *flutter.imag])
            for special in branch["special"]:
                if special["kind"] == "flutter":
                    label = f"{special['load']:.4f}"
                    omega = special["omega2"] ** 0.5
                    axes.plot(special["load"], omega, linestyle="none", **MARKERS["flutter"])
                    axes.annotate(label, (special["load"], omega), (8, -16), textcoords="offset points")
        axes.set_ylim(0, 1.15 * top)
        axes.set_xlabel(f"${diagram['parameter_label']}$")
        axes.set_ylabel(r"$\omega$")
        axes.set_title(str(diagram["title"]))
        handles = [
            Line2D([], [], color=PALETTE[1], marker=".", ls="none", label="real frequency"),
            Line2D([], [], color=PALETTE[2], marker=".", ls="none", label="complex pair, real part"),
            Line2D([], [], color=PALETTE[2], marker="+", ls="none", label="complex pair, imaginary part"),
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
