"""Write a saved diagram for other programs: VTKHDF (ParaView), CSV."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rodfem.app.cli import Parser, folder, run_folder
from rodfem.output.convert import FORMATS
from rodfem.output.files import load_json
from rodfem.whole_files import writing


def main(words: Sequence[str]) -> None:
    """Write the files and print their names; raises :class:`~rodfem.errors.InputError` for a folder without a run."""
    parser = Parser(prog="rodfem convert", description=__doc__)
    parser.add_argument("folder", type=run_folder, help="that of a run, as results/cord")
    parser.add_argument("--to", dest="format", choices=FORMATS, default="vtkhdf", help="format (default vtkhdf)")
    parser.add_argument("--output", type=folder, metavar="DIR", help="folder for the files (default FOLDER/FORMAT)")
    options = parser.parse_args(words)
    target: Path = options.output or options.folder / options.format
    load_json(options.folder / "diagram.json")  # no folder is made for a run that there is not
    with writing(target):
        target.mkdir(parents=True, exist_ok=True)
    for path in FORMATS[options.format](options.folder, target):
        print(path)
