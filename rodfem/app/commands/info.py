"""Special points, meshes and accuracy of a saved diagram."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from rodfem.app.cli import Parser, run_folder
from rodfem.file_format import DIAGRAM, read_json
from rodfem.output.summary import in_sentences
from rodfem.output.words import table_of

NEEDED = ("parameter", "constants", "branches", "meshes", "discretization", "ordinate", "range")
"""Entries of a diagram that are printed."""


def main(words: Sequence[str]) -> None:
    """Print them; raises :class:`~rodfem.errors.InputError` where the folder has no diagram."""
    parser = Parser(prog="rodfem info", description=__doc__)
    parser.add_argument("folder", type=run_folder, help="that of a run, as results/cord")
    folder = parser.parse_args(words).folder
    print("\n".join(lines(read_json(folder / "diagram.json", DIAGRAM, NEEDED))))


def lines(data: Mapping[str, Any]) -> Iterator[str]:
    """A diagram, the contents of ``diagram.json``, in lines of text."""
    constants = ", ".join(f"{name} = {value:.6g}" for name, value in data["constants"].items())
    yield f"{data.get('title', data['scene'])}: {constants or 'no constants'}"
    for mesh in data["meshes"]:
        yield f"  {mesh['elements']} elements of degree {mesh['degree']}, {mesh['unknowns']} unknowns"
    yield f"  {'branch':<12} {'kind':<13} {data['parameter']:<24} {data['ordinate'][:24]:<24} index"
    rows = list(table_of(data))
    for branch in data["branches"]:
        for name, kind, load, ordinate, index, _ in (row for row in rows if row[0] == branch["name"]):
            yield f"  {name:<12} {kind:<13} {load:<24} {ordinate:<24} {index}"
        yield f"  {branch['name']:<12} {len(branch['columns']['load'])} points; ended: {branch['ended']}"
    yield from (f"  {sentence}" for sentence in in_sentences(data))
