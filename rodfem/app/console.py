"""The program ``rodfem``, also ``python -m rodfem``: one of its commands, with the words after it.

A command is a function: its docstring's first line is its line in the list of commands.  What it needs is imported when
it runs.
"""

from __future__ import annotations

import os
import sys
import webbrowser
from collections.abc import Callable, Sequence
from difflib import get_close_matches
from pathlib import Path
from shutil import get_terminal_size
from textwrap import fill

import rodfem
from rodfem.app.cli import Parser, complain, folder, run_folder
from rodfem.errors import InputError, SetupError
from rodfem.ranks import end_quietly

HELP = """usage: rodfem COMMAND [ARGUMENTS]

Equilibria of nonlinearly elastic rods: which are stable, and at which load stability is lost.

{commands}

rodfem COMMAND --help lists the arguments of a command.
"""
UNFIT = "{} lacks what a diagram has, or has something else there ({{}}): run the scene again."
HEADS = {"folder": 28, "scene": 16, "date": 10, "branches": 8, "special": 7}
"""Columns of ``rodfem list``, and their widths."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command that ``arguments``, by default those of the shell, name; bad input ends with one sentence."""
    if arguments is None:  # a reader, as head, may leave
        end_quietly()
    name, *words = list(sys.argv[1:] if arguments is None else arguments) or ["--help"]
    if name in ("-h", "--help", "help"):
        lines = (f"  {each:<10}{_summary(command)}" for each, command in COMMANDS.items())
        print(HELP.format(commands="\n".join(lines)), end="")
    elif name == "--version":
        from rodfem.output.files import versions  # imports dolfinx, which takes a second

        print(*map("{0[0]:<8}{0[1]}".format, {"rodfem": rodfem.__version__, **versions()}.items()), sep="\n")
    elif name not in COMMANDS:
        near = get_close_matches(name, COMMANDS, n=1) or [" or ".join(COMMANDS)]
        Parser(prog="rodfem").error(f"unknown command {name!r}: choose {near[0]}")
    else:
        try:
            COMMANDS[name](words)
        except (InputError, SetupError) as trouble:
            complain(str(trouble))


def _summary(command: Callable[..., None]) -> str:
    """First line of the docstring of a command."""
    return (command.__doc__ or "").partition("\n")[0]


def convert(words: Sequence[str]) -> None:
    """Write a saved diagram for other programs: VTKHDF (ParaView), CSV, netCDF."""
    from rodfem.file_format import refusal
    from rodfem.output.files import load_json
    from rodfem.output.states import FORMATS
    from rodfem.whole_files import writing

    parser = Parser(prog="rodfem convert", description=_summary(convert))
    parser.add_argument("folder", type=run_folder, help="that of a run, as results/cord")
    parser.add_argument("--to", dest="format", choices=FORMATS, default="vtkhdf", help="format (default vtkhdf)")
    parser.add_argument("--output", type=folder, metavar="DIR", help="folder for the files (default FOLDER/FORMAT)")
    options = parser.parse_args(words)
    target: Path = options.output or options.folder / options.format
    load_json(options.folder / "diagram.json")  # no folder is made for a run that there is not
    with writing(target):
        target.mkdir(parents=True, exist_ok=True)
    with refusal(UNFIT.format(options.folder)):
        for path in FORMATS[options.format](options.folder, target):
            print(path)


def explain(words: Sequence[str]) -> None:
    """A word of the tables, files and pictures, in a sentence or two."""
    from rodfem.app.terminal import WIDTH
    from rodfem.output.table import ENTRIES, entries_of, explanation, title

    parser = Parser(prog="rodfem explain", description=_summary(explain))
    parser.add_argument("word", nargs="*", help="as index, BP LP, branch point; none lists all")
    given = parser.parse_args(words).word
    if not given:
        print("\n".join(sorted(map(title, ENTRIES), key=str.lower)))
    together = [" ".join(given)] if given else []
    each = together if any(map(entries_of, together)) or not all(map(entries_of, given)) else given
    for name, text in (entry for word in each for entry in explanation(word)):
        width = min(WIDTH, get_terminal_size().columns) if sys.stdout.isatty() else WIDTH
        print(fill(f"{name}: {text}", width, subsequent_indent="  "))


def info(words: Sequence[str]) -> None:
    """Special points, meshes and accuracy of a saved diagram."""
    from rodfem.file_format import DIAGRAM, read_json, refusal
    from rodfem.output.summary import in_sentences
    from rodfem.output.words import special_lines

    parser = Parser(prog="rodfem info", description=_summary(info))
    parser.add_argument("folder", type=run_folder, help="that of a run, as results/cord")
    path = parser.parse_args(words).folder / "diagram.json"
    needs = ("scene", "parameter", "constants", "branches", "meshes", "discretization", "ordinate", "range")
    data = read_json(path, DIAGRAM, needs)
    with refusal(UNFIT.format(path)):
        constants = ", ".join(f"{name} = {value:.6g}" for name, value in data["constants"].items())
        lines = [f"{data.get('title', data['scene'])}: {constants or 'no constants'}"]
        for mesh in data["meshes"]:
            lines.append(f"  {mesh['elements']} elements of degree {mesh['degree']}, {mesh['unknowns']} unknowns")
        lines += special_lines(data)
        for branch in data["branches"]:
            lines.append(f"  {branch['name']:<12} {len(branch['columns']['load'])} points; ended: {branch['ended']}")
        print("\n".join([*lines, *(f"  {sentence}" for sentence in in_sentences(data))]))


def list_diagrams(words: Sequence[str]) -> None:
    """Saved diagrams below a folder: scene, date, size, what the first branch does."""
    parser = Parser(prog="rodfem list", description=_summary(list_diagrams))
    parser.add_argument("folder", type=Path, nargs="?", default=Path("results"), help="default: results")
    place = parser.parse_args(words).folder
    files = sorted(place.rglob("diagram.json"))
    if not files:
        raise InputError(f"No folder in {place} has a diagram.json: run a scene, or name a folder with results.")
    print("\n".join([_row(*HEADS, "in words"), *map(_diagram, files)]))


def _diagram(file: Path) -> str:
    """Line of a diagram; a file that is none has its reason in place of numbers."""
    from rodfem.file_format import DIAGRAM, read_json, refusal
    from rodfem.output.summary import in_sentences

    name = str(file.parent)
    try:
        data = read_json(file, DIAGRAM, ("scene", "parameter", "branches"))
        with refusal(UNFIT.format(file)):
            date, branches = str((data.get("origin") or {}).get("date", ""))[: HEADS["date"]], data["branches"]
            special = sum(len(branch["special"]) for branch in branches)
            words = in_sentences(data)[0].partition("\n")[0] if branches else "no branches"
            return _row(name, data["scene"], date, str(len(branches)), str(special), words)
    except InputError as trouble:
        return f"{name:<{HEADS['folder']}} {trouble}"


def _row(*cells: str) -> str:
    *others, last = cells
    return " ".join([*(f"{cell:<{width}}" for cell, width in zip(others, HEADS.values(), strict=True)), last])


def many(words: Sequence[str]) -> None:
    """Trace a rod for each line of a table of its constants and options."""
    from rodfem.app.main import many_main

    many_main(words)


def run(words: Sequence[str]) -> None:
    """Trace the rod of a file, with its constants as options."""
    from rodfem.app.main import main as run_file

    run_file(words)


def view(words: Sequence[str]) -> None:
    """A report on a saved diagram, in the browser: the diagram, the rod in space, its stability."""
    from rodfem.report.page import write_report

    parser = Parser(prog="rodfem view", description=_summary(view))
    parser.add_argument("folder", type=run_folder, help="that of a run, as results/cord")
    parser.add_argument("--output", type=Path, help="page to write (default: report.html in the folder)")
    parser.add_argument("--no-open", action="store_true", help="write the page, and open no browser")
    given = parser.parse_args(words)
    path = write_report(given.folder, given.output)
    print(path)
    display = sys.platform in ("darwin", "win32") or os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    if not given.no_open and display:
        webbrowser.open(path.resolve().as_uri())


COMMANDS = {
    "convert": convert,
    "explain": explain,
    "info": info,
    "list": list_diagrams,
    "many": many,
    "run": run,
    "view": view,
}
