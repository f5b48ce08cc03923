"""Saved diagrams below a folder: scene, date, size, first loss of stability."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from datetime import UTC, datetime
from math import inf
from pathlib import Path
from typing import Any

from rodfem.app.cli import Parser
from rodfem.continuation.kinds import KINDS
from rodfem.errors import InputError
from rodfem.file_format import DIAGRAM, read_json
from rodfem.output.digits import number
from rodfem.output.summary import called

NEEDED = ("scene", "parameter", "branches")
DAY = len("2026-01-31")
WIDTHS = (28, 16, DAY, 8, 7)
HEADS = ("folder", "scene", "date", "branches", "special")


def main(words: Sequence[str]) -> None:
    """Print a line for each; raises :class:`~rodfem.errors.InputError` where there is none."""
    parser = Parser(prog="rodfem list", description=__doc__)
    parser.add_argument("folder", type=Path, nargs="?", default=Path("results"), help="default: results")
    print("\n".join(lines(parser.parse_args(words).folder)))


def lines(folder: Path) -> Iterator[str]:
    """Head of the table and a line for each diagram; a file that is none has its reason in place of numbers.

    Raises :class:`~rodfem.errors.InputError` where there is no file.
    """
    files = sorted(folder.rglob("diagram.json"))
    if not files:
        raise InputError(f"No folder in {folder} has a diagram.json: run a scene, or name a folder with results.")
    yield _row(*HEADS, "first loss of stability")
    for file in files:
        name = str(file.parent)
        try:
            data = read_json(file, DIAGRAM, NEEDED)
            yield _row(name, data["scene"], _date(data, file), *_sizes(data), first_loss(data))
        except InputError as trouble:
            yield f"{name:<{WIDTHS[0]}} {trouble}"


def first_loss(data: Mapping[str, Any]) -> str:
    """Kind and load of the first special point on the first branch from which on it is unstable, with its accuracy.

    Of a planar rod it is the loss of stability in the plane, and the words say so.
    """
    if not data["branches"]:
        return "no branches"
    branch = data["branches"][0]
    columns = branch["columns"]
    plane = " in the plane" if data.get("planar") else ""
    if branch.get("singular_start"):
        return "the first state is singular"
    if columns["negative"][0]:
        return f"unstable{plane} from the first state on"
    for row in sorted([x["row"] for x in branch.get("unexplained") or ()])[:1]:
        before = [x for x in branch["special"] if x["row"] <= row and _loses(x)]
        if not before:
            return f"unknown: the index changes near {data['parameter']} = {columns['load'][row]:.6g} unexplained"
    lost = next((special for special in branch["special"] if _loses(special)), None)
    if lost is not None:
        bar = lost.get("error_estimate")
        load = number(lost["load"], inf if bar is None else bar, lost.get("resolved"))
        return f"{lost['kind']}{plane} at {data['parameter']} = {load}"
    if any(columns["negative"]):
        return f"unstable{plane} somewhere, without a special point"
    ends = f"from {columns['load'][0]:.6g} to {columns['load'][-1]:.6g}"
    return f"none{plane}: {called(branch['name'])} is stable {ends}"


def _loses(special: Mapping[str, Any]) -> bool:
    return not KINDS[special["kind"]].given and not special["negative_before"] and bool(special["negative_after"])


def _row(*cells: str) -> str:
    *others, last = cells
    return " ".join([*(f"{cell:<{width}}" for cell, width in zip(others, WIDTHS, strict=True)), last])


def _sizes(data: Mapping[str, Any]) -> tuple[str, str]:
    """Numbers of branches and of special points."""
    return str(len(data["branches"])), str(sum(len(branch["special"]) for branch in data["branches"]))


def _date(data: Mapping[str, Any], file: Path) -> str:
    """Day of the run, or of the file where that does not say."""
    written = datetime.fromtimestamp(file.stat().st_mtime, UTC).isoformat()
    return str((data.get("origin") or {}).get("date") or written)[:DAY]
