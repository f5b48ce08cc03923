"""Style of all pictures: size, fonts, colours, lines, text, and how they are written."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.mathtext import MathTextParser
from matplotlib.patheffects import withStroke
from matplotlib.transforms import offset_copy

from rodfem.errors import InputError
from rodfem.output.words import with_unit
from rodfem.stability.soft_mode import PLANAR, STABLE, UNDECIDED, UNSTABLE
from rodfem.whole_files import draft_of

DPI, SIZE, FONT = 200, (7.5, 5.0), 11.0  # 1500 x 1000 pixels
STYLE = {"font.size": FONT, "font.family": "DejaVu Sans", "axes.grid": True, "grid.color": "0.92"}
PALETTE = (  # after Okabe and Ito: hues safe for the colour-blind, then the same once more and darker
    *("#303030", "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00"),
    *("#003F62", "#753400", "#00573F", "#70435C", "#2F6380", "#7E5700"),
)
GREEK = "alpha beta gamma delta epsilon zeta eta theta kappa lambda mu nu xi pi rho sigma tau phi chi psi omega".split()
ROD, STRIPE, FIRST, SECOND = "#9CC4E6", "#1F3A5F", "#D55E00", "#009E73"
"""A rod in space, the line along d1 on it, and arrows along d1 and d2."""
GREY, DARK, STEEL, LOAD = "#9A9A9A", "#6E6E6E", "#707C8A", "#B3123E"
"""What holds a rod, its axles and strings, springs and rails, and loads."""
LINES: dict[str, dict[str, Any]] = {
    STABLE: {"linestyle": "-", "linewidth": 3.0, "solid_capstyle": "round"},
    PLANAR: {"linestyle": (0, (3.2, 1.0)), "linewidth": 2.4},
    UNDECIDED: {"linestyle": (0, (4.0, 1.2, 1.0, 1.2)), "linewidth": 2.4},
    UNSTABLE: {"linestyle": (0, (1.0, 1.3)), "linewidth": 1.9},
}
"""Lines of a diagram by stability, the most stable one first."""
THIN: dict[str, Any] = {"linewidth": 0.9, "alpha": 0.75}  # line of an image of a branch
WARNING: dict[str, Any] = {"ms": 9.0, "mec": LOAD, "mew": 1.8, "mfc": "#F0E442"}
END: dict[str, Any] = {"marker": "X", "ms": 8.5, "mfc": "white", "mec": LOAD, "mew": 1.3}
"""Marks of what a diagram does not explain, and of an end before the range ends."""
HALO, RIM = ([withStroke(linewidth=width, foreground="white")] for width in (3.2, 2.6))
"""White around words and marks, and around lines that lie on wider ones."""


class Sheet(Figure):
    """A figure that a notebook shows, although pyplot has not made it."""

    def _repr_png_(self) -> bytes:
        stream = BytesIO()
        self.savefig(stream, format="png", dpi=DPI / 2)
        return stream.getvalue()


def sheet(title: str, about: str, given: Axes | None = None) -> tuple[Figure, Axes]:
    """A figure of one picture with its title, and in small letters what it is computed with."""
    if given is not None:
        if not isinstance(given, Axes):
            raise InputError(f"ax is {given!r}: give axes of matplotlib, as in ax=pyplot.gca().")
        return given.get_figure(), given  # type: ignore[return-value]
    figure = Sheet(figsize=SIZE, dpi=DPI, layout="constrained")
    axes = figure.add_subplot(axisbelow=True)
    figure.suptitle(tex(title), fontsize=FONT + 2, wrap=True)
    axes.set_title(about.replace("; ", "\n") if len(about) > 110 else about, color="0.4", fontsize=FONT - 3)
    return figure, axes


def entries_of(axes: Axes) -> dict[str, Artist]:
    """Entries of the legend that :func:`explain` has written; none before that."""
    return getattr(axes.get_legend(), "entries", {})


def explain(axes: Axes, handles: Sequence[Artist]) -> None:
    """Write the legend below the axes, each entry once: inside there may be no room."""
    entries = entries_of(axes) | {str(handle.get_label()): handle for handle in handles}
    columns = max(1, min(4, 150 // (12 + max(map(len, entries), default=0))))
    place = {"bbox_to_anchor": (0.5, 0.0), "bbox_transform": offset_copy(axes.transAxes, axes.figure, 0, -36, "points")}
    legend = axes.legend(
        list(entries.values()), list(entries), loc="upper center", ncols=columns, fontsize=FONT - 2.5, **place
    )
    legend.entries = entries  # type: ignore[attr-defined]
    layout = axes.figure.get_layout_engine()  # after which pixels are final
    layout.execute(axes.figure) if layout else axes.figure.draw_without_rendering()


def save(figure: Figure, path: Path) -> Path:
    """Write a figure; the suffix decides the format, and the folder is created where it is missing."""
    path = Path(path)
    with matplotlib.rc_context(STYLE), draft_of(path) as draft:
        figure.savefig(draft, dpi=DPI, format=path.suffix[1:] or "png")
    return path


def tex(text: str, always: bool = False) -> str:
    """Return text that matplotlib can set: TeX between dollars where it parses, else without its signs."""
    text = f"${text}$" if "$" not in text and (always or "\\" in text) else text
    try:
        MathTextParser("path").parse(text)
    except ValueError:
        return text.replace("$", "").replace("\\", "")
    return text


def axis_label(diagram: Mapping[str, Any]) -> str:
    """Load of a diagram for its axis: in words, where the scene has some, its symbol, and its unit if it has one."""
    words, unit = (str(diagram.get(f"parameter_{what}") or "") for what in ("words", "unit"))
    return axis_name(words, diagram["parameter_label"], unit)


def axis_name(words: str, label: str, unit: str = "") -> str:
    """A parameter for its axis: in words, where there are some, its symbol in TeX, and its ``unit`` if it has one."""
    symbol, words = tex(symbol_of(label), always=True), words.replace("$", "")
    return with_unit(f"{words} {symbol}" if words else symbol, unit)


def symbol_of(label: str) -> str:
    """TeX for a parameter whose label is its name alone: ``phi`` is a Greek letter, ``t0`` has an index."""
    found = re.fullmatch("([A-Za-z]+?)([0-9]*)", label)
    if not found:
        return label
    letter, index = found.groups()
    letter = "lambda" if letter == "lam" else letter
    if letter.lower() in GREEK:
        letter = f"\\{letter}"
    elif len(letter) > 1:
        return label
    return f"{letter}_{{{index}}}" if index else letter


def ordinate_in_words(diagram: Mapping[str, Any]) -> str:
    """Ordinate of a diagram for its axis: its label, after its name where that is a symbol alone, and its unit."""
    name, label = diagram["ordinate"], diagram.get("ordinate_label") or ""
    symbol = label.startswith("$") and label.endswith("$") and label.count("$") == 2
    return with_unit(f"{name} {label}" if symbol else label or name, str(diagram.get("ordinate_unit") or ""))
