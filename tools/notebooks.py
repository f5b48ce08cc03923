#!/usr/bin/env python3
"""The lessons of the course as notebooks, beside the package that they use; the first cell installs rodfem.

Run it as ``python tools/notebooks.py FOLDER``, with jupytext: ``pip install ".[notebooks]"``.
"""

from __future__ import annotations

import sys
from pathlib import Path
from shutil import copytree, ignore_patterns

import jupytext
from nbformat.v4 import new_code_cell

LESSONS = Path(__file__).parents[1] / "docs" / "course"
PACKAGE = "lesson"
"""What all lessons import."""
INSTALL = """\
# In a hosted notebook (Python 3.12 or newer) this installs rodfem and all that it needs, in a minute.
from importlib.util import find_spec

if find_spec("rodfem") is None:
    %pip install --quiet "rodfem[pip]"\
"""


def write(folder: Path) -> list[Path]:
    """Write all lessons as notebooks into ``folder``, with their package; returns the paths of the notebooks."""
    copytree(LESSONS / PACKAGE, folder / PACKAGE, ignore=ignore_patterns("__pycache__"), dirs_exist_ok=True)
    written = []
    for lesson in sorted(LESSONS.glob("[0-9]*.py")):
        notebook = jupytext.read(lesson)
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
