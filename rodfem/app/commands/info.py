"""Special points, meshes and accuracy of a saved diagram."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import inf
from typing import Any

from rodfem.app.cli import Parser, run_folder
from rodfem.continuation.kinds import KINDS
from rodfem.output.contents import read_diagram
from rodfem.output.digits import number
from rodfem.output.pieces import is_solved
from rodfem.output.summary import in_sentences

NEEDED = ("parameter", "constants", "branches", "meshes", "discretization", "ordinate", "range")
"""Entries of a diagram that are printed."""


def main(words: Sequence[str]) -> None:
    """Print them; raises :class:`~rodfem.errors.InputError` where the folder has no diagram."""
    parser = Parser(prog="rodfem info", description=__doc__)
    parser.add_argument("folder", type=run_folder, help="that of a run, as results/cord")
    folder = parser.parse_args(words).folder
    print("\n".join(lines(read_diagram(folder / "diagram.json", NEEDED))))


def lines(data: Mapping[str, Any]) -> Iterator[str]:
    """A diagram, the contents of ``diagram.json``, in lines of text."""
    constants = ", ".join(f"{name} = {value:.6g}" for name, value in data["constants"].items())
    yield f"{data.get('title', data['scene'])}: {constants or 'no constants'}"
    for mesh in data["meshes"]:
        yield f"  {mesh['elements']} elements of degree {mesh['degree']}, {mesh['unknowns']} unknowns"
    yield f"  {'branch':<12} {'kind':<13} {data['parameter']:<24} {data['ordinate'][:24]:<24} index"
    scale = max((abs(x) for branch in data["branches"] for x in branch["columns"]["ordinate"]), default=0.0)
    for branch in data["branches"]:
        for special in branch["special"]:
            given = KINDS[special["kind"]].given and not is_solved(branch, special)
            yield f"  {branch['name']:<12} {special['kind']:<13} {_values(special, scale, given)}"
        yield f"  {branch['name']:<12} {len(branch['columns']['load'])} points; ended: {branch['ended']}"
    yield from (f"  {sentence}" for sentence in in_sentences(data))


def _values(special: Mapping[str, Any], scale: float, given: bool) -> str:
    """Load, ordinate and index of a special point; a load that was ``given`` is exact; ``scale`` is of ordinates."""
    bars = [special.get(name) for name in ("error_estimate", "ordinate_error_estimate")]
    load, ordinate = (
        number(special[name], inf if bar is None else bar, special.get("resolved"), scale * (name == "ordinate"))
        for name, bar in zip(("load", "ordinate"), bars, strict=True)
    )
    if given:
        load = f"{special['load']:.10g}"
    before, after = special["negative_before"], special["negative_after"]
    index = f"{before}" if before == after else f"{before}->{after}"
    zero = f", {special['zero']} zero" if special["zero"] else ""
    return f"{load:<24} {ordinate:<24} {index}{zero}"
