#!/usr/bin/env python3
"""The lessons of the course as notebooks, each complete: first cells install rodfem and write what lessons share.

Run it as ``python tools/notebooks.py FOLDER``, with jupytext: ``pip install ".[notebooks]"``.
"""

from __future__ import annotations

import sys
from pathlib import Path

import jupytext
from nbformat.v4 import new_code_cell

LESSONS = Path(__file__).parents[1] / "docs" / "course"
SHARED = ("lesson/__init__.py", "lesson/by_hand.py", "lesson/pictures.py")
"""Modules that lessons import: a notebook that is opened alone brings them."""
INSTALL = """\
# In a hosted notebook (Python 3.12 or newer) this installs rodfem and all that it needs, in a minute.
from importlib.util import find_spec

if find_spec("rodfem") is None:
    %pip install --quiet "rodfem[pip]"\
"""


def shared() -> str:
    """Program of a cell that writes the shared modules beside the notebook."""
    lines = ["# What the lessons share: pictures, and assembly by hand.", "from pathlib import Path", ""]
    for name in SHARED:
        lines += [
            f"Path({name!r}).parent.mkdir(exist_ok=True)",
            f"Path({name!r}).write_text({(LESSONS / name).read_text()!r})",
        ]
    return "\n".join(lines)


def write(folder: Path) -> list[Path]:
    """Write all lessons as notebooks into ``folder``; returns their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for lesson in sorted(LESSONS.glob("[0-9]*.py")):
        notebook = jupytext.read(lesson)
        hidden = {"tags": ["shared"], "jupyter": {"source_hidden": True}}
        notebook.cells.insert(0, new_code_cell(shared(), metadata=hidden))
        notebook.cells.insert(0, new_code_cell(INSTALL, metadata={"tags": ["install"]}))
        notebook.metadata["kernelspec"] = {"name": "python3", "display_name": "Python 3", "language": "python"}
        written.append(folder / f"{lesson.stem}.ipynb")
        jupytext.write(notebook, written[-1])
    return written


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    for path in write(Path(sys.argv[1])):
        print(path)
