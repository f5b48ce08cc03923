"""Picture of the elimination along a rod, for docs/how-it-works.md: ``python -m benchmarks.fronts``."""

from __future__ import annotations

from itertools import pairwise, product
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import scipy.sparse as sp
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from mpi4py import MPI

from benchmarks.speed.scenes import scene
from rodfem import Discretization
from rodfem.diagram.solver import Solver
from rodfem.linalg.chain import sequence
from rodfem.linalg.matrices import local_rows

ELEMENTS, DEGREE = 5, 2
EDGE, FULL, REST, BORDER, MOVED = "#1f3b73", "#7da7d9", "#e3ecf7", "#f7e6cf", "#e0b0d5"
"""Colours of outlines, of what is eliminated, the rest of a front, the border, and of what the next front gets."""


def fronts(pattern: sp.csr_matrix, order: np.ndarray, begins: np.ndarray) -> list[tuple[int, int, int]]:
    """Fronts of a chain: first fully summed unknown, end of those, end of the unknowns that the front has besides.

    ``pattern`` is that of the matrix in the ``order`` of elimination, whose groups begin at ``begins``; the border, the
    last group, is left out.
    """
    dense, inner = pattern.toarray() != 0, int(begins[-2])
    out: list[tuple[int, int, int]] = []
    for a, b in pairwise(begins[:-1].tolist()):
        end = int(np.flatnonzero(dense[a:b, :inner].any(axis=0)).max()) + 1
        if out and end <= out[-1][2]:
            out[-1] = (out[-1][0], b, out[-1][2])  # adds no unknown: of the front before it
        else:
            out.append((a, b, end))
    return out


def draw(axes: Any, pattern: sp.csr_matrix, found: list[tuple[int, int, int]], inner: int) -> None:
    """The matrix in the order of elimination, and what the fronts have of it."""
    n = pattern.shape[0]
    for a, b, end in found:
        for corner, size, colour in (((a, a), end - a, REST), ((a, a), b - a, FULL)):
            axes.add_patch(Rectangle(np.array(corner) - 0.5, size, size, facecolor=colour, edgecolor=EDGE, lw=1.0))
    for corner, width, height in (((inner, 0), n - inner, n), ((0, inner), n, n - inner)):
        axes.add_patch(Rectangle(np.array(corner) - 0.5, width, height, facecolor=BORDER, edgecolor="none", zorder=0))
    rows = pattern.tocoo()
    axes.plot(rows.col, rows.row, "s", color="black", ms=1.7, mew=0)
    axes.set(xlim=(-1, n), ylim=(n, -1), aspect="equal", xticks=[], yticks=[])
    axes.set_title("The saddle matrix, unknowns in the order of the rod", fontsize=11)


PARTS = (("delayed", 1.7), ("vertex", 1.5), ("interior", 2.0), ("next\nvertex", 1.5), ("border", 1.5))
ELIMINATED = 3
"""Number of the parts of a front that are fully summed, the first ones."""


def explain(axes: Any) -> None:
    """Two fronts one after the other, and what of the first is added to which part of the second.

    The next vertex of a front is the vertex of the one that follows, and the border is the border of all.
    """
    ends = np.append(0.0, np.cumsum([size for _, size in PARTS]))
    own, size = ends[ELIMINATED], ends[-1]
    second = size + 1.6, 1.6
    vertex, border, left_over = slice(1, 3), slice(4, 6), slice(3, 6)
    for (left, top), cells in (
        ((0.0, 0.0), [(left_over, left_over)]),
        (second, list(product((vertex, border), repeat=2))),
    ):
        axes.add_patch(Rectangle((left, top), size, size, facecolor=REST, edgecolor="none"))
        axes.add_patch(Rectangle((left, top), own, own, facecolor=FULL, edgecolor="none"))
        for across, down in cells:
            (x, *_, right), (y, *_, bottom) = ends[across], ends[down]
            axes.add_patch(Rectangle((left + x, top + y), right - x, bottom - y, facecolor=MOVED, edgecolor="none"))
        for end in ends[1:-1]:
            axes.plot([left, left + size], [top + end] * 2, color=EDGE, lw=0.4)
            axes.plot([left + end] * 2, [top, top + size], color=EDGE, lw=0.4)
        for corner in (own, size):
            axes.add_patch(Rectangle((left, top), corner, corner, facecolor="none", edgecolor=EDGE, lw=1.4))
        for (name, _), a, b in zip(PARTS, ends, ends[1:], strict=False):
            axes.text(left + (a + b) / 2, top - 0.15, name, ha="center", va="bottom", fontsize=8)
            axes.text(left - 0.15, top + (a + b) / 2, name, ha="right", va="center", fontsize=8)
    axes.text(own / 2, own / 2, "eliminated", ha="center", va="center", fontsize=10)
    axes.text((own + size) / 2, (own + size) / 2, "Schur\ncomplement", ha="center", va="center", fontsize=9)
    arrow = {"arrowstyle": "-|>", "color": EDGE, "lw": 1.5, "connectionstyle": "arc3,rad=0.35", "shrinkA": 0}
    start, to = ((own + size) / 2, size + 0.1), (second[0] + (ends[1] + ends[2]) / 2, second[1] + size)
    axes.annotate("", to, start, arrowprops=arrow)
    axes.text(start[0] - 0.3, second[1] + size + 0.6, "is added to the next front", ha="right", fontsize=9, color=EDGE)
    axes.set(xlim=(-1.6, second[0] + size + 0.1), ylim=(second[1] + size + 1.3, -1.2), aspect="equal")
    axes.axis("off")
    axes.set_title("A front, and the next", fontsize=11)


def main(path: Path = Path(__file__).parents[1] / "docs" / "fronts.png") -> None:
    """Draw the fronts of a short cord."""
    found: Any = Solver(scene("cord"), Discretization("reduced", ELEMENTS, DEGREE), MPI.COMM_SELF).equilibria
    matrix = local_rows(found.inertia.at(found.start(20.0, 0.4)).matrix)
    matrix.eliminate_zeros()
    whole = local_rows(found.inertia.matrix)
    order, begins = sequence(whole.indptr, whole.indices, found.system.fields.dense_rows)
    pattern = matrix[order][:, order]
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 5.0), width_ratios=(1, 1.55))
    cells = fronts(whole[order][:, order], order, begins)
    draw(left, pattern, cells, int(begins[-2]))
    explain(right)
    meant = {
        FULL: "eliminated in a front", REST: "the rest of the front", MOVED: "passed on to the next front",
        BORDER: "border: a few scalars, eliminated last",
    }  # fmt: skip
    entries = [Patch(facecolor=colour, edgecolor=EDGE, label=words) for colour, words in meant.items()]
    entries.append(Line2D([], [], ls="none", marker="s", ms=3, color="black", label="nonzero entry"))
    figure.tight_layout(rect=(0, 0.07, 1, 1))
    figure.legend(handles=entries, loc="lower center", ncols=len(entries), frameon=False, fontsize=9)
    figure.savefig(path, dpi=130)


if __name__ == "__main__":
    main()
