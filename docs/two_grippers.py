"""The picture of docs/trades/two-grippers.md: 150 experiments, and the curve on which the pitchfork changes its kind.

    git clone https://github.com/StructuresComp/Helix_Bifurcation_Types theirs
    python docs/two_grippers.py theirs

reads the measured curvatures at loss of stability from ``theirs/DataProcessing/PlotFunc/ExpDataSub.mat`` and
``ExpDataSuper.mat``, computes each rod, prints the comparison, and draws ``docs/trades/two-grippers.png``.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from scipy.io import loadmat

import rodfem
from rodfem import Plan

PAGE = Path(__file__).parent / "trades" / "two-grippers.md"
CURVE = np.linspace(-0.55, 0.55, 12)
"""Ratios C22 at which the two C11 are sought at which the coefficient vanishes."""


def program() -> SimpleNamespace:
    """Names that the first block of the page defines."""
    names: dict[str, Any] = {}
    exec(re.findall(r"```python\n(.*?)```", PAGE.read_text(), flags=re.DOTALL)[0], names)
    return SimpleNamespace(**names)


def first_loss(page: SimpleNamespace, C11: float, C22: float) -> tuple[float, float]:
    """Curvature at which the helix is lost, and the coefficient of the pitchfork there, negative if the rod jumps."""
    rod = page.grippers(C11, C22)
    (first, *_) = rodfem.trace(rod, plan=Plan(depth=1, error_bars=False)).special("branch point")
    return first.point.load, first.law.coefficient


def measured(folder: Path) -> dict[str, np.ndarray]:
    """Rows C11, C22, kappa of the experiments by what the rod did."""
    folder = folder / "DataProcessing" / "PlotFunc"
    both = [loadmat(folder / f"ExpData{name}.mat") for name in ("Sub", "Super")]
    rows = np.vstack([np.hstack([data[name] for name in ("C11", "C22", "Kappa", "Type")]) for data in both])
    return {kind: rows[rows[:, 3] == number, :3] for number, kind in ((1, "jumped"), (0, "left gently"))}


def compared(page: SimpleNamespace, data: dict[str, np.ndarray]) -> dict[str, float]:
    """Differences of computed and measured curvatures in percent, and the number of rods whose kind is right."""
    found = np.array([first_loss(page, C11, C22) for rows in data.values() for C11, C22, _ in rows])
    kappa = np.vstack([*data.values()])[:, 2]
    jumps = np.concatenate([np.full(len(rows), kind == "jumped") for kind, rows in data.items()])
    off, part = found[:, 0] - kappa, 100 * (found[:, 0] / kappa - 1)
    return {
        "rms of the mean curvature": float(100 * np.sqrt(np.mean(off**2)) / kappa.mean()),
        "rms of each": float(np.sqrt(np.mean(part**2))),
        "mean": float(part.mean()),
        "right": int(((found[:, 1] < 0) == jumps).sum()),
        "experiments": len(kappa),
    }


def changes_of_kind(page: SimpleNamespace, C22: float) -> list[float]:
    """Ratios C11 at which the coefficient vanishes: marks of the locus of a path's branch point in kappa and C11."""
    gentle = 0.38 + 0.3 * C22
    diagram = rodfem.trace(page.grippers(gentle, C22), plan=Plan(depth=0, error_bars=False))
    locus = diagram.locus(diagram.special("branch point")[0], "C11", (0.02, gentle + 0.35), load=(4.0, 8.6))
    return [float(locus.values[mark.row, 1]) for mark in locus.marks if mark.kind.startswith("pitchfork")]


def main(folder: Path) -> None:
    """Compute, print and draw."""
    page, data = program(), measured(folder)
    figure = Figure(figsize=(7.0, 4.2), dpi=150, layout="constrained")
    axes = figure.subplots()
    for (kind, rows), mark in zip(data.items(), ("s", "o"), strict=True):
        axes.plot(rows[:, 0], rows[:, 1], mark, ms=4, label=f"experiment: {kind}")
    found = np.array([changes_of_kind(page, C22) for C22 in CURVE])
    axes.plot(found, CURVE, color="black")
    axes.plot([], [], color="black", label="computed: the pitchfork's coefficient vanishes")
    axes.set(xlabel=r"$C_{11} = \tau/\kappa$", ylabel=r"$C_{22} = \omega/\kappa$")
    axes.legend(frameon=False)
    figure.savefig(PAGE.with_suffix(".png"))
    print(*(f"{what}: {value:.3g}" for what, value in compared(page, data).items()), sep="\n")
    print(np.column_stack([CURVE, found]).round(4))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
